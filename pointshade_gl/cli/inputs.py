"""What the command line reads: the frame, the sequence, the scene or the photographs that the options name."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..files.access.known_names import FRAMES
from ..notes.words import option
from ..renderer.renderer import Renderer
from ..scene.appearance import Look
from ..scene.cloud import PointCloud
from ..scene.frame import Frame
from ..scene.graph import Scene, given_by, scene_of, shaded, styled
from ..scene.node import Node
from ..scene.objects import PointObject
from .option_groups import frames_from, views_from
from .options import FrameOptions
from .output import explainer, spinner

PLAIN = Look()


class MergedViews(NamedTuple):
    """Frames that are drawn as one object.

    scene    with the object; who looks is the first one's camera
    numbers  of the frames in a file of their poses
    """

    scene: Scene
    frames: Sequence[Frame]
    names: list[str]
    numbers: list[int]

    @classmethod
    def of(cls, frames: Sequence[Frame], look: Look, names: list[str], numbers: list[int]) -> MergedViews:
        """Return frames as one object."""
        scene = Scene((Node(PointObject(frames, look=look)),), frames[0].picture_camera, frames[0].pose)
        return cls(scene, frames, names, numbers)


def load(frame: FrameOptions, sequence: bool = False, scene: bool = False, pose: Any = None) -> Any:
    """The frame, the whole sequence or the scene that the options name; the built-in vase if they name nothing.

    pose  (4, 4) of all frames; None: those in the files
    """
    from ..files.clouds.load_cloud import check_frame_options
    from ..files.frame_sources import is_cloud, is_scene, load_any, open_source
    from ..files.frames.frame_files import load_frame

    source, options = frame.input, frame.load_options | ({} if pose is None else {"pose": pose})
    if not scene:
        check_frame(frame)
    frame.check_exist()
    if source is None and frame.color is None and frame.depth is None:
        source = FRAMES[0]
    for is_kind, kind in ((is_scene, "a scene"), (is_cloud, "a point cloud")):
        if is_kind(source):
            if frame.frame is not None:
                raise ValueError(f"{option('frame')} is one of a sequence, and {source} is {kind}: leave it out")
            return load_any(source, **options, **frame.cloud_options)
    check_frame_options(frame.cloud_options, source)
    if frame.frame is not None:
        return _numbered(open_source(source, **options), frames_from(frame.frame, 1)[0])
    return (open_source if sequence else load_frame)(source, **options)


def load_clouds(frame: FrameOptions, look: Look, plain: Look, inputs: Sequence[str]) -> Scene:
    """Several point clouds as one scene, in which each is called as its file. plain: the look without options."""
    paths = [path for path in (frame.input, *inputs) if path is not None]
    clouds = [load(replace(frame, input=path), scene=True) for path in paths]
    return scene_of(
        *(styled(cloud, given_by(look, plain)) for cloud in clouds), names=[Path(path).stem for path in paths]
    )


def are_clouds(frame: FrameOptions, inputs: Sequence[str]) -> bool:
    """Whether the INPUTs are point clouds. Raises ValueError where only some are."""
    from ..files.frame_sources import is_cloud

    paths = [frame.input, *inputs]
    clouds = [path for path in paths if is_cloud(path)]
    if clouds and len(clouds) < len(paths):
        other = next(path for path in paths if path not in clouds)
        raise ValueError(
            f"{clouds[0]} is a point cloud and {other or 'the other INPUT'} is none: pass INPUTs of one kind, or put "
            "them into one Scene in Python"
        )
    return bool(clouds)


def load_together(frame: FrameOptions, look: Look, inputs: Sequence[str]) -> MergedViews:
    """One frame of each of several inputs, the first or that with the number given, as one object."""
    every = [str(frame.input), *inputs]
    numbers = [0] * len(every) if frame.frame is None else frames_from(frame.frame, len(every))
    check_different(every, numbers)
    names = [f"{name} {number}" if every.count(name) > 1 else name for name, number in zip(every, numbers, strict=True)]
    sources = load_several(replace(frame, frame=None), inputs, names)
    found = [_numbered(source, number) for source, number in zip(sources, numbers, strict=True)]
    return MergedViews.of(found, look, every, list(range(len(every))))


def check_different(inputs: Sequence[str], numbers: Sequence[int]) -> None:
    """Raises ValueError if the same frame is given twice. numbers: of the frame in each of the inputs."""
    found = [(Path(path).resolve(), number) for path, number in zip(inputs, numbers, strict=True)]
    twice = next((path for k, path in enumerate(inputs) if found[k] in found[:k]), None)
    if twice is not None:
        raise ValueError(
            f"{twice} is given twice: pass folders that differ, or {option('views', 'N')} for frames of one folder"
        )


def _numbered(source: Any, number: int) -> Frame:
    """A frame of a sequence by its number. A single frame is number 0."""
    frames = source if isinstance(source, Sequence) else [source]
    if number >= len(frames):
        raise ValueError(f"{option('frame', number)}: there are {len(frames)} frames, counted from 0")
    return frames[number]


def load_views(frame: FrameOptions, look: Look, views: str) -> MergedViews:
    """Frames of a sequence as one object."""
    from ..files.frame_sources import views_of

    count = views_from(views)
    check_frame(frame)
    source = load(frame, sequence=True)
    found = views_of(source, count)
    numbers = [source.parts[k].number for k in found]
    return MergedViews.of(list(found.values()), look, list(map(str, found)), numbers)


def load_several(frame: FrameOptions, inputs: Sequence[str], names: Sequence[str] = ()) -> list[Any]:
    """Sources of frames of one thing, all read with the same options: of INPUT, and of more.

    names  by which their poses are found in a file; the inputs themselves by default

    Raises ValueError without poses.
    """
    from ..files.finding.folder_cameras import poses_of_inputs
    from ..files.frame_sources import check_posed

    if frame.depth or frame.color:
        raise ValueError(f"pass {option('depth')} or {option('color')} with one INPUT")
    frame.check_exist()
    every = [str(frame.input), *inputs]
    poses = (
        [None] * len(every) if frame.poses is None else poses_of_inputs(frame.poses, names or every, frame.max_pixels)
    )
    one = replace(frame, poses=None)
    found = [load(replace(one, input=path), sequence=True, pose=pose) for path, pose in zip(every, poses, strict=True)]
    check_posed(found)
    return found


def check_frame(frame: FrameOptions) -> None:
    """Raises ValueError for a scene, and for a point cloud."""
    from ..files.frame_sources import is_cloud, is_scene

    for is_kind, kind in ((is_scene, "a scene"), (is_cloud, "a point cloud")):
        if is_kind(frame.input):
            raise ValueError(f"{frame.input} is {kind}, expected a frame: pass it to `pointshade render` or `view`")


def as_scene(source: Any, look: Look, plain: Look) -> Any:
    """A scene or a point cloud as a scene, with the options of a look that were given; a frame as it is.

    plain  the look without options. Raises ValueError for options that the objects have not.
    """
    if isinstance(source, Scene):
        return shaded(source, check_look(look, plain))
    if isinstance(source, PointCloud):
        return scene_of(styled(source, given_by(look, plain)))
    return source


def check_stream(look: Look, is_stream: bool) -> None:
    """Raises ValueError for a filter over time where only one frame is drawn."""
    if look.temporal and not is_stream:
        raise ValueError(
            f"{option('temporal', True)} filters the frames of a sequence over time, and here is a single one: "
            "leave it out, or pass a sequence, and write its frames to a film or to numbered files, such as %04d.png"
        )


def check_align(aligns: bool, is_several: bool) -> None:
    """Raises ValueError for poses that are to be corrected of a single frame."""
    if aligns and not is_several:
        raise ValueError(
            f"{option('align', True)} corrects the poses of several frames of one thing, and here is a single one: "
            f"pass {option('views', 'N')} or several INPUTs, or write the frames of a sequence to a film"
        )


def check_look(look: Look, plain: Look = PLAIN) -> str | None:
    """The shading for all objects of a scene, None if each keeps its own. plain: of a command without options.

    Raises ValueError for other options about the look of objects: those of a scene have their own.
    """
    given, usual = ({**one.options, **vars(one.material)} for one in (look, plain))
    changed = [name for name in given if name not in ("material", "shading") and given[name] != usual[name]]
    if changed:
        options = ", ".join(map(option, changed))
        raise ValueError(f"the objects of a scene have a look of their own: leave out {options}")
    return None if look.shading == plain.shading else look.shading


def load_photographs(frame: FrameOptions) -> Sequence[Frame]:
    """Read all frames of a sequence. Raises ValueError for a scene and for a single frame."""
    check_frame(frame)
    if frame.frame is not None:
        raise ValueError(f"an albedo needs all photographs of a folder: leave out {option('frame')}")
    found = load(frame, sequence=True)
    if isinstance(found, Frame):
        raise ValueError("an albedo needs several photographs of one view: pass a folder with a sequence of frames")
    return found


def albedo_of(renderer: Renderer, photos: Sequence[Frame], explain: bool) -> NDArray[np.uint8]:
    """Estimate the albedo that photographs share; --explain prints their lights."""
    with spinner("estimating the albedo"):
        albedo = renderer.estimate_albedo(photos)
    explainer(explain)(renderer)
    return albedo


def as_one_frame(renderer: Renderer, photos: Sequence[Frame], explain: bool) -> Frame:
    """Return the first photograph in the colours of the albedo that all share."""
    return replace(photos[0], color=albedo_of(renderer, photos, explain))
