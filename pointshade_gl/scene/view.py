"""How frames and scenes are seen: from where and under which lights."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..messages.formatting import option
from ..messages.validation import check_choice, check_size, check_type
from .appearance import Look
from .camera import Camera, check_pose, check_turns, orbit_pose
from .frame import Frame
from .graph import Scene
from .light import Light, check_lights
from .render_settings import SIMPLE, Finish

SIZES = ("depth", "color", "half")


@dataclass(frozen=True)
class View:
    """From where, under which lights and how everything is drawn; the same for all pictures of a film.

    lights  empty: the default light, or a scene's own
    pose    (4, 4) camera-to-world for all frames; None: each frame's own, moved by yaw, pitch and dolly as in
            `orbit_pose`
    size    (width, height) of the picture in pixels; "depth" or "color": as large as that; None: as the larger of the
            two; "half": half as wide and high as the larger one
    look    how frames are drawn; the objects of a scene have their own
    finish  how many samples are averaged, and what lies behind and below

    Raises TypeError or ValueError for anything else.
    """

    lights: Sequence[Light] = ()
    pose: NDArray[np.float64] | None = None
    yaw: float = 0.0
    pitch: float = 0.0
    dolly: float = 0.0
    size: tuple[int, int] | str | None = None
    look: Look = field(default_factory=Look)
    finish: Finish = SIMPLE

    def __post_init__(self) -> None:
        object.__setattr__(self, "lights", check_lights(self.lights))
        object.__setattr__(self, "pose", None if self.pose is None else check_pose(self.pose))
        _check_one_way(self.pose, self.yaw, self.pitch, self.dolly)
        if isinstance(self.size, str):
            check_choice(option("size"), self.size, SIZES)
        elif self.size is not None:
            object.__setattr__(self, "size", check_size(self.size))
        check_type(self.look, Look, "look")

    def of(self, frame: Frame | Scene, pivot: ArrayLike | None = None) -> dict[str, Any]:
        """The arguments of `Renderer.render` for a frame or scene. The camera turns around pivot, (3,) world."""
        frame = frame.framed() if isinstance(frame, Scene) else frame
        pose = viewing_pose(frame, self.pose, self.yaw, self.pitch, self.dolly, pivot)
        camera = None if self.size is None else _sized_camera(frame, self.size)
        look = {} if isinstance(frame, Scene) else self.look.options
        return {"light": self.lights or None, "camera": camera, "pose": pose, **look, **self.finish.options}

    def shows_photograph(self, source: Frame | Scene | Sequence[Frame]) -> bool:
        """Whether frames are seen unlit as their cameras saw them: one sample gives their colours back exactly."""
        look = self.look
        is_plain = look.shading == "none" and look.splat == "footprint" and look.size in (None, 1)
        is_plain = is_plain and not look.unlight and not look.remove_highlights
        is_moved = self.pose is not None or any((self.yaw, self.pitch, self.dolly)) or self.size is not None
        return is_plain and not is_moved and not isinstance(source, Scene)


def viewing_pose(
    frame: Frame | Scene,
    pose: ArrayLike | None = None,
    yaw: float = 0.0,
    pitch: float = 0.0,
    dolly: float = 0.0,
    pivot: ArrayLike | None = None,
) -> NDArray[np.float64]:
    """The pose, (4, 4); None is that of the frame or framed scene, moved round pivot, (3,) world, as in `orbit_pose`.

    Raises ValueError or TypeError for impossible values, and for a pose that is to be moved.
    """
    turns = _check_one_way(pose, yaw, pitch, dolly)
    if pose is not None:
        return check_pose(pose)
    if not any(turns):
        return np.asarray(frame.pose)
    return orbit_pose(frame.pose, frame.pivot if pivot is None else pivot, *turns, upright_of(frame))


def _check_one_way(pose: ArrayLike | None, yaw: float, pitch: float, dolly: float) -> tuple[float, float, float]:
    turns = check_turns(yaw, pitch, dolly)
    if pose is not None and any(turns):
        given = " and ".join(option(name) for name, turn in zip(("yaw", "pitch", "dolly"), turns, strict=True) if turn)
        raise ValueError(f"pass {option('pose')} or {given}, not both: only a frame's own pose is moved")
    return turns


def _sized_camera(frame: Frame | Scene, size: tuple[int, int] | str) -> Camera:
    """The frame's or scene's own camera, for a picture of this size. Raises ValueError for a size that it has not."""
    own = frame.picture_camera if isinstance(frame, Frame) else frame.camera
    assert own is not None, "only scenes without a frame have none"
    if not isinstance(size, str):
        return own.fitted(*size)
    if size == "half":
        return own.resized(max(own.width // 2, 1), max(own.height // 2, 1))
    if isinstance(frame, Scene):
        raise ValueError(f"{option('size', size)} is the size of a frame's picture: for a scene pass width and height")
    if size == "depth":
        return frame.camera
    if frame.color is None:
        raise ValueError(f"{option('size', size)} needs a colour picture, this frame has none")
    height, width = frame.color.shape[:2]
    return frame.camera.resized(width, height)


def upright_of(frame: Frame | Scene) -> NDArray[np.float64] | None:
    """The axis that camera and lights turn around: a scene's vertical. A frame has no known up direction: None."""
    return frame.upright if isinstance(frame, Scene) else None
