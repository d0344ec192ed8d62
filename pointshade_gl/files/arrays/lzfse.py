"""Decompresses Apple's LZFSE, in which Record3D stores depth; checks the unpacked size first."""

from __future__ import annotations

import struct

from ..access.content import import_extra

_END, _PLAIN, _LZVN, _LZFSE = b"bvx$", b"bvx-", b"bvxn", b"bvx2"


def unpack(data: bytes, size: int, name: str) -> bytes:
    """Unpack to `size` bytes; plain ones stay. Raises ValueError for broken bytes, or without the extra `record3d`."""
    if not data.startswith(b"bvx") and len(data) == size:
        return data
    liblzfse = import_extra("liblzfse", "record3d", f"{name} is packed by LZFSE")
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
