"""Writes a film from a series of pictures: .mp4 for players, .gif for web pages."""

from __future__ import annotations

import math
from contextlib import suppress
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ...checks.arguments import check_fps
from ...checks.foreign_arrays import AnyArray
from ...notes.words import option
from ..access.atomic_write import check_place, error_of, hidden_beside, naming_written
from ..access.content import FilePath, check_not_read, followed
from ..access.known_names import FILMS, check_suffix, first_of, is_numbered
from ..pictures.picture_files import check_picture, check_writable

if TYPE_CHECKING:
    from PIL import Image  # imported where it is used: most programs write no film

BACKGROUND = (28, 28, 32)  # films have no alpha: where nothing was drawn they are dark grey


def check_film(path: FilePath) -> Path:
    """The path, for a check before long work. Raises ValueError or OSError if no `Film` can be written there."""
    path = check_suffix(path, FILMS, "the suffix of a film")
    if path.suffix.lower() == ".mp4":
        _find_ffmpeg(path)
    return check_place(path)


def is_series(path: Path) -> bool:
    """True for a path of many pictures: a film, or a name with a number in it."""
    return path.suffix.lower() in FILMS or is_numbered(path)


def check_series(path: Path) -> None:
    """Raises ValueError or OSError unless many pictures can be written there; call it before a long computation."""
    if not is_series(path):
        expected = f"a film ({', '.join(FILMS)}) or a number in the name (such as %04d.png)"
        raise ValueError(f"many pictures need {expected}, got {path}")
    if is_numbered(path):
        check_writable(first_of(path))
    else:
        check_film(path)


class Film:
    """A film that is being written: .mp4 for players, .gif for web pages.

    Parameters
    ----------
    path : path
        The file, .mp4 or .gif.
    fps : float
        Pictures per second, 0.01 to 1000.

    Raises
    ------
    ValueError
        For another suffix, for .mp4 without the extra `video`, and for an impossible fps.
    OSError
        If the folder does not exist, or ffmpeg fails.

    Notes
    -----
    The first picture sets the size of the film (.mp4 crops odd sizes by a pixel); others are fitted into it. A .gif
    keeps its pictures in memory until the end, when it finds the 256 colours that suit all of them. The file appears,
    complete, when the film is closed. After an error, or without a picture, there is none.

    Examples
    --------
    >>> with ps.Film("out.mp4", fps=30) as film:
    ...     film.add(image)
    """

    def __init__(self, path: FilePath, fps: float = 25.0):
        self.path = followed(check_film(path))  # a link stays a link, its target is replaced
        self.fps = check_fps(fps, option("fps"), "pictures")
        self._temporary = hidden_beside(self.path)
        self._writer: _Mp4 | _Gif | None = None

    def add(self, image: AnyArray) -> None:
        """Add a picture.

        Parameters
        ----------
        image : (h, w, 3|4) uint8
            Transparent parts become dark grey.
        """
        picture = _flattened(image)
        with naming_written(self.path):
            if self._writer is None:
                kind = _Mp4 if self.path.suffix.lower() == ".mp4" else _Gif
                self._writer = kind(self._temporary, picture.size, self.fps)
            if picture.size != self._writer.shown:
                from PIL import ImageOps

                picture = ImageOps.pad(picture, self._writer.shown, color=BACKGROUND)
            self._writer.add(picture)

    def close(self) -> None:
        """Finish the file and put it in its place. A second call does nothing."""
        if self._writer is None:
            return
        try:
            with naming_written(self.path):
                self._writer.finish()
                check_not_read(self.path)
                self._temporary.replace(self.path)
        finally:
            self.discard()

    def discard(self) -> None:
        """Remove what was written so far."""
        if self._writer is not None:
            self._writer.abort()
        self._writer = None
        self._temporary.unlink(missing_ok=True)

    def __enter__(self) -> Film:
        return self

    def __exit__(self, error: object, *_: object) -> None:
        if error is None:
            self.close()
        else:
            self.discard()


_DECODED = ["-f", "rawvideo", "-pix_fmt", "rgb24"]
# half the time of the preset medium at crf 18, for a film a tenth larger and 0.1 to 0.3 dB below it
_QUALITY = ["-c:v", "libx264", "-preset", "veryfast", "-crf", "17"]
_ENCODED = [*_QUALITY, "-pix_fmt", "yuv420p", "-movflags", "+faststart", "-f", "mp4"]
# players expect BT.709, and ffmpeg converts by BT.601 if nothing else is asked for
_BT709 = "scale=out_color_matrix=bt709:out_range=tv,setparams=colorspace=bt709:color_primaries=bt709:color_trc=bt709"
_CONVERTED = ["-vf", f"crop=trunc(iw/2)*2:trunc(ih/2)*2,{_BT709}"]


class _Mp4:
    """H.264 by ffmpeg, which reads raw pictures from a pipe; even sizes and yuv420p, which every player shows."""

    def __init__(self, path: Path, size: tuple[int, int], fps: float):
        import subprocess
        import tempfile

        self.shown = size
        self._log = tempfile.TemporaryFile()  # noqa: SIM115 - a pipe would stop ffmpeg when nobody reads it
        source = [*_DECODED, "-s", f"{size[0]}x{size[1]}", "-r", str(fps), "-i", "-"]
        self._process = subprocess.Popen(
            [_find_ffmpeg(path), "-v", "error", *source, *_CONVERTED, *_ENCODED, str(path)],
            stdin=subprocess.PIPE,
            stdout=subprocess.DEVNULL,
            stderr=self._log,
            start_new_session=True,  # Ctrl+C is for us: it would end ffmpeg before the film is whole
        )

    def add(self, picture: Image.Image) -> None:
        assert self._process.stdin
        try:
            self._process.stdin.write(picture.tobytes())
        except OSError:  # the pipe is closed at the other end
            raise self._failure() from None

    def finish(self) -> None:
        self._close_pipe()
        if self._process.wait():
            raise self._failure()

    def abort(self) -> None:
        self._process.kill()
        self._close_pipe()
        self._process.wait()
        self._log.close()

    def _close_pipe(self) -> None:
        assert self._process.stdin
        with suppress(OSError):  # the rest cannot be written; the exit status shows it
            self._process.stdin.close()

    def _failure(self) -> OSError:
        self._process.wait()
        self._log.seek(0)
        lines = self._log.read().decode(errors="replace").split("\n")
        return error_of(f"ffmpeg ended with {' '.join(lines).strip() or self._process.returncode}")


class _Gif:
    """256 colours for the whole film and no dithering: nothing flickers, and still parts take no space."""

    def __init__(self, path: Path, size: tuple[int, int], fps: float):
        self.shown = size
        self._path, self._fps = path, fps
        self._pictures: list[Image.Image] = []

    def add(self, picture: Image.Image) -> None:
        self._pictures.append(picture)

    def finish(self) -> None:
        from PIL import Image

        palette = _palette(self._pictures)
        first, *others = (item.quantize(palette=palette, dither=Image.Dither.NONE) for item in self._pictures)
        # a GIF counts hundredths of a second, and browsers slow down pictures shorter than two of them
        ticks = np.diff(np.rint(np.arange(len(self._pictures) + 1) * 100 / self._fps)).clip(2)
        durations = [int(tick) * 10 for tick in ticks]
        first.save(self._path, "GIF", save_all=True, append_images=others, duration=durations, loop=0)

    def abort(self) -> None:
        self._pictures.clear()


def _palette(pictures: list[Image.Image], looked_at: int = 400_000) -> Image.Image:
    """The 256 colours nearest to those of the film, as a palette picture; every picture counts."""
    from PIL import Image

    side = max(8, math.isqrt(looked_at // len(pictures)))
    sizes = [(min(side, item.width), min(side, item.height)) for item in pictures]
    samples = [item.resize(size, Image.Resampling.NEAREST) for item, size in zip(pictures, sizes, strict=True)]
    strip = Image.new("RGB", (samples[0].width, samples[0].height * len(samples)))
    for k, sample in enumerate(samples):
        strip.paste(sample, (0, k * sample.height))
    return strip.quantize(256, method=Image.Quantize.MEDIANCUT, kmeans=3)


def _flattened(image: AnyArray) -> Image.Image:
    from PIL import Image

    picture = Image.fromarray(np.ascontiguousarray(check_picture(image, "film")))
    if picture.mode != "RGBA":
        return picture.convert("RGB")
    result = Image.new("RGB", picture.size, BACKGROUND)
    result.paste(picture, mask=picture)
    return result


def _find_ffmpeg(path: Path) -> str:
    try:
        imageio_ffmpeg: Any = import_module("imageio_ffmpeg")  # only here: an optional extra
    except ImportError:
        way_out = "pip install '.[video]' in the clone for .mp4; .gif works without"
        raise ValueError(f"cannot write {path}: {way_out}") from None
    try:
        return imageio_ffmpeg.get_ffmpeg_exe()
    except RuntimeError as error:
        raise OSError(f"cannot write {path}: {error}") from None
