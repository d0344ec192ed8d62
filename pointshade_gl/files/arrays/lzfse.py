"""Decompresses Apple's LZFSE, in which Record3D stores depth; checks the unpacked size first."""

from __future__ import annotations

import struct
from importlib import import_module

_END, _PLAIN, _LZVN, _LZFSE = b"bvx$", b"bvx-", b"bvxn", b"bvx2"


def unpack(data: bytes, size: int, name: str) -> bytes:
    """The unpacked bytes, of which there must be `size`; bytes that are not packed come back as they are.

    Raises ValueError for any other size, for broken bytes, and without the extra `record3d`.
    """
    if not data.startswith(b"bvx") and len(data) == size:
        return data
    try:
        liblzfse = import_module("liblzfse")
    except ImportError:
        raise ValueError(f"{name} is packed by LZFSE: pip install 'pointshade-gl[record3d]' to read it") from None
    try:
        declared = _declared_size(data)
        unpacked = liblzfse.decompress(data) if declared == size else b""
    except (struct.error, ValueError, liblzfse.error):
        raise ValueError(f"{name} is broken or truncated") from None
    if declared != size or len(unpacked) != size:
        raise ValueError(f"{name} holds {declared} bytes, expected {size}")
    return unpacked


def _declared_size(data: bytes) -> int:
    """The sum of what all blocks say. Raises ValueError or struct.error if they do not end in the data."""
    at = total = 0
    while (kind := data[at : at + 4]) != _END:
        (raw,) = struct.unpack_from("<I", data, at + 4)
        if kind == _PLAIN:
            at += 8 + raw
        elif kind == _LZVN:
            at += 12 + struct.unpack_from("<I", data, at + 8)[0]
        elif kind == _LZFSE:
            fields = struct.unpack_from("<3Q", data, at + 8)
            literals, commands, header = fields[0] >> 20 & 0xFFFFF, fields[1] >> 40 & 0xFFFFF, fields[2] & 0xFFFFFFFF
            at += max(header, 32) + literals + commands
        else:
            raise ValueError("an unknown block")
        total += raw
    return total
