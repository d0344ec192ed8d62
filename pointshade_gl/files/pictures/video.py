"""Reads single pictures of films: of colours, as recorders write them beside depth pictures, and of depth."""

from __future__ import annotations

import warnings
from collections.abc import Generator
from pathlib import Path
from threading import RLock
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..access.content import MAX_PIXELS, FilePath, check_pixels, import_extra, note_read, read_head

_KEPT = 4  # pictures: threads ask for neighbours in any order
_MOST_OPEN = 2  # films: depth and its colours


class _Open:
    """A film that is being decoded; sequences ask for one picture after the other."""

    def __init__(self, path: Path, max_pixels: float, is_deep: bool):
        ffmpeg = import_extra("imageio_ffmpeg", "video", f"{path} is a video")
        read_head(path)
        note_read([path])
        form: dict[str, Any] = {"pix_fmt": "gray16le", "bits_per_pixel": 16} if is_deep else {}
        self._pictures: Generator[Any, None, None] = ffmpeg.read_frames(str(path), **form)
        self.path, self.is_deep, self.next = path, is_deep, 0
        about = next(self._pictures)
        self._width, self._height = about["size"]  # as ffmpeg turns it upright
        self.format = str(about.get("pix_fmt", ""))
        self.kept: dict[int, NDArray[Any]] = {}
        check_pixels(self._width, self._height, str(path), max_pixels)

    def read(self, number: int) -> NDArray[Any]:
        while number not in self.kept:
            try:
                data = next(self._pictures)
            except StopIteration:
                raise ValueError(f"{self.path} has {self.next} pictures, picture {number} is wanted") from None
            if self.next > number - _KEPT:
                shape = (self._height, self._width) if self.is_deep else (self._height, self._width, 3)
                self.kept[self.next] = np.frombuffer(data, "<u2" if self.is_deep else np.uint8).reshape(shape)
                self.kept.pop(self.next - _KEPT, None)
            self.next += 1
        return self.kept[number]

    def close(self) -> None:
        with warnings.catch_warnings():  # imageio-ffmpeg leaves the pipes of an ffmpeg that has ended
            warnings.simplefilter("ignore", ResourceWarning)
            self._pictures.close()


_lock = RLock()  # of one thread, too: a sequence may be thrown away while another is read
_open: list[_Open] = []  # the last ones


def read_video_frame(
    path: FilePath, number: int, max_pixels: float = MAX_PIXELS, is_deep: bool = False
) -> NDArray[Any]:
    """(h, w, 3) picture of this number, from 0, quick in order. Raises ValueError without it, or the extra `video`.
    is_deep: (h, w) uint16 of its brightness instead."""
    with _lock:
        return _opened(Path(path), number, max_pixels, is_deep).read(number)


def pixel_format(path: FilePath) -> str:
    """ffmpeg's name for how a film's pixels are stored, such as yuv420p10le. Raises as `read_video_frame` does."""
    with _lock:
        return _opened(Path(path), 0, MAX_PIXELS, False).format


def _opened(path: Path, number: int, max_pixels: float, is_deep: bool) -> _Open:
    same = [one for one in _open if (one.path, one.is_deep) == (path, is_deep)]
    if same and (number >= same[0].next or number in same[0].kept):
        return same[0]
    for one in same or _open[: len(_open) - _MOST_OPEN + 1]:
        _open.remove(one)
        one.close()
    reason = ""
    with warnings.catch_warnings():  # as in `close`, of a film that cannot be read
        warnings.simplefilter("ignore", ResourceWarning)
        try:
            _open.append(_Open(path, max_pixels, is_deep))
        except (OSError, RuntimeError, StopIteration) as error:  # with all that ffmpeg has printed
            reason = str(error).partition("\n")[0] or "it has no pictures"
    if reason:
        raise ValueError(f"{path} is not a video that ffmpeg can read: {reason}")
    return _open[-1]


def count_pictures(path: FilePath, max_pixels: float = MAX_PIXELS) -> int:
    """How many pictures a video has. Raises ValueError for what is none, and without the extra `video`."""
    ffmpeg = import_extra("imageio_ffmpeg", "video", f"{path} is a video")
    read_video_frame(path, 0, max_pixels)
    try:
        return max(1, ffmpeg.count_frames_and_secs(str(path))[0])
    except (OSError, RuntimeError):
        return 1


def close_video() -> None:
    with _lock:
        while _open:
            _open.pop().close()
