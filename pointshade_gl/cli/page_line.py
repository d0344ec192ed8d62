"""The part of a `pointshade render ...` line that all pictures of a page share: page/command.js adds the rest."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from dataclasses import replace

from ..files.access.known_names import FRAMES
from ..notes.words import option
from .command_words import words_of
from .look_options import LookOptions
from .options import FrameOptions
from .picture_options import PictureOptions


def page_line(
    frame: FrameOptions,
    look: LookOptions,
    picture: PictureOptions,
    more: Sequence[str] | None = None,
    views: str | None = None,
    unlight_all: bool = False,
) -> str:
    """Return what was typed about what is read and how it looks, but for lights, shading, samples and exposure."""
    frame = frame if frame.input or frame.depth or frame.color else replace(frame, input=FRAMES[0])
    words = [*words_of(frame), *(more or []), *(["--views", views] if views else [])]
    words += [option("unlight_all")] if unlight_all else []
    words += words_of(replace(look, light=None, shading=LookOptions().shading))
    words += words_of(replace(picture, samples=None, exposure=None))
    return shlex.join(["pointshade", "render", *words])
