"""Refines surfaces: as fine as their colours, flying pixels moved, completed where depth is missing or hidden."""

from __future__ import annotations

import math

import moderngl
import numpy as np

from ...scene.camera import Camera
from ...scene.frame import is_cut_out
from ...scene.noise import Noise
from ...scene.visible import bridged_stride
from ..core.frame_textures import CALM_CELL, DepthTextures, FrameTextures, PointSurface
from ..core.images import R32F, RG16, RG32F, RGBA32F, Box, Fitted, Image, Images, empty, read_texture
from ..core.programs import FullscreenPasses
from .surface_normals import Estimator, SurfacePass

SIDE, BLOCK = 4, 8  # pixels along a side of a cell, and cells along one of a block, as in the shader
CELLS = "near_planes", "other_planes", "colors_map"


class CompletionPass(FullscreenPasses):
    """Carries the planes around missing points to them, and lets them vote there."""

    def __init__(self, context: moderngl.Context):
        super().__init__(context)
        self._images = self._keep(Fitted(context, CompletionImages))
        self._hidden = self._keep(Fitted(context, Image, R32F))

    def run(
        self, textures: FrameTextures, surface: PointSurface, camera: Camera, completed: PointSurface, beyond: float
    ) -> tuple[float, float]:
        """Write the surface of a frame without gaps to `completed`.

        camera  the frame's, at the surface's size
        beyond  the depth of what has no surface, where the photograph is to be seen in its place; 0.0 leaves it empty

        Returns the share of the pixels that got a surface, and of those that got none.
        """
        from ...estimation.stereo_shadows import find_shifts, hidden_below  # only here

        frame, colors, pixels = textures.frame, textures.color, surface.size[0] * surface.size[1]
        assert frame is not None, "nothing was uploaded"
        images, source = self._images.fit(surface.size), camera.intrinsics
        shifts = find_shifts(frame.depth, abs(frame.camera.fx))
        hidden = self._hidden.fit(frame.depth.shape[::-1] if any(shifts) else (1, 1))
        if any(shifts):
            hidden.texture.write(hidden_below(frame.depth, shifts))
        same, has_shadows = int(colors.size == surface.size), int(any(shifts))
        points = {"surface_map": surface.texture, "color_map": colors}
        find_cells = self.fullscreen("surface/completion_cells.frag", SAME_SIZE=same)
        find_cells.draw(images.cells.target, points, source=source)
        cells = dict(zip(CELLS, images.cells.textures, strict=True))
        alone = not frame.is_sparse and is_cut_out(frame.depth)
        walked = {name: cells[name] for name in ("near_planes", "colors_map")}
        blocks = self.fullscreen("surface/completion_blocks.frag", SAME_SIZE=same)
        blocks.draw(images.blocks.target, {"near_planes": cells["near_planes"]})
        walk = self.fullscreen("surface/completion_stops.frag", SAME_SIZE=same)
        walk.draw(images.stops.target, walked | {"block_map": images.blocks.texture}, is_alone=alone)
        seen = {"surface_map": surface.texture, "hidden_map": hidden.texture} if any(shifts) else {}
        rays = self.fullscreen("surface/completion_rays.frag", SAME_SIZE=same, HIDDEN=has_shadows)
        rays.draw(images.planes.target, cells | seen | {"stops_map": images.stops.texture}, is_alone=alone)
        planes, evidence = images.planes.textures
        settled = self.fullscreen("surface/completion_settled.frag", SAME_SIZE=same)
        settled.draw(images.settled.target, {"plane_map": planes, "evidence_map": evidence})
        empty(images.pixels.target)
        maps = cells | seen | points | {"plane_map": images.settled.texture}
        fill = self.fullscreen("surface/completion_pixels.frag", SAME_SIZE=same, HIDDEN=has_shadows)
        fill.draw(images.pixels.target, maps, source=source)
        both = {"surface_map": surface.texture, "completed_map": images.pixels.texture}
        both |= {"color_map": colors} if beyond else {}
        photo = {"beyond": beyond} if beyond else {}
        completed.confine((0, 0, *surface.size))
        join = self.fullscreen("surface/completed_surface.frag", SAME_SIZE=same, PHOTO=int(beyond > 0))
        join.draw(completed.target, both, source=source, **photo)
        completed.certainty = surface.certainty
        completed.raise_version()
        missing, found = read_texture(self._context, cells["colors_map"])[..., 3], images.settled.read()[..., 3] > 0
        return float(missing[found].sum()) / pixels, float(missing[~found].sum()) / pixels


class CompletionImages(Images):
    """What is found on the way, for one size of surface: see the shaders."""

    def __init__(self, context: moderngl.Context, size: tuple[int, int]):
        super().__init__(context, size)
        cells = -(-size[0] // SIDE), -(-size[1] // SIDE)
        self.cells = self._keep(Image(context, cells, *(RGBA32F for _ in CELLS)))
        self.blocks = self._keep(Image(context, (-(-cells[0] // BLOCK), -(-cells[1] // BLOCK)), R32F))
        self.stops = self._keep(Image(context, (SIDE * cells[0], SIDE * cells[1]), RG16))
        self.planes = self._keep(Image(context, cells, RGBA32F, RGBA32F))
        self.settled = self._keep(Image(context, cells))
        self.pixels = self._keep(Image(context, size))


class HiddenPlanesPass(FullscreenPasses):
    """Continues planes behind the objects that hide them, see shaders/common/hidden_planes.glsl."""

    def run(self, surface: PointSurface, camera: Camera, bridged: PointSurface) -> None:
        """Write the hidden planes to `bridged`, of its `bridged_camera`. camera: the frame's, at the surface's size."""
        bridged.confine((0, 0, *bridged.size))
        inputs = {"source": camera.intrinsics, "stride": bridged_stride(camera)}
        bridge = self.fullscreen("surface/hidden_planes.frag")
        bridge.draw(bridged.target, {"surface_map": surface.texture}, **inputs)
        bridged.raise_version()


Textures = dict[str, moderngl.Texture]
LEVELS = 3, 5  # of means over more and more distant cells; the second where neighbours share their noise
OWN_SHARE = 1.0, 0.1  # of a pixel's normal, likewise
WRONG = 0.6  # tilt of a cell whose depth is wrong


class CalmNormalsPass(FullscreenPasses):
    """Averages normals of noisy frames for light, see shaders/common/calm_normals.glsl."""

    def __init__(self, context: moderngl.Context):
        super().__init__(context)
        self._witness, self._doubts = (self._keep(Fitted(context, Image, RGBA32F)) for _ in range(2))
        self._scatter = self._keep(Fitted(context, Image, RG32F))
        self._cells = [self._keep(Fitted(context, Image, RGBA32F, RGBA32F)) for _ in range(2)]

    def run(
        self, textures: FrameTextures, surface: PointSurface, camera: Camera, noise: Noise, calm: PointSurface
    ) -> float:
        """Write the surface of a frame with calm normals to `calm`. camera: the frame's, at the surface's size.

        Returns the share of the frame whose depth is wrong over wide areas, where neighbours share their noise.
        """
        is_shared = noise.bumps > 0
        inputs = {"noise": noise.relative, "intrinsics": camera.intrinsics}
        pixels = self._find_witness(textures, surface)
        size = -(-surface.size[0] // CALM_CELL), -(-surface.size[1] // CALM_CELL)
        cells, others = (one.fit(size) for one in self._cells)
        self.fullscreen("surface/calm_cells.frag").draw(cells.target, pixels, **inputs)
        facets, doubts = _facets(cells), {}
        if is_shared:
            doubts["doubt_map"] = facets["witness_map"] = self._doubt(facets, cells.size)
        for level in range(LEVELS[is_shared]):
            average = self.fullscreen("surface/calm_levels.frag", SHARED=int(is_shared and level == 0))
            average.draw(others.target, facets, stride=1 << level, **inputs)
            cells, others = others, cells
            facets = _facets(cells)
        around = dict(zip(("other_map", "joined_map"), cells.textures, strict=True))
        calm.confine(surface.window)
        turn = self.fullscreen("surface/calm_normals.frag", DOUBTED=int(is_shared))
        turn.draw(calm.target, pixels | around | doubts, own_share=OWN_SHARE[is_shared], **inputs)
        calm.certainty = self._doubted_certainty(calm, cells, doubts or {"doubt_map": cells.textures[1]})
        calm.shape = surface
        calm.raise_version()
        return float((np.abs(self._doubts.fit(cells.size).read()[..., 1]) >= WRONG).mean()) if is_shared else 0.0

    def _find_witness(self, textures: FrameTextures, surface: PointSurface) -> Textures:
        """Return the maps of what is known of each pixel."""
        witness = self._witness.fit(surface.size)
        is_completed = surface is not textures.surface
        same = int(textures.color.size == surface.size)
        look = self.fullscreen("surface/calm_witness.frag", SAME_SIZE=same, COMPLETED=int(is_completed))
        assert surface.certainty is not None, "of noisy frames it was found"
        maps = {"surface_map": surface.texture, "certainty_map": surface.certainty, "color_map": textures.color}
        measured = {"measured_map": textures.surface.texture} if is_completed else {}
        look.draw(witness.target, maps | measured)
        return {"surface_map": surface.texture, "witness_map": witness.texture}

    def _doubt(self, facets: Textures, size: tuple[int, int]) -> moderngl.Texture:
        """Return the witness of cells that doubts wrong depth."""
        scatter, doubts = self._scatter.fit(size), self._doubts.fit(size)
        find, judge = (self.fullscreen("surface/calm_doubts.frag", STAGE=stage) for stage in range(2))
        find.draw(scatter.target, facets)
        judge.draw(doubts.target, {"witness_map": facets["witness_map"], "scatter_map": scatter.texture})
        return doubts.texture

    def _doubted_certainty(self, calm: PointSurface, cells: Image, doubts: Textures) -> moderngl.Texture:
        lower, target = self.fullscreen("surface/calm_doubts.frag", STAGE=2), calm.calm_certainty_target
        lower.draw(target, _facets(cells) | doubts)
        (texture,) = target.color_attachments
        assert isinstance(texture, moderngl.Texture)
        return texture


def _facets(cells: Image) -> Textures:
    return dict(zip(("surface_map", "witness_map"), cells.textures, strict=True))


COUNTED = 16  # as in flying_pixel_mixing.glsl
# Share of mixed samples among those at steps, above which a sensor mixes. Measured: .99 to 1 by lidar, .65 by a Kinect,
# up to .77 in clean depth, where snapping would cost sharpness.
MIXES = 0.95
FEWEST = 50  # samples at steps that are enough to tell


class FlyingPixelPass(FullscreenPasses):
    """Moves mixed samples onto the plane of one side, chosen by their colour; they do not count for normals."""

    def __init__(self, context: moderngl.Context, surface: SurfacePass):
        super().__init__(context)
        self._surface = surface
        self._images = self._keep(Fitted(context, SnapImages))

    def run(
        self, frame: FrameTextures, guide: moderngl.Texture, camera: Camera, estimator: Estimator | None
    ) -> PointSurface:
        """Return the frame's surface, without flying pixels if its sensor makes any; valid until the next call.

        guide  mean colour of each sample
        """
        images = self._images.fit(frame.size)
        if estimator is None or not self._mixes(frame, images):
            return frame.surface
        images.unmixed.surface.confine(frame.surface.window)
        self._surface.run(images.unmixed, camera, estimator)
        maps = {"surface_map": images.unmixed.surface.texture, "mixed_map": frame.surface.texture}
        maps |= {"depth_map": frame.depth, "mixing_map": images.mixing, "guide_map": guide}
        images.snapped.confine(frame.surface.window)
        snap = self.fullscreen("surface/flying_pixel_snap.frag")
        snap.draw(images.snapped.target, maps, source=camera.intrinsics)
        return images.snapped

    def _mixes(self, frame: FrameTextures, images: SnapImages) -> bool:
        """Return whether the sensor mixes surfaces: nearly all steps in depth have samples between their two sides."""
        find, count = (self.fullscreen(f"surface/{name}.frag") for name in ("flying_pixels", "flying_pixel_counts"))
        find.draw(images.mixing_target, {"depth_map": frame.depth})
        count.draw(images.counts.target, {"mixing_map": images.mixing})
        mixed, sharp = images.counts.read().reshape(-1, 2).sum(0)
        return mixed + sharp >= FEWEST and mixed > MIXES * (mixed + sharp)


class SnapImages(Images):
    """mixing and counts (RG32F), see flying_pixel_mixing.glsl; depth without mixed samples; the snapped surface."""

    def __init__(self, context: moderngl.Context, size: tuple[int, int]):
        super().__init__(context, size)
        blocks = -(-size[0] // COUNTED), -(-size[1] // COUNTED)
        with self._all_or_nothing():
            self.unmixed = self._keep(DepthTextures(context, size))
            self.snapped = self._keep(PointSurface(context, size))
            self.mixing = self._texture(*RG32F)
            self.mixing_target = self._framebuffer(self.mixing, self.unmixed.depth)
            self.counts = self._keep(Image(context, blocks, RG32F))


class UpsamplePass(FullscreenPasses):
    """Enlarges surfaces: colour decides to which surface a pixel belongs, its position alone its depth and its normal.

    It trusts the colours, and nothing checks them. Near edges of ray-traced scenes with samples of 7.5 pixels, 8 % of
    the depths are wrong without a vote and 1 % with it; 2 % with noise of 20/255 in the colours, 5 % of 40/255; 6 %
    where the colours are shifted by .4 of a sample, 10 % by a whole one.
    """

    def __init__(self, context: moderngl.Context, surface: SurfacePass):
        super().__init__(context)
        self._guide = self._keep(Fitted(context, Image, RGBA32F))  # mean colour of each sample
        self._calm = self._keep(Fitted(context, Image, R32F))  # whether its neighbours lie on its plane
        self._snap = self._keep(FlyingPixelPass(context, surface))

    def run(
        self, frame: FrameTextures, small: PointSurface, camera: Camera, estimator: Estimator | None,
        large: PointSurface,
    ) -> None:  # fmt: skip
        """Enlarge a frame's surface, of estimated normals or the caller's own, from `small` to `large`.

        camera  took the frame, at the depth's size
        """
        guide, calm = self._guide.fit(small.size), self._calm.fit(small.size)
        colors = {"color_map": frame.color}
        self.fullscreen("surface/upsample_guide.frag").draw(guide.target, colors, small_size=small.size)
        snapped = self._snap.run(frame, guide.texture, camera, estimator)
        source = {"surface_map": snapped.texture, "source": camera.intrinsics}
        self.fullscreen("surface/planar_mask.frag").draw(calm.target, source)
        large.confine(_enlarged(small.window, small.size, large.size))
        maps = {"guide_map": guide.texture, "calm_map": calm.texture}
        self.fullscreen("surface/upsample_vote.frag").draw(large.target, source | colors | maps, large_size=large.size)
        large.certainty = small.certainty
        large.raise_version()


def _enlarged(window: Box, size: tuple[int, int], larger: tuple[int, int]) -> Box:
    """Return the window of a larger picture that may show a smaller one's window: one sample more on each side."""
    edges = []
    for axis in (0, 1):
        low, high = window[axis] - 1, window[axis] + window[axis + 2] + 1
        scale = larger[axis] / size[axis]
        edges.append((max(math.floor(low * scale), 0), min(math.ceil(high * scale), larger[axis])))
    (left, right), (top, bottom) = edges
    return left, top, right - left, bottom - top
