"""The options of `pointshade render` about the finished picture: samples, background, ground."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from ..files.writing.film import BACKGROUND, FILM_SUFFIXES
from ..messages.formatting import option

if TYPE_CHECKING:
    from ..scene.render_settings import Finish
    from ..scene.view import View

PICTURE = "Picture"
STILL, FILM = 16, 4  # samples of a picture, and of each picture of a film, unless the user says how many
# what lies behind a picture in formats without alpha
_OPAQUE = {".jpg": "black", ".jpeg": "black"} | dict.fromkeys(FILM_SUFFIXES, "#{:02x}{:02x}{:02x}".format(*BACKGROUND))


@dataclass(frozen=True)
class PictureOptions:
    """How a picture is finished."""

    samples: Annotated[
        int | None,
        typer.Option(
            metavar="N",
            help=f"Average N pictures, for smooth outlines and soft shadows. Default: {STILL}, in a film {FILM}, "
            "and 1 for a photograph seen as it was taken.",
            rich_help_panel=PICTURE,
        ),
    ] = None
    background: Annotated[
        str | None,
        typer.Option(
            metavar="COLOR|transparent",
            help="What lies behind: white, '#102030' or transparent. Default: transparent, in .jpg black, in films "
            "dark grey.",
            rich_help_panel=PICTURE,
        ),
    ] = None
    ground: Annotated[
        bool,
        typer.Option("--ground", help="Put a ground below, on which only shadows are seen.", rich_help_panel=PICTURE),
    ] = False
    ground_height: Annotated[
        float | None,
        typer.Option(
            metavar="M",
            help="Where the ground lies, metres along up from the world's origin: -1.2 is 1.2 m below the camera. "
            "Default: a floor that is shown, or what lies lowest.",
            rich_help_panel=PICTURE,
        ),
    ] = None

    def finish(self, output: Path, view: View, source: Any, is_film: bool, turns: bool) -> Finish:
        """The Finish of the pictures that a view shows. Raises ValueError for values that do not fit the output.

        turns  whether the camera turns around the object
        """
        from ..scene.render_settings import Finish

        suffix, samples = output.suffix.lower(), self.samples
        if self.background == "transparent" and suffix in _OPAQUE:
            raise ValueError(f"{output} cannot be transparent: write a .png, or leave out {option('background')}")
        if samples is None:
            is_exact = not self.ground and not turns and view.shows_photograph(source)
            samples = 1 if is_exact else FILM if is_film else STILL
        behind = self.background
        if behind is None and (samples > 1 or self.ground):
            behind = _OPAQUE.get(suffix)
        return Finish(samples, behind, self.ground, self.ground_height)

    def check_none(self, output: Path) -> None:
        """Raises ValueError if one was given for an output that is no picture."""
        given = [name for name, value in vars(self).items() if value is not None and value is not False]
        if given:
            raise ValueError(f"{output} is no picture: leave out {', '.join(map(option, given))}")
