"""Continues planes behind the objects that hide them, as a smaller surface that only casts shadows."""

from __future__ import annotations

from ...scene.camera import Camera
from ...scene.visible import bridged_stride
from ..core.frame_textures import PointSurface
from ..core.passes import FullscreenPasses


class HiddenPlanesPass(FullscreenPasses):
    """Continues planes behind the objects that hide them, see shaders/common/hidden_planes.glsl."""

    def run(self, surface: PointSurface, camera: Camera, bridged: PointSurface) -> None:
        """Write the hidden planes to `bridged`, of its `bridged_camera`. camera: the frame's, at the surface's size."""
        bridged.confine((0, 0, *bridged.size))
        inputs = {"source": camera.intrinsics, "stride": bridged_stride(camera)}
        bridge = self.fullscreen("surface/hidden_planes.frag")
        bridge.draw(bridged.target, {"surface_map": surface.texture}, **inputs)
        bridged.raise_version()
