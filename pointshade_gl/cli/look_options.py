"""The options of the command line that say how objects look: groups as in cli/options.py."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Annotated

import typer

from ..scene.appearance import Look, Material
from ..scene.light import Light
from ..scene.option_fields import CAMERA, LIGHT, SETS, SHADING, SURFACE
from .light_words import FIELDS, light_from
from .option_groups import group_of, typed

Lights = Annotated[
    list[str] | None,
    typer.Option(
        metavar="X,Y,Z|WORDS",
        help="Point light at X,Y,Z (metres, world axes), or words: 'position=-.5,-.7,.2 color=#ffcc99 shadow'. "
        f"Known are {', '.join(FIELDS)}. Repeatable. Replaces a scene's own lights, and casts shadows there "
        "unless shadow=no.",
        rich_help_panel=LIGHT,
    ),
]
_SHADING, *_FORM = typed(Look, (SHADING,))
_REST = typed(Look, (LIGHT, CAMERA, SETS))
_MISSING = [one for one in typed(Look, (SURFACE,), {"missing": "complete"}) if one[0] == "missing"]  # for pictures


@dataclass(frozen=True)
class NormalOptions(group_of(typed(Look, (SURFACE,)))):
    """How normals are estimated."""

    def look(self) -> Look:
        """The values as a Look. Raises ValueError for unknown names and impossible numbers."""
        return Look(Material(**self.values_of(Material)), **self.values_of(Look))


@dataclass(frozen=True)
class LookOptions(
    group_of([_SHADING, ("light", Lights, None), *typed(Material, (SHADING,)), *_FORM, *_REST, *_MISSING]),
    NormalOptions,
):
    """How objects look, and under which lights."""

    @classmethod
    def of(cls, look: Look) -> LookOptions:
        """What is typed for a look; its values need not be texts."""
        values = look.options | vars(look.material)
        return cls(**{one.name: values[one.name] for one in fields(cls) if one.name in values})

    def lights(self, shadow: bool = False) -> list[Light]:
        """The lights in the order given. Raises ValueError for a text that is not a light.

        shadow  whether those that do not say so cast shadows
        """
        return [light_from(text, shadow=shadow) for text in self.light or []]
