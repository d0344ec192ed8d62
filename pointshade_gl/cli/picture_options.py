"""The options of `pointshade render` about the finished picture: samples, background, ground."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from ..files.access.written_suffixes import FILMS
from ..files.writing.film import BACKGROUND
from ..messages.formatting import option
from ..scene.option_fields import PICTURE
from ..scene.render_settings import FILM, STILL, Finish
from ..scene.view import View
from .look_options import LookOptions
from .option_groups import group_of, typed
from .options import ViewOptions

# what lies behind a picture in formats without alpha
_OPAQUE = {".jpg": "black", ".jpeg": "black"} | dict.fromkeys(FILMS, "#{:02x}{:02x}{:02x}".format(*BACKGROUND))


@dataclass(frozen=True)
class PictureOptions(group_of(typed(Finish, (PICTURE,), None))):
    """How a picture is finished."""

    def finish(self, output: Path, samples: int) -> Finish:
        """The Finish of pictures. Raises ValueError for values that do not fit the output. samples: unless typed."""
        suffix, chosen = output.suffix.lower(), self.values_of(Finish)
        if self.background == "transparent" and suffix in _OPAQUE:
            raise ValueError(f"{output} cannot be transparent: write a .png, or leave out {option('background')}")
        if "samples" not in chosen:
            chosen["samples"] = samples
        if "background" not in chosen and (chosen["samples"] > 1 or self.ground):
            chosen["background"] = _OPAQUE.get(suffix)
        return Finish(**{"exposure": "sensor", **chosen})

    def check_none(self, output: Path) -> None:
        """Raises ValueError if one was given for an output that is no picture."""
        given = [name for name, value in vars(self).items() if value is not None and value is not False]
        if given:
            raise ValueError(f"{output} is no picture: leave out {', '.join(map(option, given))}")


def view_of(
    look: LookOptions,
    place: ViewOptions,
    picture: PictureOptions,
    output: Path,
    *,
    is_scene: bool,
    is_film: bool,
    is_changed: bool,
    is_cloud: bool = False,
) -> View:
    """The View of what is drawn. Raises ValueError or OSError.

    is_scene    whether it is a scene, as of point clouds
    is_changed  whether something else than a single frame is seen by its own camera
    """
    chosen = look.look()
    is_photograph = chosen.is_plain and place == ViewOptions() and not (is_scene or is_changed)
    lights = look.lights(shadow=picture.ground or is_scene)
    is_hard = not picture.ground and not any(light.is_soft for light in lights)
    samples = 1 if is_photograph and not picture.ground else FILM if is_film or (is_cloud and is_hard) else STILL
    return place.view(chosen, lights, picture.finish(output, samples))
