"""The other way round: values and windows become the words of the command line that makes their picture."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from typing import TYPE_CHECKING, Any, TypeGuard

import numpy as np
from numpy.typing import NDArray

from ..files.access.known_names import FRAMES
from ..files.frame_sources import is_cloud
from ..notes.words import option
from ..scene.appearance import CLOUD_SPLATS, Look
from ..scene.camera import quaternion_of
from ..scene.cloud import CLOUD_SHADINGS, PointCloud
from ..scene.graph import Scene, scene_of
from ..scene.light import Light
from ..scene.viewpoint import viewing_pose
from .option_groups import LookGroup
from .options import FrameOptions
from .written import EnvironmentOptions, PictureOptions

if TYPE_CHECKING:  # a picture without a window needs none of it
    from ..viewer.document import Dropped, SavedPicture
    from ..viewer.picture import ShownPicture
    from ..viewer.state import Shown, Views

DIGITS = 12  # of a number: far more than pictures show, so that the line makes the same one


def words_of(options: Any) -> list[str]:
    """The words for a group of options (see cli/options.py), without those that have their default."""
    words = []
    for field in fields(options):
        value = getattr(options, field.name)
        if value == field.default or value is None:
            continue
        name = f"--{field.name.replace('_', '-')}"
        for one in value if isinstance(value, list) else [value]:
            words += [name] if one is True else [text_of(one)] if field.name == "input" else [name, text_of(one)]
    return words


def text_of(value: Any) -> str:
    """A number, several with commas between them, or a text as it is."""
    if isinstance(value, Sequence | np.ndarray) and not isinstance(value, str):
        return ",".join(map(text_of, value))
    return f"{value + 0.0:.{DIGITS}g}" if isinstance(value, float | np.floating) else str(value)


def look_words(look: Look) -> list[str]:
    """How objects look. A filter over time is left out: a single picture has nothing before it."""
    return words_of(LookGroup.of(look.alone))


def light_words(light: Light, in_scene: bool) -> list[str]:
    """`--light` and its words. In a scene lights cast shadows unless they say no."""
    words, plain = [], Light(shadow=in_scene)
    for field in fields(Light):
        value = getattr(light, field.name)
        if value != getattr(plain, field.name):
            is_switch = isinstance(value, bool)
            words.append(f"{field.name}={'yes' if value else 'no'}" if is_switch else f"{field.name}={text_of(value)}")
    return ["--light", " ".join(words)]


def pose_words(pose: NDArray[np.float64]) -> list[str]:
    """`--pose` with tx,ty,tz,qx,qy,qz,qw."""
    return ["--pose", text_of([*pose[:3, 3], *quaternion_of(pose[:3, :3])])]


CLOSE = 1e-9  # share of the distance: poses that differ by less are the same


@dataclass(frozen=True)
class Typed:
    """How the command line names what a window shows.

    inputs   one INPUT, or several; none where the options name the files
    options  words that say how it is read, such as ("--depth-scale", "1000")
    """

    inputs: tuple[str, ...]
    options: tuple[str, ...] = ()


def render_line(typed: Typed, saved: SavedPicture) -> tuple[str, str]:
    """Return the line that makes a saved picture, and what it leaves out, in words ("": nothing).

    The line is "" if there is none. typed  for what the window was opened with; what was dropped onto it names itself
    """
    from ..viewer.state import camera_of

    picture, camera = saved.picture, saved.picture.camera
    typed = _as_typed(saved.document.dropped) if saved.document.dropped else typed
    source, missing = _source_words(saved, typed)
    if source is None:
        return "", missing
    shown = picture.shown
    own = camera_of(shown.shown[0] if _are_views(shown) else shown)  # of the line's picture, without a size
    size = []
    if (camera.width, camera.height) != (own.width, own.height):
        size = ["--picture-size", f"{camera.width}x{camera.height}"]
    if own.fitted(camera.width, camera.height) != camera:
        return "", "no command line names this camera"
    clouds = _clouds(picture, typed.inputs)
    look, left_out = _look_words(picture, clouds)
    pose = _pose_words(picture, scene_of(*clouds) if clouds else shown)
    around, unsaid = _environment_words(picture)
    words = [*source, *look, *_light_words(picture, picture.lights), *around, *pose, *size]
    if isinstance(picture.exposure, float) and picture.exposure and picture.now.state.is_lit:
        words += ["--exposure", text_of(picture.exposure)]
    if not picture.now.state.finish.is_light:
        words += ["--show", picture.now.state.finish.show]
    words += ["--samples", str(saved.samples), "-o", saved.name]
    return shlex.join(["pointshade", "render", *words]), "; ".join(filter(None, [missing, left_out, unsaid]))


def _as_typed(dropped: Dropped) -> Typed:
    return Typed(dropped.inputs, tuple(w for name, path in dropped.files.items() for w in (f"--{name}", str(path))))


def _source_words(saved: SavedPicture, typed: Typed) -> tuple[list[str] | None, str]:
    """INPUT and what tells its frames apart; or None, and why there are none."""
    shown, numbers, options = saved.picture.shown, saved.document.playback.numbers, list(typed.options)
    if isinstance(shown, Scene):
        hidden = _hidden(shown) - _hidden(saved.document.first)
        return [*typed.inputs, *options], f"that these are hidden: {', '.join(sorted(hidden))}" if hidden else ""
    if _are_views(shown) and len(numbers) > 1:  # of several sources
        chosen = [k for k, on in enumerate(shown.on) if on]
        words = ",".join(str(max(numbers[k], 0)) for k in chosen)
        return [*(typed.inputs[k] for k in chosen), *options, "--frame", words], ""
    if _are_views(shown):
        names = ",".join(shown.shown_names)
        return [*typed.inputs, *options, "--views" if len(shown.shown) > 1 else "--frame", names], ""
    if not numbers:
        return [*typed.inputs, *options], ""
    if numbers[0] < 0:
        return None, "no command line names a frame of a live stream"
    return [*typed.inputs, *options, "--frame", str(numbers[0])], ""


def _are_views(shown: Any) -> TypeGuard[Views]:
    from ..viewer.state import Views

    return isinstance(shown, Views)


def _hidden(scene: Any) -> set[str]:
    return {node.name or "a node" for _, node in scene.every_node() if not node.visible}


def _clouds(picture: ShownPicture, inputs: Sequence[str]) -> list[PointCloud]:
    """The clouds that are shown, if the INPUTs are such; none of other scenes."""
    from ..viewer.state import clouds_of

    return clouds_of(picture.shown) if all(map(is_cloud, inputs)) else []


def _look_words(picture: ShownPicture, clouds: Sequence[PointCloud]) -> tuple[list[str], str]:
    """What of the look a scene has, which is a shading for all its objects; what clouds have; or all of frames."""
    if isinstance(picture.shown, Scene):
        state = picture.now.state
        shading = state.look.shading if state.lit else "none"
        if not clouds:
            return words_of(LookGroup(shading=shading)), ""
        return words_of(_cloud_options(clouds[0], shading if shading in CLOUD_SHADINGS else CLOUD_SHADINGS[0])), ""
    look = picture.request().look
    if not _are_views(picture.shown) or len(picture.shown.shown) == 1:
        look = replace(look, align=False)  # there is nothing to align
    is_whole = look == look.alone
    return look_words(look), "" if is_whole else "the filter over time, which needs the frames before"


def _cloud_options(cloud: PointCloud, shading: str) -> LookGroup:
    """How a cloud looks. Discs are what clouds have unless they are told otherwise."""
    splat = {} if cloud.splat == CLOUD_SPLATS[0] else {"splat": cloud.splat}
    return replace(LookGroup(), shading=shading, point_size=cloud.point_size, **splat, **vars(cloud.material))


def _light_words(picture: ShownPicture, lights: Sequence[Light]) -> list[str]:
    """Nothing where light is not seen, or is as the scene has it."""
    own = picture.shown.lights if isinstance(picture.shown, Scene) else None
    if not picture.now.state.is_lit or (own is not None and _are_same(lights, own)):
        return []
    return [word for light in lights for word in light_words(light, in_scene=own is not None)]


def _environment_words(picture: ShownPicture) -> tuple[list[str], str]:
    """Nothing where light is not seen; what no words say, in words. A scene's own environment goes without saying."""
    state, own = picture.now.state, picture.shown.environment if isinstance(picture.shown, Scene) else None
    finish = state.finish
    if not state.is_lit:
        return [], ""
    options = EnvironmentOptions.of(finish)
    is_own = finish.environment is own
    unsaid = {
        "its environment": finish.environment is not None and not is_own and options.environment is None,
        "that the scene's environment is switched off": finish.environment is None and not is_own,
        "how its environment is turned": isinstance(finish.environment_rotation, tuple),
    }
    words = words_of(replace(options, environment=None) if is_own else options)
    return words, "; ".join(text for text, is_so in unsaid.items() if is_so)


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


def _pose_words(picture: ShownPicture, shown: Shown) -> list[str]:
    """Yaw, pitch and dolly if they make its pose, otherwise the pose itself. shown: as the line has it unmoved."""
    from ..viewer.state import Views

    state, pose = picture.now.state, picture.pose
    if isinstance(shown, Views):
        return [] if np.allclose(shown.shown[0].pose, pose, rtol=0, atol=0) else pose_words(pose)
    turns = {"yaw": state.yaw, "pitch": state.pitch, "dolly": 1 - state.distance}
    turns = {name: round(value, 12) for name, value in turns.items()}
    try:
        moved = viewing_pose(shown, None, turns["yaw"], turns["pitch"], turns["dolly"])
    except ValueError:
        return pose_words(pose)
    if np.abs(moved - pose).max() > CLOSE * max(shown.scale, 1e-3):
        return pose_words(pose)
    return [word for name, value in turns.items() if value for word in (f"--{name}", text_of(float(value)))]


def page_line(
    frame: FrameOptions,
    look: LookGroup,
    picture: PictureOptions,
    more: Sequence[str] | None = None,
    views: str | None = None,
    unlight_all: bool = False,
) -> str:
    """Return what was typed about what is read and how it looks, but for lights, shading, samples and exposure."""
    frame = frame if frame.input or frame.depth or frame.color else replace(frame, input=FRAMES[0])
    words = [*words_of(frame), *(more or []), *(["--views", views] if views else [])]
    words += [option("unlight_all")] if unlight_all else []
    words += words_of(replace(look, light=None, shading=LookGroup().shading))
    words += words_of(replace(picture, samples=None, exposure=None))
    return shlex.join(["pointshade", "render", *words])
