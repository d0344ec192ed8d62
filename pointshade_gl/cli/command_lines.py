"""The other way round: values, windows and pages become the command line that makes their picture."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..files.access.known_names import FRONT, VASE, WHOLE
from ..files.input_kinds import Kind
from ..scene.appearance import CLOUD_SPLATS
from ..scene.camera import quaternion_of
from ..scene.cloud import CLOUD_SHADINGS, PointCloud
from ..scene.graph import Scene, scene_of
from ..scene.light import Light
from ..scene.viewpoint import turns_away, viewing_pose
from .inputs import Inputs
from .option_groups import AppearanceGroup, flag_of
from .options import EnvironmentOptions, FrameOptions, PictureOptions, PlaceOptions

if TYPE_CHECKING:  # a picture without a window needs none of it
    from ..viewer.document import SavedPicture
    from ..viewer.state import ShownPicture, Views

ARGUMENTS = "input", "more"  # which are typed without a flag
DIGITS = 12  # of a number: far more than pictures show, so that the line makes the same one


def words_of(options: Any) -> list[str]:
    """The words for a group of options (see cli/options.py), without those that have their default."""
    words = []
    for field in fields(options):
        value = getattr(options, field.name)
        if value == field.default or value is None:
            continue
        flag = [] if field.name in ARGUMENTS else [flag_of(field.name)]
        for one in value if isinstance(value, list) else [value]:
            words += flag if one is True else [*flag, text_of(one)]
    return words


def text_of(value: Any) -> str:
    """A number, several with commas between them, or a text as it is."""
    if isinstance(value, Sequence | np.ndarray) and not isinstance(value, str):
        return ",".join(map(text_of, value))
    return f"{value + 0.0:.{DIGITS}g}" if isinstance(value, float | np.floating) else str(value)


def light_words(light: Light, in_scene: bool) -> list[str]:
    """`--light` and its words. In a scene lights cast shadows unless a word forbids it."""
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
    """How the command line names what a window shows."""

    inputs: tuple[str, ...]  # one INPUT, or several; none where the options name the files
    options: tuple[str, ...] = ()  # words for how it is read, such as ("--depth-scale", "1000")

    @classmethod
    def of(cls, frame: FrameOptions, more: Sequence[str] = ()) -> Typed:
        """What was typed about the input."""
        words = words_of(frame.named)
        named = 0 if words[0].startswith("--") else 1
        return cls((*words[:named], *more), tuple(words[named:]))


def render_line(typed: Typed, saved: SavedPicture) -> tuple[str, str]:
    """Return the line that makes a saved picture, and what it leaves out, in words ("": nothing). The line is "" if
    there is none. typed: what the window was opened with; what was dropped onto it names itself."""
    from ..viewer.state import Views, camera_of, clouds_of

    picture, camera, dropped = saved.picture, saved.picture.camera, saved.document.dropped
    shown, state = picture.shown, picture.now.state
    if dropped is not None:
        files = [word for name, path in dropped.files.items() for word in (f"--{name}", str(path))]
        typed = Typed(dropped.inputs, tuple(files))
    scene, views = shown if isinstance(shown, Scene) else None, shown if isinstance(shown, Views) else None
    if typed == Typed((VASE,)) and (views or turns_away(np.linalg.inv(shown.pose) @ picture.pose)):
        typed = Typed((WHOLE if views else FRONT,))  # as it is seen; the first name would take either
    source, missing = _source_words(saved, typed, scene, views)
    if source is None:
        return "", missing
    own = camera_of(shown if views is None else views.shown[0])  # of the line's picture, without a size
    if own.fitted(camera.width, camera.height) != camera:
        return "", "no command line names this camera"
    clouds = clouds_of(shown) if all(Kind.of(path) is Kind.CLOUD for path in typed.inputs) else []
    look, no_look = _look_words(picture, scene, clouds, is_alone=views is None or len(views.shown) == 1)
    environment, no_environment = _environment_words(picture, scene)
    words = [*source, *look, *_light_words(picture, scene), *environment]
    if views is None:
        words += _turn_words(picture, scene_of(*clouds) if clouds else shown)
    elif not np.allclose(views.shown[0].pose, picture.pose, rtol=0, atol=0):
        words += pose_words(picture.pose)
    if (camera.width, camera.height) != (own.width, own.height):
        words += ["--picture-size", f"{camera.width}x{camera.height}"]
    exposure, fill = picture.metered
    if isinstance(exposure, float) and (exposure or fill) and state.is_lit:
        words += ["--exposure", text_of(exposure)]
    if fill and state.is_lit:
        words += ["--fill", text_of(fill)]
    if not state.finish.is_light:
        words += ["--show", state.finish.show]
    words += ["--samples", str(saved.samples), "-o", saved.name]
    return _line(words), "; ".join(filter(None, [missing, no_look, no_environment]))


def _line(words: Sequence[str]) -> str:
    return shlex.join(["pointshade", "render", *words])


def _source_words(
    saved: SavedPicture, typed: Typed, scene: Scene | None, views: Views | None
) -> tuple[list[str] | None, str]:
    """INPUT and which of its frames is shown; or None, and why there are none."""
    numbers, inputs, chosen = saved.document.playback.numbers, typed.inputs, list[str]()
    if scene is not None:
        hidden = ", ".join(sorted(_hidden(scene) - _hidden(saved.document.first)))
        return [*inputs, *typed.options], f"that these are hidden: {hidden}" if hidden else ""
    if views is not None and len(numbers) > 1:  # of several sources
        on = [k for k, is_on in enumerate(views.on) if is_on]
        inputs = tuple(inputs[k] for k in on)
        chosen = ["--frame", ",".join(str(max(numbers[k], 0)) for k in on)]
    elif views is not None:
        chosen = ["--views" if len(views.shown) > 1 else "--frame", ",".join(views.shown_names)]
    elif numbers and numbers[0] < 0:
        return None, "no command line names a frame of a live stream"
    elif numbers:
        chosen = ["--frame", str(numbers[0])]
    return [*inputs, *typed.options, *chosen], ""


def _hidden(scene: Any) -> set[str]:
    return {node.name or "a node" for _, node in scene.every_node() if not node.visible}


def _look_words(
    picture: ShownPicture, scene: Scene | None, clouds: Sequence[PointCloud], is_alone: bool
) -> tuple[list[str], str]:
    """What of the look a scene has, which is a shading for all its objects; what clouds have; or all of frames."""
    state = picture.now.state
    shading = state.look.shading if state.lit else "none"
    if clouds:  # discs are what they have unless another splat is given
        shading = shading if shading in CLOUD_SHADINGS else CLOUD_SHADINGS[0]
        splat = {} if clouds[0].splat == CLOUD_SPLATS[0] else {"splat": clouds[0].splat}
        size = clouds[0].point_size
        return words_of(AppearanceGroup(shading=shading, point_size=size, **splat, **vars(clouds[0].material))), ""
    if scene is not None:
        return words_of(AppearanceGroup(shading=shading)), ""
    look = picture.request().look
    look = replace(look, align=look.align and not is_alone)  # one frame has nothing to be aligned with
    words, is_whole = words_of(AppearanceGroup.of(look.alone)), look == look.alone
    return words, "" if is_whole else "the filter over time, which needs the frames before"


def _light_words(picture: ShownPicture, scene: Scene | None) -> list[str]:
    """Nothing where light is not seen, or is as the scene has it, in any order."""
    if not picture.now.state.is_lit:
        return []
    lights, own = picture.lights, [] if scene is None else scene.lights
    is_own = len(lights) == len(own) and all(any(_is_same(light, other) for other in own) for light in lights)
    return [] if is_own else [word for light in lights for word in light_words(light, scene is not None)]


def _environment_words(picture: ShownPicture, scene: Scene | None) -> tuple[list[str], str]:
    """Nothing where light is not seen; what no options express, in words. A scene's own environment needs none."""
    if not picture.now.state.is_lit:
        return [], ""
    finish = picture.now.state.finish
    is_own = finish.environment is (None if scene is None else scene.environment)
    options = EnvironmentOptions.of(finish)
    missing = {
        "its environment": finish.environment is not None and not is_own and options.environment is None,
        "that the scene's environment is switched off": finish.environment is None and not is_own,
        "how its environment is turned": isinstance(finish.environment_rotation, tuple),
    }
    words = words_of(replace(options, environment=None) if is_own else options)
    return words, "; ".join(text for text, is_so in missing.items() if is_so)


def _is_same(light: Light, other: Light) -> bool:
    for name in vars(light):
        a, b = getattr(light, name), getattr(other, name)
        if name == "direction" and a is not None and b is not None:
            a, b = (np.array(one) / np.linalg.norm(one) for one in (a, b))
        if not (a is b if a is None or b is None else np.allclose(a, b, rtol=1e-6, atol=1e-6)):
            return False
    return True


def _turn_words(picture: ShownPicture, unmoved: Any) -> list[str]:
    """Yaw, pitch and dolly if they make the picture's pose, otherwise the pose itself."""
    state = picture.now.state
    yaw, pitch, dolly = (round(float(one), DIGITS) for one in (state.yaw, state.pitch, 1 - state.distance))
    try:
        moved = viewing_pose(unmoved, None, yaw, pitch, dolly)
    except ValueError:
        return pose_words(picture.pose)
    if np.abs(moved - picture.pose).max() > CLOSE * max(unmoved.scale, 1e-3):
        return pose_words(picture.pose)
    return words_of(PlaceOptions(yaw=yaw, pitch=pitch, dolly=dolly))


def page_line(inputs: Inputs, look: AppearanceGroup, picture: PictureOptions, unlight_all: bool = False) -> str:
    """Return what was typed about what is read and how it looks, but for lights, shading, samples and exposure. A page
    adds the words of what it shows: see page/command.js."""
    named = inputs.frame.named
    named = replace(named, input=FRONT) if named.input == VASE else named  # a page shows no other side
    words = words_of(named) + words_of(inputs.others)
    words += [flag_of("unlight_all")] if unlight_all else []
    words += words_of(replace(look, light=None, shading=AppearanceGroup().shading))
    words += words_of(replace(picture, samples=None, exposure=None, fill=None))
    return _line(words)
