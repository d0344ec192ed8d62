"""Checks what a LAS file promises before a library allocates it: the compressor ends the process for lack of memory."""

from __future__ import annotations

import struct
from io import BufferedReader

_HEADER = 375  # bytes of the longest header; older ones have 227
_VLR, _EVLR = 54, 60  # bytes of a record's own header
_PACKED = 0b11000000  # bits of the point format
_LAST = -1  # the place of the chunk table: in the last bytes of the file


def check_las_header(file: BufferedReader, size: int) -> None:
    """Raises ValueError for more points, records or chunks than an open file of this size can hold."""
    head = file.read(_HEADER).ljust(_HEADER, b"\0")
    version, offset, records = head[25], *struct.unpack_from("<II", head, 96)
    kind, row, points = head[104], *struct.unpack_from("<HI", head, 105)
    header = struct.unpack_from("<H", head, 94)[0]
    late = 0
    if version >= 4:
        late, points = struct.unpack_from("<I", head, 243)[0], struct.unpack_from("<Q", head, 247)[0]
    room = size - offset
    if not 0 < header <= offset <= size:
        raise ValueError(f"its points begin at {offset} of {size} bytes")
    if records * _VLR > offset or late * _EVLR > size:
        raise ValueError(f"it counts {records + late} records in {size} bytes")
    if not row or (not kind & _PACKED and points * row > room):
        raise ValueError(f"it counts {points} points of {row} bytes, and has {room}")
    if kind & _PACKED and points:
        _check_chunks(file, offset, row, size)
    file.seek(0)


def _check_chunks(file: BufferedReader, offset: int, row: int, size: int) -> None:
    """Of a compressed file: a chunk has one whole point at least."""
    place = _int64(file, offset)
    if place == _LAST:
        place = _int64(file, size - 8)
    if not offset <= place <= size - 8:
        raise ValueError(f"its table of chunks begins at {place} of {size} bytes")
    file.seek(place)
    chunks = struct.unpack("<II", file.read(8))[1]
    if chunks * row > size - offset:
        raise ValueError(f"it counts {chunks} chunks in {size - offset} bytes")


def _int64(file: BufferedReader, place: int) -> int:
    file.seek(place)
    data = file.read(8)
    if len(data) < 8:
        raise ValueError("it ends before its points")
    return struct.unpack("<q", data)[0]
