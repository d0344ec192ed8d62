"""Reads from the first bytes of an image file what kind of values it holds, without decoding it."""

from __future__ import annotations

import re
import struct
from pathlib import Path

_PNG = b"\x89PNG"
_DEEP = re.compile(rb"P[25](?:\s|#[^\n]*\n)+\d+\s+\d+\s+(\d+)\s")  # a PGM's largest value
_LOSSY = (".jpg", ".jpeg", ".webp", ".bmp")


def shallowness(path: Path) -> int:
    """Return how little of the depth a picture keeps: 0 for 16 bits or floats, 1 for 8 bits, 2 for colours."""
    if path.suffix.lower() in _LOSSY:
        return 2
    head = _head(path)
    if not head.startswith(_PNG):
        return 0
    bits, kind = head[24:26].ljust(2, b"\0")
    return 2 if kind else int(bits < 16)


def is_deep_grey(path: Path) -> bool:
    """Whether it is a PNG or PGM of one channel of 16 bits, which is depth and nothing else."""
    head = _head(path)
    if head.startswith(_PNG):
        return head[24:26] == b"\x10\x00"
    found = _DEEP.match(head)
    return found is not None and int(found[1]) > 255


def is_picture(path: Path) -> bool:
    """Whether it begins as a PNG, JPEG, TIFF, BMP, WEBP or PNM does."""
    return _head(path).startswith((_PNG, b"\xff\xd8", b"II*\0", b"MM\0*", b"BM", b"RIFF", b"P2", b"P3", b"P5", b"P6"))


def png_size(path: Path) -> tuple[int, int] | None:
    """(width, height) of a PNG; None for any other file."""
    head = _head(path)
    if not head.startswith(_PNG) or len(head) < 24:
        return None
    width, height = struct.unpack(">2I", head[16:24])
    return width, height


def _head(path: Path) -> bytes:
    with path.open("rb") as file:
        return file.read(512)
