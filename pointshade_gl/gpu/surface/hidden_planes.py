"""Continues planes behind the objects that hide them, as a smaller surface that only casts shadows."""

from __future__ import annotations

import moderngl

from ...scene.camera import Camera
from ...scene.level_of_detail import bridged_stride
from ..core.frame_textures import PointSurface
from ..core.memory import Owner
from ..core.passes import FullscreenPass


class HiddenPlanesPass(Owner):
    """Continues planes behind the objects that hide them, see shaders/common/hidden_planes.glsl."""

    def __init__(self, context: moderngl.Context):
        super().__init__(context)
        with self._all_or_nothing():
            self._bridge = self._keep(FullscreenPass(context, "surface/hidden_planes.frag"))

    def run(self, surface: PointSurface, camera: Camera, bridged: PointSurface) -> None:
        """Write the hidden planes to `bridged`, which has the size of its `bridged_camera`. camera: took the frame, at
        the surface's size."""
        bridged.confine((0, 0, *bridged.size))
        inputs = {"surface_map": surface.texture}
        self._bridge.draw(bridged.target, inputs, source=camera.intrinsics, stride=bridged_stride(camera))
        bridged.raise_version()
