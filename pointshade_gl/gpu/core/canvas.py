"""The render target of the light pass: the picture itself, or the sum of its antialiasing samples."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from typing import NamedTuple

import moderngl

from ..context.raw_gl import DEPTH_TEST
from ..context.saved_state import enabled
from .additive_blend import AdditiveBlend
from .images import Box, confine, empty


class Canvas(NamedTuple):
    """The image that receives the light of a picture."""

    image: moderngl.Framebuffer
    adding: AdditiveBlend | None = None  # None: sRGB, emptied first; else linear light is added to what is there
    is_masked: bool = False  # only pixels are drawn whose depth is far: their depth stays

    @property
    def linear(self) -> bool:
        return self.adding is not None

    @contextmanager
    def opened(self, window: Box) -> Iterator[moderngl.Framebuffer]:
        """Let a pass draw on this window of the image inside the context."""
        if self.adding is None:
            empty(self.image, window)
            yield self.image
            return
        confine(self.image, window)
        with self.adding.on(), self._tested():
            yield self.image

    def _tested(self) -> AbstractContextManager[None]:
        if not self.is_masked:
            return nullcontext()
        self.image.depth_mask = False
        return enabled(self.image.ctx, DEPTH_TEST)
