"""The render target of the light pass: the picture itself, or the sum of its antialiasing samples."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import NamedTuple

import moderngl

from .additive_blend import AdditiveBlend
from .images import Box, confine, empty


class Canvas(NamedTuple):
    """The image that receives the light of a picture."""

    image: moderngl.Framebuffer
    adding: AdditiveBlend | None = None  # None: sRGB, emptied first; else linear light is added to what is there

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
        with self.adding.on():
            yield self.image
