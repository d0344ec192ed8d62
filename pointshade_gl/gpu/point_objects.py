"""Point objects on the GPU: splats carried into a view, then what each of its pixels sees of them."""

from __future__ import annotations

from typing import Any, NamedTuple

import moderngl
import numpy as np

from ..camera import Camera, Eye
from .compute_splats import ComputeSplatPass
from .passes import FullscreenPass
from .point_splats import PointSplatPass
from .rasterizers import Rasterizers
from .raw_gl import DEPTH_TEST
from .resolve import Looking, ResolvePass
from .shadows import Tile
from .state import enabled
from .textures import FrameTextures, PointLight, PointSurface, SplatImage, SurfaceImage, confine


class Points(NamedTuple):
    """Where the points of an object are, and how large: all that its shadow depends on."""

    surface: PointSurface
    source: Camera  # that took the frame
    pose: np.ndarray  # (4, 4) from its axes to the world, without the scale
    scale: float
    sizes: np.ndarray  # (1,) or (h*w,) float32, source pixels
    splat: str


class ShownPoints(NamedTuple):
    """Points with what colours them."""

    points: Points
    textures: FrameTextures
    light: PointLight | None  # of the points themselves, for flat and gouraud shading
    shading: str


class PointObjects:
    """Draws point objects into views and into shadow maps."""

    def __init__(self, context: moderngl.Context, rasterizers: Rasterizers):
        self._context, self._rasterizers = context, rasterizers
        self._resolve = ResolvePass(context)
        self._shadow_passes: dict[bool, FullscreenPass] = {}
        self._scratch: SplatImage | None = None  # of the size of a shadow view

    def draw_splats(self, image: SplatImage, points: Points, eye: Eye) -> None:
        """How far the nearest splat is at each pixel of a view."""
        rasterizer, near = self._rasterizer(points), eye.near / points.scale
        view = carried(points, eye)
        rasterizer.draw(points.surface, points.source, image, eye.camera, view, near, points.sizes, points.splat)

    def draw_picture(self, picture: moderngl.Framebuffer, splats: SplatImage, shown: ShownPoints, eye: Eye) -> None:
        """What the splats left -> the picture, where its colours are known already: for none, flat and gouraud."""
        self._resolve.draw_picture(picture, self._looking(splats, shown, eye), shown.shading)

    def draw_lit(
        self,
        picture: moderngl.Framebuffer,
        splats: SplatImage,
        shown: ShownPoints,
        eye: Eye,
        lights: dict[str, Any],
    ) -> None:
        """What the splats left -> the picture, lit at once: for phong. lights: inputs of shaders/common/lights.glsl."""
        self._resolve.draw_lit(picture, self._looking(splats, shown, eye), lights)

    def draw_surface(self, surfaces: SurfaceImage, splats: SplatImage, shown: ShownPoints, eye: Eye) -> None:
        """What the splats left -> the surfaces that the light pass reads, for phong."""
        surfaces.window = splats.window
        self._resolve.draw_surfaces(surfaces.target, self._looking(splats, shown, eye), shown.shading, 1)
        surfaces.raise_version()

    def add_surface(
        self, surfaces: SurfaceImage, splats: SplatImage, shown: ShownPoints, eye: Eye, number: int
    ) -> None:
        """The splats and surfaces of one object among others. number: of its material, counted from 1."""
        self.draw_splats(splats, shown.points, eye)
        depth = eye.near, shown.points.scale
        looking = self._looking(splats, shown, eye)
        self._resolve.draw_surfaces(surfaces.shared_target, looking, shown.shading, number, depth)

    def add_shadow(self, tile: Tile, points: Points, eye: Eye) -> None:
        """The object's depth in a light's view. The eye is the light's."""
        if self._scratch is None or self._scratch.size != (tile.side, tile.side):
            if self._scratch is not None:
                self._scratch.release()
            self._scratch = SplatImage(self._context, (tile.side, tile.side))
        self.draw_splats(self._scratch, points, eye)
        inputs: dict[str, Any] = {"first": tile.first}
        look_up = self._rasterizer(points).look_up
        if look_up:
            self._scratch.nearest.bind_to_storage_buffer(0)
            inputs |= {"side": tile.side, "near": eye.near / points.scale}
        else:
            inputs["depth_map"] = self._scratch.depth
        left, top, width, height = self._scratch.window
        confine(tile.target, (tile.first[0] + left, tile.first[1] + top, width, height))
        with enabled(self._context, DEPTH_TEST):
            self._shadow_pass(look_up).draw(tile.target, {}, **inputs)
        confine(tile.target, None)

    def _looking(self, splats: SplatImage, shown: ShownPoints, eye: Eye) -> Looking:
        points = shown.points
        colors = shown.textures.color if shown.light is None else shown.light.texture
        view, look_up = carried(points, eye), self._rasterizer(points).look_up
        return Looking(points.surface.texture, colors, points.source, splats, eye.camera, view, look_up)

    def _rasterizer(self, points: Points) -> PointSplatPass | ComputeSplatPass:
        return self._rasterizers.choose(points.sizes, points.splat)

    def _shadow_pass(self, look_up: bool) -> FullscreenPass:
        if look_up not in self._shadow_passes:
            version = 430 if look_up else 330
            made = FullscreenPass(self._context, "shadow.frag", version, LOOK_UP=int(look_up))
            self._shadow_passes[look_up] = made
        return self._shadow_passes[look_up]

    def release(self) -> None:
        for item in (self._scratch, *self._shadow_passes.values(), self._resolve, self._rasterizers):
            if item is not None:
                item.release()


def carried(points: Points, eye: Eye) -> np.ndarray:
    """(4, 4) from the axes of the frame's camera to those of the eye, in the frame's own unit."""
    view = np.linalg.inv(eye.pose) @ points.pose
    view[:3, 3] /= points.scale
    return view
