"""Reads the members of zip archives, with size limits, from any thread. Nothing is written to disk."""

from __future__ import annotations

import threading
import weakref
from io import BufferedIOBase
from pathlib import Path
from typing import cast
from zipfile import ZipFile, ZipInfo

from ...messages.formatting import cut, shown
from ..access.content import FilePath, open_regular
from ..access.limits import FILE_BYTES, MAX_PIXELS, PARTS, check_limit

ZIP = b"PK"
_STORED, _DEFLATED = 0, 8  # other methods unpack a block to gigabytes
_ENCRYPTED = 1


class Archive:
    """The files in a zip archive; it is open as long as this object lives.

    Raises OSError if the path is not a file, ValueError if it is not a complete archive of up to PARTS members.
    """

    def __init__(self, path: FilePath, max_pixels: float = MAX_PIXELS):
        self.path, self.max_pixels, self._lock = Path(path), max_pixels, threading.Lock()
        open_regular(path).close()
        try:
            self._zip = ZipFile(path)  # opened by its name, it closes itself
            members = self._zip.infolist()
        except MemoryError:
            raise
        except Exception as error:  # zipfile raises of everything for broken bytes
            raise ValueError(f"{path} is a broken or truncated zip archive: {cut(error)}") from None
        check_limit(len(members), f"{path} has {len(members)} members", max_pixels, PARTS)
        self._members = {member.filename: member for member in members if not member.is_dir()}
        self.names = self._members.keys()
        self._streams: list[BufferedIOBase] = []
        weakref.finalize(self, _close, self._zip, self._streams)

    def size(self, name: str) -> int:
        """The bytes of a member. `read` and `open` give no more, whatever is packed."""
        return self._members[name].file_size

    def read(self, name: str) -> bytes:
        """All bytes of a member. Raises ValueError if it is missing, damaged or larger than a picture may be."""
        member = self._find(name)
        title = f"{self.path}/{shown(name)[1:-1]}"
        check_limit(member.file_size, f"{title} has {member.file_size} bytes", self.max_pixels, FILE_BYTES)
        try:
            with self._lock:
                return self._zip.read(member)
        except MemoryError:
            raise
        except Exception as error:
            raise ValueError(f"{title} is damaged: {cut(error)}") from None

    def open(self, name: str) -> BufferedIOBase:
        """A member as a stream, which is closed with the archive. Raises ValueError if it is missing or damaged."""
        member = self._find(name)
        try:
            with self._lock:
                self._streams.append(cast(BufferedIOBase, self._zip.open(member)))
                return self._streams[-1]
        except MemoryError:
            raise
        except Exception as error:
            raise ValueError(f"{self.path}/{shown(name)[1:-1]} is damaged: {cut(error)}") from None

    def _find(self, name: str) -> ZipInfo:
        member = self._members.get(name)
        if member is None:
            raise ValueError(f"{self.path} has no {shown(name)[1:-1]}")
        if member.flag_bits & _ENCRYPTED or member.compress_type not in (_STORED, _DEFLATED):
            raise ValueError(
                f"{self.path} is packed with a password or an unusual method: unpack it and pass the files"
            )
        return member


def _close(archive: ZipFile, streams: list[BufferedIOBase]) -> None:
    for stream in streams:
        stream.close()
    archive.close()
