"""Reads single frames of a video, which some recorders (StrayScanner) write beside numbered depth images."""

from __future__ import annotations

import warnings
from collections.abc import Generator
from pathlib import Path
from threading import RLock
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..access.content import MAX_PIXELS, FilePath, check_pixels, import_extra, note_read, read_head


class _Open:
    """A video that is being decoded; sequences ask for one picture after the other."""

    def __init__(self, path: Path, max_pixels: float):
        ffmpeg = import_extra("imageio_ffmpeg", "video", f"{path} is a video")
        read_head(path)
        note_read([path])
        self._pictures: Generator[Any, None, None] = ffmpeg.read_frames(str(path))
        self.path, self.next = path, 0
        self._width, self._height = next(self._pictures)["source_size"]
        check_pixels(self._width, self._height, str(path), max_pixels)

    def read(self, number: int) -> NDArray[np.uint8]:
        try:
            while self.next < number:
                next(self._pictures)
                self.next += 1
            data = next(self._pictures)
        except StopIteration:
            raise ValueError(f"{self.path} has {self.next} pictures, picture {number} is wanted") from None
        self.next += 1
        return np.frombuffer(data, np.uint8).reshape(self._height, self._width, 3)

    def close(self) -> None:
        with warnings.catch_warnings():  # imageio-ffmpeg leaves the pipes of an ffmpeg that has ended
            warnings.simplefilter("ignore", ResourceWarning)
            self._pictures.close()


_lock = RLock()  # of one thread, too: a sequence may be thrown away while another is read
_last: list[_Open] = []  # at most one


def read_video_frame(path: FilePath, number: int, max_pixels: float = MAX_PIXELS) -> NDArray[np.uint8]:
    """(h, w, 3) picture of this number, from 0, quick in order. Raises ValueError without it, or the extra `video`."""
    path = Path(path)
    with _lock:
        if not (_last and _last[0].path == path and _last[0].next <= number):
            close_video()
            try:
                _last.append(_Open(path, max_pixels))
            except (OSError, RuntimeError, StopIteration) as error:
                reason = str(error).partition("\n")[0]  # what follows is all that ffmpeg has printed
                raise ValueError(f"{path} is not a video that ffmpeg can read: {reason}") from None
        return _last[0].read(number)


def count_pictures(path: FilePath, max_pixels: float = MAX_PIXELS) -> int:
    """How many pictures a video has. Raises ValueError for what is none, and without the extra `video`."""
    ffmpeg = import_extra("imageio_ffmpeg", "video", f"{path} is a video")
    read_video_frame(path, 0, max_pixels)
    try:
        return max(1, ffmpeg.count_frames_and_secs(str(path))[0])
    except (OSError, RuntimeError):
        return 1


def close_video() -> None:
    """Ends the decoding of the last video."""
    with _lock:
        while _last:
            _last.pop().close()
