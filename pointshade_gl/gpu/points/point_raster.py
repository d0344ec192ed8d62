"""Rasterises splats as GL points: every pixel with a depth becomes one, and the depth test keeps the nearest."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import moderngl
import numpy as np

from ...scene.camera import Camera
from ..context.raw_gl import DEPTH_TEST, PROGRAM_POINT_SIZE
from ..context.saved_state import enabled
from ..core.frame_textures import PointSurface
from ..core.images import Box
from ..core.memory import Owner
from ..core.passes import bind_textures
from ..core.programs import build_program, set_uniforms, source_and_target
from ..core.view_images import SplatImage
from .rims import has_rims
from .set_splats import SetSplats


class PointSplatPass(Owner):
    """Draws source ids and depth with GL_POINTS; the only vertex data is the size attribute. Rims are a second draw.

    A splat larger than the driver's largest point is drawn at that size round its place in the picture.
    """

    look_up = False

    def __init__(self, context: moderngl.Context):
        super().__init__(context)
        with self._all_or_nothing():
            self._program = self._keep(build_program(context, "points/splats.vert", "points/splats.frag"))
            self._vertices = Vertices(context, self._program, np.ones(1, np.float32))
        self._rims: dict[bool, moderngl.VertexArray] = {}  # of a frame, of one of a set; made when first needed
        self._set_program: moderngl.Program | None = None  # these two for the first set of frames
        self._set_vertices: Vertices | None = None

    def draw(
        self,
        points: PointSurface,
        source: Camera,
        image: SplatImage,
        camera: Camera,
        view: np.ndarray,
        near: float,
        sizes: np.ndarray,
        splat: str,
    ) -> None:
        """view (4, 4) takes source axes to target axes; near in source units; sizes (1,) or (h*w,) float32."""
        if not np.array_equal(sizes, self._vertices.sizes):
            vertices = Vertices(self._context, self._program, sizes)
            self._vertices.release()
            self._vertices = vertices
        self._clear(image)
        warp = points, source, image, camera, view, near
        rims = has_rims(sizes, splat)
        shape = {"side": self._vertices.side, "is_round": splat == "round", "has_rims": rims}
        self._add(self._program, self._vertices.array, *warp, **shape)
        if rims:
            self._add_rims(*warp)
        image.raise_version()

    def draw_set(self, parts: Sequence[SetSplats], image: SplatImage, camera: Camera) -> list[Box]:
        """Rasterise the splats of several frames, all of one size, by their keys. Returns the part of the view that
        each covers."""
        if self._set_program is None:
            self._set_program = self._keep(build_program(self._context, "points/splats.vert", "points/set_splats.frag"))
        if self._set_vertices is None or not np.array_equal(parts[0].sizes, self._set_vertices.sizes):
            vertices = Vertices(self._context, self._set_program, parts[0].sizes)
            if self._set_vertices is not None:
                self._set_vertices.release()
            self._set_vertices = vertices
        self._clear(image)
        for part in parts:
            rims, inputs = has_rims(part.sizes, part.splat), {"trust_map": part.trust, "primary": part.primary}
            warp = part.surface, part.source, image, camera, part.view, part.near
            shape = {"side": self._set_vertices.side, "is_round": part.splat == "round", "has_rims": rims}
            self._add(self._set_program, self._set_vertices.array, *warp, **inputs, **shape)
            if rims:
                self._add_rims(*warp, **inputs)
        image.raise_version()
        return [image.window] * len(parts)

    def _clear(self, image: SplatImage) -> None:
        image.window = 0, 0, *image.size
        image.visible.use()
        image.visible.clear(0, depth=1.0)  # id 0 is nothing: the only value that means the same as int and float

    def _add(
        self,
        program: moderngl.Program,
        vertices: moderngl.VertexArray,
        points: PointSurface,
        source: Camera,
        image: SplatImage,
        camera: Camera,
        view: np.ndarray,
        near: float,
        **inputs: Any,
    ) -> None:
        warp = source_and_target(source, camera, view)
        inputs |= {"surface_map": points.texture}
        bind_textures(program, inputs)
        set_uniforms(program, target_size=image.size, near=near, **warp, first_id=1, **inputs)
        with enabled(self._context, DEPTH_TEST, PROGRAM_POINT_SIZE):
            vertices.render(moderngl.POINTS, vertices=source.width * source.height)

    def _add_rims(self, *warp: Any, **of_set: Any) -> None:
        """Draw the rims, which the draw of the splats has left out. of_set: inputs of one of several frames."""
        is_set = bool(of_set)
        if is_set not in self._rims:
            program = self._keep(build_program(self._context, "points/rims.vert", "points/rims.frag", SET=int(is_set)))
            self._rims[is_set] = self._allocate(self._context.vertex_array, program, [])
        array = self._rims[is_set]
        self._add(array.program, array, *warp, **of_set)

    def release(self) -> None:
        for vertices in (self._set_vertices, self._vertices):
            if vertices is not None:
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
