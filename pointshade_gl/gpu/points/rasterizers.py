"""Rasterises splats: as GL points, by compute shaders where these can, or lit, straight into the picture."""

from __future__ import annotations

import struct
from collections.abc import Sequence
from functools import cached_property
from typing import Any, NamedTuple

import moderngl
import numpy as np

from ...scene.camera import Camera
from ..context.caller_state import DEPTH_TEST, PROGRAM_POINT_SIZE, enabled
from ..context.software_driver import wants_software
from ..core.frame_textures import KnownRims, PointSurface
from ..core.images import Box, Image, Owner
from ..core.programs import bind_texture, build_compute, build_program, set_inputs, set_uniforms, source_and_target
from ..core.view_images import SplatImage, Target


def has_rims(sizes: np.ndarray, splat: str) -> bool:
    """Return whether splats of these sizes, (1,) or (h*w,) source pixels, and shape have rims: squares of 1 do."""
    return splat == "footprint" and bool((sizes == 1).all())


FRAME, SET, EXACT = range(3)  # whose splats: a frame's alone, one of several frames', and of such without noise


class Splats(NamedTuple):
    """A frame's splats, and their way into a view."""

    surface: PointSurface
    source: Camera  # that took the frame
    camera: Camera  # who looks
    view: np.ndarray  # (4, 4) source axes to target axes
    near: float  # source units
    sizes: np.ndarray  # (1,) or (h*w,) float32, source pixels; of one of several frames (1,)
    splat: str
    trust: Image | None = None  # of one of several frames: in its points; and where others say that its rims end
    primary: float = 1.0  # share of its splats
    is_exact: bool = False  # none of the frames has noise

    @property
    def way(self) -> dict[str, Any]:
        """The uniforms of the warp."""
        return source_and_target(self.source, self.camera, self.view)

    @property
    def of_set(self) -> dict[str, Any]:
        """The inputs that only one of several frames has."""
        return {} if self.trust is None else {"trust_map": self.trust.texture, "primary": self.primary}

    @property
    def of_set_rims(self) -> dict[str, Any]:
        """The same of its rims alone."""
        if self.trust is None:
            return {}
        return {"cuts_map": self.trust.textures[1]}

    @property
    def kind(self) -> int:
        """FRAME, SET or EXACT."""
        return FRAME if self.trust is None else EXACT if self.is_exact else SET

    @property
    def has_rims(self) -> bool:
        return has_rims(self.sizes, self.splat)


def union(windows: Sequence[Box]) -> Box:
    """Return the smallest box round all boxes that are not empty."""
    if not windows[1:]:
        return windows[0]
    boxes = [(x, y, x + w, y + h) for x, y, w, h in windows if w > 0 and h > 0] or [(0, 0, 0, 0)]
    edges = zip(*boxes, strict=True)
    left, top, right, bottom = (pick(edge) for pick, edge in zip((min, min, max, max), edges, strict=True))
    return left, top, right - left, bottom - top


class PointSplatPass(Owner):
    """Draws source ids and depth with GL_POINTS; the only vertex data is the size attribute. Rims are a second draw.

    A splat larger than the driver's largest point is drawn at that size round its place in the picture.
    """

    look_up = False

    def __init__(self, context: moderngl.Context):
        super().__init__(context)
        self._vertices: dict[int, Vertices] = {}  # by kind; made when first needed
        self._rims: dict[int, moderngl.VertexArray] = {}  # the same

    def draw(self, image: SplatImage, splats: Splats) -> None:
        """Fills an image of the view."""
        self.draw_set(image, [splats])

    def draw_set(self, image: SplatImage, parts: Sequence[Splats]) -> list[Box]:
        """The keys of several frames' splats, all of one size. Returns the part of the view that each comes to."""
        vertices = self._fit_vertices(parts[0].sizes, parts[0].kind)
        image.window = 0, 0, *image.size
        image.visible.use()
        image.visible.clear(0, depth=1.0)  # id 0 is nothing: the only value that means the same as int and float

        for part in parts:
            self._draw(vertices.array, part, image, **vertices.shape(part))
            if part.has_rims:
                self._draw(self._rim_array(part.kind), part, image, **part.of_set_rims)
        image.raise_version()
        return [image.window] * len(parts)

    def _fit_vertices(self, sizes: np.ndarray, kind: int) -> Vertices:
        if kind not in self._vertices:
            shaders = "points/splats.vert", f"points/{'set_' * (kind != FRAME)}splats.frag"
            program = self._keep(build_program(self._context, *shaders, EXACT=int(kind == EXACT)))
            self._vertices[kind] = Vertices(self._context, program, sizes)
        self._vertices[kind] = self._vertices[kind].fitted(sizes)
        return self._vertices[kind]

    def _draw(self, array: moderngl.VertexArray, splats: Splats, image: SplatImage, **others: Any) -> None:
        maps = {"surface_map": splats.surface.texture}
        inputs = splats.of_set | splats.way | others | maps
        set_inputs(array.program, inputs | {"target_size": image.size, "near": splats.near, "first_id": 1})
        with enabled(self._context, DEPTH_TEST, PROGRAM_POINT_SIZE):
            array.render(moderngl.POINTS, vertices=splats.source.width * splats.source.height)

    def _rim_array(self, kind: int) -> moderngl.VertexArray:
        if kind not in self._rims:
            shaders = "points/rims.vert", "points/rims.frag"
            program = self._keep(
                build_program(self._context, *shaders, SET=int(kind != FRAME), EXACT=int(kind == EXACT))
            )
            self._rims[kind] = self._allocate(self._context.vertex_array, program, [])
        return self._rims[kind]

    def release(self) -> None:
        for vertices in self._vertices.values():
            vertices.release()
        super().release()


class Vertices(Owner):
    """The sizes of the splats: one for the whole draw (side, else 0), or one a point."""

    def __init__(self, context: moderngl.Context, program: moderngl.Program, sizes: np.ndarray):
        super().__init__(context)
        self.sizes = sizes.copy()  # the caller may write into theirs
        self.side = float(sizes[0]) if sizes.size == 1 else 0.0
        with self._all_or_nothing():
            content = []
            if sizes.size > 1:
                content = [(self._allocate(context.buffer, self.sizes.tobytes()), "1f", "size")]
            self.array = self._allocate(context.vertex_array, program, content)

    def fitted(self, sizes: np.ndarray) -> Vertices:
        """These, or, for splats of other sizes, new ones in their place."""
        if np.array_equal(sizes, self.sizes):
            return self
        made = Vertices(self._context, self.array.program, sizes)
        self.release()
        return made

    def shape(self, splats: Splats) -> dict[str, Any]:
        """The uniforms of how the splats look."""
        return {"side": self.side, "is_round": splats.splat == "round", "has_rims": splats.has_rims}


GROUP, BLOCK = 32, 4  # threads, and pixels a side for each, as in splats.comp
GROUP_ON_GPU, BLOCK_ON_GPU = 64, 1
CUTS = 3  # the unit of the texture of cuts
KEPT = 3  # the unit of the image of kept rims, as in rims.comp
MOST_GROUPS = 65535  # of threads, which every driver takes
PIXELS_A_GROUP = 1 << 20  # of the view


class ComputeSplatPass(Owner):
    """Notes the depth of the nearest splat; the resolve pass finds which one it was by looking up that point in the
    frame.

    For footprints of size 1: these leave no gap between neighbours, so the look-up finds the splat itself. The first
    step draws most splats; it puts those that are large, and the rims, on lists for steps of their own.
    """

    look_up = True

    def __init__(self, context: moderngl.Context, tolerance: float, is_software: bool):
        """tolerance: how far off a plane pixels may lie to be drawn as one larger splat, as a share of 1/z; on GPUs a
        thread for each pixel is faster.
        """
        super().__init__(context)
        self._is_software = is_software
        merges = wants_software(context)
        self._group, self._block = (GROUP, BLOCK) if merges else (GROUP_ON_GPU, BLOCK_ON_GPU)
        self._merge = {"tolerance": tolerance} if merges else {}
        self._programs: dict[tuple[str, int, int], moderngl.ComputeShader] = {}  # made when they are first needed
        self._large, self._rims, self._chosen = (self._keep(RimList(context)) for _ in range(3))

    def draw(self, image: SplatImage, splats: Splats) -> None:
        """Fills an image of the view. Sizes and shape are not asked."""
        (image.window,) = self.draw_set(image, [splats])

    def draw_set(self, image: SplatImage, parts: Sequence[Splats]) -> list[Box]:
        """The keys of several frames' splats. Returns the part of the view that each comes to."""
        clear_nearest(self._context, image, self._is_software)
        image.may_hide = not self._is_software
        windows = [self._add(image, part) for part in parts]
        image.window, image.is_listed = union(windows), image.active is not None
        image.raise_version()
        return windows

    def _add(self, image: SplatImage, splats: Splats) -> Box:
        points, kind = splats.surface, splats.kind
        left, top, width, height = points.window
        group, block = self._group, self._block
        corner = left // block * block, top // block * block
        inputs = {"surface_map": points.texture, "target_size": image.size}
        inputs |= splats.way | splats.of_set
        blocks = -(-points.size[0] // block) * -(-points.size[1] // block)
        listed = {"near": splats.near, "list_length": blocks, **self._merge}
        known = points.known_rims
        masked = 0 if image.active is None else 1 + image.is_listed
        program = self._program("points/splats.comp", kind, masked)
        if image.active is not None and masked == 1:
            bind_texture(program, "active_map", image.active, unit=2)
            set_uniforms(program, active_map=2)
        own = inputs | listed | ({"corner": corner} if masked < 2 else {})
        own |= {"most_groups": MOST_GROUPS, "known_rims": -1 if known is None else known.number}
        set_inputs(program, own)
        for name in inputs:
            inputs[name] = own[name]  # the lists' programs find the textures at the same units
        image.nearest.bind_to_storage_buffer(0)
        across, down = -(-(left + width - corner[0]) // (group * block)), -(-(top + height - corner[1]) // block)
        pixels = points.size[0] * points.size[1]
        most = pixels // 8 if self._is_software else pixels
        rims, large = self._draw_most(program, (across, down), image, most, blocks)
        rim_groups, rim_count = -1, 0
        if self._is_software:  # which has run its shaders: nobody waits
            rim_groups, *_, rim_count = struct.unpack("5I", rims.read(20))
        if rim_count > most:
            rims, large = self._draw_most(program, (across, down), image, rim_count, blocks)  # again, with room for all
            rim_groups, *_, rim_count = struct.unpack("5I", rims.read(20))
        image.may_hide |= bool(known or rim_groups)
        if known or rim_groups:
            self._draw_rims(splats, rims, rim_count, inputs | {"near": splats.near})
        if not self._is_software:
            self._run_list("points/large_splats.comp", large, inputs | listed, kind)
            return 0, 0, *image.size
        if (head := head_of(large))[0]:
            self._run_list("points/large_splats.comp", large, inputs | listed, kind)
            head = head_of(large)
        return window_of(head, *image.size)

    def _draw_most(
        self, program: moderngl.ComputeShader, groups: tuple[int, int], image: SplatImage, most: int, blocks: int
    ) -> tuple[moderngl.Buffer, moderngl.Buffer]:
        """Draws all but large splats and rims. Returns lists: of `most` rims, and of the blocks with large splats."""
        head = struct.pack("9i", 0, 1 + image.size[0] * image.size[1] // PIXELS_A_GROUP, 1, *[0] * 6)
        large, rims = self._large.emptied(blocks, 1, head), self._rims.emptied(most, place=2)
        self._run_blocks(program, groups, image)
        barriers = moderngl.SHADER_STORAGE_BARRIER_BIT | moderngl.BUFFER_UPDATE_BARRIER_BIT
        self._context.memory_barrier(barriers | moderngl.COMMAND_BARRIER_BIT)  # the lists say how many groups draw them
        return rims, large

    def _run_blocks(self, program: moderngl.ComputeShader, groups: tuple[int, int], image: SplatImage) -> None:
        """Draw all blocks, or those that may be seen in the tiles of the view that are drawn."""
        if image.active is None:
            program.run(*groups)
        elif image.is_listed:
            program.run_indirect(self._chosen.bound(place=3))
        else:
            self._chosen.emptied(groups[0] * self._group * groups[1], place=3)
            program.run(*groups)

    def _draw_rims(self, splats: Splats, rims: moderngl.Buffer, count: int, inputs: dict[str, Any]) -> None:
        """Draw the rims that a view before has kept, or those on the list. On software drivers the second view of the
        points keeps what it finds of them.

        count  of the rims there; 0 on hardware, where it is not known
        """
        points, kind = splats.surface, splats.kind
        if splats.trust is not None:
            cuts = splats.trust.textures[1]
            bind_texture(self._program("points/rims.comp", kind), "cuts_map", cuts, unit=CUTS)
            inputs = inputs | splats.of_set_rims | {"cuts_map": CUTS}
        if (known := points.known_rims) is not None:
            self._draw_known(known, inputs, kind)
            return
        room = points.room_for_rims(count) if count else None
        if room is not None:
            room.bind_to_image(KEPT)
        self._run_list("points/rims.comp", rims, inputs | no_rims(keeps=room is not None), kind)
        if room is not None:
            points.keep_rims(count, room)

    def _draw_known(self, known: KnownRims, inputs: dict[str, Any], kind: int) -> None:
        known.texture.bind_to_image(KEPT)
        program = self._program("points/rims.comp", kind)
        set_uniforms(program, **inputs | no_rims() | {"known_rims": known.number})
        program.run(-(-known.number // GROUP))
        self._context.memory_barrier(moderngl.SHADER_STORAGE_BARRIER_BIT)

    def _run_list(self, name: str, listed: moderngl.Buffer, inputs: dict[str, Any], kind: int) -> None:
        """Draw what the first step has put on a list."""
        program = self._program(name, kind)
        set_uniforms(program, **inputs)
        program.run_indirect(listed)
        self._context.memory_barrier(moderngl.SHADER_STORAGE_BARRIER_BIT)

    def _program(self, name: str, kind: int, masked: int = 0) -> moderngl.ComputeShader:
        key = name, kind, masked
        if key not in self._programs:
            constants = {"WINDOW": int(self._is_software), "SET": int(kind != FRAME), "EXACT": int(kind == EXACT)}
            constants |= {"MASKED": masked} if masked else {}
            constants |= {} if self._block == BLOCK else {"BLOCK": self._block, "GROUP": self._group}
            self._programs[key] = self._keep(build_compute(self._context, name, **constants))
        return self._programs[key]


def no_rims(keeps: bool = False) -> dict[str, Any]:
    """Return the uniforms of rims.comp while no rims are known. keeps: whether it keeps those that it finds."""
    return {"known_rims": -1, "keeps": keeps}


def clear_nearest(context: moderngl.Context, image: SplatImage, is_software: bool) -> None:
    """Clear `nearest` of a view after everybody has read it: llvmpipe's threads ignore barriers."""
    if is_software:
        context.finish()
    else:
        context.memory_barrier(moderngl.SHADER_STORAGE_BARRIER_BIT)
    image.nearest.clear()


def head_of(listed: moderngl.Buffer) -> tuple[int, ...]:
    """Return the first eight numbers of a list, see compute_raster.glsl."""
    return struct.unpack("8i", listed.read(32))


def window_of(head: Sequence[int], width: int, height: int) -> Box:
    """Return the part of the view in which the compute shaders have drawn, to which later passes are confined.

    head  of the list of large splats, see compute_raster.glsl
    """
    to_left, up, right, down = head[4:8]
    across, down = right + to_left - width, down + up - height
    return width - to_left, height - up, across if across > 0 else 0, down if down > 0 else 0


EMPTY_LIST = struct.pack("5i", 0, 1, 1, 0, 0)


class RimList(Owner):
    """A list of rim pixels, see compute_raster.glsl, or of others."""

    _most = -1  # for which there is room: none yet

    def emptied(self, most: int, place: int, head: bytes = EMPTY_LIST) -> moderngl.Buffer:
        """Return the list, empty and with room for so many, where the shaders at this binding find it."""
        if self._most < most:
            self._most = -1
            self.release()
            self._buffer = self._allocate(self._context.buffer, reserve=len(head) + 4 * most)
            self._most = most
        self._buffer.write(head)
        self._buffer.bind_to_storage_buffer(place)
        return self._buffer

    def bound(self, place: int) -> moderngl.Buffer:
        """Return the list as it is, where the shaders at this binding find it."""
        self._buffer.bind_to_storage_buffer(place)
        return self._buffer


class Rasterizers:
    """Both rasterisers, each made when it is first used.

    can_compute  whether there is OpenGL 4.3: footprints of size 1 are then drawn by the compute shader
    merge        of the compute rasteriser, see `Renderer`
    """

    def __init__(self, context: moderngl.Context, is_software: bool, can_compute: bool, merge: float):
        self._context, self.is_software = context, is_software
        self.can_compute, self._merge = can_compute, merge
        self._made: dict[bool, PointSplatPass | ComputeSplatPass] = {}
        self._last: tuple[Any, str, PointSplatPass | ComputeSplatPass | None] = None, "", None

    def choose(self, sizes: np.ndarray, splat: str) -> PointSplatPass | ComputeSplatPass:
        """Return the rasteriser for splats of these sizes, (1,) or (h*w,) in source pixels, and of this shape."""
        last = self._last
        if last[0] is sizes and last[1] == splat and last[2] is not None:
            return last[2]  # asked several times for one draw
        computed = self.can_compute and has_rims(sizes, splat)
        if computed not in self._made:
            made = ComputeSplatPass(self._context, self._merge, self.is_software) if computed else None
            self._made[computed] = made or PointSplatPass(self._context)
        self._last = sizes, splat, None if sizes.flags.writeable else self._made[computed]
        return self._made[computed]

    def release(self) -> None:
        for rasterizer in self._made.values():
            rasterizer.release()


class LitSplatPass(Owner):
    """Lights splats in the vertex shader, once per splat; nothing is kept for later passes.

    Which splat is visible, and where, is as in `PointSplatPass`.
    """

    def __init__(self, context: moderngl.Context):
        super().__init__(context)
        with self._all_or_nothing():
            program = self._keep(build_program(context, "points/splats.vert", "points/splats.frag", LIT=1))
            self._vertices = Vertices(context, program, np.ones(1, np.float32))

    def draw(self, target: Target, splats: Splats, lights: dict[str, Any]) -> None:
        """lights: inputs of shaders/common/lights.glsl, source axes, with color_map, material and eye."""
        self._vertices = self._vertices.fitted(splats.sizes)
        array, count = self._vertices.array, splats.source.width * splats.source.height
        inputs = {"surface_map": splats.surface.texture, "target_size": target.size, "near": splats.near}
        inputs |= splats.way | lights
        set_inputs(array.program, inputs)
        set_uniforms(array.program, **self._vertices.shape(splats))
        target.shared_picture.use()
        target.shared_picture.clear(depth=1.0)
        with enabled(self._context, DEPTH_TEST, PROGRAM_POINT_SIZE):
            array.render(moderngl.POINTS, vertices=count)
            if splats.has_rims:
                array = self._rims
                set_uniforms(array.program, **inputs)
                array.render(moderngl.POINTS, vertices=count)

    @cached_property
    def _rims(self) -> moderngl.VertexArray:
        program = self._keep(build_program(self._context, "points/rims.vert", "points/rims.frag", LIT=1))
        return self._allocate(self._context.vertex_array, program, [])

    def release(self) -> None:
        self._vertices.release()
        super().release()
