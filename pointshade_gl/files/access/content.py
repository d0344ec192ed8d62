"""Reads the content of files as bytes, text or JSON, up to a size limit. Only regular files are opened.

A command of the command line also keeps track of what it reads, and does not write over it.
"""

from __future__ import annotations

import math
import os
import re
import stat
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from importlib import import_module
from io import BufferedReader
from os import PathLike
from pathlib import Path
from typing import Any

from ...checks.arguments import check_path
from ...notes.words import cut, near_path, option, shown

MAX_PIXELS = 2**27  # 134 million; a frame of 12 288 x 8 192 pixels has 101 million
LONGEST_SIDE = 2**16  # pixels; graphics cards take up to 2**14 or 2**15
FOLDER_FILES = 200_000  # files and folders of one folder that are looked at
_ENDLESS = 10**18

# Other limits for each pixel of that number: they rise with it, and never fall below what the default gives.
FILE_BYTES = 16  # bytes of a picture, an array or a buffer: four channels of 32 bits (2 GiB)
TEXT_BYTES = 1 / 16  # bytes of a text file of numbers or names (8 MiB)
PICTURE_TEXT = 1 / 4  # bytes of a picture whose values are written as text (32 MiB)
JSON_VALUES = 1 / 32  # values in a JSON file (4 million); texts in it may be long
CLOUD_TEXT = 1  # bytes of a point cloud that is written as text (128 MiB)
SCENE_TEXT = 1  # bytes of a .gltf file, which may hold its buffers as text (128 MiB)
SCENE_BYTES = 4  # bytes of a .glb file and of each buffer (512 MiB)
SCENE_CORNERS = 1 / 4  # corners, normals, texture coordinates and indices of all meshes of a scene (34 million)
SCENE_PIXELS = 4  # pixels of all textures and frames of a scene (537 million)
SCENE_FRAMES = 2**-19  # frames of a scene (256)
PARTS = 1 / 1024  # lines of a list of pictures, nodes of a scene (131 072)


def check_limit(amount: int, what: str, max_pixels: float, share: float | None = None) -> None:
    """Raises ValueError, naming `max_pixels`, if the amount ("a.png has 9x9 pixels") is larger. share: for anything but
    pixels: the limit is this share of `max_pixels`, or of the default if that is larger."""
    limit = max_pixels if share is None else max(max_pixels, MAX_PIXELS) * share
    if amount > limit:
        raised = option("max_pixels", math.ceil(min(amount, _ENDLESS) / (share or 1)), beside_file=True)
        raise ValueError(f"{what}, the limit is {limit:.0f}: pass {raised} to allow it")


def check_pixels(width: int, height: int, name: str, max_pixels: float) -> None:
    """Raises ValueError if a picture of this size has more pixels than the limit, or a longer side than any has."""
    if max(width, height) > LONGEST_SIDE:
        raise ValueError(f"{name} has {width}x{height} pixels, the limit for a side is {LONGEST_SIDE}")
    check_limit(width * height, f"{name} has {width}x{height} pixels", max_pixels)


FilePath = str | PathLike[str]
MATLAB = b"MATLAB "  # the first bytes of a .mat file
IN_JSON = "backslashreplace"  # how names that are no text are encoded: as JSON escapes such characters itself
_files_read: dict[tuple[int, int], Path] | None = None  # by device and inode; None: nobody wants to know


@contextmanager
def noting_reads() -> Iterator[None]:
    """Inside, `check_not_read` knows all files that were read: also by other threads, not by other processes."""
    global _files_read
    _files_read = {}
    try:
        yield
    finally:
        _files_read = None


def note_read(paths: Iterable[object]) -> None:
    """Notes files that are read, or will be. What is no path is passed over, as is a file that does not exist."""
    if _files_read is None:
        return
    for path in paths:
        if isinstance(path, Path):
            with suppress(OSError, ValueError):  # a name with a null
                status = path.stat()
                _files_read.setdefault((status.st_dev, status.st_ino), path)


def allow_overwriting() -> None:
    """From now on `check_not_read` passes every file."""
    global _files_read
    _files_read = None


def check_not_read(*outputs: Path) -> None:
    """Raises ValueError if an output is a file that was read, under whatever name: a link, another spelling."""
    for path in outputs if _files_read else ():
        with suppress(OSError):  # most outputs are new files
            status = path.stat()
            if source := (_files_read or {}).get((status.st_dev, status.st_ino)):
                same = "it" if source == path else f"it is {source}, which"
                way_out = f"Pass another output, or {option('overwrite', True)} to replace it"
                raise ValueError(f"cannot write {path}: {same} is read as an input. {way_out}")


def open_regular(path: FilePath, is_probed: bool = False) -> BufferedReader:
    """The file, opened for reading. Raises OSError for folders, pipes and devices, which may never end. One that is
    only probed, to see what it is, does not count as read."""
    path = Path(path)
    try:
        mode = path.stat().st_mode
    except FileNotFoundError:
        raise FileNotFoundError(f"{path} does not exist{near_path(path)}") from None
    if stat.S_ISDIR(mode):
        raise IsADirectoryError(f"{path} is a folder, expected a file")
    if not stat.S_ISREG(mode):
        raise OSError(f"{path} is a pipe or a device, expected a file")
    file = path.open("rb")
    if not is_probed:
        note_read([path])
    return file


def read_head(path: FilePath, size: int = 64) -> bytes:
    """The first bytes of a file. Raises OSError if it is not one, ValueError if empty or a git-LFS pointer."""
    check_path(path)
    with open_regular(path, is_probed=True) as file:
        # a file of the system has 0, and reading it may never end
        head = file.read(size) if os.fstat(file.fileno()).st_size else b""
    if not head:
        raise ValueError(f"{path} is empty, expected a file of more than 0 bytes")
    if head.startswith(b"version https://git-lfs"):
        raise ValueError(f"{path} is a git-LFS pointer, not the file itself: run `git lfs pull` in its repository")
    return head


def read_bytes(path: FilePath, max_pixels: float = MAX_PIXELS, share: float = FILE_BYTES) -> bytes:
    """All bytes of a file. Raises OSError or ValueError as `read_head` does, ValueError for more than the limit."""
    read_head(path)
    with open_regular(path) as file:
        size = check_size(file, path, max_pixels, share)
        data = file.read(size + 1)
    if len(data) > size:  # files of the system have 0 and go on for ever
        raise ValueError(f"{path} has more bytes than its size says: is it still being written?")
    return data


@contextmanager
def naming(name: FilePath, what: str, kinds: tuple[type[Exception], ...] = (Exception,)) -> Iterator[None]:
    """Turns errors of these kinds into ValueErrors, "NAME WHAT: ...", unless they name the file; not MemoryError."""
    try:
        yield
    except kinds as error:
        if isinstance(error, MemoryError) or str(error).startswith(f"{name} "):
            raise
        raise ValueError(f"{name} {what}: {cut(error)}") from None


def followed(path: Path) -> Path:
    """The path with all links followed. Raises OSError for links that lead to each other."""
    try:
        real = path.resolve()
    except RuntimeError:  # up to Python 3.12
        real = path
    except UnicodeEncodeError:
        raise ValueError(f"{str(path)!a} cannot be the name of a file: it is no text") from None
    if real.is_symlink():
        raise OSError(f"{path} is a link that leads back to itself")
    return real


def import_extra(module: str, extra: str, what: str) -> Any:
    """A module that reads files and comes with an optional extra. Raises ValueError, "WHAT: ...", without it."""
    try:
        return import_module(module)
    except ImportError:
        raise ValueError(f"{what}: pip install '.[{extra}]' in the clone to read it") from None


def check_size(file: BufferedReader, path: FilePath, max_pixels: float, share: float = FILE_BYTES) -> int:
    """The bytes of an open file. Raises ValueError for more than the limit."""
    size = os.fstat(file.fileno()).st_size
    check_limit(size, f"{path} has {size} bytes", max_pixels, share)
    return size


def read_text(path: FilePath, max_pixels: float = MAX_PIXELS) -> str:
    """The text of a file. Raises OSError if the path is not a file, ValueError if it is not text or too long."""
    try:
        return read_bytes(path, max_pixels, TEXT_BYTES).decode("utf-8-sig")
    except UnicodeDecodeError:
        raise ValueError(f"{path} is not a text file") from None


def parse_json(text: str, max_pixels: float = MAX_PIXELS, name: FilePath = "") -> Any:
    """The value in a text of JSON. Raises ValueError, "NAME is not valid JSON: ...", or for too many values."""
    values = sum(map(text.count, ",[{"))
    check_limit(values, f"{name} is JSON of {values} values".lstrip(), max_pixels, JSON_VALUES)
    import json  # only here

    try:
        return json.loads(text)
    except (ValueError, RecursionError) as error:
        reason = "it is nested too deeply" if isinstance(error, RecursionError) else error
        raise ValueError(f"{name} is not valid JSON: {reason}".lstrip()) from None


def parse_object(text: str, path: FilePath, max_pixels: float = MAX_PIXELS) -> dict[str, Any]:
    """The object in the text of a JSON file. Raises ValueError, naming the file, for anything else."""
    data = parse_json(text, max_pixels, path)
    if not isinstance(data, dict):
        raise ValueError(f"{path} must hold a JSON object, got {shown(data)}")
    return data


def split_numbers(text: str, ignored: str = " \t\r\n,;[]()") -> list[float] | None:
    """The numbers of a text that holds nothing but numbers, else None. ignored: characters at its ends."""
    try:
        return [float(part) for part in re.split(r"[\s,;]+", text.strip(ignored))]
    except ValueError:
        return None
