"""Draws trained splats as a layer before other objects: blended in order, with their surface, and their shadows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import moderngl
import numpy as np

from ...estimation.splat_projection import COLUMNS, SURFACE_COLUMNS, Rows, SplatView, project_splats, splat_normals
from ...scene.appearance import NOT_LIT
from ...scene.camera import Eye, view_matrix
from ...scene.cloud import PointCloud
from ...scene.gaussians import Gaussians
from ...scene.shadow_cameras import ShadowView
from ..context.caller_state import managed
from ..core.images import RG32F, RGBA16F, RGBA32F, Fitted, Image, Images, confine, empty
from ..core.programs import AdditiveBlend, FullscreenPasses, build_program, set_inputs
from ..core.steps import Parts
from ..core.view_images import Canvas, Drawable, SurfaceImage
from ..shading.light_set import ShadowMap, SplatShadows

COLORS, SURFACE, DEPTHS = range(3)  # KIND of shaders/splats/splat.vert
LAYOUT = (("middle", "2f", 8), ("arms", "3f", 12), ("depth", "1f", 4), ("shade", "4f", 16))
SURFACE_LAYOUT = (("normal", "3f", 12), ("slope", "2f", 8))
HALF, SOLID, ANY = 0.5, 0.95, 0.004  # of a pixel that splats cover: more is a surface; nothing is behind; is seen
SHARES = 0.8, 0.2  # of the normals of cells, and of the plane through the depths beside
UNLIT = 0.25  # length of a mean normal, below which splats are not lit
BESIDE, WIDEST = 0.17, 4  # thicknesses between pixels that a map of shadows averages, and most pixels
THICKNESS = 3.0  # median lengths of splats: a surface of them is as deep


@dataclass(eq=False, slots=True)
class PlacedSplats(Parts, Drawable):
    """A cloud of trained splats, its place in the world, and how it is drawn."""

    cloud: PointCloud
    pose: np.ndarray  # (4, 4) from node axes to the world, without the scale
    scale: float

    @property
    def shading(self) -> str:
        return self.cloud.shading

    def seen(self, eye: Eye, normals: Any = None) -> SplatView:
        view = view_matrix(self.pose, eye.pose)
        return SplatView(self.cloud, self.scale * view[:3, :3], view[:3, 3], normals, self.shading not in NOT_LIT)

    @property
    def held(self) -> Gaussians:
        assert self.cloud.gaussians is not None, "a cloud of splats"
        return self.cloud.gaussians

    @property
    def thickness(self) -> float:
        """Return how deep a surface of them is, world units."""
        return THICKNESS * self.scale * self.held.median_length


class LayerImage(Images):
    """The blended splats of a view.

    colors   RGBA32F: sRGB, and how much is covered
    normals  RGBA16F: of the splats' cells
    depths   RGBA32F: depth from a reference, its square and its cube, and how much is covered
    seen     RG32F: depth of one surface in each pixel, and how much is covered
    fitted   RGBA32F: normal and depth of their surface
    """

    reference = 0.0

    @cached_property
    def sums(self) -> Image:
        return self._keep(Image(self._context, self.size, RGBA32F, RGBA16F, RGBA32F))

    @cached_property
    def colors(self) -> moderngl.Framebuffer:
        return self._framebuffer(self.sums.textures[0])

    @cached_property
    def seen(self) -> Image:
        return self._keep(Image(self._context, self.size, RG32F))

    @cached_property
    def fitted(self) -> Image:
        return self._keep(Image(self._context, self.size))

    @cached_property
    def lit(self) -> Image:
        """What the light pass makes of them; linear."""
        return self._keep(Image(self._context, self.size))

    @cached_property
    def behind(self) -> Image:
        """The picture of the other objects; linear."""
        return self._keep(Image(self._context, self.size))


class SplatLayer(FullscreenPasses):
    """Draws trained splats into views and into maps of shadows. All that are in view are sorted together."""

    def __init__(self, context: moderngl.Context):
        super().__init__(context)
        self._covering = AdditiveBlend(context, covers=True)
        self._adding = AdditiveBlend(context)
        self._images = [self._keep(Fitted(context, LayerImage)) for _ in range(2)]
        self._tiles = self._keep(Fitted(context, Image, RGBA32F))  # of the size of a light's view
        self._shadows = self._keep(Fitted(context, Image, RGBA32F))
        self._programs: dict[tuple[int, int], moderngl.Program] = {}
        self._normals: dict[Gaussians, np.ndarray] = {}

    def fit(self, size: tuple[int, int], has_surface: bool) -> LayerImage:
        """Return the image of a view: one for colours alone, and one with the surface, as a ground wants both."""
        return self._images[has_surface].fit(size)

    def canvas(self, image: Image) -> Canvas:
        """What the light of a layer, or of what is behind it, is drawn on."""
        empty(image.target)
        return Canvas(image.target, self._adding)

    def keep_only(self, clouds: Sequence[PointCloud]) -> None:
        """Forget what is known of all other clouds."""
        held = {cloud.gaussians for cloud in clouds}
        self._normals = {one: found for one, found in self._normals.items() if one in held}

    def blend(
        self, image: LayerImage, things: Sequence[PlacedSplats], eye: Eye, opaque: SurfaceImage | None,
        has_surface: bool,
    ) -> None:  # fmt: skip
        """Blend the splats that an eye sees before what is opaque. has_surface: with their normals and depths."""
        views = [thing.seen(eye, self._normals_of(thing) if has_surface else None) for thing in things]
        image.reference = _reference(things, eye)
        rows = project_splats(views, eye, image.reference)
        target = image.sums.target if has_surface else image.colors
        empty(target)
        inputs: dict[str, Any] = {"target_size": image.size}
        if opaque is not None:
            inputs |= {"opaque_map": opaque.surface, "reference": image.reference}
        self._draw(target, SURFACE if has_surface else COLORS, rows, inputs)
        if has_surface:
            is_mixed = any(thing.shading in NOT_LIT for thing in things)
            self._fit_surface(image, eye, max(thing.thickness for thing in things), UNLIT if is_mixed else 0.0)
        image.raise_version()

    def _fit_surface(self, image: LayerImage, eye: Eye, thickness: float, unlit: float) -> None:
        _, normals, depths = image.sums.textures
        empty(image.seen.target)
        single = self.fullscreen("splats/depth.frag")
        inputs = {"depths_sum": depths, "target": eye.camera.intrinsics}
        single.draw(image.seen.target, inputs, reference=image.reference, thickness=thickness)
        empty(image.fitted.target)
        inputs = {"normals_map": normals, "seen_map": image.seen.texture}
        fit = self.fullscreen("splats/surface.frag")
        fit.draw(image.fitted.target, inputs, target=eye.camera.intrinsics, shares=SHARES, unlit=unlit)

    def _normals_of(self, thing: PlacedSplats) -> np.ndarray:
        cloud, held = thing.cloud, thing.held
        if thing.shading in NOT_LIT:
            return np.zeros((len(held), 3), np.float32)
        if held not in self._normals:
            self._normals[held] = splat_normals(cloud.positions, held, cloud.up_direction)
        return self._normals[held]

    def merge(
        self, surfaces: SurfaceImage, image: LayerImage, opaque: SurfaceImage | None, least: float, number: float,
        hides: bool,
    ) -> None:  # fmt: skip
        """Draw the surface of the splats, where they cover so much, and around it what is opaque.

        number: of their material, below 0 for eye-dome lighting; hides: what is near hides light from all around
        """
        surfaces.has_visibility = hides
        inputs = {"colors_sum": image.sums.textures[0], "fitted": image.fitted.texture}
        kind = 0
        if opaque is not None:
            kind = 1 + opaque.has_visibility
            inputs |= {"opaque_map": opaque.surface, "opaque_colors": opaque.albedo}
            inputs |= {"opaque_visibility": opaque.visibility} if opaque.has_visibility else {}
        surfaces.window = 0, 0, *surfaces.size
        empty(surfaces.target)
        merged = self.fullscreen("splats/merge.frag", None, OPAQUE=kind)
        merged.draw(surfaces.target, inputs, least=least, number=number)
        surfaces.raise_version()

    def compose(self, canvas: Canvas, image: LayerImage, is_lit: bool, has_behind: bool) -> None:
        """Draw the picture: the splats, lit or in their own colours, over what is behind them."""
        inputs = {"colors_sum": image.sums.textures[0]}
        inputs |= {"lit_sum": image.lit.texture} if is_lit else {}
        inputs |= {"behind_sum": image.behind.texture} if has_behind else {}
        constants = {"LINEAR": int(canvas.linear), "LIT": int(is_lit), "BEHIND": int(has_behind)}
        with canvas.opened((0, 0, *image.size)) as target:
            self.fullscreen("splats/compose.frag", None, **constants).draw(target, inputs)

    def find_shadows(
        self, shadow_map: ShadowMap, views: Sequence[ShadowView], things: Sequence[PlacedSplats]
    ) -> SplatShadows:
        """Return the map of the shadows that splats cast in the views of lights: tiles as in the shadow map."""
        map_image = self._shadows.fit(shadow_map.texture.size)
        empty(map_image.target)
        thickness = max(thing.thickness for thing in things)
        for k, (eye, *_) in enumerate(views):
            first, side = shadow_map.place(k), eye.camera.width
            tile = self._tiles.fit((side, side))
            reference = _reference(things, eye)
            seen = [thing.seen(eye, np.zeros((len(thing.cloud), 3), np.float32)) for thing in things]
            empty(tile.target)
            self._draw(tile.target, DEPTHS, project_splats(seen, eye, reference), {"target_size": (side, side)})
            confine(map_image.target, (*first, side, side))
            stride = _stride(thickness * eye.camera.fx / max(reference, eye.near))
            blurred = self.fullscreen("splats/shadow.frag")
            blurred.draw(
                map_image.target, {"depths_sum": tile.texture}, first=first, reference=reference, thickness=thickness,
                stride=stride,
            )  # fmt: skip
        confine(map_image.target, None)
        map_image.raise_version()
        return SplatShadows(map_image, thickness)

    def _draw(self, target: moderngl.Framebuffer, kind: int, rows: Rows, inputs: dict[str, Any]) -> None:
        if not len(rows):
            return
        key = kind, int("opaque_map" in inputs)
        if key not in self._programs:
            files = "splats/splat.vert", "splats/splat.frag"
            self._programs[key] = self._keep(build_program(self._context, *files, KIND=kind, HIDDEN=key[1]))
        program = self._programs[key]
        set_inputs(program, inputs)
        with self._drawn(program, rows) as array, self._covering.on():
            target.use()
            array.render(moderngl.TRIANGLES, 3, instances=len(rows))

    @managed
    def _drawn(self, program: moderngl.Program, rows: Rows) -> Any:
        """Have the rows on the GPU inside."""
        layout = LAYOUT + SURFACE_LAYOUT if rows.shape[1] == SURFACE_COLUMNS else LAYOUT
        assert rows.shape[1] in (COLUMNS, SURFACE_COLUMNS)
        read = [name for name, *_ in layout if name in program]
        form = " ".join(form if name in read else f"{size}x" for name, form, size in layout)
        buffer = self._context.buffer(rows)
        try:
            array = self._context.vertex_array(program, [(buffer, f"{form}/i", *read)])
            try:
                yield array
            finally:
                array.release()
        finally:
            buffer.release()


def _stride(thickness: float) -> int:
    """Return the pixels between those that a map of shadows averages. thickness: of a surface, pixels."""
    return int(min(max(round(BESIDE * thickness), 1), WIDEST))


def _reference(things: Sequence[PlacedSplats], eye: Eye) -> float:
    """Return the depth of the middle of them."""
    middles = [thing.pose[:3, :3] @ (thing.scale * thing.cloud.main_corners.mean(0)) + thing.pose[:3, 3]
               for thing in things if len(thing.cloud)]  # fmt: skip
    if not middles:
        return 1.0
    middle = np.mean(middles, 0) - eye.pose[:3, 3]
    return float(middle @ eye.pose[:3, 2])
