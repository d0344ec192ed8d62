"""Turntable views: the light or the camera moves once around a frame or scene, in even steps."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from .camera import orbit_pose
from .frame import Frame
from .graph import Scene
from .light import Light, transformed
from .render_settings import with_environment_turned
from .view import View, upright_of

TURN = 75  # pictures of a turn: three seconds at 25 per second
# where the light starts: above the front; from the pivot, camera axes, in units of the frame's scale
_FRONT = (0.0, -0.45, -0.75)


def views_of_turn(frame: Frame | Scene, view: View, what: str, count: int) -> Iterator[View]:
    """Return views in `count` even steps of one turn. `what` turns: "light" or "camera"."""
    turned = TURNTABLES[what]
    for k in range(count):
        yield turned(view, frame, 360 * k / count)


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


TURNTABLES = {"light": with_light_turned, "camera": with_camera_turned}
