"""Draws point objects: rasterises their splats, then resolves the surfaces of the pixels."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

import moderngl
import numpy as np

from ...scene.camera import Camera, Eye
from ...scene.values import frozen
from ...scene.visible import bridged_camera
from ..core.frame_textures import Colors, FrameTextures, PointSurface
from ..core.images import Box, Fitted, Image, depth_tested
from ..core.programs import FullscreenPasses
from ..core.steps import Parts
from ..core.view_images import Canvas, Drawable, ShownFrame, SplatImage, SurfaceImage, Target
from ..shading.light_set import ShadowTile
from ..surface.surface_normals import Estimator
from .rasterizers import ComputeSplatPass, LitSplatPass, PointSplatPass, Rasterizers, Splats
from .set_merge import ResolveInputs, ResolvePass, SetMergePass, SetPart, TargetNormals, key_inputs

if TYPE_CHECKING:
    from ...estimation.multi_view import SetReport
    from .view_consensus import Consensus

SINGLE = np.ones(1, np.float32)


class Points(NamedTuple):
    """Where the points of an object are, and how large: everything that its shadow depends on."""

    surface: PointSurface
    source: Camera  # that took the frame
    pose: np.ndarray  # (4, 4) from its axes to the world, without the scale
    scale: float
    sizes: np.ndarray  # (1,) or (h*w,) float32, source pixels
    splat: str
    bridged: PointSurface | None = None  # what they hide, of their `bridged_camera`: it casts shadows, too

    kind, several = "splats", 1

    def add_shadow(self, passes: Any, tile: ShadowTile, eye: Eye) -> None:
        passes.points.add_shadow(tile, self, eye)

    @property
    def hidden(self) -> Points | None:
        """Return what the points hide, as points."""
        if self.bridged is None:
            return None
        return Points(self.bridged, bridged_camera(self.source), self.pose, self.scale, SINGLE, "footprint")


@dataclass(eq=False, slots=True)
class ShownPoints(ShownFrame):
    """Points with their colours or their light."""

    points: Points
    textures: FrameTextures
    colors: Colors
    light: Image | None  # of the points themselves, for flat and gouraud shading
    shading: str  # pyright: ignore[reportIncompatibleMethodOverride]
    visibility: Image | None = None  # what they see of the light from all around, if something may hide it

    def add_surface(self, passes: Any, target: Target, eye: Eye, number: int, lights: dict[str, Any]) -> None:
        passes.points.add_surface(target, self, eye, number)


class PointSet(NamedTuple):
    """The points of several frames of one object."""

    parts: tuple[Points, ...]
    trusts: tuple[Image, ...]  # see `Splats.trust`
    is_exact: bool  # the frames have no noise
    differ: float  # by how much frames that agree may differ, in their own unit: so far off they cast no shadows

    kind = "splats"

    @property
    def several(self) -> int:
        return len(self.parts)

    def add_shadow(self, passes: Any, tile: ShadowTile, eye: Eye) -> None:
        passes.points.add_shadow(tile, self, eye)

    @property
    def scale(self) -> float:
        return self.parts[0].scale


@dataclass(eq=False, slots=True)
class ShownSet(Parts, Drawable):
    """Several frames that are drawn as one object."""

    points: PointSet
    views: tuple[ShownPoints, ...] = field()  # pyright: ignore[reportIncompatibleMethodOverride]
    consensus: Consensus
    importances: np.ndarray  # (n,) of the frames in this view
    shading: str  # pyright: ignore[reportIncompatibleMethodOverride]
    estimator: Estimator | None  # of normals in the view; None takes those of the frames

    @property
    def shape(self) -> PointSet:
        return self.points

    def add_surface(self, passes: Any, target: Target, eye: Eye, number: int, lights: dict[str, Any]) -> None:
        passes.points.add_set(target, self, eye, number)

    @property
    def has_doubts(self) -> bool:
        return self.estimator is None and any(view.has_doubts for view in self.views)

    @property
    def weights(self) -> dict[Any, float]:
        return dict(zip((view.textures.frame for view in self.views), self.importances.tolist(), strict=True))

    def report(self) -> SetReport:
        """Return what was found out about the frames. Reads back how far their points are trusted."""
        from ...estimation.multi_view import SetReport  # only here

        textures = [view.textures for view in self.views]
        known = [one.frame.depth > 0 for one in textures if one.frame]
        trusted = [trust.read()[..., 0] > 0 for trust in self.points.trusts]
        distrusted = [np.count_nonzero(points & ~sure) for points, sure in zip(known, trusted, strict=True)]
        points = np.array([np.count_nonzero(points) for points in known])
        band, gains = self.consensus.band, self.consensus.gains
        return SetReport(self.choices, band, gains, points, np.array(distrusted), self.importances)


class PointObjects(FullscreenPasses):
    """Draws point objects into views and into shadow maps."""

    def __init__(self, context: moderngl.Context, rasterizers: Rasterizers):
        super().__init__(context)
        self._rasterizers = self._keep(rasterizers)
        self._resolve = self._keep(ResolvePass(context))
        self._scratch = self._keep(Fitted(context, SplatImage))  # of the size of a shadow view
        self._target_normals = self._keep(TargetNormals(context))

    @cached_property
    def _lit(self) -> LitSplatPass:
        return self._keep(LitSplatPass(self._context))

    @cached_property
    def _merge(self) -> SetMergePass:
        return self._keep(SetMergePass(self._context))

    def draw_splats(self, image: SplatImage, points: Points, eye: Eye) -> None:
        """How far the nearest splat is at each pixel of a view."""
        self._rasterizer(points).draw(image, _splats(points, eye))

    def can_light(self, points: Points) -> bool:
        """Return whether `draw_lit_splats` draws these as separate steps would: vertices, and normals are certain."""
        return not self._rasterizer(points).look_up and points.surface.certainty is None

    def draw_lit_splats(self, target: Target, points: Points, colors: Colors, eye: Eye, lights: dict[str, Any]) -> None:
        """Draw the picture in one pass: for flat. lights: those of shaders/common/lights.glsl, in the points' axes."""
        self._lit.draw(target, _splats(points, eye), lights | {"color_map": colors.texture})
        target.raise_version()

    def draw_picture(self, canvas: Canvas, splats: SplatImage, shown: ShownPoints, eye: Eye) -> None:
        """Draw the picture from rasterised splats whose colours are known already: for none, flat and gouraud."""
        self._resolve.draw_picture(canvas, self._looking(splats, shown, eye))

    def draw_lit(
        self, canvas: Canvas, splats: SplatImage, shown: ShownPoints, eye: Eye, lights: dict[str, Any]
    ) -> None:
        """Draw the picture from rasterised splats, lit in the same pass: for phong. lights: as `draw_lit_splats`."""
        self._resolve.draw_lit(canvas, self._looking(splats, shown, eye), lights)

    def draw_surface(
        self, surfaces: SurfaceImage, splats: SplatImage, shown: ShownPoints, eye: Eye, samples: int | None = None
    ) -> None:
        """Draw the surfaces that the light pass reads from rasterised splats: for phong.

        samples  of the picture, whose mean colour they have; their depth is negative where more may change in a pixel
        """
        surfaces.window, surfaces.has_doubts, surfaces.has_eye_dome = splats.window, shown.has_doubts, False
        surfaces.has_visibility, surfaces.knows_visibility = shown.visibility is not None, True
        self._resolve.draw_surfaces(surfaces.target, self._looking(splats, shown, eye), 1, samples=samples)
        surfaces.raise_version()

    def add_surface(self, target: Target, shown: ShownPoints, eye: Eye, number: int) -> None:
        """Draw the splats and surfaces of one object among others. number: of its material, counted from 1."""
        self.draw_splats(target.splats, shown.points, eye)
        looking, depth = self._looking(target.splats, shown, eye), (eye.near, shown.points.scale)
        self._resolve.draw_surfaces(target.surfaces.shared_target, looking, number, depth)

    def add_set(self, target: Target, shown: ShownSet, eye: Eye, number: int) -> None:
        """Draw several frames of one object among others: all splats into one image, then their weighted surfaces."""
        from ...estimation.multi_view import primary_shares  # only here

        points, splats, consensus = shown.points, target.splats, shown.consensus
        windows = self._draw_set(splats, points, eye, primary_shares(shown.importances))
        looking = [self._looking(splats, view, eye) for view in shown.views]
        trusts = [trust.texture for trust in points.trusts]
        gains = [tuple(gain.tolist()) for gain in consensus.gains]
        parts = list(map(SetPart, looking, trusts, windows, shown.importances.tolist(), gains))
        sums = target.sums if target.surfaces.has_visibility else target.sums_without
        self._merge.add_up(sums, parts, consensus.fine_band, consensus.is_exact)
        look_up, normals = looking[0].look_up, None
        if shown.estimator:
            normals = self._target_normals.find(sums, splats, look_up, eye.camera, shown.estimator)
        inputs = {"near": eye.near, "scale": points.scale, "material_number": float(number)}
        marks = target.surfaces.marks_doubts
        inputs |= {"others": len(parts) - 1} if shown.has_doubts or marks else {}
        self._merge.draw_surfaces(target, sums, look_up, inputs, normals, marks)

    def _draw_set(self, image: SplatImage, points: PointSet, eye: Eye, primary: np.ndarray) -> list[Box]:
        parts = [
            _splats(one, eye)._replace(trust=trust, primary=float(share), is_exact=points.is_exact)
            for one, trust, share in zip(points.parts, points.trusts, primary, strict=True)
        ]
        return self._rasterizer(points.parts[0]).draw_set(image, parts)

    def add_shadow(self, tile: ShadowTile, points: Points | PointSet, eye: Eye) -> None:
        """Draw the depth of an object, and of what it hides, into a shadow map. eye: the light's camera."""
        hidden = points.hidden if isinstance(points, Points) else None
        if isinstance(points, Points) and hidden and not self._rasterizer(points).look_up:
            self._add_shadow(tile, hidden, eye)  # source ids are those of one surface
            hidden = None
        self._add_shadow(tile, points, eye, hidden)

    def _add_shadow(self, tile: ShadowTile, points: Points | PointSet, eye: Eye, hidden: Points | None = None) -> None:
        """hidden: points that are drawn together with the others"""
        scratch = self._scratch.fit((tile.side, tile.side))
        if isinstance(points, PointSet):
            self._draw_set(scratch, points, eye, np.ones(len(points.parts)))
            fragment, look_up = "points/set_shadow.frag", self._rasterizer(points.parts[0]).look_up
            inputs = key_inputs(scratch, look_up) | {"near": eye.near / points.scale, "behind": points.differ}
        else:
            fragment, (look_up, inputs) = "shading/shadow.frag", self._depths(points, scratch, eye, hidden)
        with depth_tested(self._context, tile.target, tile.part(scratch.window)):
            self.fullscreen(fragment, look_up).draw(tile.target, {}, first=tile.first, **inputs)

    def _depths(
        self, points: Points, image: SplatImage, eye: Eye, hidden: Points | None
    ) -> tuple[bool, dict[str, Any]]:
        """Draws splats. Returns how and by which inputs shadow.frag finds their depth."""
        rasterizer, splats = self._rasterizer(points), _splats(points, eye)
        rasterizer.draw_set(image, [_splats(hidden, eye), splats] if hidden else [splats])
        if not rasterizer.look_up:
            maps = {"source_ids": image.source_ids, "window_depths": image.depth, "surface_map": splats.surface.texture}
            return False, maps | splats.way | {"first_id": 1, "near": splats.near}
        image.nearest.bind_to_storage_buffer(0)
        return True, {"side": image.size[0], "near": splats.near}

    def _looking(self, splats: SplatImage, shown: ShownPoints, eye: Eye) -> ResolveInputs:
        points = shown.points
        colors = shown.colors.texture if shown.light is None else shown.light.texture
        view, near = model_view(points.pose, points.scale, eye), eye.near / points.scale
        where = points.source, splats, eye.camera, view, self._rasterizer(points).look_up, near
        visibility = shown.visibility and shown.visibility.texture
        surface = points.surface
        shape = surface.shape or surface
        normals = None if shape is surface else surface.texture
        return ResolveInputs(shape.texture, colors, *where, shown.shading, surface.certainty, visibility, normals)

    def _rasterizer(self, points: Points) -> PointSplatPass | ComputeSplatPass:
        return self._rasterizers.choose(points.sizes, points.splat)


def model_view(pose: np.ndarray, scale: float, eye: Eye) -> np.ndarray:
    """Return (4, 4) from the axes of a frame's camera to those of the eye, in the frame's own unit."""
    global _last_view
    last = _last_view  # other threads have theirs
    if last[0] is not pose or last[1] is not eye or last[2] != scale:
        view = np.linalg.inv(eye.pose) @ pose
        view[:3, 3] /= scale
        last = _last_view = pose, eye, scale, frozen(view)
    return last[3]


_last_view: tuple[Any, Any, float, Any] = None, None, 0.0, None  # for whom it was found, which is asked again at once


def _splats(points: Points, eye: Eye) -> Splats:
    view, near = model_view(points.pose, points.scale, eye), eye.near / points.scale
    shape = points.surface.shape or points.surface
    return Splats(shape, points.source, eye.camera, view, near, points.sizes, points.splat)
