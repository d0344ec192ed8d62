"""Reads what Blender writes: one multilayer OpenEXR file, not compressed, 32-bit floats, scan lines from the top."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np


def read_layers(path: Path) -> dict[str, np.ndarray]:
    """(h, w) float32 of each channel, by name. Raises ValueError for anything but plain scan lines of floats."""
    data = path.read_bytes()
    head, at = _header(data)
    channels, left, top, right, bottom = _channels(head["channels"]), *struct.unpack("<4i", head["dataWindow"])
    if head["compression"] != b"\0":
        raise ValueError(f"{path.name} must not be compressed")
    width, height = right - left + 1, bottom - top + 1
    line = np.dtype([("row", "<i4"), ("bytes", "<i4"), *((name, "<f4", width) for name in channels)])
    lines = np.frombuffer(data, line, height, at + 8 * height)
    if (lines["row"] != np.arange(top, bottom + 1)).any():
        raise ValueError(f"{path.name} must hold its lines from the top")
    return {name: lines[name] for name in channels}


def _header(data: bytes) -> tuple[dict[str, bytes], int]:
    """Attributes by name, and where the table of offsets begins."""
    magic, version = struct.unpack_from("<II", data)
    if magic != 20000630 or version & 0x1A00:  # tiles, deep data, several parts
        raise ValueError("no OpenEXR file of one part with scan lines")
    found, at = {}, 8
    while data[at]:
        name, _, rest = data[at : at + 256].partition(b"\0")
        kind = rest.partition(b"\0")[0]
        at += len(name) + len(kind) + 2
        (size,) = struct.unpack_from("<i", data, at)
        found[name.decode()] = data[at + 4 : at + 4 + size]
        at += 4 + size
    return found, at + 1


def _channels(listing: bytes) -> list[str]:
    names = []
    while listing[0]:
        name, _, rest = listing.partition(b"\0")
        if struct.unpack_from("<i", rest) != (2,):
            raise ValueError(f"channel {name.decode()} must hold 32-bit floats")
        names.append(name.decode())
        listing = rest[16:]
    return names
