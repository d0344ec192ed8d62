"""Turntable views: the light or the camera moves once around a frame or scene, or the camera swings before it."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from ..checks.arguments import check_choice
from ..notes.words import option
from .camera import orbit_pose
from .frame import Frame
from .graph import Scene
from .light import Light, transformed
from .render_settings import with_environment_turned
from .view import View, upright_of

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
        kind = "swing" if isinstance(frame, Frame) else "360"
    return kind, SWING


def with_light_turned(view: View, frame: Frame | Scene, degrees: float) -> View:
    """Return the view after its lights moved around the pivot: from the front to the right, behind, and to the left.
    An environment turns with them; beside it there are no others than those given."""
    frame = frame.framed() if isinstance(frame, Scene) else frame
    pose, pivot = np.asarray(frame.pose), frame.pivot
    turn = orbit_pose(pose, pivot, degrees, upright=upright_of(frame)) @ np.linalg.inv(pose)
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
    return replace(view, pose=orbit_pose(view.pose, frame.pivot, degrees, upright=upright_of(frame)))
