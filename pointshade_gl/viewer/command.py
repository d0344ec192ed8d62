"""The `pointshade render ...` line that makes the picture of a window: the command line, the other way round."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from ..cli.command_words import light_words, look_words, pose_words, text_of
from ..scene.appearance import Look
from ..scene.camera import Camera
from ..scene.graph import Scene
from ..scene.light import Light
from ..scene.view import viewing_pose
from .screen import render_arguments
from .shown import camera_of
from .together import Together
from .views import Views

if TYPE_CHECKING:
    from .viewer import Viewer

CLOSE = 1e-9  # share of the distance: poses that differ by less are the same


@dataclass(frozen=True)
class Typed:
    """How the command line names what a window shows.

    inputs   one INPUT, or several; none where the options name the files
    options  words that say how it is read, such as ("--depth-scale", "1000")
    """

    inputs: tuple[str, ...]
    options: tuple[str, ...] = ()


def render_line(viewer: Viewer, camera: Camera, samples: int, output: str) -> tuple[str, str]:
    """The line that makes the picture as this camera sees it, and what it leaves out, in words ("": nothing).

    The line is "" if there is none.
    """
    if viewer.opened.typed is None:
        return "", "no command line names what this program shows"
    shown = render_arguments(viewer, camera)
    source, missing = _source_words(viewer, viewer.opened.typed)
    if source is None:
        return "", missing
    own = _own_camera(viewer)
    size = (
        []
        if (camera.width, camera.height) == (own.width, own.height)
        else ["--size", f"{camera.width}x{camera.height}"]
    )
    if own.fitted(camera.width, camera.height) != camera:
        return "", "no command line names this camera"
    look, left_out = _look_words(viewer, shown)
    words = [*source, *look, *_light_words(viewer, shown), *_pose_words(viewer, shown["pose"]), *size]
    words += ["--samples", str(samples), "-o", output]
    return shlex.join(["pointshade", "render", *words]), "; ".join(filter(None, [missing, left_out]))


def _source_words(viewer: Viewer, typed: Typed) -> tuple[list[str] | None, str]:
    """INPUT and what tells its frames apart; or None, and why there are none."""
    frame, playback, options = viewer.frame, viewer.playback, list(typed.options)
    if isinstance(frame, Scene):
        hidden = _hidden(frame) - _hidden(viewer.opened.first)
        return [*typed.inputs, *options], f"that these are hidden: {', '.join(sorted(hidden))}" if hidden else ""
    if isinstance(playback, Together) and isinstance(frame, Views):
        chosen = [k for k, on in enumerate(frame.on) if on]
        numbers = ",".join(str(max(playback.indices[k], 0)) for k in chosen)
        return [*(typed.inputs[k] for k in chosen), *options, "--frame", numbers], ""
    if isinstance(frame, Views):
        numbers = ",".join(frame.shown_names)
        return [*typed.inputs, *options, "--views" if len(frame.shown) > 1 else "--frame", numbers], ""
    if playback is None:
        return [*typed.inputs, *options], ""
    if playback.index < 0:
        return None, "no command line names a frame of a live stream"
    return [*typed.inputs, *options, "--frame", str(playback.index)], ""


def _hidden(scene: Any) -> set[str]:
    return {node.name or "a node" for _, node in scene.every_node() if not node.visible}


def _own_camera(viewer: Viewer) -> Camera:
    """That of the picture which the line makes, unless it names a size."""
    return camera_of(viewer.frame.shown[0] if isinstance(viewer.frame, Views) else viewer.frame)


def _look_words(viewer: Viewer, shown: dict[str, Any]) -> tuple[list[str], str]:
    """What of the look a scene has, which is a shading for all its objects, or all that frames have."""
    if isinstance(viewer.frame, Scene):
        shading = "none" if not viewer.state.lit else viewer.state.look.shading
        return look_words(Look(shading=shading)), ""
    look = Look(**{name: shown[name] for name in Look().options})
    return look_words(look), "the filter over time, which needs the frames before" if look.temporal else ""


def _light_words(viewer: Viewer, shown: dict[str, Any]) -> list[str]:
    """Nothing where light is not seen, or is as the scene has it."""
    lights: list[Light] = shown["light"]
    own = viewer.frame.lights if isinstance(viewer.frame, Scene) else None
    if not viewer.state.is_lit or (own is not None and _are_same(lights, own)):
        return []
    return [word for light in lights for word in light_words(light, in_scene=own is not None)]


def _are_same(lights: Sequence[Light], others: Sequence[Light]) -> bool:
    """Whether these are the same lights, in any order."""
    return len(lights) == len(others) and all(any(_is_same(a, b) for b in others) for a in lights)


def _is_same(light: Light, other: Light) -> bool:
    for name in vars(light):
        a, b = getattr(light, name), getattr(other, name)
        if name == "direction" and a is not None and b is not None:
            a, b = (np.array(one) / np.linalg.norm(one) for one in (a, b))
        if not (a is b if a is None or b is None else np.allclose(a, b, rtol=1e-6, atol=1e-6)):
            return False
    return True


def _pose_words(viewer: Viewer, pose: np.ndarray) -> list[str]:
    """Yaw, pitch and dolly if they make this pose, otherwise the pose itself."""
    state, frame = viewer.state, viewer.frame
    if isinstance(frame, Views):
        return [] if np.allclose(frame.shown[0].pose, pose, rtol=0, atol=0) else pose_words(pose)
    turns = {"yaw": state.yaw, "pitch": state.pitch, "dolly": 1 - state.distance}
    turns = {name: round(value, 12) for name, value in turns.items()}
    try:
        moved = viewing_pose(frame, None, **turns)
    except ValueError:
        return pose_words(pose)
    if np.abs(moved - pose).max() > CLOSE * max(frame.scale, 1e-3):
        return pose_words(pose)
    return [word for name, value in turns.items() if value for word in (f"--{name}", text_of(float(value)))]
