"""How frames are looked at: from where, under which lights, in which style; and the way of a light round an object."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .camera import orbit_pose
from .frame import Frame
from .light import Light
from .look import Look
from .scene import Scene

# a light that goes round starts above the front, in scales of the frame from its pivot, camera axes
_FRONT = (0.0, -0.45, -0.75)


@dataclass(frozen=True)
class View:
    """One choice for all pictures of a film.

    lights  none is the default light
    pose    (4, 4) camera-to-world, the same for all frames; None is each frame's own, turned by yaw, pitch and dolly
            as in `orbit_pose`
    size    (width, height) of the picture in pixels; None is that of the depth
    look    how frames are drawn; the objects of a scene have their own
    """

    lights: Sequence[Light] = ()
    pose: NDArray[np.float64] | None = None
    yaw: float = 0.0
    pitch: float = 0.0
    dolly: float = 0.0
    size: tuple[int, int] | None = None
    look: Look = field(default_factory=Look)

    def of(self, frame: Frame | Scene, pivot: ArrayLike | None = None) -> dict[str, Any]:
        """The arguments of `Renderer.render` for a frame; pivot, (3,) world, is what the camera turns round."""
        frame = frame.framed() if isinstance(frame, Scene) else frame
        pivot = frame.pivot if pivot is None else pivot
        turns = self.yaw, self.pitch, self.dolly, _upright(frame)
        pose = orbit_pose(frame.pose, pivot, *turns) if self.pose is None else self.pose
        camera = frame.camera.fitted(*self.size) if self.size and frame.camera else None
        look = {} if isinstance(frame, Scene) else self.look.options
        return {"light": self.lights or None, "camera": camera, "pose": pose, **look}

    def with_light_turned(self, frame: Frame | Scene, degrees: float) -> View:
        """The lights gone round the pivot: from the front to the right, behind, and back from the left."""
        frame = frame.framed() if isinstance(frame, Scene) else frame
        pose, pivot = np.asarray(frame.pose), frame.pivot
        turn = orbit_pose(pose, pivot, degrees, upright=_upright(frame)) @ np.linalg.inv(pose)
        lights = self.lights or (frame.lights if isinstance(frame, Scene) else [])
        start = pivot + frame.scale * pose[:3, :3] @ _FRONT
        return replace(self, lights=[_turned(light, turn) for light in lights or [Light(position=tuple(start))]])

    def with_camera_turned(self, frame: Frame | Scene, degrees: float) -> View:
        """The camera gone round the frame's pivot, to its right."""
        if self.pose is None:
            return replace(self, yaw=self.yaw + degrees)
        return replace(self, pose=orbit_pose(self.pose, frame.pivot, degrees, upright=_upright(frame)))


def _upright(frame: Frame | Scene) -> NDArray[np.float64] | None:
    """What the camera goes round: of a scene its vertical; which way is up in a frame nobody knows."""
    return frame.upright if isinstance(frame, Scene) else None


def _turned(light: Light, turn: NDArray[np.float64]) -> Light:
    if light.position is not None:
        light = replace(light, position=tuple(turn[:3, :3] @ light.position + turn[:3, 3]))
    if light.direction is not None:
        light = replace(light, direction=tuple(turn[:3, :3] @ light.direction))
    return light
