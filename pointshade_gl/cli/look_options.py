"""The options of the command line that say how objects look: groups as in cli/options.py."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated

import typer

from ..scene.appearance import FLYING, NORMALS_AT, SHADINGS, SPLATS, UPSAMPLINGS
from ..scene.noise import SENSORS
from ..scene.normal_methods import METHODS
from .completion import one_of
from .light_words import FIELDS, light_from
from .options import FRAME, LIGHT, VIEW
from .parse import noise_from, point_size_from

if TYPE_CHECKING:
    from ..scene.appearance import Look
    from ..scene.light import Light


@dataclass(frozen=True)
class NormalOptions:
    """How normals are estimated."""

    normals: Annotated[
        str,
        typer.Option(
            metavar="METHOD",
            help=f"How normals are estimated: {', '.join(METHODS)}.",
            autocompletion=one_of(METHODS),
            rich_help_panel=FRAME,
        ),
    ] = "auto"
    max_depth_step: Annotated[
        str | None,
        typer.Option(metavar="M", help="A larger depth step ends a surface: metres, or '3%'.", rich_help_panel=FRAME),
    ] = None
    noise: Annotated[
        str | None,
        typer.Option(
            metavar="M|SENSOR",
            help=f"Noise of the depth: metres, what --explain prints, or {', '.join(SENSORS)}. Default: measured.",
            autocompletion=one_of(SENSORS),
            rich_help_panel=FRAME,
        ),
    ] = None
    flying: Annotated[
        str,
        typer.Option(
            metavar="METHOD",
            help="Pixels that hang between two surfaces: keep, or snap (put them onto the nearer one).",
            autocompletion=one_of(FLYING),
            rich_help_panel=FRAME,
        ),
    ] = "keep"
    temporal: Annotated[
        bool,
        typer.Option(
            "--temporal", help="Filter noisy depth of a sequence over time: less flicker.", rich_help_panel=FRAME
        ),
    ] = False

    def noise_value(self) -> float | str | None:
        """Metres, the name of a sensor, noise in words, or None."""
        return noise_from(self.noise)


@dataclass(frozen=True)
class LookOptions(NormalOptions):
    """How objects look, and under which lights."""

    shading: Annotated[
        str,
        typer.Option(
            metavar="MODEL",
            help=f"How surfaces are lit: {', '.join(SHADINGS)}.",
            autocompletion=one_of(SHADINGS),
            rich_help_panel=LIGHT,
        ),
    ] = "phong"
    light: Annotated[
        list[str] | None,
        typer.Option(
            metavar="X,Y,Z|WORDS",
            help="Point light at X,Y,Z: metres, world axes. Or words: 'position=-.5,-.7,.2 color=#ffcc99 shadow'; "
            f"known are {', '.join(FIELDS)}. Repeatable. Replaces a scene's own lights, and casts shadows there "
            "unless shadow=no.",
            rich_help_panel=LIGHT,
        ),
    ] = None
    ambient: Annotated[
        float, typer.Option(metavar="N", help="Strength of the ambient light.", rich_help_panel=LIGHT)
    ] = 0.1
    diffuse: Annotated[
        float, typer.Option(metavar="N", help="Strength of the diffuse reflection.", rich_help_panel=LIGHT)
    ] = 0.9
    specular: Annotated[float, typer.Option(metavar="N", help="Strength of the highlight.", rich_help_panel=LIGHT)] = (
        0.3
    )
    shininess: Annotated[float, typer.Option(metavar="N", help="Exponent of the highlight.", rich_help_panel=LIGHT)] = (
        32.0
    )
    splat: Annotated[
        str,
        typer.Option(
            metavar="SHAPE",
            help=f"What is drawn of each point: {', '.join(SPLATS)} (triangles between pixels).",
            autocompletion=one_of(SPLATS),
            rich_help_panel=VIEW,
        ),
    ] = "footprint"
    point_size: Annotated[
        str | None,
        typer.Option(
            metavar="N|fill",
            help="Size of the points in pixels of the frame, or fill: close the gaps between them. Default: 1.",
            autocompletion=one_of(("fill",)),
            rich_help_panel=VIEW,
        ),
    ] = None
    upsample: Annotated[
        str,
        typer.Option(
            metavar="METHOD",
            help="Where color is larger than depth: vote (bring depth to its size) or none.",
            autocompletion=one_of(UPSAMPLINGS),
            rich_help_panel=VIEW,
        ),
    ] = "vote"
    normals_at: Annotated[
        str,
        typer.Option(
            metavar="PLACE",
            help="Of --views, normals are estimated in each view (source) or in the picture (target).",
            autocompletion=one_of(NORMALS_AT),
            rich_help_panel=VIEW,
        ),
    ] = "source"
    unlight: Annotated[
        bool,
        typer.Option(
            "--unlight",
            help="Divide the light in the picture out of its colours, if the picture tells it.",
            rich_help_panel=LIGHT,
        ),
    ] = False
    remove_highlights: Annotated[
        bool,
        typer.Option(
            "--remove-highlights",
            help="Take the highlights in the picture out of its colours, if the picture tells them.",
            rich_help_panel=LIGHT,
        ),
    ] = False

    def look(self) -> Look:
        """The values as a Look. Raises ValueError for unknown names and impossible numbers."""
        from ..scene.appearance import Look, Material

        return Look(
            Material(self.ambient, self.diffuse, self.specular, self.shininess),
            self.normals,
            self.shading,
            point_size_from(self.point_size),
            splat=self.splat,
            max_depth_step=self.max_depth_step,
            noise=self.noise_value(),
            upsample=self.upsample,
            normals_at=self.normals_at,
            flying=self.flying,
            temporal=self.temporal,
            unlight=self.unlight,
            remove_highlights=self.remove_highlights,
        )

    def lights(self, shadow: bool = False) -> list[Light]:
        """The lights in the order given. Raises ValueError for a text that is not a light.

        shadow  whether those that do not say so cast shadows
        """
        return [light_from(text, shadow=shadow) for text in self.light or []]
