"""A page in a notebook's cell: in a frame of its own, cut off from the notebook."""

from __future__ import annotations

import html
from functools import partial
from typing import TYPE_CHECKING

from ..checks.arguments import Progress, check_count
from ..notes.notes import Note
from ..renderer.renderer import Renderer
from ..renderer.requests import GROUPS, RequestOptions, Source
from ..scene.option_fields import takes
from .page_file import draw_page
from .parts import QualityName

if TYPE_CHECKING:
    from typing_extensions import Unpack

HEIGHT = 480  # CSS pixels
LOWEST = 120
MOST = 2_500_000  # bytes: Jupyter drops outputs of 3 million bytes and more in its first setting


class Cell:
    """What a notebook shows as a page. `html` is the page itself."""

    def __init__(self, page: str, title: str, height: int):
        self.html, self._title, self._height = page, title, height

    def _repr_html_(self) -> str:
        """A frame whose scripts run and save pictures, and that can reach neither the notebook nor anything else."""
        return (
            f'<iframe srcdoc="{html.escape(self.html)}" title="{html.escape(self._title)}" '
            'sandbox="allow-scripts allow-downloads" allow="clipboard-write" allowfullscreen '
            f'style="display: block; width: 100%; height: {self._height}px; border: 0"></iframe>'
        )

    def __repr__(self) -> str:
        return f"Cell({len(self.html) / 1e6:.1f} MB, {self._height} pixels high)"


@takes(RequestOptions, *GROUPS, like=Renderer.render)
def draw_cell(
    renderer: Renderer,
    source: Source,
    *,
    height: int = HEIGHT,
    quality: QualityName | None = None,
    title: str = "pointshade",
    notes: Note | None = None,
    progress: Progress | None = None,
    **options: Unpack[RequestOptions],
) -> Cell:
    """Show a frame, several frames of one thing, a scene or a cloud in a notebook: the light is under the mouse.

    As the last line of a cell it shows itself.

    Parameters
    ----------
    source : Frame, sequence of Frame, Scene, PointCloud, path or RenderRequest
        What is shown, as `render` takes it.
    height : int
        Of the cell, CSS pixels; it is as wide as the notebook.
    quality : {"exact", "small"}, optional
        As for `save_page`; None: "exact", or "small" where that would be more than 2.5 MB. Notebooks keep each page,
        and Jupyter drops outputs of 3 MB and more unless ServerApp.iopub_data_rate_limit is raised.
    title : str
        What the page says below its picture.

    Raises
    ------
    ValueError, TypeError
        For arguments that do not fit.
    """
    height = check_count(height, "height", LOWEST, "of pixels ")
    draw = partial(draw_page, renderer, source, title=title, notes=notes, progress=progress, **options)
    page = draw(quality=quality or "exact")
    if quality is None and len(page) > MOST:
        page = draw(quality="small")
    return Cell(page, title, height)
