"""How frames and scenes are seen: from where, under which lights, and as turntables."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal, TypedDict, get_args

import numpy as np
from numpy.typing import NDArray

from ..checks.arguments import check_choice, check_size, check_type
from ..checks.foreign_arrays import Numbers
from ..notes.words import option
from .appearance import Appearance
from .camera import Camera, check_pose, check_turns, orbit_pose
from .frame import Frame
from .graph import Scene
from .light import Light, check_lights, transformed
from .option_fields import PICTURE, VIEW, Cli, opt, option_class
from .settings import SIMPLE, OutputSettings, with_environment_turned
from .values import Options

SizeName = Literal["depth", "color", "half"]
SIZES: tuple[SizeName, ...] = get_args(SizeName)


class MoveOptions(TypedDict, total=False):
    """The options of a View that move its camera."""

    yaw: float
    pitch: float
    dolly: float


@option_class
@dataclass(frozen=True, eq=False)
class View(Options):
    """From where, under which lights and how everything is drawn; the same for all pictures of a film.

    Raises
    ------
    TypeError, ValueError
        for anything else
    """

    lights: Sequence[Light] = opt((), "empty: the default light, or a scene's own")
    pose: Numbers | None = opt(
        None,
        "(4, 4) camera-to-world of the camera that looks; None: the frame's own, moved by yaw, pitch and dolly",
        "Camera-to-world, instead of yaw, pitch and dolly: a matrix of 4x4 or 3x4, or a place and a quaternion, "
        "in a file or here.",
        Cli(VIEW, "FILE|tx,ty,tz,qx,qy,qz,qw"),
    )
    yaw: float = opt(
        0.0,
        "degrees to the right by which the frame's own camera moves around its pivot, as in `orbit_pose`; not "
        "with a pose",
        "Degrees by which the camera moves to its right around the object, as VTK's azimuth.",
        Cli(VIEW, "DEG", short="--azimuth"),
    )
    pitch: float = opt(
        0.0,
        "degrees upwards, as yaw",
        "Degrees by which it moves upwards, as VTK's elevation.",
        Cli(VIEW, "DEG", short="--elevation"),
    )
    dolly: float = opt(
        0.0,
        "share of the way to the pivot, as yaw; below 0 moves away",
        "Share of the way to the object; below 0 moves away.",
        Cli(VIEW, "N"),
    )
    picture_size: tuple[int, int] | SizeName | None = opt(
        None,
        '(width, height) of the picture in pixels; "depth" or "color": as large as that; None: as the larger of '
        'the two; "half": half as wide and high as the larger one',
        "Size of the picture: WxH, depth, color, or half; default: the larger of depth and color.",
        Cli(PICTURE, "WxH|NAME"),
    )
    look: Appearance = opt(Appearance(), "how frames are drawn; the objects of a scene have their own")
    finish: OutputSettings = opt(SIMPLE, "how many samples are averaged, and what lies behind and below")

    def __post_init__(self) -> None:
        object.__setattr__(self, "lights", check_lights(self.lights))
        object.__setattr__(self, "pose", None if self.pose is None else check_pose(self.pose))
        if self.yaw is not View.yaw or self.pitch is not View.pitch or self.dolly is not View.dolly:
            turns = _check_one_way(self.pose, self.yaw, self.pitch, self.dolly)
            for name, turn in zip(("yaw", "pitch", "dolly"), turns, strict=True):
                object.__setattr__(self, name, turn)
        if self.picture_size is not None:
            size, name = self.picture_size, option("picture_size")
            if isinstance(size, str):
                check_choice(name, size, SIZES)
            else:
                object.__setattr__(self, "picture_size", check_size(size, name))
        if type(self.look) is not Appearance:
            check_type(self.look, Appearance, "look")

    def of(self, frame: Frame | Scene, pivot: Numbers | None = None) -> dict[str, Any]:
        """Return the arguments of `Renderer.render` for a frame or a scene.

        Parameters
        ----------
        frame : Frame or Scene
            What is drawn.
        pivot : (3,), optional
            What the camera turns around, world axes; None is the middle of the frame or scene.
        """
        camera, pose = self.seen(frame, pivot)
        look = self.look.options if frame.frames else {}
        return {"light": self.lights or None, "camera": camera, "pose": pose, **look, **self.finish.options}

    def seen(self, frame: Frame | Scene, pivot: Numbers | None = None) -> tuple[Camera | None, NDArray[np.float64]]:
        """Return the camera that looks, None for the frame's or scene's own, and its pose.

        Parameters
        ----------
        frame : Frame or Scene
            What is drawn.
        pivot : (3,), optional
            As in `of`.
        """
        frame = frame.framed()
        pose = viewing_pose(frame, self.pose, self.yaw, self.pitch, self.dolly, pivot)
        return None if self.picture_size is None else _sized_camera(frame, self.picture_size), pose

    def shows_photograph(self, source: Frame | Scene | Sequence[Frame]) -> bool:
        """Return whether frames are seen unlit as their cameras saw them: one sample gives their colours back exactly.

        Parameters
        ----------
        source : Frame, sequence of Frame or Scene
            What is drawn.
        """
        is_moved = self.pose is not None or any((self.yaw, self.pitch, self.dolly)) or self.picture_size is not None
        return self.look.is_plain and not is_moved and not isinstance(source, Scene)


def viewing_pose(
    frame: Frame | Scene, pose: Numbers | None = None, yaw: float = 0.0, pitch: float = 0.0, dolly: float = 0.0,
    pivot: Numbers | None = None,
) -> NDArray[np.float64]:  # fmt: skip
    """The pose, (4, 4); None is that of the frame or framed scene, moved round pivot, (3,) world, as in `orbit_pose`.

    Raises ValueError or TypeError for impossible values, and for a pose that is to be moved.
    """
    turns = _check_one_way(pose, yaw, pitch, dolly) if yaw or pitch or dolly else ()
    if pose is not None:
        return check_pose(pose)
    if not turns:
        return np.asarray(frame.pose)
    return orbit_pose(frame.pose, frame.pivot if pivot is None else pivot, *turns, frame.upright)


AWAY = 5.0  # degrees


def turns_away(turn: NDArray[np.float64]) -> bool:
    """Whether a (4, 4) pose, in the axes of a frame's camera, turns so far that the frame does not show all."""
    return float(np.trace(turn[:3, :3]) - 1) / 2 < math.cos(math.radians(AWAY))


def is_turned(pose: Numbers | None = None, yaw: float = 0.0, pitch: float = 0.0) -> bool:
    """Whether the camera turns so far that a frame at the world's origin does not show all that is seen."""
    return turns_away(orbit_pose(None, (0, 0, 1), yaw, pitch) if pose is None else np.asarray(pose))


def _check_one_way(pose: Numbers | None, yaw: float, pitch: float, dolly: float) -> tuple[float, float, float]:
    turns = check_turns(yaw, pitch, dolly)
    if pose is not None and any(turns):
        given = " and ".join(option(name) for name, turn in zip(("yaw", "pitch", "dolly"), turns, strict=True) if turn)
        raise ValueError(f"pass {option('pose')} or {given}, not both: only a frame's own pose is moved")
    return turns


def _sized_camera(frame: Frame | Scene, size: tuple[int, int] | SizeName) -> Camera:
    """The frame's or scene's own camera, for a picture of this size. Raises ValueError for a size that it has not."""
    own = check_type(frame.picture_camera, Camera, "camera")
    if not isinstance(size, str):
        return own.fitted(*size)
    if size == "half":
        return own.resized(max(own.width // 2, 1), max(own.height // 2, 1))
    if not frame.frames:
        raise ValueError(f"{option('picture_size', size)} is of a frame's picture: for a scene pass width and height")
    (frame,) = frame.frames
    if size == "depth":
        return frame.camera
    if frame.color is None:
        raise ValueError(f"{option('picture_size', size)} needs a colour picture, this frame has none")
    height, width = frame.color.shape[:2]
    return frame.camera.resized(width, height)


TURNTABLES = "light", "camera", "swing", "360"
TURN = 75  # pictures of a turn: three seconds at 25 per second
SWING = 25.0  # degrees to either side: beyond them more of a single frame is missing than is seen
# where the light starts: above the front; from the pivot, camera axes, in units of the frame's scale
_FRONT = (0.0, -0.45, -0.75)


def views_of_turn(frame: Frame | Scene, view: View, what: str, count: int) -> Iterator[View]:
    """Return `count` views, after which the first would come again: one turn in even steps, or one swing.

    what  "light" or "360": the light or the camera goes all the way around. "swing" or "swing:DEG": the camera goes so
          many degrees to its right, to its left and back, slowest where it turns back. "camera": 360, but swing for a
          frame, which has no back

    Raises ValueError for anything else.
    """
    kind, degrees = _kind_of(what, frame)
    if kind == "swing":
        angles = [degrees * math.sin(2 * math.pi * k / count) for k in range(count)]
    else:
        angles = [360 * k / count for k in range(count)]
    turned = with_light_turned if kind == "light" else with_camera_turned
    return (turned(view, frame, angle) for angle in angles)


def moves_camera(what: str | None) -> bool:
    """Return whether a turntable shows other views than the first; None: there is none."""
    return what not in (None, "light")


def check_turntable(what: Any) -> None:
    """Raises ValueError for anything but what `views_of_turn` takes."""
    _kind_of(what, Scene())


def _kind_of(what: Any, frame: Frame | Scene) -> tuple[str, float]:
    """What moves, "light", "360" or "swing", and by how many degrees a swing."""
    kind, colon, text = what.partition(":") if isinstance(what, str) else (what, "", "")
    name = option("turntable")
    if colon and kind == "swing":
        try:
            degrees = float(text)
        except ValueError:
            degrees = 0.0
        if not 0 < degrees <= 180:
            raise ValueError(f"{name} swing:DEG takes degrees to either side, above 0 and at most 180, got {text!r}")
        return kind, degrees
    check_choice(name, what, TURNTABLES)
    if kind == "camera":
        kind = "swing" if frame.frames else "360"
    return kind, SWING


def with_light_turned(view: View, frame: Frame | Scene, degrees: float) -> View:
    """Return the view after its lights moved around the pivot: from the front to the right, behind, and to the left.
    An environment turns with them; beside it there are no others than those given."""
    frame = frame.framed()
    pose, pivot = np.asarray(frame.pose), frame.pivot
    turn = orbit_pose(pose, pivot, degrees, upright=frame.upright) @ np.linalg.inv(pose)
    scene = frame if isinstance(frame, Scene) else Scene()
    lights, finish = view.lights or scene.lights, view.finish
    if finish.environment is not None or scene.environment is not None:
        finish = with_environment_turned(finish, degrees, turn[:3, :3])
        return replace(view, lights=[transformed(light, turn) for light in lights], finish=finish)
    start = pivot + frame.scale * pose[:3, :3] @ _FRONT
    own = Light(position=tuple(start), shadow=view.finish.ground is not False)
    return replace(view, lights=[transformed(light, turn) for light in lights or [own]])


def with_camera_turned(view: View, frame: Frame | Scene, degrees: float) -> View:
    """Return the view after its camera moved around the frame's pivot, to its right."""
    if view.pose is None:
        return replace(view, yaw=view.yaw + degrees)
    return replace(view, pose=orbit_pose(view.pose, frame.pivot, degrees, upright=frame.upright))
