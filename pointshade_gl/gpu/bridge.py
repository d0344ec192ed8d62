"""Bridge pass: a surface -> what it hides and what goes on behind it, as a smaller surface that only casts shadows."""

from __future__ import annotations

import moderngl

from ..camera import Camera
from .memory import Owner
from .passes import FullscreenPass
from .textures import PointSurface

PLACES = 160  # in a row of the smaller surface, about
STRIDES = 4, 6  # pixels of the surface for each of the smaller one, at least and at most


class BridgePass(Owner):
    """See shaders/common/bridge.glsl."""

    def __init__(self, context: moderngl.Context):
        super().__init__(context)
        with self._all_or_nothing():
            self._bridge = self._keep(FullscreenPass(context, "bridge.frag"))

    def run(self, surface: PointSurface, camera: Camera, bridged: PointSurface) -> None:
        """camera: who took the frame, at the surface's size; `bridged` has the size of its `bridged_camera`."""
        bridged.confine((0, 0, *bridged.size))
        inputs = {"surface_map": surface.texture}
        self._bridge.draw(bridged.target, inputs, source=camera.intrinsics, stride=stride_of(camera))
        bridged.raise_version()


def stride_of(camera: Camera) -> int:
    least, most = STRIDES
    return min(max(-(-camera.width // PLACES), least), most)


def bridged_camera(camera: Camera) -> Camera:
    """The camera of the smaller surface: it has one pixel in the middle of each stride."""
    stride = stride_of(camera)
    cx, cy = (camera.cx - stride // 2) / stride, (camera.cy - stride // 2) / stride
    width, height = -(-camera.width // stride), -(-camera.height // stride)
    return Camera(camera.fx / stride, camera.fy / stride, cx, cy, width, height)
