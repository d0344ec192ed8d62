"""Puts the objects of a scene on the GPU: points with their normals, as many as the view needs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property
from typing import TYPE_CHECKING

import moderngl
import numpy as np
from numpy.typing import NDArray

from ..checks.arguments import Count
from ..estimation.cloud_estimates import facing, is_scan, outward
from ..estimation.splat_projection import splat_normals
from ..gpu.clouds.cloud_objects import PlacedCloud
from ..gpu.clouds.cloud_store import CloudNormals, CloudStore, planes_of_slabs
from ..gpu.clouds.splat_layer import PlacedSplats
from ..gpu.core.frame_textures import FrameTextures, PointSurface
from ..gpu.core.images import Image, Owner
from ..gpu.core.steps import Steps
from ..gpu.drawables import Drawables, Objects
from ..gpu.meshes.mesh_objects import Grid, PlacedMesh, ShownGrid, depth_step
from ..gpu.points.point_objects import Points, PointSet, ShownPoints, ShownSet
from ..gpu.points.set_merge import target_estimator
from ..gpu.points.tiles import TileStore, needs_tiles
from ..gpu.surface.frame_store import DrawnPoints, FrameStore
from ..notes.notes import print_note
from ..notes.words import option
from ..scene.appearance import LIT_EARLY, NOT_LIT, Appearance, SurfaceOptions
from ..scene.cloud import PointCloud
from ..scene.frame import Frame
from ..scene.node import Placed
from ..scene.objects import Mesh, PointObject
from ..scene.option_fields import keys_of
from ..scene.visible import VisibleScene, coarser, coarser_size, coarser_step, finer_camera, is_alone, level_of

if TYPE_CHECKING:
    from ..estimation.agreement import ReducedFrame
    from ..estimation.light_fit import FoundLight
    from ..gpu.points.view_consensus import ConsensusPass, FrameReductionPass, HighlightRemovalPass

_KINDS = Mesh, PointCloud, PointObject
_INVENTED = "missing", "temporal"  # options that add points, or those of other frames
COARSER = 8  # every so many pixels of a frame in tiles are enough to find its pose


class GpuScene(Owner):
    """Keeps on the GPU what the last picture shows or casts shadows in it, for the next one to use again.

    drawn         the objects of the last picture, on the GPU
    photo_lights  those of the photographs that the last albedo was estimated from; none if a picture came after it
    """

    def __init__(self, context: moderngl.Context, steps: Steps, objects: Objects):
        super().__init__(context)
        self._steps, self._objects = steps, objects
        self.frames = self._keep(FrameStore(context, steps))
        self._clouds = self._keep(CloudStore(context))
        self._has_splats = False  # did the last picture have trained ones?
        self.tiles = self._keep(TileStore(context, steps, self.frames, objects.points))
        self._coarse: dict[tuple[Frame, int], Frame] = {}
        self.drawn: Drawables = {}
        self.photo_lights: list[FoundLight] = []
        self._last: VisibleScene | None = None  # whose objects `drawn` are
        self._forgotten = 0  # `steps.forgotten` at that time

    @cached_property
    def _consensus(self) -> ConsensusPass:
        from ..gpu.points.view_consensus import ConsensusPass  # only here

        return self._keep(ConsensusPass(self._context, self._steps))

    @cached_property
    def _reduction(self) -> FrameReductionPass:
        from ..gpu.points.view_consensus import FrameReductionPass  # only here

        return self._keep(FrameReductionPass(self._context))

    @cached_property
    def _highlights(self) -> HighlightRemovalPass:
        from ..gpu.points.view_consensus import HighlightRemovalPass  # only here

        return self._keep(HighlightRemovalPass(self._context, self._steps))

    def prepare(self, visible: VisibleScene, count: Count | None = None) -> Drawables:
        """Put everything that is visible or casts a shadow on the GPU. count: of `merged_frames`, counted twice."""
        if count is None and self.drawn and self._has_objects_of(visible):
            self._steps.counts["culled"] += len(visible.scene.instances) - len(visible.shown)
            self.photo_lights = []
            return self.drawn
        count, self._last = count or Count(), None
        self.drawn = {}  # its textures may be freed now
        self._steps.counts["culled"] += len(visible.scene.instances) - len(visible.shown)
        used = _used(visible)
        meshes, clouds, objects = ([p for p in used if isinstance(p.content, kind)] for kind in _KINDS)
        self._objects.keep_only(p.content for p in meshes)
        drawables: Drawables = {p: PlacedMesh(p.content, p.world[None]) for p in meshes}
        drawables |= self._prepare_clouds(clouds, visible)
        large = {
            p: self.tiles.points_of(p.content.frame, p.content.look, *p.rigid_axes)
            for p in objects
            if p.content.is_single and _coarser_step(p, visible) == 1
            and needs_tiles(p.content.frame, p.content.look, self.tiles.largest_side)
        }  # fmt: skip
        self.tiles.keep_only(list(large.values()))
        drawables |= large
        objects = [p for p in objects if p not in large]
        singles = [member for p in objects for member in p.members]
        shown = self._prepare_points(singles, visible, {p for p in objects if p.content.is_single}, count)
        for p in objects:
            views = tuple(v for v in map(shown.__getitem__, p.members) if isinstance(v, ShownPoints))
            drawables[p] = shown[p] if p.content.is_single else self._as_one(p, views, visible, count)
        self.drawn, self.photo_lights, self._last = drawables, [], visible
        self._forgotten = self._steps.forgotten
        return drawables

    def _has_objects_of(self, now: VisibleScene) -> bool:
        """Return whether the objects of the last view are all, and as fine, as another needs."""
        last = self._last
        if last is None or self._forgotten != self._steps.forgotten or last.scene is not now.scene:
            return False
        if last.environment_light != now.environment_light or last.shown != now.shown:
            return False
        if last.shadow_casters != now.shadow_casters:
            return False
        is_same_camera = last.eye.camera == now.eye.camera
        if is_same_camera and np.array_equal(last.eye.pose, now.eye.pose):
            return True
        content = now.scene.instances[0].content  # a frame alone has all of its points in every view of one size
        return is_alone(now.scene.instances) and content.is_alike_from_everywhere and is_same_camera

    def read_normals(self, frame: Frame, look: Appearance) -> NDArray[np.float32]:
        """Return (h, w, 4), read-only: the normals and depths of a frame's points, in its camera's axes."""
        self.drawn = {}  # its textures may be freed now
        if needs_tiles(frame, look, self.tiles.largest_side):
            points = self.tiles.points_of(frame, look, frame.pose, 1.0)
            self.tiles.keep_only([points])
            return points.gather(lambda part: part.textures.surface.read())
        (textures,) = self.frames.upload([frame])
        points = self.frames.find_points(textures, frame, look, frame.camera)
        return (self.frames.complete(textures, frame, points) if look.completes else points).surface.read()

    def read_albedo(self, frames: Sequence[Frame]) -> NDArray[np.uint8]:
        """Return (h, w, 3) the albedo on which photographs of one view agree, sRGB. One at a time is on the GPU."""
        from ..estimation.photo_shading import AlbedoSum, share_albedo

        self.drawn = {}  # its textures may be freed now
        colors, total = self.frames.colors, AlbedoSum()
        photos = [colors.sample(self._surfaced(frame), frame.camera) for frame in frames]
        found = share_albedo(photos)
        for frame, photo, one in zip(frames, photos, found, strict=True):
            assert frame.color is not None, "a photograph has colours"
            albedo = colors.read_unlit(self._surfaced(frame), frame.camera, photo, one.gains)
            total.add(frame.color, albedo, one.weight, photo.size)
        self.photo_lights = [one.light for one in found]
        return total.color

    def read_reduced(self, frame: Frame, look: Appearance) -> ReducedFrame:
        """Return the small copy of a frame by which its pose is found. One at a time is on the GPU."""
        self.drawn = {}  # its textures may be freed now
        if needs_tiles(frame, look, self.tiles.largest_side):
            frame = coarser(frame, COARSER)
        (textures,) = self.frames.upload([frame])
        self.frames.find_normals(textures, frame, surface_of(look))
        return self._reduction.read(textures)

    def _surfaced(self, frame: Frame) -> FrameTextures:
        """Return the textures of a single frame, with its normals."""
        (textures,) = self.frames.upload([frame])
        self.frames.find_normals(textures, frame, Appearance())
        return textures

    def release(self) -> None:
        self.drawn, self._coarse, self._last = {}, {}, None
        super().release()

    def _prepare_clouds(self, clouds: list[Placed], visible: VisibleScene) -> Drawables:
        """Return as many points of each cloud as the view needs."""
        drawables: Drawables = {}
        others: dict[Placed, Placed] = {}
        for p in clouds:
            if p.content.is_gaussian:
                drawables[p] = PlacedSplats(p.content, *p.rigid_axes)
            else:
                others[p] = p if p.content.gaussians is None else replace(p, content=p.content.as_discs)
        if freed := self._clouds.keep_only(others[p].content for p in others):
            self._steps.forget(of=freed)
        if drawables or self._has_splats:
            self._has_splats = bool(drawables)
            self._objects.splats.keep_only([p.content for p in drawables])
        for p in others:
            placed = others[p]
            level = level_of(placed, visible.eye)
            points = self._clouds.get(placed.content, level)
            drawables[p] = PlacedCloud(points, placed.content, *p.rigid_axes, 2.0 ** (0.5 * level))
        return drawables

    def _prepare_points(
        self, singles: list[Placed], visible: VisibleScene, alone: set[Placed], count: Count
    ) -> dict[Placed, ShownPoints | ShownGrid]:
        """Return the points of each frame; of objects with one frame as coarse or as fine as the view needs."""
        shown: dict[Placed, ShownPoints | ShownGrid] = {}
        places = _places(visible) if any(p.content.look.temporal for p in singles) else {}
        if places:
            self.frames.streams.keep_only(places.values())
        steps = [_coarser_step(p, visible) if p in alone else 1 for p in singles]
        wanted = [(p.content.frame, step) for p, step in zip(singles, steps, strict=True)]
        known = self._coarse
        self._coarse = {key: known.get(key) or coarser(*key) for key in dict.fromkeys(wanted) if key[1] > 1}
        frames: list[Frame] = [self._coarse[key] if key[1] > 1 else key[0] for key in wanted]
        for p, step, frame, textures in zip(singles, steps, frames, self.frames.upload(frames), strict=True):
            look = p.content.look
            is_finer = step == 1 and p in alone
            camera = finer_camera(frame, look, visible.eye.camera) if is_finer else frame.camera
            drawn = self.frames.find_points(textures, frame, look, camera, places.get(p, 0))
            if look.completes:
                photo = look.missing == "photo" and p in alone and p.is_own_view(visible.eye.pose)
                drawn = self.frames.complete(textures, frame, drawn, photo)
            noise = textures.choice.noise
            if noise and noise.share and look.shading not in NOT_LIT and look.normals == "auto":
                drawn = self.frames.calm(textures, drawn, noise)
            if look.remove_highlights and p in alone:
                from ..gpu.points.view_consensus import describe_missing_views  # only here

                textures.note_once("highlights", "alone", frame.camera, describe_missing_views())
            visibility, environment_light = None, visible.environment_light
            if environment_light.occlusion and look.shading not in NOT_LIT:
                radius = environment_light.radius(frame.scale * p.rigid_axes[1]) / p.rigid_axes[1]
                visibility = self.frames.find_visibility(textures, drawn, radius)
            if look.splat == "mesh":
                shown[p] = self._as_grid(p, drawn, textures, visibility)
            else:
                bridged = self.frames.bridge(textures, drawn) if p in alone and p in visible.shadow_casters else None
                shown[p] = _as_splats(p, drawn, textures, step, bridged, visibility)
            count.step(p not in alone)
        return shown

    def _as_grid(self, p: Placed, drawn: DrawnPoints, textures: FrameTextures, visibility: Image | None) -> ShownGrid:
        """Return points as the triangles between them."""
        surface, lit, source, colors = drawn
        look = p.content.look
        grid = Grid(surface, source, *p.rigid_axes, depth_step(look))
        self._objects.find_triangles(grid)
        light = lit if look.shading == "gouraud" else None
        material = look.material.strengths if look.shading == "flat" else None
        return ShownGrid(grid, textures, colors, look.shading, light, material, visibility)

    def _as_one(self, p: Placed, views: tuple[ShownPoints, ...], visible: VisibleScene, count: Count) -> ShownSet:
        """Return several frames of one object, with what they agree on and their weights in this view."""
        from ..estimation.multi_view import importances  # only here

        counted = count.done + len(views)
        members, colors = [view.textures for view in views], [view.colors for view in views]
        consensus = self._consensus.find(members, colors, count)
        count.step(counted - count.done)  # if they are known already
        trusts = tuple(view.textures.trust for view in views if view.textures.trust)
        differ = consensus.fine_band * p.content.scale
        points = PointSet(tuple(view.points for view in views), trusts, consensus.is_exact, differ)
        if p.content.look.remove_highlights:
            found = self._highlights.find(members, colors, consensus)
            views = tuple(replace(view, colors=one) for view, one in zip(views, found, strict=True))
        weights = importances(p.content.frames, p.seen_from(visible.eye.pose), consensus.wrong, consensus.is_exact)
        return ShownSet(points, views, consensus, weights, views[0].shading, target_estimator(p.content.look))


def merged_frames(visible: VisibleScene) -> int:
    """Return how many frames there are of objects that have several."""
    return sum(len(p.members) for p in _used(visible) if not p.content.is_single)


def _used(visible: VisibleScene) -> list[Placed]:
    needed = {*visible.shown, *visible.shadow_casters}
    return [p for p in visible.scene.instances if p in needed]


def _places(visible: VisibleScene) -> dict[Placed, int]:
    """Return the number of each frame among all frames of the scene, visible or not: it identifies a stream."""
    objects = (p for p in visible.scene.instances if p.content.frames)
    return {member: k for k, member in enumerate(member for p in objects for member in p.members)}


def _coarser_step(p: Placed, visible: VisibleScene) -> int:
    """Return 1 to draw all points: for a frame alone, and where an option is an array; else the step for this view."""
    return coarser_step(p, visible.eye) if p.content.look.is_uniform and not is_alone(visible.scene.instances) else 1


def _as_splats(
    p: Placed, drawn: DrawnPoints, textures: FrameTextures, step: int, bridged: PointSurface | None,
    visibility: Image | None,
) -> ShownPoints:  # fmt: skip
    look, (surface, lit, source, colors) = p.content.look, drawn
    sizes = look.sizes_for(p.content.frame.depth)
    sizes = sizes if step == 1 else np.array([coarser_size(float(sizes[0]), step)], np.float32)
    points = Points(surface, source, *p.rigid_axes, sizes, look.splat, bridged)
    light = lit if look.shading in LIT_EARLY else None
    return ShownPoints(points, textures, colors, light, look.shading, visibility)


def surface_of(look: Appearance) -> Appearance:
    """Return what of a look decides where the points of single frames lie that poses are found by."""
    kept = {name: getattr(look, name) for name in keys_of(SurfaceOptions) if name not in _INVENTED}
    return Appearance(normals=look.normals, **kept)


def read_cloud_normals(context: moderngl.Context, cloud: PointCloud, noise: float | None = None) -> CloudNormals:
    """Return what is known of each point. The cloud's own normals stay as they are, at unit length.

    Others point to `seen_from`, without one to a scanner at zero that shows in how points are spread, else to where the
    surface is seen from outside, and those of a sheet up.
    """
    if cloud.gaussians is not None:
        normals = splat_normals(cloud.positions, cloud.gaussians, cloud.up_direction)
        some, length = np.ones(len(cloud), np.float32), 2 * cloud.gaussians.median_length
        return CloudNormals(normals, some, np.full(len(cloud), length, np.float32))
    found = planes_of_slabs(context, cloud.positions, cloud.normals, noise)
    given = np.zeros(len(cloud), np.bool_) if cloud.normals is None else np.any(cloud.normals, axis=1)
    if cloud.confidence is not None:
        found = found._replace(confidence=np.where(given, cloud.confidence, found.confidence))
    if given.all():
        return found
    seen_from = cloud.seen_from
    if seen_from is None and is_scan(cloud.positions, -cloud.origin):
        seen_from = -cloud.origin
        print_note(
            "the points are spread as a scanner at 0, 0, 0 sees them: their normals point there; "
            f"{option('seen_from')} names another place"
        )
    if seen_from is not None:
        normals = facing(cloud.positions, found.normals, seen_from)
    else:
        normals, is_sheet = outward(cloud.positions, found.normals, cloud.up_direction)
        if is_sheet:
            up = f"{option('up')} is {cloud.up}"
            print_note(f"the cloud is an open sheet, which has no outside: its normals point up ({up})")
    return found._replace(normals=np.where(given[:, None], found.normals, normals))
