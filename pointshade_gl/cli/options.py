"""The options of the command line, each declared once: as a field of a group, or as a type of its own.

A command takes whole groups as parameters; `spread` shows their fields to Typer as single options.
"""

from __future__ import annotations

import inspect
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import MISSING, dataclass, fields, is_dataclass, replace
from functools import wraps
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, cast, get_type_hints

import typer

from ..files.access.content import MAX_PIXELS, allow_overwriting
from ..files.access.known_names import DEPTH_MAPS, FILMS, FOUND_POSES, IMAGES, NORMALS, POINTS, RENDERED, VASE
from ..files.cameras.lenses import PROJECTIONS
from ..files.clouds.cloud_columns import COLOR_BY
from ..files.depth.depth_kinds import KINDS
from ..files.depth.scale_over_time import SCALES
from ..files.input_kinds import Kind
from ..files.networks.model_options import PIXELS
from ..files.writing.film import BACKGROUND
from ..notes.notes import silence
from ..notes.words import option
from ..scene import option_fields as panels
from ..scene.appearance import Appearance
from ..scene.cloud import UPS
from ..scene.environment import Environment
from ..scene.light import Light
from ..scene.option_fields import Cli
from ..scene.settings import SIMPLE, OutputSettings
from ..scene.viewpoint import SIZES, TURNTABLES, View
from . import option_groups as groups
from .help import complete_input
from .option_groups import FieldOptions, cli_option, flag_of, option_info, typed

if TYPE_CHECKING:
    from ..page.parts import QualityName

QUALITIES = "exact", "small"  # of page/parts.py, which imports NumPy


def _output(suffixes: tuple[str, ...], help: str = "The file to write, such as out.png") -> Any:
    return option_info(f"{help}; it ends with {', '.join(suffixes)}.", Cli("", "FILE"), "-o", "--output")


NoOutput = Annotated[Path | None, typer.Option("-o", "--output", hidden=True, help="Of `pointshade render`.")]
RenderOutput = Annotated[
    Path | None, _output(RENDERED, "The file to write, such as out.png (default: a new one here, called like INPUT)")
]
NormalsOutput = Annotated[Path, _output((*NORMALS, *POINTS))]
DepthOutput = Annotated[Path, _output(DEPTH_MAPS)]
AlbedoOutput = Annotated[Path, _output(IMAGES)]
PosesOutput = Annotated[Path, _output(FOUND_POSES, "The file to write, such as poses.json")]
SheetOutput = Annotated[Path | None, _output(IMAGES, "Also write a contact sheet (colour, depth, normals, lit)")]
Device = Annotated[int, option_info("Which GPU to use (Linux).", Cli("", "N"))]
Quiet = Annotated[
    bool, option_info("Print no notes.", Cli(), callback=lambda wanted: silence() if wanted else None, is_eager=True)
]
Overwrite = Annotated[
    bool,
    option_info(
        "Write over a file that is read as an input, too.",
        Cli(),
        callback=lambda wanted: allow_overwriting() if wanted else None,
    ),
]
Axes = Annotated[
    str | None,
    option_info(
        "What x, y, z or red, green, blue are: opencv (right, down, forward), opengl (right, up, towards the "
        "viewer) or directx (right, down, towards the viewer). Default: opencv in .npy, opengl elsewhere. In the .ply "
        "of a point cloud opencv, opengl or blender (right, forward, up); default: the cloud's own.",
        Cli(panels.PICTURE, "NAME"),
    ),
]
Bits = Annotated[int, option_info("Bits of a colour in a .png.", Cli(panels.PICTURE, "8|16"))]
Explain = Annotated[
    bool,
    option_info(
        "Print which estimator ran, and why; of --views also what they agree on, of --align the corrections.", Cli()
    ),
]


@dataclass(frozen=True)
class RunOptions:
    """What every command has that draws and writes."""

    overwrite: Overwrite = False
    device: Device = 0
    quiet: Quiet = False


@dataclass(frozen=True)
class InputOptions:
    """What is read."""

    input: Annotated[
        str | None,
        typer.Argument(
            metavar="INPUT",
            help="A folder with a depth and a colour picture and their camera, or with a sequence of them; a depth "
            "file; or what is built in: 'vase', 'vase/whole' from all sides. For render, depth and view also a scene: "
            ".gltf, .glb or 'demo'. For all but albedo and align also a point cloud: .ply, .pcd, .xyz, .las, .e57...",
            autocompletion=complete_input,
            callback=groups.check_input,
        ),
    ] = None
    color: str | None = cli_option("Colour picture.", Cli(panels.READING, "FILE"))
    depth: str | None = cli_option("Depth picture.", Cli(panels.READING, "FILE"))
    poses: str | None = cli_option(
        "Poses of the frames, in place of those in INPUT; of several INPUTs one pose for each, by name or in order.",
        Cli(panels.READING, "FILE"),
    )


@dataclass(frozen=True)
class ReadingOptions:
    """How depth, camera and names in files are to be understood."""

    intrinsics: str | None = cli_option("Camera of the depth picture.", Cli(panels.CAMERA, "FILE|fx,fy,cx,cy"))
    fov: float | None = cli_option("Vertical field of view, instead of intrinsics.", Cli(panels.CAMERA, "DEG"))
    depth_scale: float | None = cli_option("Depth units per metre (1000: millimetres).", Cli(panels.CAMERA, "N"))
    depth_kind: str | None = cli_option(
        f"What depth values are: {', '.join(KINDS)}. Those of a network are often inverse.",
        Cli(panels.CAMERA, "KIND", KINDS),
    )
    projection: str | None = cli_option(
        "How the pictures show the world: pinhole (straight already), lens (as the camera's file says), fisheye, "
        "equirectangular (a panorama).",
        Cli(panels.CAMERA, known=PROJECTIONS),
    )
    baseline: float | None = cli_option("Metres between the two cameras, for disparity.", Cli(panels.CAMERA, "M"))
    near: float | None = cli_option(
        "Metres of a depth buffer's near plane, where it is 0; of reversed depth, where it is 1; of the largest value "
        "of inverse depth.",
        Cli(panels.CAMERA, "M"),
    )
    far: float | None = cli_option(
        "Metres of the far plane, at the other end; may be inf. Of a buffer of reversed z the two are exchanged.",
        Cli(panels.CAMERA, "M"),
    )
    channel: str | None = cli_option(
        "Which channel of the depth's file is depth: its name, or its number from 0.", Cli(panels.CAMERA, "NAME")
    )
    allow_outside: bool = cli_option("Let files name others outside their folder.", Cli(panels.READING), default=False)
    depth_model: str | None = cli_option(
        "INPUT is a photograph, a video or a folder of photographs: an .onnx network makes its depth (extra 'onnx').",
        Cli(panels.NETWORK, "FILE"),
    )
    model_size: str | None = cli_option(
        "Pixels of the network's input, or of its shorter side, where its file does not say them.",
        Cli(panels.NETWORK, "WxH|N"),
    )
    model_pixels: str | None = cli_option(
        f"What the network's pixels are: {', '.join(PIXELS)}.", Cli(panels.NETWORK, "KIND", PIXELS)
    )
    cache: bool = cli_option(
        "Keep the network's depth in a folder .pointshade beside the photograph.", Cli(panels.NETWORK), default=False
    )
    scale_frames: str | None = cli_option(
        "Of a film whose depth has no scale: find one for all frames (auto, the default), or keep each by itself.",
        Cli(panels.NETWORK, known=SCALES),
    )
    max_pixels: int = cli_option(
        "Pixels a picture may have; scales all limits.", Cli(panels.READING, "N"), default=MAX_PIXELS
    )


@dataclass(frozen=True)
class CloudGroup:
    """How a point cloud is to be understood."""

    up: str | None = cli_option("Of a point cloud: which axis points up.", Cli(panels.CLOUD, "AXIS", UPS))
    color_by: str | None = cli_option(
        f"Of a point cloud: where its colours are from, {', '.join(COLOR_BY)} or any field of the file, which "
        "`pointshade info` lists; a picture gets a legend.",
        Cli(panels.CLOUD, "FIELD"),
    )
    color_range: str | None = cli_option(
        "Of a point cloud: the numbers that get the first and the last colour of --color-by.",
        Cli(panels.CLOUD, "LOW,HIGH"),
    )
    columns: str | None = cli_option(
        "Of a point cloud: what the columns of its file are, such as x,y,z,nx,ny,nz,label; _ passes one over.",
        Cli(panels.CLOUD, "NAME,NAME..."),
    )
    all_points: bool = cli_option(
        "Of a point cloud: keep what the file marks as noise or withheld, and returns at 0,0,0 that never came.",
        Cli(panels.CLOUD),
        default=False,
    )
    most: int | None = cli_option(
        "Of a point cloud: read N points at most, an even sample.", Cli(panels.CLOUD, "N"), min=1
    )

    crop: str | None = cli_option(
        "Of a point cloud: two opposite corners of a box, in the file's coordinates; what lies outside is left out.",
        Cli(panels.CLOUD, "X,Y,Z,X,Y,Z"),
    )
    clean: bool = cli_option(
        "Of a point cloud: leave out stray points, which are few and far from all others.",
        Cli(panels.CLOUD),
        default=False,
    )
    seen_from: list[str] | None = cli_option(
        "Of a point cloud: where its scanner stood, in the file's coordinates; estimated normals point there. "
        "Repeatable.",
        Cli(panels.CLOUD, "X,Y,Z"),
    )

    @property
    def cloud_options(self) -> dict[str, Any]:
        """Those that were typed, by name. Raises ValueError for texts that are no range or no places."""
        typed = {one.name: getattr(self, one.name) for one in fields(CloudGroup)}
        given = {name: value for name, value in typed.items() if value not in (None, False)}
        if self.color_range is not None:
            given["color_range"] = groups.range_from(self.color_range, "color_range")
        return given | {name: groups.places_from(given[name], name) for name in ("crop", "seen_from") if name in given}


@dataclass(frozen=True)
class FrameOptions(CloudGroup, ReadingOptions, InputOptions):
    """What is read, and what its depth means."""

    frame: str | None = cli_option(
        "One frame of a sequence, counted from 0; of several INPUTs one number for each.",
        Cli(panels.READING, "N[,N...]"),
    )

    @property
    def load_options(self) -> dict[str, Any]:
        """All about frames but what is read, by name, as arguments of `load_frame`; a switch that is off is None."""
        others = "input", "frame", *(one.name for one in fields(CloudGroup))
        return {name: None if value is False else value for name, value in vars(self).items() if name not in others}

    @property
    def named(self) -> FrameOptions:
        """The options themselves, or if they name nothing to read, with the built-in frame as INPUT."""
        return self if self.input or self.depth or self.color else replace(self, input=VASE)

    @property
    def title(self) -> str:
        """What is read, as it was typed."""
        named = self.named
        return str(named.input or named.depth or named.color)

    @property
    def kind(self) -> Kind:
        return Kind.of(self.input)

    @property
    def holds_points(self) -> bool:
        """Whether INPUT is a point cloud, or a mesh, whose vertices are points."""
        from ..files.clouds.load_cloud import is_mesh

        return self.kind is Kind.CLOUD or is_mesh(self.input)

    def check_exist(self) -> None:
        """Raises FileNotFoundError if one of the files does not exist."""
        names = "color", "depth", "poses", "intrinsics", "depth_model"
        groups.check_exist(self.input, **{name: getattr(self, name) for name in names})


@dataclass(frozen=True)
class MoreOptions:
    """What is drawn together with INPUT, or of it, as one object."""

    more: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="MORE",
            help="More folders with frames of the same thing, with poses (or see --poses): all play at once, merged "
            "into one object. Or more point clouds, meshes, scenes and frames, which lie in one world.",
            autocompletion=complete_input,
        ),
    ] = None
    views: str | None = cli_option(
        "Merge N evenly chosen frames of a sequence with poses, or all, or those with these numbers, into one object.",
        Cli(panels.SETS, "N|all|N,N..."),
    )

    @property
    def is_set(self) -> bool:
        """Whether several frames, or clouds, are drawn as one object."""
        return bool(self.more) or self.views is not None


_POSE, *_TURNS = typed(View, panels.VIEW)


@dataclass(frozen=True)
class PlaceOptions(groups.group_of([*_TURNS, _POSE])):
    """From where objects are seen."""

    zoom: float | None = cli_option(
        "In place of --dolly: how many times as large the object is seen.", Cli(panels.VIEW, "N")
    )

    def place(self) -> dict[str, Any]:
        """Pose, yaw, pitch and dolly that were typed, by these names. Raises ValueError or OSError."""
        pose = {} if self.pose is None else {"pose": groups.pose_from(self.pose)}
        return self.values_of(View) | pose | ({} if self.zoom is None else {"dolly": self._dolly(self.zoom)})

    def _dolly(self, zoom: float) -> float:
        if self.dolly:
            raise ValueError(f"pass {option('zoom')} or {option('dolly')}, not both: each says how near the camera is")
        if not 0 < zoom < math.inf:
            raise ValueError(f"{option('zoom')} must be above 0, such as 2 for twice as large, got {zoom:g}")
        return 1 - 1 / zoom


@dataclass(frozen=True)
class ViewOptions(groups.group_of(typed(View, panels.PICTURE)), PlaceOptions):
    """From where objects are seen, and how large the picture is."""

    def view(self, look: Appearance, lights: Sequence[Light] = (), finish: OutputSettings = SIMPLE) -> View:
        """The View, with a look, lights and a finish. Raises ValueError or OSError."""
        size = groups.size_from(self.picture_size, "picture_size", SIZES)
        return View(lights, look=look, finish=finish, **self.place() | {"picture_size": size})


@dataclass(frozen=True)
class EnvironmentOptions(groups.group_of(typed(OutputSettings, panels.LIGHT, is_needed=False))):
    """Light from all around, and how light above white is shown."""

    @classmethod
    def of(cls, finish: OutputSettings) -> EnvironmentOptions:
        """What is typed for a finish, as far as words express it; its values need not be texts."""
        values = {one.name: finish.options.get(one.name) for one in fields(cls)}
        return cls(**{name: _as_typed(value) for name, value in values.items()})

    def chosen(self) -> dict[str, Any]:
        """The values that were typed, by the names of the fields of OutputSettings. Raises ValueError or OSError."""
        from ..files.pictures.hdr_files import find_environment

        chosen = self.values_of(OutputSettings)
        return chosen if self.environment is None else chosen | {"environment": find_environment(self.environment)}


def _as_typed(value: Any) -> Any:
    """The value as it is typed; None: no words express it."""
    if isinstance(value, Environment):
        return value.name or None
    if isinstance(value, bool):
        return "yes" if value else "no"
    return None if isinstance(value, tuple) else value


# what lies behind a picture in formats without alpha
_OPAQUE = {".jpg": "black", ".jpeg": "black"} | dict.fromkeys(FILMS, "#{:02x}{:02x}{:02x}".format(*BACKGROUND))


@dataclass(frozen=True)
class PictureOptions(groups.group_of(typed(OutputSettings, panels.PICTURE, is_needed=False)), EnvironmentOptions):
    """How a picture is finished."""

    def finish(self, output: Path, samples: int) -> OutputSettings:
        """The settings of pictures. Raises ValueError for values that do not fit the output. samples: unless typed."""
        suffix, chosen = output.suffix.lower(), self.chosen()
        if self.background == "transparent" and suffix in _OPAQUE:
            raise ValueError(f"{output} cannot be transparent: write a .png, or leave out {option('background')}")
        chosen.setdefault("samples", samples)
        if chosen["samples"] > 1 or self.ground:
            chosen.setdefault("background", _OPAQUE.get(suffix))
        return OutputSettings(**{"exposure": "sensor", **chosen})


@dataclass(frozen=True)
class PageOptions(FieldOptions):
    """How a page is written."""

    about, way_out = "page", ", or write an .html"

    quality: str | None = cli_option(
        "Of an .html: exact, or small (a third smaller, colours as JPEG).", Cli(panels.PAGE, "NAME", QUALITIES)
    )
    title: str | None = cli_option("Of an .html. Default: INPUT.", Cli(panels.PAGE, "TEXT"))

    @property
    def exactness(self) -> QualityName:
        """The quality that was typed, or the first."""
        return cast("QualityName", self.quality or QUALITIES[0])


@dataclass(frozen=True)
class FilmOptions:
    """What a film or a series of pictures shows."""

    turntable: str | None = cli_option(
        "Make a film in which the light or the camera moves around the object. The camera goes all around (360), or 25 "
        "degrees to either side and back (swing, or other degrees). camera: a swing of a single frame, else 360. With "
        "--temporal the frames of a sequence play meanwhile, else its first one is shown.",
        Cli(panels.FILM, "light|camera|swing[:DEG]|360", TURNTABLES),
    )
    frames: int | None = cli_option(
        "Pictures of a turntable (default 75), or only the first N of a sequence.", Cli(panels.FILM, "N"), min=1
    )
    fps: float = cli_option("Pictures per second.", Cli(panels.FILM, "N"), default=25.0)


@dataclass(frozen=True)
class WindowOptions(
    groups.group_of(
        one
        for one in typed(OutputSettings, panels.PICTURE, is_needed=False)
        if one[0] in ("samples", "exposure", "fill", "show")
    )
):
    """The window of `pointshade view`."""

    window_size: str | None = cli_option(
        "Size of the window.", Cli(panels.WINDOW, "WxH"), "--window-size", "--picture-size"
    )
    panel: bool = cli_option("Open the panel (needs the extra 'gui').", Cli(panels.WINDOW), default=False)
    fps: str = cli_option(
        "Frames of a sequence per second; of several INPUTs also one number for each.",
        Cli(panels.WINDOW, "N[,N...]"),
        default="30",
    )
    record: Path | None = cli_option(f"Record the window as a film: {' or '.join(FILMS)}.", Cli(panels.WINDOW, "FILE"))


@dataclass(frozen=True)
class BenchOptions:
    """What `pointshade bench` measures."""

    output: Path = cli_option("Where to write.", Cli("", "FOLDER"), "-o", "--output", default=Path("bench"))
    quick: bool = cli_option("Smaller pictures, fewer scenes: under a minute.", Cli(), default=False)
    only: list[str] | None = cli_option("Only this method, condition or stress; repeatable.", Cli("", "NAME"))
    images: bool = cli_option(
        "Also measure lit pictures: estimators, forms, samples. In a clone only.", Cli(), default=False
    )
    speed: bool = cli_option("Measure speed instead: stages, points; in a clone merging, too.", Cli(), default=False)
    against: str | None = cli_option(
        "With --speed: only compare with a commit, or with an older speed.json. In a clone only.", Cli("", "REV|FILE")
    )
    views: bool = cli_option(
        "Measure several views of one thing instead: normals, flicker, cost. In a clone only.", Cli(), default=False
    )
    seed: int = cli_option("Seed of the noise and the holes.", Cli("", "N"), min=0, default=0)


def _show_all(context: typer.Context, wanted: bool) -> None:
    if wanted:
        from .help import show_help

        show_help(context.command, context, everything=True)
        raise typer.Exit


HelpAll = Annotated[
    bool, option_info("Show all options, in groups, and exit.", Cli(), callback=_show_all, is_eager=True)
]


def spread(command: Callable[..., None]) -> Callable[..., None]:
    """The command as Typer wants it: for each parameter that is a group, one parameter per field of the group.

    A field may be a group itself. There is also --help-all.
    """
    asked = inspect.signature(command, eval_str=True).parameters
    options = [option for one in asked.values() for option in _options_in(one.name, one.annotation, one.default)]
    options.append(_option("help_all", HelpAll, False))

    @wraps(command)
    def with_options(help_all: bool, **given: Any) -> None:
        command(**{name: _taken(name, one.annotation, given) for name, one in asked.items()})

    with_options.__signature__ = inspect.Signature(options)  # type: ignore[attr-defined]
    with_options.__annotations__ = {option.name: option.annotation for option in options}
    return with_options


def _options_in(name: str, kind: Any, default: Any) -> Iterator[inspect.Parameter]:
    """The options of a group, or the one that is none."""
    if not is_dataclass(kind):
        yield _option(name, kind, default)
        return
    types = get_type_hints(kind, include_extras=True)
    for one in fields(kind):
        how, own = one.metadata.get("typer"), types[one.name]
        empty = inspect.Parameter.empty if one.default is MISSING else one.default
        yield from _options_in(one.name, Annotated[own, how] if how else own, empty)


def _option(name: str, kind: Any, default: Any) -> inspect.Parameter:
    for how in getattr(kind, "__metadata__", ()):
        if default is False and how.default is ... and not how.param_decls:  # unnamed: Typer would add --no-NAME
            how.param_decls = (flag_of(name),)
    return inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, annotation=kind, default=default)


def _taken(name: str, kind: Any, given: dict[str, Any]) -> Any:
    """The value of an option, or the group of those of its fields, taken out of what was given."""
    if not (isinstance(kind, type) and is_dataclass(kind)):
        return given.pop(name)
    types = get_type_hints(kind)
    return kind(**{one.name: _taken(one.name, types[one.name], given) for one in fields(kind)})
