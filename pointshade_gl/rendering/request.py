"""The arguments of a picture: what is drawn, and who looks. Checked here, before anything is drawn."""

from __future__ import annotations

from collections.abc import Sequence
from os import PathLike
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..messages.formatting import shown
from ..messages.validation import check_type
from ..scene.appearance import Look, Material
from ..scene.camera import Camera
from ..scene.frame import Frame
from ..scene.graph import Scene
from ..scene.node import Node
from ..scene.point_object import PointObject, check_frames
from ..scene.view import viewing_pose

FilePath = str | PathLike[str]


class Scenes:
    """Makes scenes of frames, and keeps the last one: the same object shows the pipeline that nothing has changed."""

    def __init__(self) -> None:
        self._last: tuple[tuple[Frame, ...], Look, Scene] | None = None

    def of(self, frame: Frame | Sequence[Frame] | Scene, options: tuple[Any, ...]) -> Scene:
        """What is drawn; options as in Look. Raises TypeError or ValueError."""
        if isinstance(frame, Scene):
            _check_plain(options)
            return frame.framed()
        if isinstance(frame, Frame | Sequence) and not isinstance(frame, bytes):
            return self.of_frames(check_frames(frame), Look(*options))
        raise TypeError(f"frame must be a Frame, a sequence of frames, a Scene or a path, got {shown(frame)}")

    def of_frames(self, frames: tuple[Frame, ...], look: Look) -> Scene:
        """The scene of one object; the last one again if nothing has changed."""
        if self._last is None or self._last[0] != frames or not look.is_uniform or self._last[1] != look:
            first = frames[0]
            scene = Scene((Node(PointObject(frames, look=look)),), first.picture_camera, first.pose)
            self._last = (frames, look, scene) if look.is_uniform else None
            return scene
        return self._last[2]


def loaded(frame: Frame | Sequence[Frame] | Scene | FilePath) -> Frame | Sequence[Frame] | Scene:
    """The frame or scene itself; of a path or a built-in name, what is there."""
    if not isinstance(frame, str | PathLike):
        return frame
    from ..files.sources import load_any  # which imports the readers of all files

    return load_any(frame)


def seen_by(
    frame: Frame | Sequence[Frame] | Scene,
    scene: Scene,
    camera: Camera | None,
    pose: ArrayLike | None,
    yaw: float,
    pitch: float,
    dolly: float,
) -> tuple[Camera, NDArray[np.float64]]:
    """Who looks: the scene's own camera and pose unless others are given. Raises TypeError or ValueError."""
    camera = check_type(scene.camera if camera is None else camera, Camera, "camera")
    mover = scene if isinstance(frame, Scene) else scene.things[0].content.frame  # of several frames the first
    return camera, viewing_pose(mover, pose, yaw, pitch, dolly)


def _check_plain(options: tuple[Any, ...]) -> None:
    """Raises ValueError for options of a Look that were passed with a scene: its objects have their own."""
    plain = Look().options
    changed = [
        name
        for (name, before), value in zip(plain.items(), options, strict=True)
        if not (value is before or (isinstance(value, str | Material) and value == before))
    ]
    if changed:
        raise ValueError(f"the objects of a scene have a look of their own: leave out {', '.join(changed)}")
