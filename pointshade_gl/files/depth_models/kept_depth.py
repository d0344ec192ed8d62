"""Depth that a network made, kept in a hidden folder beside the photograph, named by the bytes of both."""

from __future__ import annotations

import hashlib
import io
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...notes.notes import Note
from ...notes.words import cut
from ..access.atomic_write import sha256_of, written_whole
from ..cameras.intrinsics import Intrinsics
from ..containers.contents import Contents
from .model_options import ModelOptions

FOLDER = ".pointshade"
_VERSION = "1"  # of what is kept: another one is not read
_LETTERS = 24
_WEIGHTS = "_data", ".data"


def place_of(photo_file: Path, photo: NDArray[np.uint8], options: ModelOptions, focal: float | None) -> Path:
    """Return the file of a photograph's depth. It differs by all that decides about the depth."""
    assert options.path is not None
    status = options.path.stat()
    network = _digest_of(options.path, status.st_mtime_ns, status.st_size)
    told = f"{_VERSION} {network} {photo.shape} {options.size} {options.pixels} {focal and round(focal, 3)}"
    name = hashlib.sha256(told.encode() + np.ascontiguousarray(photo).tobytes()).hexdigest()[:_LETTERS]
    return photo_file.parent / FOLDER / f"{name}.npz"


@lru_cache(4)
def _digest_of(path: Path, _time: int, _size: int) -> str:
    """Return the digest of a network; large ones have their weights in a file beside them."""
    weights = [one for name in _WEIGHTS if (one := path.with_name(path.name + name)).is_file()]
    return " ".join(sha256_of(one)[1] for one in (path, *weights))


def kept(place: Path, name: str) -> Contents | None:
    """Return the depth that is kept there; None without any, and for a file that is damaged."""
    try:
        with place.open("rb") as held, np.load(held, allow_pickle=False) as file:
            found = {key: file[key] for key in file.files}
        depth, numbers = found["depth"], found.get("camera")
        if depth.ndim != 2 or depth.dtype != np.float32:
            return None
        camera = None
        if numbers is not None:
            fx, fy, cx, cy, width, height = (float(one) for one in numbers)
            camera = Intrinsics(name, (fx, fy, cx, cy), (int(width), int(height)))
        scale = float(found["scale"])
        return Contents(depth, None, camera, None, found.get("valid"), None, str(found["kind"]) or None, scale or None)
    except Exception:  # broken bytes make NumPy and zipfile raise of everything
        return None


def keep(place: Path, contents: Contents, note: Note) -> None:
    """Write a depth. Where that is impossible a note says so."""
    held: dict[str, Any] = {
        "depth": np.asarray(contents.depth, np.float32),
        "kind": np.array(contents.depth_kind or ""),
        "scale": np.array(contents.depth_scale or 0.0),
    }
    if contents.valid is not None:
        held["valid"] = contents.valid
    if contents.intrinsics is not None and contents.intrinsics.size is not None:
        held["camera"] = np.array([*contents.intrinsics.numbers, *contents.intrinsics.size], np.float64)
    packed = io.BytesIO()
    np.savez_compressed(packed, **held)
    try:
        place.parent.mkdir(exist_ok=True)
        with written_whole(place) as temporary:
            temporary.write_bytes(packed.getvalue())
    except OSError as error:
        note(f"depth is not kept beside the photograph: {cut(error)}")
