"""Rasterises splats with compute shaders (OpenGL 4.3): atomics keep the nearest inverse depth of each pixel."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import moderngl
import numpy as np

from ..core.frame_textures import KnownRims, PointSurface
from ..core.images import Box
from ..core.memory import Owner
from ..core.passes import bind_texture, set_inputs
from ..core.programs import build_compute, set_uniforms
from ..core.view_images import SplatImage
from .set_splats import Splats, union

GROUP, BLOCK = 32, 4  # as in splats.comp
KEPT = 3  # the unit of the image of kept rims, as in rims.comp
MOST_GROUPS = 65535  # of threads, which every driver takes
LIST_LENGTH = 1 << 20  # blocks with large splats: more of them, of over 16 million points, are left out
PIXELS_A_GROUP = 1 << 20  # of the view


class ComputeSplatPass(Owner):
    """Notes the depth of the nearest splat; the resolve pass finds which one it was by looking up that point in the
    frame.

    For footprints of size 1: these leave no gap between neighbours, so the look-up finds the splat itself. The first
    step draws most splats; it puts those that are large, and the rims, on lists for steps of their own.
    """

    look_up = True

    def __init__(self, context: moderngl.Context, tolerance: float, is_software: bool):
        """tolerance: how far off a plane pixels may lie to be drawn as one larger splat, as a share of 1/z."""
        super().__init__(context)
        self._is_software = is_software
        self._tolerance = tolerance
        self._programs: dict[tuple[str, bool, int], moderngl.ComputeShader] = {}  # made when they are first needed
        with self._all_or_nothing():
            self._large = self._allocate(context.buffer, reserve=4 * (9 + LIST_LENGTH))
        self._rims, self._chosen = (self._keep(RimList(context)) for _ in range(2))

    def draw(self, image: SplatImage, splats: Splats) -> None:
        """Fills an image of the view. Sizes and shape are not asked."""
        (image.window,) = self.draw_set(image, [splats])

    def draw_set(self, image: SplatImage, parts: Sequence[Splats]) -> list[Box]:
        """The keys of several frames' splats. Returns the part of the view that each comes to."""
        clear_nearest(self._context, image, self._is_software)
        windows = [self._add(image, part) for part in parts]
        image.window, image.is_listed = union(windows), image.active is not None
        image.raise_version()
        return windows

    def _add(self, image: SplatImage, splats: Splats) -> Box:
        points, is_set = splats.surface, splats.trust is not None
        left, top, width, height = points.window
        corner = left // BLOCK * BLOCK, top // BLOCK * BLOCK
        inputs = {"surface_map": points.texture, "target_size": image.size}
        inputs |= splats.way | splats.of_set
        listed = {"near": splats.near, "tolerance": self._tolerance, "list_length": LIST_LENGTH}
        known = points.known_rims
        masked = 0 if image.active is None else 1 + image.is_listed
        program = self._program("points/splats.comp", is_set, masked)
        if masked < 2:
            set_uniforms(program, corner=corner)
        if image.active is not None and masked == 1:
            bind_texture(program, "active_map", image.active, unit=2)
            set_uniforms(program, active_map=2)
        set_inputs(program, inputs)  # binds the textures for the lists' programs, too
        set_uniforms(program, **listed, most_groups=MOST_GROUPS, known_rims=-1 if known is None else known.number)
        image.nearest.bind_to_storage_buffer(0)
        across, down = -(-(left + width - corner[0]) // (GROUP * BLOCK)), -(-(top + height - corner[1]) // BLOCK)
        pixels = points.size[0] * points.size[1]
        most = pixels // 8 if self._is_software else pixels
        rims = self._draw_most(program, (across, down), image, most)
        if self._is_software and (found := _count(rims, 4)) > most:
            rims = self._draw_most(program, (across, down), image, found)  # again, with room for all rims
        if known:
            self._draw_known(known, inputs | {"near": splats.near}, is_set)
        elif not self._is_empty(rims):
            self._draw_rims(points, rims, inputs | {"near": splats.near}, is_set)
        if not self._is_empty(self._large):
            self._run_list("points/large_splats.comp", self._large, inputs | listed, is_set)
        return read_window(self._large, *image.size) if self._is_software else (0, 0, *image.size)

    def _draw_most(
        self, program: moderngl.ComputeShader, groups: tuple[int, int], image: SplatImage, most: int
    ) -> moderngl.Buffer:
        """Draws all but large splats and rims, and lists these. Returns the list of rims, which has room for `most`."""
        indirect = 0, 1 + image.size[0] * image.size[1] // PIXELS_A_GROUP, 1, 0
        self._large.write(np.array([*indirect, *[0] * 5], np.int32))
        self._large.bind_to_storage_buffer(1)
        rims = self._rims.emptied(most, place=2)
        self._run_blocks(program, groups, image)
        barriers = moderngl.SHADER_STORAGE_BARRIER_BIT | moderngl.BUFFER_UPDATE_BARRIER_BIT
        self._context.memory_barrier(barriers | moderngl.COMMAND_BARRIER_BIT)  # the lists say how many groups draw them
        return rims

    def _run_blocks(self, program: moderngl.ComputeShader, groups: tuple[int, int], image: SplatImage) -> None:
        """Draw all blocks, or those that may be seen in the tiles of the view that are drawn."""
        if image.active is None:
            program.run(*groups)
        elif image.is_listed:
            program.run_indirect(self._chosen.bound(place=3))
        else:
            self._chosen.emptied(groups[0] * GROUP * groups[1], place=3)
            program.run(*groups)

    def _draw_rims(self, points: PointSurface, rims: moderngl.Buffer, inputs: dict[str, Any], is_set: bool) -> None:
        """Draw the rims on the list. On software drivers the second view of the points keeps what it finds of them."""
        count = _count(rims, 4) if self._is_software else 0
        room = points.room_for_rims(count) if count else None
        if room is not None:
            room.bind_to_image(KEPT)
        self._run_list("points/rims.comp", rims, inputs | no_rims(keeps=room is not None), is_set)
        if room is not None:
            points.keep_rims(count, room)

    def _draw_known(self, known: KnownRims, inputs: dict[str, Any], is_set: bool) -> None:
        """Draw the rims that a view before has kept."""
        known.texture.bind_to_image(KEPT)
        program = self._program("points/rims.comp", is_set)
        set_uniforms(program, **inputs | no_rims() | {"known_rims": known.number})
        program.run(-(-known.number // GROUP))
        self._context.memory_barrier(moderngl.SHADER_STORAGE_BARRIER_BIT)

    def _run_list(self, name: str, listed: moderngl.Buffer, inputs: dict[str, Any], is_set: bool) -> None:
        """Draw what the first step has put on a list."""
        program = self._program(name, is_set)
        set_uniforms(program, **inputs)
        program.run_indirect(listed)
        self._context.memory_barrier(moderngl.SHADER_STORAGE_BARRIER_BIT)

    def _program(self, name: str, is_set: bool, masked: int = 0) -> moderngl.ComputeShader:
        key = name, is_set, masked
        if key not in self._programs:
            constants = {"WINDOW": int(self._is_software), "SET": int(is_set)} | ({"MASKED": masked} if masked else {})
            self._programs[key] = self._keep(build_compute(self._context, name, **constants))
        return self._programs[key]

    def _is_empty(self, listed: moderngl.Buffer) -> bool:
        """Return whether a list is known to be empty: a software driver has run its shaders, nobody waits for them."""
        return self._is_software and _count(listed, 0) == 0


def no_rims(keeps: bool = False) -> dict[str, Any]:
    """Return the uniforms of rims.comp while no rims are known. keeps: whether it keeps those that it finds."""
    return {"known_rims": -1, "keeps": keeps}


def _count(listed: moderngl.Buffer, place: int) -> int:
    """Return a number at the head of a list, see compute_raster.glsl."""
    return int(np.frombuffer(listed.read(4, offset=4 * place), np.uint32)[0])


def clear_nearest(context: moderngl.Context, image: SplatImage, is_software: bool) -> None:
    """Clear `nearest` of a view after everybody has read it: llvmpipe's threads ignore barriers."""
    if is_software:
        context.finish()
    else:
        context.memory_barrier(moderngl.SHADER_STORAGE_BARRIER_BIT)
    image.nearest.clear()


def read_window(drawn: moderngl.Buffer, width: int, height: int) -> Box:
    """Return the part of the view in which the compute shaders have drawn, to which later passes are confined."""
    to_left, up, right, down = np.frombuffer(drawn.read(16, offset=16), np.int32).tolist()
    return width - to_left, height - up, max(right + to_left - width, 0), max(down + up - height, 0)


class RimList(Owner):
    """A list of rim pixels, see compute_raster.glsl, or of others."""

    _most = -1  # for which there is room: none yet

    def emptied(self, most: int, place: int) -> moderngl.Buffer:
        """Return the list, empty and with room for so many, where the shaders at this binding find it."""
        if self._most < most:
            self._most = -1
            self.release()
            self._buffer = self._allocate(self._context.buffer, reserve=4 * (5 + most))
            self._most = most
        self._buffer.write(np.array([0, 1, 1, 0, 0], np.int32))
        return self.bound(place)

    def bound(self, place: int) -> moderngl.Buffer:
        """Return the list as it is, where the shaders at this binding find it."""
        self._buffer.bind_to_storage_buffer(place)
        return self._buffer
