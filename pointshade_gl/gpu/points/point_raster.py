"""Rasterises splats as GL points: every pixel with a depth becomes one, and the depth test keeps the nearest."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import moderngl
import numpy as np

from ..context.raw_gl import DEPTH_TEST, PROGRAM_POINT_SIZE
from ..context.saved_state import enabled
from ..core.images import Box
from ..core.memory import Owner
from ..core.passes import set_inputs
from ..core.programs import build_program, set_uniforms
from ..core.view_images import SplatImage
from .set_splats import Splats


class PointSplatPass(Owner):
    """Draws source ids and depth with GL_POINTS; the only vertex data is the size attribute. Rims are a second draw.

    A splat larger than the driver's largest point is drawn at that size round its place in the picture.
    """

    look_up = False

    def __init__(self, context: moderngl.Context):
        super().__init__(context)
        self._vertices: dict[bool, Vertices] = {}  # of a frame, of one of a set; made when first needed
        self._rims: dict[bool, moderngl.VertexArray] = {}  # the same

    def draw(self, image: SplatImage, splats: Splats) -> None:
        """Fills an image of the view."""
        self.draw_set(image, [splats])

    def draw_set(self, image: SplatImage, parts: Sequence[Splats]) -> list[Box]:
        """The keys of several frames' splats, all of one size. Returns the part of the view that each comes to."""
        vertices = self._fit_vertices(parts[0].sizes, parts[0].trust is not None)
        image.window = 0, 0, *image.size
        image.visible.use()
        image.visible.clear(0, depth=1.0)  # id 0 is nothing: the only value that means the same as int and float

        for part in parts:
            self._draw(vertices.array, part, image, **vertices.shape(part))
            if part.has_rims:
                self._draw(self._rim_array(part.trust is not None), part, image)
        image.raise_version()
        return [image.window] * len(parts)

    def _fit_vertices(self, sizes: np.ndarray, is_set: bool) -> Vertices:
        if is_set not in self._vertices:
            fragment = f"points/{'set_' * is_set}splats.frag"
            program = self._keep(build_program(self._context, "points/splats.vert", fragment))
            self._vertices[is_set] = Vertices(self._context, program, sizes)
        self._vertices[is_set] = self._vertices[is_set].fitted(sizes)
        return self._vertices[is_set]

    def _draw(self, array: moderngl.VertexArray, splats: Splats, image: SplatImage, **shape: Any) -> None:
        set_inputs(array.program, splats.of_set | {"surface_map": splats.surface.texture})
        set_uniforms(array.program, target_size=image.size, near=splats.near, first_id=1, **splats.way, **shape)
        with enabled(self._context, DEPTH_TEST, PROGRAM_POINT_SIZE):
            array.render(moderngl.POINTS, vertices=splats.source.width * splats.source.height)

    def _rim_array(self, is_set: bool) -> moderngl.VertexArray:
        if is_set not in self._rims:
            program = self._keep(build_program(self._context, "points/rims.vert", "points/rims.frag", SET=int(is_set)))
            self._rims[is_set] = self._allocate(self._context.vertex_array, program, [])
        return self._rims[is_set]

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
