"""Unpacks a zip archive with a frame or a sequence into a temporary folder, removed when the program ends."""

from __future__ import annotations

import atexit
import re
import shutil
import tempfile
from functools import lru_cache
from pathlib import Path

from ...notes.words import shown
from ..access.content import FilePath, open_regular, read_head
from ..access.limits import FILE_BYTES, MAX_PIXELS, check_limit
from ..arrays.zip_archive import ZIP, Archive

_OUTSIDE = re.compile(r"[/\0]|[A-Za-z]:|(?:.*/)?\.\.(?:/|$)")  # absolute, with a drive, or upwards
_LEFT_OUT = re.compile(r"(?:.*/)?(?:__MACOSX/|\.)")  # hidden files, and macOS's twins
_REMEMBERED = 8  # archives


def is_zip_folder(path: FilePath, max_pixels: float = MAX_PIXELS) -> bool:
    """Whether a file is a zip archive of files, not of NumPy's arrays. Raises OSError, ValueError as `Archive` does."""
    if not read_head(path).startswith(ZIP):
        return False
    return any(not name.endswith(".npy") for name in Archive(path, max_pixels).names)


def unpack_folder(path: FilePath, max_pixels: float = MAX_PIXELS) -> Path:
    """The only folder of a zip archive, or its top; unpacked once. Raises as `Archive`, and for unsafe contents."""
    open_regular(path).close()
    state = Path(path).stat()
    return _unpack(Path(path).absolute(), (state.st_mtime_ns, state.st_size), max_pixels)


@lru_cache(_REMEMBERED)
def _unpack(path: Path, version: tuple[int, int], max_pixels: float) -> Path:
    """version  is another one when the file was written again"""
    archive = Archive(path, max_pixels)
    names = {name: name.replace("\\", "/") for name in archive.names}
    for name, plain in names.items():
        if _OUTSIDE.match(plain):
            raise ValueError(f"{path} names {shown(name)}, which lies outside it: it is not unpacked")
    names = {name: plain for name, plain in names.items() if not _LEFT_OUT.match(plain)}
    size = sum(map(archive.size, names))
    check_limit(size, f"{path} has {size} bytes when unpacked", max_pixels, FILE_BYTES)
    folder = Path(tempfile.mkdtemp(prefix="pointshade-"))
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    for name, plain in names.items():
        place = folder / plain
        place.parent.mkdir(parents=True, exist_ok=True)
        place.write_bytes(archive.read(name))
    while len(entries := list(folder.iterdir())) == 1 and entries[0].is_dir():
        folder = entries[0]
    return folder
