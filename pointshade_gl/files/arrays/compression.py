"""Reads members of zip archives, and unpacks LZF and Apple's LZFSE."""

from __future__ import annotations

import struct
import threading
import weakref
from contextlib import ExitStack
from io import BufferedIOBase
from pathlib import Path
from typing import cast
from zipfile import ZipFile, ZipInfo

from ...notes.words import shown
from ..access.content import FILE_BYTES, MAX_PIXELS, PARTS, FilePath, check_limit, import_extra, naming, open_regular

ZIP = b"PK"
METHODS = (0, 8)  # stored and deflated, which NumPy writes; other methods unpack a block to gigabytes
_ENCRYPTED = 1


class Archive:
    """The files of a zip archive, open as long as this lives. Raises OSError, or ValueError for a broken one."""

    def __init__(self, path: FilePath, max_pixels: float = MAX_PIXELS):
        self.path, self.max_pixels, self._lock = Path(path), max_pixels, threading.Lock()
        open_regular(path).close()
        self._opened = ExitStack()
        with naming(path, "is a broken or truncated zip archive"):  # zipfile raises of everything for broken bytes
            self._zip = self._opened.enter_context(ZipFile(path))
            members = self._zip.infolist()
        check_limit(len(members), f"{path} has {len(members)} members", max_pixels, PARTS)
        self._members = {member.filename: member for member in members if not member.is_dir()}
        self.names = self._members.keys()
        weakref.finalize(self, self._opened.close)

    def size(self, name: str) -> int:
        """The bytes of a member. `read` and `open` give no more, whatever is packed."""
        return self._members[name].file_size

    def packed(self, name: str) -> int:
        """The bytes that a member takes in the archive."""
        return self._members[name].compress_size

    def read(self, name: str) -> bytes:
        """All bytes of a member. Raises ValueError if it is missing, damaged or larger than a picture may be."""
        member = self._find(name)
        title = f"{self.path}/{shown(name)[1:-1]}"
        check_limit(member.file_size, f"{title} has {member.file_size} bytes", self.max_pixels, FILE_BYTES)
        with naming(title, "is damaged"), self._lock:
            return self._zip.read(member)

    def open(self, name: str) -> BufferedIOBase:
        """A member as a stream, which is closed with the archive. Raises ValueError if it is missing or damaged."""
        member = self._find(name)
        with naming(f"{self.path}/{shown(name)[1:-1]}", "is damaged"), self._lock:
            return cast(BufferedIOBase, self._opened.enter_context(self._zip.open(member)))

    def _find(self, name: str) -> ZipInfo:
        member = self._members.get(name)
        if member is None:
            raise ValueError(f"{self.path} has no {shown(name)[1:-1]}")
        if member.flag_bits & _ENCRYPTED or member.compress_type not in METHODS:
            way_out = "unpack it and pass the files"
            raise ValueError(f"{self.path} is packed with a password or an unusual method: {way_out}")
        return member


_RUN = 32  # control bytes below are the length of a run, less 1
_MOST = 88  # times: three bytes give at most 264


def unpack_lzf(packed: bytes, size: int) -> bytes:
    """The `size` bytes that were packed. Raises ValueError if it gives another number, or is broken."""
    if size > _MOST * len(packed):
        raise ValueError(f"{len(packed)} packed bytes cannot give {size}")
    out, at, end, done = bytearray(size), 0, len(packed), 0
    try:
        while at < end:
            control = packed[at]
            at += 1
            if control < _RUN:
                after = at + control + 1
                out[done : done + control + 1] = packed[at:after]
                done, at = done + control + 1, after
                continue
            length = (control >> 5) + 2
            if length == 9:
                length += packed[at]
                at += 1
            start = done - ((control & 31) << 8) - packed[at] - 1
            at += 1
            if start < 0:
                raise ValueError("it copies from before its beginning")
            if start + length <= done:
                out[done : done + length] = out[start : start + length]
            else:  # it repeats what it writes
                period = out[start:done]
                out[done : done + length] = (period * (length // len(period) + 1))[:length]
            done += length
            if done > size:
                break
    except IndexError:
        raise ValueError("it ends in the middle of a copy") from None
    if done != size or len(out) != size or at > end:
        raise ValueError(f"it gives another number of bytes than {size}")
    return bytes(out)


_END, _PLAIN, _LZVN, _LZFSE = b"bvx$", b"bvx-", b"bvxn", b"bvx2"


def unpack_lzfse(data: bytes, size: int, name: str) -> bytes:
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
    """The sum of the sizes that all blocks state. Raises ValueError or struct.error if they do not end in the data."""
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
