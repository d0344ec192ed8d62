"""Reads a folder of photographs of one view, each under its own light, and finds what they have in common."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..notes.words import option
from ..renderer.renderer import Renderer
from ..scene.frame import Frame
from .inputs import check_frame, load
from .options import FrameOptions
from .output import explainer, spinner


def load_photographs(frame: FrameOptions) -> Sequence[Frame]:
    """Read all frames of a sequence. Raises ValueError for a scene and for a single frame."""
    check_frame(frame)
    if frame.frame is not None:
        raise ValueError(f"an albedo needs all photographs of a folder: leave out {option('frame')}")
    found = load(frame, sequence=True)
    if isinstance(found, Frame):
        raise ValueError("an albedo needs several photographs of one view: pass a folder with a sequence of frames")
    return found


def albedo_of(renderer: Renderer, photos: Sequence[Frame], explain: bool) -> NDArray[np.uint8]:
    """Estimate the albedo that photographs share; --explain prints their lights."""
    with spinner("estimating the albedo"):
        albedo = renderer.estimate_albedo(photos)
    explainer(explain)(renderer)
    return albedo


def as_one_frame(renderer: Renderer, photos: Sequence[Frame], explain: bool) -> Frame:
    """Return the first photograph in the colours of the albedo that all share."""
    return replace(photos[0], color=albedo_of(renderer, photos, explain))
