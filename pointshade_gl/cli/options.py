"""The options of the command line, each declared once: as a field of a group, or as a type of its own.

A command takes whole groups as parameters; `spread` shows their fields to Typer as single options.
"""

from __future__ import annotations

import inspect
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import MISSING, dataclass, fields, is_dataclass
from functools import wraps
from pathlib import Path
from typing import Annotated, Any, get_type_hints

import typer

from ..files.access.content import MAX_PIXELS, allow_overwriting
from ..files.access.known_names import DEPTH_MAPS, FILMS, FOUND_POSES, IMAGES, NORMALS, POINTS, RENDERED
from ..files.clouds.cloud_columns import COLOR_BY
from ..files.depth.depth_kinds import KINDS
from ..files.depth.scale_over_time import SCALES
from ..files.networks.model_options import PIXELS
from ..notes.notes import silence
from ..notes.words import option
from ..scene.appearance import Look
from ..scene.cloud import UPS
from ..scene.light import Light
from ..scene.option_fields import CAMERA, CLOUD, FILM, LIGHT, NETWORK, PAGE, PICTURE, READING, SETS, VIEW, WINDOW
from ..scene.settings import SIMPLE, Finish
from ..scene.viewpoint import SIZES, TURNTABLES, View
from .help import complete_input
from .option_groups import check_exist, check_input, cli_option, group_of, pose_from, size_from, typed


def _output(suffixes: tuple[str, ...], help: str = "The file to write, such as out.png") -> Any:
    return typer.Option("-o", "--output", metavar="FILE", help=f"{help}; it ends with {', '.join(suffixes)}.")


NoOutput = Annotated[Path | None, typer.Option("-o", "--output", hidden=True, help="Of `pointshade render`.")]
RenderOutput = Annotated[
    Path | None, _output(RENDERED, "The file to write, such as out.png (default: a new one here, called like INPUT)")
]
NormalsOutput = Annotated[Path, _output((*NORMALS, *POINTS))]
DepthOutput = Annotated[Path, _output(DEPTH_MAPS)]
AlbedoOutput = Annotated[Path, _output(IMAGES)]
PosesOutput = Annotated[Path, _output(FOUND_POSES, "The file to write, such as poses.json")]
SheetOutput = Annotated[Path | None, _output(IMAGES, "Also write a contact sheet (colour, depth, normals, lit)")]
Device = Annotated[int, typer.Option(metavar="N", help="Which GPU to use (Linux).")]
Small = Annotated[bool, typer.Option("--small", help="Take longer to write a smaller PNG.", rich_help_panel=PICTURE)]
Views = Annotated[
    str | None,
    typer.Option(
        metavar="N|all|N,N...",
        help="Merge N evenly chosen frames of a sequence with poses, or all, or those with these numbers, into one "
        "object.",
        rich_help_panel=SETS,
    ),
]
UnlightAll = Annotated[
    bool,
    typer.Option(
        "--unlight-all",
        help="The frames of INPUT are photographs of one view, each under its own light: draw their common albedo.",
        rich_help_panel=LIGHT,
    ),
]
MoreInputs = Annotated[
    list[str] | None,
    typer.Argument(
        metavar="MORE",
        help="More folders with frames of the same thing, with poses (or see --poses): all play at once, merged into "
        "one object. Or more point clouds, which lie in one world.",
        autocompletion=complete_input,
    ),
]
Quiet = Annotated[
    bool,
    typer.Option(
        "--quiet", callback=lambda wanted: silence() if wanted else None, is_eager=True, help="Print no notes."
    ),
]
Overwrite = Annotated[
    bool,
    typer.Option(
        "--overwrite",
        callback=lambda wanted: allow_overwriting() if wanted else None,
        help="Write over a file that is read as an input, too.",
    ),
]
Axes = Annotated[
    str | None,
    typer.Option(
        metavar="NAME",
        help="What x, y, z or red, green, blue are: opencv (right, down, forward), opengl (right, up, towards the "
        "viewer) or directx (right, down, towards the viewer). Default: opencv in .npy, opengl elsewhere. In the .ply "
        "of a point cloud opencv, opengl or blender (right, forward, up); default: the cloud's own.",
        rich_help_panel=PICTURE,
    ),
]
PointAxes = Annotated[
    str | None,
    typer.Option(
        "--axes",
        metavar="opencv|opengl|blender",
        help="What x, y, z are in a .ply: opencv (right, down, forward, the world of the poses of frames), opengl "
        "(right, up, towards the viewer, as in MeshLab) or blender (right, forward, up). Default: opengl of frames, "
        "of a point cloud its own.",
        rich_help_panel=PAGE,
    ),
]
Bits = Annotated[int, typer.Option(metavar="8|16", help="Bits of a colour in a .png.", rich_help_panel=PICTURE)]


def _show_all(context: typer.Context, wanted: bool) -> None:
    if wanted:
        from .help import show_help

        show_help(context.command, context, everything=True)
        raise typer.Exit


HelpAll = Annotated[
    bool, typer.Option("--help-all", callback=_show_all, is_eager=True, help="Show all options, in groups, and exit.")
]
Explain = Annotated[
    bool,
    typer.Option(
        "--explain",
        help="Print which estimator ran, and why; of --views also what they agree on, of --align the corrections.",
    ),
]


@dataclass(frozen=True)
class InputOptions:
    """What is read."""

    input: Annotated[
        str | None,
        typer.Argument(
            metavar="INPUT",
            help="A folder with a depth and a colour picture and their camera, or with a sequence of them; a depth "
            "file; or 'vase', which is built in. For render, depth and view also a scene: .gltf, .glb or 'demo'. For "
            "all but albedo and align also a point cloud: .ply, .pcd, .xyz, .las, .laz, .e57, .npy...",
            autocompletion=complete_input,
            callback=check_input,
        ),
    ] = None
    color: str | None = cli_option("Colour picture.", metavar="FILE", panel=READING)
    depth: str | None = cli_option("Depth picture.", metavar="FILE", panel=READING)
    poses: str | None = cli_option(
        "Poses of the frames, in place of those in INPUT; of several INPUTs one pose for each, by name or in order.",
        metavar="FILE",
        panel=READING,
    )


@dataclass(frozen=True)
class ReadingOptions:
    """How depth, camera and names in files are to be understood."""

    intrinsics: str | None = cli_option("Camera of the depth picture.", metavar="FILE|fx,fy,cx,cy", panel=CAMERA)
    fov: float | None = cli_option("Vertical field of view, instead of intrinsics.", metavar="DEG", panel=CAMERA)
    depth_scale: float | None = cli_option("Depth units per metre (1000: millimetres).", metavar="N", panel=CAMERA)
    depth_kind: str | None = cli_option(
        f"What depth values are: {', '.join(KINDS)}. Those of a network are often inverse.",
        metavar="KIND",
        known=KINDS,
        panel=CAMERA,
    )
    baseline: float | None = cli_option("Metres between the two cameras, for disparity.", metavar="M", panel=CAMERA)
    allow_outside: bool = cli_option(
        "Let files name others outside their folder.", "--allow-outside", default=False, panel=READING
    )
    depth_model: str | None = cli_option(
        "INPUT is a photograph, a video or a folder of photographs: an .onnx network makes its depth (extra 'onnx').",
        metavar="FILE",
        panel=NETWORK,
    )
    model_size: str | None = cli_option(
        "Pixels of the network's input, or of its shorter side, where its file does not say them.",
        metavar="WxH|N",
        panel=NETWORK,
    )
    model_pixels: str | None = cli_option(
        f"What the network's pixels are: {', '.join(PIXELS)}.", metavar="KIND", known=PIXELS, panel=NETWORK
    )
    cache: bool = cli_option(
        "Keep the network's depth in a folder .pointshade beside the photograph.",
        "--cache",
        default=False,
        panel=NETWORK,
    )
    scale_frames: str | None = cli_option(
        "Of a film whose depth has no scale: find one for all frames (auto, the default), or keep each by itself.",
        metavar="auto|keep",
        known=SCALES,
        panel=NETWORK,
    )
    max_pixels: int = cli_option(
        "Pixels a picture may have; scales all limits.", metavar="N", default=MAX_PIXELS, panel=READING
    )


@dataclass(frozen=True)
class CloudGroup:
    """How a point cloud is to be understood."""

    up: str | None = cli_option("Of a point cloud: which axis points up.", metavar="AXIS", known=UPS, panel=CLOUD)
    color_by: str | None = cli_option(
        f"Of a point cloud: where its colours are from, {', '.join(COLOR_BY)}.",
        metavar="WHAT",
        known=COLOR_BY,
        panel=CLOUD,
    )
    most: int | None = cli_option(
        "Of a point cloud: read N points at most, an even sample.", metavar="N", min=1, panel=CLOUD
    )

    @property
    def cloud_options(self) -> dict[str, Any]:
        """Those that were typed, by name."""
        typed = {field.name: getattr(self, field.name) for field in fields(CloudGroup)}
        return {name: value for name, value in typed.items() if value is not None}


@dataclass(frozen=True)
class FrameOptions(CloudGroup, ReadingOptions, InputOptions):
    """What is read, and what its depth means."""

    frame: str | None = cli_option(
        "One frame of a sequence, counted from 0; of several INPUTs one number for each.",
        metavar="N[,N...]",
        panel=READING,
    )

    @property
    def load_options(self) -> dict[str, Any]:
        """All about frames but what is read, by name, as arguments of `load_frame`; a switch that is off is None."""
        others = "input", "frame", *(field.name for field in fields(CloudGroup))
        found = {field.name: getattr(self, field.name) for field in fields(self) if field.name not in others}
        return {name: None if value is False else value for name, value in found.items()}

    def check_exist(self) -> None:
        """Raises FileNotFoundError if one of the files does not exist."""
        names = "color", "depth", "poses", "intrinsics", "depth_model"
        check_exist(self.input, **{name: getattr(self, name) for name in names})


_PLACE, _SIZE = typed(View, (VIEW,)), typed(View, (PICTURE,))


@dataclass(frozen=True)
class PlaceOptions(group_of(_PLACE)):
    """From where objects are seen."""

    zoom: float | None = cli_option(
        "In place of --dolly: how many times as large the object is seen.", metavar="N", panel=VIEW
    )

    def place(self) -> dict[str, Any]:
        """Pose, yaw, pitch and dolly that were typed, by these names. Raises ValueError or OSError."""
        pose = {} if self.pose is None else {"pose": pose_from(self.pose)}
        return self.values_of(View) | pose | ({} if self.zoom is None else {"dolly": self._dolly(self.zoom)})

    def _dolly(self, zoom: float) -> float:
        if self.dolly:
            raise ValueError(f"pass {option('zoom')} or {option('dolly')}, not both: each says how near the camera is")
        if not 0 < zoom < math.inf:
            raise ValueError(f"{option('zoom')} must be above 0, such as 2 for twice as large, got {zoom:g}")
        return 1 - 1 / zoom


@dataclass(frozen=True)
class ViewOptions(group_of(_SIZE), PlaceOptions):
    """From where objects are seen, and how large the picture is."""

    def view(self, look: Look, lights: Sequence[Light] = (), finish: Finish = SIMPLE) -> View:
        """The View, with a look, lights and a finish. Raises ValueError or OSError."""
        size = size_from(self.picture_size, "picture_size", SIZES)
        return View(lights, look=look, finish=finish, **self.place() | {"picture_size": size})


@dataclass(frozen=True)
class FilmOptions:
    """What a film or a series of pictures shows."""

    turntable: str | None = cli_option(
        "Make a film in which the light or the camera moves around the object. The camera goes all around (360), or 25 "
        "degrees to either side and back (swing, or other degrees). camera: a swing of a single frame, else 360.",
        metavar="light|camera|swing[:DEG]|360",
        known=TURNTABLES,
        panel=FILM,
    )
    frames: int | None = cli_option(
        "Pictures of a turntable (default 75), or only the first N of a sequence.", metavar="N", min=1, panel=FILM
    )
    fps: float = cli_option("Pictures per second.", metavar="N", default=25.0, panel=FILM)


_SEEN = [one for one in typed(Finish, (PICTURE,), None) if one[0] in ("samples", "exposure", "show")]


@dataclass(frozen=True)
class WindowOptions(group_of(_SEEN)):
    """The window of `pointshade view`."""

    window_size: str | None = cli_option(
        "Size of the window.", "--window-size", "--picture-size", metavar="WxH", panel=WINDOW
    )
    panel: bool = cli_option("Open the panel (needs the extra 'gui').", "--panel", default=False, panel=WINDOW)
    fps: str = cli_option(
        "Frames of a sequence per second; of several INPUTs also one number for each.",
        metavar="N[,N...]",
        default="30",
        panel=WINDOW,
    )
    record: Path | None = cli_option(
        f"Record the window as a film: {' or '.join(FILMS)}.", metavar="FILE", panel=WINDOW
    )


@dataclass(frozen=True)
class BenchOptions:
    """What `pointshade bench` measures."""

    output: Path = cli_option("Where to write.", "-o", "--output", metavar="FOLDER", default=Path("bench"))
    quick: bool = cli_option("Smaller pictures, fewer scenes: under a minute.", "--quick", default=False)
    only: list[str] | None = cli_option("Only this method, condition or stress; repeatable.", metavar="NAME")
    images: bool = cli_option(
        "Also measure lit pictures: estimators, forms, samples. In a clone only.", "--images", default=False
    )
    speed: bool = cli_option("Measure speed instead: stages, points, merging.", "--speed", default=False)
    against: str | None = cli_option(
        "With --speed: only compare with a commit, or with an older speed.json. In a clone only.", metavar="REV|FILE"
    )
    views: bool = cli_option(
        "Measure several views of one thing instead: normals, flicker, cost. In a clone only.", "--views", default=False
    )
    seed: int = cli_option("Seed of the noise and the holes.", metavar="N", min=0, default=0)


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
    return inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, annotation=kind, default=default)


def _taken(name: str, kind: Any, given: dict[str, Any]) -> Any:
    """The value of an option, or the group of those of its fields, taken out of what was given."""
    if not (isinstance(kind, type) and is_dataclass(kind)):
        return given.pop(name)
    types = get_type_hints(kind)
    return kind(**{one.name: _taken(one.name, types[one.name], given) for one in fields(kind)})
