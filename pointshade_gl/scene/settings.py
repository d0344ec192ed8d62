"""How a picture is finished: how many samples are averaged, and what lies behind and below. Plain frozen values."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields, replace
from os import PathLike
from typing import Any, Literal, TypedDict, cast, get_args

import numpy as np
from numpy.typing import NDArray

from ..checks.arguments import (
    LARGEST,
    as_array,
    check_choice,
    check_color,
    check_direction,
    check_float,
    check_number,
    check_point,
    is_a,
)
from ..checks.foreign_arrays import Numbers
from ..notes.words import option, shown
from .appearance import is_single
from .environment import FAR_AS_SEEN, NAMES, Environment, check_environment
from .option_fields import LIGHT, PICTURE, Cli, number_or_text, opt, option_class
from .sample_pattern import check_samples
from .values import SHOWS, Show, linear_color

STILL, FILM = 16, 4  # samples of a picture of the command line; of each picture of a film, and of a point cloud
STOPS = 32.0  # of exposure, at most
FILL = 0.5  # of photographs, which are lit already: they stay above this share of themselves
Vector = tuple[float, float, float]
Metering = Literal["auto", "sensor"]
METERINGS: tuple[Metering, ...] = get_args(Metering)
Tone = Literal["none", "neutral"]
TONES: tuple[Tone, ...] = get_args(Tone)
OCCLUSION: dict[str, bool | None] = {"auto": None, "yes": True, "no": False}  # what words of the command line stand for


class LinearOptions(TypedDict, total=False):
    """The options of OutputSettings that passes have, too."""

    samples: int
    ground: bool | Numbers
    ground_height: float | None
    environment: Environment | Numbers | str | PathLike[str] | None
    environment_intensity: float
    environment_rotation: float | Numbers
    ambient_occlusion: bool | float | None


class OutputOptions(LinearOptions, total=False):
    """The options of OutputSettings."""

    background: str | Numbers | None
    exposure: float | Metering
    fill: float | None
    tone: Tone
    show: Show


def occlusion_of(text: str) -> bool | float | None:
    """Return the value of `ambient_occlusion` for a text of the command line. Raises ValueError."""
    if text in OCCLUSION:
        return OCCLUSION[text]
    try:
        return float(text)
    except ValueError:
        raise ValueError(
            f"{option('ambient_occlusion')} takes {', '.join(OCCLUSION)} or metres, got {shown(text)}"
        ) from None


@option_class
@dataclass(frozen=True)
class OutputSettings:
    """What is made of the light that a picture shows.

    Averages and backgrounds are mixed in linear light. Over a transparent background shadows are black, and their alpha
    is the share of the light that they take.

    Raises
    ------
    ValueError, TypeError
        for anything else
    """

    samples: int = opt(
        1,
        "how many pictures are averaged, each seen from another place within the pixels (and from other places of"
        " lights with a radius or an angle): smooth outlines, textures and shadows. 1 is a single picture, seen "
        "from the middle of each pixel: unlit and from the frame's own camera it is the photograph.",
        f"Average N pictures, for smooth outlines and soft shadows. Default: {STILL}, in a film and of a "
        f"point cloud without soft shadows {FILM}, and 1 for a photograph seen as it was taken.",
        Cli(PICTURE, "N"),
    )
    background: str | Numbers | None = opt(
        None,
        'a colour: a name, "#rrggbb", or linear RGB; None or "transparent" is transparent. Alpha is the share of the '
        "pixel that is covered, and colours are not multiplied by it.",
        "What lies behind: white, '#102030' or transparent. Default: transparent, in .jpg black, in films dark grey.",
        Cli(PICTURE, "COLOR|transparent"),
    )
    ground: bool | Numbers = opt(
        False,
        "True puts a ground under the object, on which only shadows are seen: those of lights that cast them. "
        "Without a light there is one that does, with soft shadows. Where the frame itself shows a floor, the "
        "ground goes on from there. Up is up from that floor, else up in the frame's picture, as no frame says "
        "more, and the world's y in a scene; (3,) in world axes says it otherwise.",
        "Put a ground below, on which only shadows are seen.",
        Cli(PICTURE),
    )
    ground_height: float | None = opt(
        None,
        "where the ground lies along up, metres (world units) from the world's origin: -1.2 is 1.2 m below the frame's "
        "camera; None finds a floor, or what lies lowest",
        "Where the ground lies, metres along up from the world's origin: -1.2 is 1.2 m below the camera. Default:"
        " a floor that is shown, or what lies lowest.",
        Cli(PICTURE, "M", kind=float),
    )
    exposure: float | Metering = opt(
        0.0,
        'stops by which all light is multiplied: 1 is twice the light. "auto" makes the lit part as bright as the '
        "photograph, or as unlit colours: the medians of both are the same, seen from the frame's own camera, so that "
        'turning changes nothing. "sensor" is auto for photographs, which are frames with colours and measured noise, '
        "and 0 for all else.",
        "Stops by which light is multiplied: 1 is twice the light; auto: as bright as the photograph. Default: "
        "sensor, which is auto for frames with colours and measured noise, and 0 for all else.",
        Cli(PICTURE, "N|auto|sensor", METERINGS, read=number_or_text),
    )
    fill: float | None = opt(
        None,
        "light from all around that is mixed in, as a share of all light, 0 to 1: no point is darker than this share "
        f"of its own colour. None is {FILL:g} where `exposure` is found for a photograph with measured noise, which "
        "is lit already, and 0 for all else. Scenes, environments and materials without ambient light have none",
        "Share of light from all around, 0 to 1: no point is darker than this share of its own colour. Default: "
        f"{FILL:g} where the exposure of a photograph with measured noise is found, else 0.",
        Cli(PICTURE, "N", kind=float),
    )
    tone: Tone = opt(
        "none",
        'how light is shown that is stronger than white: "none" cuts it off, each channel by itself; "neutral" lets it '
        "roll off towards white, which keeps hues (Khronos PBR Neutral, 2024). Below 0.8 neutral takes off 0.04, less "
        "of the darkest colours, and nothing else. It leaves backgrounds, shadows on a ground and unlit pictures alone",
        "How light stronger than white is shown: cut off (none), or rolled off with its hue (neutral).",
        Cli(LIGHT, known=TONES),
    )
    environment: Environment | Numbers | str | PathLike[str] | None = opt(
        None,
        'light from all around, in place of the ambient light of materials: "sky" or "studio", a file with a picture '
        "of the whole sphere (see `load_environment`; OutputSettings itself takes no files), an `Environment`, or what "
        "that takes. Surfaces reflect it as they reflect lamps: diffuse * albedo * irradiance / pi, and specular * "
        "2 / (shininess + 1) * the mean radiance in a lobe of this shininess round the mirrored ray, so that specular "
        "(shininess + 1) / 2 mirrors it. It stands upright where up is known from a floor in the frame, up in its "
        "picture or the world's y in a scene; below a floor or a ground it is hidden. There are no lamps beside it, "
        "unless a light is given or a scene has its own. None is a scene's own, or none",
        f"Light from all around, in place of ambient light: {', '.join(NAMES)}, or a picture of the whole sphere (.hdr,"
        " .exr, .jpg, .png). Without --light there are no lamps beside it, except a scene's own.",
        Cli(LIGHT, "NAME|FILE", NAMES),
    )
    environment_intensity: float = opt(
        1.0, "factor on the environment", "Factor on the environment's light.", Cli(LIGHT, "N")
    )
    environment_rotation: float | Numbers = opt(
        0.0,
        "degrees by which the environment is turned about up, counterclockwise seen from above; or (3, 3), the "
        "rotation from world axes to those of the environment",
        "Degrees by which the environment is turned, counterclockwise seen from above.",
        Cli(LIGHT, "DEG"),
    )
    ambient_occlusion: bool | float | None = opt(
        None,
        "whether what is near hides a part of the ambient light and of the environment, never of lamps; a number is "
        "how far near reaches, world units; True is the median depth. None is True where more than a tenth of the "
        "light is of that kind",
        "Whether what is near hides a part of ambient light and environment; M: how far near reaches, metres. Default:"
        " auto, which is yes where they are more than a tenth of the light.",
        Cli(LIGHT, "auto|yes|no|M", tuple(OCCLUSION), read=occlusion_of, short="--ao"),
    )
    show: Show = opt(
        "light",
        'what colours stand for: "light", or "normals" (red right, green up, blue towards the viewer), "depth" along '
        'the viewer\'s axis (from blue, the nearest, to red, the farthest, even in 1/z), or "certainty" of the normals '
        "(from blue, certain, to red, an expected error of 30 degrees or more; of several frames also what nobody "
        "trusts). `Renderer.color_scale` has the range. These are pictures to look at: `render_depth` and "
        "`estimate_normals` return numbers",
        "What colours stand for: light, normals, depth (blue near, red far) or certainty of normals (blue certain).",
        Cli(PICTURE, known=SHOWS),
    )

    def __post_init__(self) -> None:
        object.__setattr__(self, "samples", check_samples(self.samples))
        object.__setattr__(self, "background", _check_background(self.background))
        object.__setattr__(self, "ground", _check_ground(self.ground))
        object.__setattr__(self, "ground_height", _check_height(self.ground_height, self.ground))
        object.__setattr__(self, "exposure", check_exposure(self.exposure))
        if self.fill is not None:
            object.__setattr__(self, "fill", check_number(self.fill, option("fill"), 0, 1))
        check_choice(option("tone"), self.tone, TONES)
        check_choice(option("show"), self.show, SHOWS)
        object.__setattr__(self, "environment", check_environment(self.environment))
        intensity = check_number(self.environment_intensity, option("environment_intensity"), 0)
        object.__setattr__(self, "environment_intensity", intensity)
        object.__setattr__(self, "environment_rotation", check_rotation(self.environment_rotation))
        object.__setattr__(self, "ambient_occlusion", check_occlusion(self.ambient_occlusion))

    @property
    def behind(self) -> Vector | None:
        """The background in linear RGB; None is transparent."""
        return cast("Vector | None", self.background)

    @property
    def is_plain(self) -> bool:
        """Return whether a single sample over nothing is the picture."""
        return self.samples == 1 and self.behind is None and self.ground is False and self.tone == "none"

    @property
    def is_light(self) -> bool:
        """Return whether colours stand for light."""
        return self.show == "light"

    @property
    def of_numbers(self) -> OutputSettings:
        """Return the finish of a picture whose colours stand for numbers; no light changes it."""
        dark = {"environment": None, "ambient_occlusion": False}
        return replace(self, ground=False, ground_height=None, exposure=0.0, fill=0.0, tone="none", **dark)

    @property
    def near(self) -> float:
        """Return how far things may be that hide light from all around, world units, where that is asked for."""
        wanted = self.ambient_occlusion
        return FAR_AS_SEEN if wanted is None or isinstance(wanted, bool) else wanted

    @property
    def of_passes(self) -> OutputSettings:
        """Return the finish of passes: linear light, as strong as the lights are, over nothing."""
        return replace(self, background=None, exposure=0.0, fill=0.0, tone="none", show="light")

    @property
    def up(self) -> Vector | None:
        """Which way is up on the ground, world axes; None is not known, or there is no ground."""
        return None if isinstance(self.ground, bool) else cast("Vector", self.ground)

    @property
    def options(self) -> dict[str, Any]:
        """Those that are not the default, by name, as arguments of `Renderer.render`."""
        return {f.name: value for f in fields(self) if (value := getattr(self, f.name)) != f.default}


def check_exposure(exposure: Any) -> float | Metering:
    """Return stops, or how they are found. Raises ValueError or TypeError for anything else."""
    if isinstance(exposure, str) and exposure in METERINGS:
        return exposure
    words = " or ".join(METERINGS)
    return check_float(
        exposure, f"{option('exposure')} must be stops from -{STOPS:g} to {STOPS:g}, {words}", -STOPS, STOPS
    )


def check_rotation(rotation: Any) -> float | tuple[Vector, Vector, Vector]:
    """Return degrees, or the rows of a rotation. Raises TypeError or ValueError for anything else."""
    if is_single(rotation):
        return check_number(rotation, option("environment_rotation"), -LARGEST, LARGEST)
    complaint = f"{option('environment_rotation')} must be degrees, or a rotation of shape (3, 3)"
    matrix = as_array(rotation, complaint)
    is_rotation = matrix.shape == (3, 3) and np.allclose(matrix @ matrix.T, np.eye(3), atol=1e-3)
    if not is_rotation or np.linalg.det(matrix) < 0:
        raise ValueError(f"{complaint}, got {shown(rotation)}")
    x, y, z = (check_point(row, "row") for row in matrix)
    return x, y, z


def check_occlusion(occlusion: Any) -> bool | float | None:
    """Return whether there is any, or its radius. Raises TypeError or ValueError for anything else."""
    if occlusion is None or is_a(occlusion, bool, np.bool_):
        return None if occlusion is None else bool(occlusion)
    radius = check_number(occlusion, option("ambient_occlusion"), 0)
    return radius if radius > 0 else False


def with_environment_turned(
    finish: OutputSettings, degrees: float, turn: NDArray[np.float64] | None = None
) -> OutputSettings:
    """Return a finish with its environment turned further, in degrees counterclockwise seen from above.

    turn  (3, 3) the same in world axes, for a rotation that is a matrix; None is about the environment's own up
    """
    if isinstance(finish.environment_rotation, float):
        return replace(finish, environment_rotation=(finish.environment_rotation + degrees) % 360)
    before = np.asarray(finish.environment_rotation)
    if turn is not None:
        return replace(finish, environment_rotation=before @ turn.T)
    cos, sin = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    back = np.array([[cos, 0, -sin], [0, 1, 0], [sin, 0, cos]])
    return replace(finish, environment_rotation=back @ before)


def _check_background(background: str | Numbers | None) -> Vector | None:
    if background is None:
        return None
    if not isinstance(background, str):
        return check_color(background, option("background"))
    if background == "transparent":
        return None
    try:
        return linear_color(background)
    except ValueError as error:
        raise ValueError(f"{option('background')}: {error}") from None


def _check_ground(ground: Any) -> bool | Vector:
    return ground if isinstance(ground, bool) else check_direction(ground, "ground")


def _check_height(height: Any, ground: bool | Numbers) -> float | None:
    if height is None:
        return None
    if ground is False:
        raise ValueError(f"{option('ground_height')} is that of a ground: pass {option('ground', True)}, too")
    return check_number(height, option("ground_height"), -LARGEST, LARGEST)


SIMPLE = OutputSettings()
