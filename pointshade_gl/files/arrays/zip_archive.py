"""Reads the members of zip archives, with size limits, from any thread. Nothing is written to disk."""

from __future__ import annotations

import threading
import weakref
from io import BufferedIOBase
from pathlib import Path
from typing import cast
from zipfile import ZipFile, ZipInfo

from ...notes.words import shown
from ..access.content import FilePath, naming, open_regular
from ..access.limits import FILE_BYTES, MAX_PIXELS, PARTS, check_limit

ZIP = b"PK"
METHODS = (0, 8)  # stored and deflated, which NumPy writes; other methods unpack a block to gigabytes
_ENCRYPTED = 1


class Archive:
    """The files of a zip archive, open as long as this lives. Raises OSError, or ValueError for a broken one."""

    def __init__(self, path: FilePath, max_pixels: float = MAX_PIXELS):
        self.path, self.max_pixels, self._lock = Path(path), max_pixels, threading.Lock()
        open_regular(path).close()
        with naming(path, "is a broken or truncated zip archive"):  # zipfile raises of everything for broken bytes
            self._zip = ZipFile(path)  # opened by its name, it closes itself
            members = self._zip.infolist()
        check_limit(len(members), f"{path} has {len(members)} members", max_pixels, PARTS)
        self._members = {member.filename: member for member in members if not member.is_dir()}
        self.names = self._members.keys()
        self._streams: list[BufferedIOBase] = []
        weakref.finalize(self, _close, self._zip, self._streams)

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
            self._streams.append(cast(BufferedIOBase, self._zip.open(member)))
            return self._streams[-1]

    def _find(self, name: str) -> ZipInfo:
        member = self._members.get(name)
        if member is None:
            raise ValueError(f"{self.path} has no {shown(name)[1:-1]}")
        if member.flag_bits & _ENCRYPTED or member.compress_type not in METHODS:
            raise ValueError(
                f"{self.path} is packed with a password or an unusual method: unpack it and pass the files"
            )
        return member


def _close(archive: ZipFile, streams: list[BufferedIOBase]) -> None:
    for stream in streams:
        stream.close()
    archive.close()
