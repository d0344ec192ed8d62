"""The options of `pointshade render` about the finished picture: samples, background, ground; its light."""

from __future__ import annotations

from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

from ..files.access.known_names import FILMS
from ..files.writing.film import BACKGROUND
from ..notes.words import option
from ..scene.environment import Environment
from ..scene.option_fields import LIGHT, PICTURE
from ..scene.settings import FILM, STILL, Finish
from ..scene.viewpoint import View
from .look_options import LookOptions
from .option_groups import group_of, typed
from .options import ViewOptions
from .parse import environment_from

# what lies behind a picture in formats without alpha
_OPAQUE = {".jpg": "black", ".jpeg": "black"} | dict.fromkeys(FILMS, "#{:02x}{:02x}{:02x}".format(*BACKGROUND))


@dataclass(frozen=True)
class EnvironmentOptions(group_of(typed(Finish, (LIGHT,), None))):
    """Light from all around, and how light above white is shown."""

    @classmethod
    def of(cls, finish: Finish) -> EnvironmentOptions:
        """What is typed for a finish, as far as words can say it; its values need not be texts."""
        values = {one.name: finish.options.get(one.name) for one in fields(cls)}
        return cls(**{name: _as_typed(value) for name, value in values.items()})

    def chosen(self) -> dict[str, Any]:
        """The values that were typed, by the names of the fields of Finish. Raises ValueError or OSError."""
        chosen = self.values_of(Finish)
        if "environment" in chosen:
            chosen["environment"] = environment_from(chosen["environment"])
        return chosen


@dataclass(frozen=True)
class PictureOptions(group_of(typed(Finish, (PICTURE,), None)), EnvironmentOptions):
    """How a picture is finished."""

    def finish(self, output: Path, samples: int) -> Finish:
        """The Finish of pictures. Raises ValueError for values that do not fit the output. samples: unless typed."""
        suffix, chosen = output.suffix.lower(), self.chosen()
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


def _as_typed(value: Any) -> Any:
    """The value as it is typed; None: no words say it."""
    if isinstance(value, Environment):
        return value.name or None
    if isinstance(value, bool):
        return "yes" if value else "no"
    return None if isinstance(value, tuple) else value


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
