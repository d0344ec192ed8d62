"""Completes a surface where depth is missing, see shaders/common/completion.glsl."""

from __future__ import annotations

import moderngl
import numpy as np

from ...scene.camera import Camera
from ...scene.frame import Frame
from ..core.frame_textures import FrameTextures, PointSurface
from ..core.images import R32F, RG16, RGBA32F, Fitted, Image, Images, empty, read_texture
from ..core.passes import FullscreenPasses

SIDE, BLOCK = 4, 8  # pixels along a side of a cell, and cells along one of a block, as in the shader
RING = 16  # part of the picture's shorter side that sensors may lose along its border
ALONE = 0.5  # share without depth of what runs round the picture there, beyond which an object was cut out
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
        self.fullscreen("surface/completion_cells.frag", SAME_SIZE=same).draw(
            images.cells.target, points, source=source
        )
        cells = dict(zip(CELLS, images.cells.textures, strict=True))
        alone, walked = _is_alone(frame), {name: cells[name] for name in ("near_planes", "colors_map")}
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
        self.fullscreen("surface/completion_pixels.frag", SAME_SIZE=same, HIDDEN=has_shadows).draw(
            images.pixels.target, maps, source=source
        )
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


def _is_alone(frame: Frame) -> bool:
    """Return whether the frame shows an object that was cut out: there is nothing round it."""
    if frame.is_sparse:
        return False
    missing = frame.depth == 0
    inset = min(missing.shape) // RING
    ring = missing[inset : missing.shape[0] - inset, inset : missing.shape[1] - inset]
    return float(np.mean(np.concatenate([ring[0], ring[-1], ring[:, 0], ring[:, -1]]))) > ALONE
