"""Finds in a view what hides light from all around, for all that frames do not know of their points."""

from __future__ import annotations

import moderngl

from ...scene.camera import Camera
from ..core.images import R32F, RGBA32F, Fitted, Image
from ..core.passes import FullscreenPasses
from ..core.view_images import SurfaceImage
from ..surface.visibility import mean_of_planes, visibility_stride


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
        planes, means, whole = (
            self._planes.fit(size),
            [one.fit(size) for one in self._means],
            self._whole.fit(surfaces.size),
        )
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
