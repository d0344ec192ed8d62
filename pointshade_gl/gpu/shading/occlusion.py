"""What hides light from all around: seen from a frame's own camera, and in a view for all that it shows."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import moderngl

from ...scene.camera import Camera
from ..context.software_driver import wants_software
from ..core.frame_textures import PointSurface
from ..core.images import R32F, RGBA32F, Fitted, Image, confine
from ..core.programs import FullscreenPasses
from ..core.view_images import SurfaceImage

POINTS = 400_000  # for about so many the planes are searched, and for the rest of a frame the results mixed:
POINTS_ON_CPU = 80_000  # of 640x480 every second one


class VisibilityPass(FullscreenPasses):
    """Looks at the neighbours of points (shaders/common/visibility.glsl)."""

    def __init__(self, context: moderngl.Context):
        super().__init__(context)
        self._planes = self._keep(Fitted(context, Image, RGBA32F, R32F))
        self._means = [self._keep(Fitted(context, Image)) for _ in range(2)]

    def run(self, surface: PointSurface, camera: Camera, radius: float, visibility: Image) -> None:
        """Write the visibility of a frame's points.

        camera  that took the frame, at the surface's size
        radius  how far things may be that hide light, in the frame's unit
        """
        stride = visibility_stride(self._context, surface.size)
        size = -(-surface.size[0] // stride), -(-surface.size[1] // stride)
        planes, means = self._planes.fit(size), [one.fit(size) for one in self._means]
        left, top, width, height = surface.window
        some = left // stride, top // stride, -(-width // stride) + 1, -(-height // stride) + 1
        for image, window in (*((one, some) for one in (planes, *means)), (visibility, surface.window)):
            confine(image.target, window)
        common = {"surface_map": surface.texture, "intrinsics": camera.intrinsics, "stride": stride}
        self.fullscreen("surface/hidden_in_plane.frag").draw(planes.target, {}, radius=radius, **common)
        final = self.fullscreen("surface/visibility.frag")
        final.draw(visibility.target, {"mean_map": mean_of_planes(self, planes, means, common)}, **common)
        visibility.raise_version()


def mean_of_planes(
    passes: FullscreenPasses, planes: Image, means: Sequence[Image], common: dict[str, Any]
) -> moderngl.Texture:
    """Return what is hidden from points, of what hidden_in_plane.frag found: the mean of means, a tent round each."""
    once, again = passes.fullscreen("surface/mean_hidden.frag"), passes.fullscreen("surface/mean_hidden.frag", AGAIN=1)
    maps: dict[str, moderngl.Texture] = dict(zip(("plane_map", "weight_map"), planes.textures, strict=True))
    once.draw(means[0].target, maps, first=-2, **common)
    again.draw(means[1].target, {"plane_map": means[0].texture}, first=-1, **common)
    return means[1].texture


def visibility_stride(context: moderngl.Context, size: tuple[int, int]) -> int:
    """Return which pixels of a picture look at their neighbours: every one, every second one ..."""
    points = POINTS_ON_CPU if wants_software(context) else POINTS
    return max(round(math.sqrt(size[0] * size[1] / points)), 1)


class ViewVisibilityPass(FullscreenPasses):
    """Looks at the neighbours of pixels: of meshes and clouds at all of them, of points at those of other objects."""

    def __init__(self, context: moderngl.Context):
        super().__init__(context)
        self._planes = self._keep(Fitted(context, Image, RGBA32F, R32F))
        self._means = [self._keep(Fitted(context, Image)) for _ in range(2)]
        self._whole = self._keep(Fitted(context, Image, RGBA32F))

    def find(self, surfaces: SurfaceImage, camera: Camera, radius: float, sample: int) -> moderngl.Texture:
        """Return the visibility of all pixels, RGBA32F, as `SurfaceImage.visibility`.

        radius  how far things may be that hide light, world units
        sample  of the picture: each looks along other planes
        """
        stride = visibility_stride(self._context, surfaces.size)
        size = -(-surfaces.size[0] // stride), -(-surfaces.size[1] // stride)
        planes, means = self._planes.fit(size), [one.fit(size) for one in self._means]
        whole = self._whole.fit(surfaces.size)
        common = {"surface_map": surfaces.surface, "intrinsics": camera.intrinsics, "stride": stride}
        along = self.fullscreen("surface/hidden_in_plane.frag", OBJECTS=1)
        own = {"numbers_map": surfaces.albedo, "visibility_map": surfaces.visibility}
        along.draw(planes.target, own, radius=radius, shift=plane_shift(sample), **common)
        maps = {"mean_map": mean_of_planes(self, planes, means, common), "visibility_map": surfaces.visibility}
        self.fullscreen("shading/view_visibility.frag").draw(whole.target, maps, **common)
        return whole.texture


def plane_shift(sample: int) -> tuple[int, int]:
    """Return by how many pixels the planes of shaders/common/visibility.glsl are moved in a sample: 16 see all, and
    the first 2, 4 and 8 some that are evenly spread."""
    spread = 0, 2, 1, 3
    return spread[sample // 4 % 4], spread[sample % 4]


def plane_turn(sample: int) -> float:
    """Return by how many half circles the planes of a ground are turned in a sample: of 16 neighbours and 16 samples no
    two look along the same plane. If all looked along the same 16, these would show as rays.
    """
    return (7 * sample + 4 * (sample // 16)) % 16 / 256
