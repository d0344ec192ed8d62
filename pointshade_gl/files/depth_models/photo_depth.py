"""Depth of photographs by a network: each photograph is shown to it once, and its depth may be kept beside it."""

from __future__ import annotations

import threading
from collections import OrderedDict
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...notes.errors import is_expected
from ...notes.notes import Note
from ...notes.words import cut, option
from ..access.limits import check_pixels
from ..containers.contents import Contents
from .families import PIXELS
from .kept_depth import keep, kept, place_of
from .model_options import ModelOptions
from .onnx_network import Network, open_network
from .predicted import Taken, contents_of_function, contents_of_network

_REMEMBERED = 32  # depths, as a frame is often read again
_MOST_WRONG = "which is no depth"


class PhotoDepth:
    """A network that is shown photographs. From any thread."""

    def __init__(self, options: ModelOptions, note: Note, max_pixels: float):
        self._options, self._note, self._max_pixels = options, note, max_pixels
        self._lock = threading.RLock()  # functions of others may not be made for threads
        self._recent: OrderedDict[Any, Contents] = OrderedDict()

    def of(self, photo: NDArray[np.uint8], key: Any, beside: Path | None, focal: float | None) -> Contents:
        """Return what the network makes of a photograph (h, w, 3).

        key     what tells this photograph from others
        beside  the photograph's file, beside which depth may be kept
        focal   in pixels, if it is known

        Raises ValueError, TypeError or OSError, in one sentence.
        """
        with self._lock:
            if key in self._recent:
                self._recent.move_to_end(key)
                return self._recent[key]
            found = _checked(self._made(photo, beside, focal), self._options.title)
            self._recent[key] = found
            while len(self._recent) > _REMEMBERED:
                self._recent.popitem(last=False)
            return found

    def _made(self, photo: NDArray[np.uint8], beside: Path | None, focal: float | None) -> Contents:
        size = photo.shape[1], photo.shape[0]
        check_pixels(*size, "the photograph", self._max_pixels)
        if self._options.path is None:
            return self._called(photo, size)
        place = place_of(beside, photo, self._options, focal) if self._options.cache and beside else None
        if place is not None and (found := kept(place, self._options.title)):
            return found
        network = open_network(self._options.path)
        self._tell(network, size)
        prepared = network.prepare(photo, self._options)
        outputs = network.run(prepared)
        contents = contents_of_network(outputs, Taken(network, prepared, size, focal), self._note, self._max_pixels)
        if place is not None:
            keep(place, contents, self._note)
        return contents

    def _called(self, photo: NDArray[np.uint8], size: tuple[int, int]) -> Contents:
        """Return what a function makes of it."""
        function: Any = self._options.model
        try:
            given = function(photo)
        except (MemoryError, KeyboardInterrupt):
            raise
        except Exception as error:
            reason = cut(error) if is_expected(error) else f"{type(error).__name__}: {cut(error)}"
            raise ValueError(f"{self._options.title} failed: {reason}") from error
        return contents_of_function(given, self._options.title, size, self._note, self._max_pixels)

    def _tell(self, network: Network, size: tuple[int, int]) -> None:
        """Print what is guessed about a network."""
        if network.remark:
            self._note(network.remark)
        width, height = network.size(self._options, *size)
        mean = network.normalization(self._options)[0]
        pixels = self._options.pixels or _name_of(mean)
        kinds = {"inverse": "inverse depth", "z": "depth without a scale", "": "depth of the kind that its values show"}
        gives = kinds.get(network.output, "metres")
        why = f"{network.family.title}, by its names" if network.family.known_by else network.family.title
        if network.facts.source:
            why += f", and {network.facts.source}"
        self._note(
            f"{network.path.name} is taken as {why}: input {width}x{height} with {pixels} pixels, output {gives}; if "
            f"not, pass {option('model_size', 'WxH')}, {option('model_pixels', *PIXELS)} or {option('depth_kind')}"
        )


def _name_of(mean: tuple[float, ...]) -> str:
    return {0.485: "imagenet", 0.5: "symmetric", 0.0: "unit or byte"}.get(round(mean[0], 3), "its own")


def _checked(contents: Contents, title: str) -> Contents:
    """Raise ValueError for depth that is known nowhere, or the same everywhere."""
    values = contents.depth[np.isfinite(contents.depth)] if contents.depth.dtype.kind == "f" else contents.depth
    if not values.size:
        raise ValueError(f"{title} gave no number that is finite for this photograph, {_MOST_WRONG}")
    if values.min() == values.max():
        raise ValueError(f"{title} gave {values.min():g} everywhere for this photograph, {_MOST_WRONG}")
    return contents
