"""`pointshade render -o relit.html`: its options, and how it is written."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

from ..checks.arguments import Count
from ..files.access.known_names import PAGES
from ..notes.words import option
from ..renderer.renderer import Renderer
from ..renderer.requests import RenderRequest
from ..scene.frame import Frame
from ..scene.option_fields import PAGE
from ..scene.viewpoint import View
from .option_groups import said
from .options import FilmOptions, FrameOptions
from .output import open_renderer, progress, report, spinner, warn_skipped

if TYPE_CHECKING:
    from ..page.parts import QualityName

NAMES = "exact", "small"  # of page/parts.py, which imports NumPy


def is_page(output: Path) -> bool:
    """Whether a page is to be written there."""
    return output.suffix.lower() in PAGES


@dataclass(frozen=True)
class PageOptions:
    """How a page is written."""

    quality: str | None = said(
        "Of an .html: exact, or small (a third smaller, colours as JPEG).", metavar="NAME", known=NAMES, panel=PAGE
    )
    title: str | None = said("Of an .html. Default: INPUT.", metavar="TEXT", panel=PAGE)

    @property
    def exactness(self) -> QualityName:
        """The quality that was typed, or the first."""
        return cast("QualityName", self.quality or NAMES[0])

    def check(self, output: Path, film: FilmOptions) -> None:
        """Raises ValueError or OSError unless a page can be written there, of a frame that no option moves."""
        from ..page.page_file import check_page_path

        check_page_path(output)
        if film.turntable is not None:
            raise ValueError(f"{output} is moved by who looks at it: leave out {option('turntable')}")

    def check_none(self, output: Path) -> None:
        """Raises ValueError if one was given for an output that is no page."""
        given = [name for name, value in vars(self).items() if value is not None]
        if given:
            raise ValueError(f"{output} is no page: leave out {', '.join(map(option, given))}, or write an .html")

    def write_film(
        self,
        frames: Sequence[Frame],
        view: View,
        output: Path,
        frame: FrameOptions,
        film: FilmOptions,
        device: int,
        tell: Callable[[Renderer], None],
    ) -> None:
        """Writes the page in which frames of a sequence play. The size of the picture is that of its points, too."""
        from ..files.access.atomic_write import written_whole
        from ..page.films import draw_film, frames_of
        from ..page.page_file import largest_of

        frames = frames_of(frames, film.frames)
        title = self._title(frame)
        start = time.perf_counter()
        with open_renderer(device, output) as renderer, progress(len(frames) + 1) as advance:
            largest = largest_of(RenderRequest.seen(frames[0], view))

            def tell_all(done: int, all: int) -> None:
                advance(done, all)
                tell(renderer)

            text = draw_film(
                renderer, frames, view, film.fps, quality=self.exactness, largest=largest, title=title,
                count=Count(tell_all), skipped=warn_skipped,
            )  # fmt: skip
            with written_whole(output) as temporary:
                temporary.write_text(text, encoding="utf-8")
            what = f"a page of {output.stat().st_size / 1e6:.2f} MB in which {len(frames)} frames play"
            report(output, what, renderer, time.perf_counter() - start)

    def _title(self, frame: FrameOptions) -> str:
        return Path(str(frame.input or frame.depth or "vase")).stem if self.title is None else self.title

    def write(
        self, source: Any, view: View, output: Path, frame: FrameOptions, line: str, device: int,
        tell: Callable[[Renderer], None],
    ) -> None:  # fmt: skip
        """Writes the page. A size smaller than that of the source is that of the points in the page, too.

        line  as `page_line` makes it
        """
        from ..page.page_file import largest_of, write_page

        request = RenderRequest.seen(source, view)
        title = self._title(frame)
        start = time.perf_counter()
        with open_renderer(device, output) as renderer, spinner("writing"):
            largest = largest_of(request)
            write_page(renderer, output, request, quality=self.exactness, largest=largest, title=title, command=line)
            tell(renderer)
            report(output, f"a page of {output.stat().st_size / 1e6:.2f} MB", renderer, time.perf_counter() - start)
