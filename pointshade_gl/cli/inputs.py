"""What the command line reads: the frame, the sequence, the scene or the photographs that the options name."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..files.access.known_names import VASE, WHOLE
from ..files.input_kinds import Kind
from ..notes.notes import print_note
from ..notes.words import option
from ..renderer.renderer import Renderer
from ..scene import graph, viewpoint
from ..scene.appearance import Appearance
from ..scene.camera import check_pose
from ..scene.cloud import PointCloud
from ..scene.frame import Frame
from ..scene.graph import Scene
from ..scene.node import Node
from ..scene.objects import PointObject
from ..scene.settings import FILM, STILL
from ..scene.viewpoint import View
from .option_groups import AppearanceGroup, frames_from, views_from
from .options import CloudGroup, FrameOptions, MoreOptions, PictureOptions, PlaceOptions, ViewOptions
from .output import explainer, spinner

if TYPE_CHECKING:
    from ..files.clouds.cloud_columns import ColorLegend

PLAIN = Appearance()


class Loaded(NamedTuple):
    """What is drawn."""

    source: Any  # a frame, a sequence of frames or a scene
    # that are drawn as one object, whose scene is the source; who looks is the first one's camera
    frames: Sequence[Frame] = ()
    names: Sequence[str] = ()  # of these frames
    numbers: Sequence[int] = ()  # of these frames in a file of their poses
    legend: ColorLegend | None = None  # what the colours of a cloud mean that numbers were turned into

    @classmethod
    def merged(cls, frames: Sequence[Frame], look: Appearance, names: Sequence[str], numbers: Sequence[int]) -> Loaded:
        scene = Scene((Node(PointObject(frames, look=look)),), frames[0].picture_camera, frames[0].pose)
        return cls(scene, frames, names, numbers)

    @property
    def plays(self) -> bool:
        return isinstance(self.source, Sequence)


@dataclass(frozen=True)
class Inputs:
    """What a command names, before it is read."""

    frame: FrameOptions
    others: MoreOptions

    @property
    def paths(self) -> list[str | None]:
        return [self.frame.input, *(self.others.more or [])]

    @cached_property
    def kind(self) -> Kind:
        """What INPUT is; several of different kinds, or with a scene among them, are one scene."""
        kinds = {Kind.of(path) for path in self.paths}
        return Kind.of(self.frame.input) if len(kinds) == 1 else Kind.SCENE

    def load(self, look: Appearance, plain: Appearance, sequence: bool = False) -> Loaded:
        """Read what is drawn; a scene and point clouds with the options of a look that were given. plain: the look
        without options. Raises ValueError for options that the objects have not."""
        names = [Path(str(path)).stem for path in self.paths]
        if self.kind is Kind.CLOUD:
            given, legends = graph.given_by(look, plain), list[Any]()
            clouds = [
                graph.styled(self._load_beside(replace(self.frame, input=path), legends), given) for path in self.paths
            ]
            return Loaded(graph.scene_of(*clouds, names=names), legend=next(iter(legends), None))
        if self.kind is Kind.SCENE and self.others.more:
            return self._load_kinds(look, plain, names)
        if self.others.more:
            return self._load_together(look)
        if self.others.views is not None:
            return self._load_views(look, self.others.views)
        if self._is_mesh(self.frame.input):
            legends = list[Any]()
            mesh = graph.dressed(self._load_beside(self.frame, legends), graph.given_by(look, plain))
            return Loaded(mesh, legend=next(iter(legends), None))
        found = load(self.frame, sequence, scene=True)
        return Loaded(graph.shaded(found, check_look(look, plain)) if self.kind is Kind.SCENE else found)

    @staticmethod
    def _is_mesh(path: str | None) -> bool:
        from ..files.clouds.load_cloud import is_mesh

        return is_mesh(path)

    def _load_beside(self, frame: FrameOptions, legends: list[Any]) -> Any:
        """A cloud or a mesh. What its colours mean is added to the legends."""
        from ..files.clouds.load_cloud import check_cloud_options, load_with_legend

        if not frame.cloud_options.get("color_by") or frame.frame is not None:
            return load(frame, scene=True)
        frame.check_exist()
        check_cloud_options([name for name, one in frame.load_options.items() if one is not None], str(frame.input))
        shared = {"max_pixels": frame.max_pixels, "allow_outside": frame.allow_outside}
        found, legend = load_with_legend(str(frame.input), **shared, **frame.cloud_options)
        legends += [legend] if legend is not None else []
        return found

    def _load_kinds(self, look: Appearance, plain: Appearance, names: list[str]) -> Loaded:
        """Clouds, scenes and frames as one scene, each with those of the options that it has."""
        from ..files.clouds.load_cloud import check_cloud_options, check_frame_options

        if self.others.views is not None:
            raise ValueError(f"{option('views')} merges the frames of one sequence: leave it out, or pass one INPUT")
        if self.frame.frame is not None:
            raise ValueError(f"{option('frame')} is of frames alone: leave it out, or pass the frame's own file")
        given, legends, parts = graph.given_by(look, plain), list[Any](), list[Any]()
        kinds = [Kind.of(path) for path in self.paths]
        shading = None if look.shading == plain.shading else look.shading
        of_clouds = {one.name: one.default for one in fields(CloudGroup)}
        kept = (*of_clouds, "input", "max_pixels", "allow_outside")
        of_frames = {one.name: one.default for one in fields(self.frame) if one.name not in kept}
        if Kind.FRAMES not in kinds:
            graph.check_of_clouds(given)
            check_cloud_options([one for one in of_frames if getattr(self.frame, one) not in (None, False)], names[0])
        meshes = [self._is_mesh(path) for path in self.paths]
        if Kind.CLOUD not in kinds and not any(meshes):
            check_frame_options(self.frame.cloud_options, names[0])
        for path, kind, is_mesh in zip(self.paths, kinds, meshes, strict=True):
            alone = replace(self.frame, input=path, **of_frames)
            if kind is Kind.CLOUD:
                own = {name: one for name, one in given.items() if graph.is_of_clouds(name) and name != "shading"}
                part: Any = graph.styled(self._load_beside(alone, legends), own)
                parts.append(part if shading is None else part._shaded(shading))
            elif is_mesh:
                own = {name: one for name, one in given.items() if name in ("material", "shading")}
                if Kind.CLOUD in kinds:  # a field is that of the clouds
                    alone = replace(alone, color_by=None, color_range=None)
                parts.append(graph.dressed(self._load_beside(alone, legends), own))
            elif kind is Kind.SCENE:
                parts.append(graph.shaded(load(replace(alone, **of_clouds), scene=True), shading))
            else:
                found = load(replace(self.frame, input=path, frame=None, **of_clouds), sequence=True)
                if not isinstance(found, Frame):
                    print_note(f"{path}: the first of its {len(found)} frames is drawn, the others are left out")
                parts.append(PointObject(_numbered(found, 0), look=look))
        return Loaded(graph.beside(parts, names), legend=next(iter(legends), None))

    def _load_together(self, look: Appearance) -> Loaded:
        """One frame of each of several inputs, the first or that with the number given."""
        every = list(map(str, self.paths))
        numbers, names = numbers_and_names(self.frame, every)
        check_different(every, numbers)
        sources = load_several(replace(self.frame, frame=None), every, names)
        found = [_numbered(source, number) for source, number in zip(sources, numbers, strict=True)]
        return Loaded.merged(found, look, every, range(len(every)))

    def _load_views(self, look: Appearance, views: str) -> Loaded:
        from ..files.frame_sources import views_of

        count = views_from(views)
        source = load(self.frame, sequence=True)
        found = views_of(source, count)
        numbers = [source.parts[k].number for k in found]
        return Loaded.merged(list(found.values()), look, list(map(str, found)), numbers)


def with_all_sides(frame: FrameOptions, others: MoreOptions, turns: bool) -> tuple[FrameOptions, MoreOptions]:
    """The options, with all frames of the built-in object where it is named, or its front alone and the view turns."""
    if turns and is_front(frame, others):
        frame = replace(frame, input=WHOLE)
    if frame == FrameOptions(input=WHOLE) and not others.is_set:
        others = replace(others, views="all")
    return frame, others


def is_turned(place: PlaceOptions) -> bool:
    """Whether the camera turns so far that a frame at the world's origin does not show all that is seen."""
    pose = None if place.pose is None else check_pose(place.place()["pose"])
    return viewpoint.is_turned(pose, place.yaw, place.pitch)


def is_front(frame: FrameOptions, others: MoreOptions) -> bool:
    """Whether nothing but the front of the built-in object is named."""
    return frame.named == FrameOptions(input=VASE) and not others.is_set


def load(frame: FrameOptions, sequence: bool = False, scene: bool = False, pose: Any = None) -> Any:
    """The frame, the whole sequence or the scene that the options name; the built-in vase if they name nothing. scene:
    whether it may be a scene or a point cloud. pose: (4, 4) of all frames; None: those in the files."""
    from ..files.clouds.load_cloud import check_frame_options
    from ..files.frame_sources import load_any, open_source

    kind = frame.kind if scene else check_frame(frame)
    frame.check_exist()
    source, options = frame.named.input, frame.load_options | ({} if pose is None else {"pose": pose})
    if kind is not Kind.FRAMES:
        if frame.frame is not None:
            raise ValueError(f"{option('frame')} is one of a sequence, and {source} is {kind.value}: leave it out")
    elif sequence or frame.frame is not None:
        check_frame_options(frame.cloud_options, source)
        opened = open_source(source, **options)
        return opened if frame.frame is None else _numbered(opened, frames_from(frame.frame, 1)[0])
    return load_any(source, **options, **frame.cloud_options)


def load_points(frame: FrameOptions) -> PointCloud:
    """The points of a cloud, and of a mesh its vertices."""
    from ..files.clouds.load_cloud import is_mesh, load_cloud

    if not is_mesh(frame.input):
        return load(frame, scene=True)
    return load_cloud(str(frame.input), max_pixels=frame.max_pixels, **frame.cloud_options)


def check_frame(frame: FrameOptions) -> Kind:
    """Return what it is. Raises ValueError for a scene, and for a point cloud."""
    kind = frame.kind
    if kind is not Kind.FRAMES:
        raise ValueError(f"{frame.input} is {kind.value}, expected a frame: pass it to `pointshade render` or `view`")
    return kind


def numbers_and_names(frame: FrameOptions, inputs: Sequence[str]) -> tuple[list[int], list[str]]:
    """Return which frame is read of each input, by default the first, and the names of these frames. They are called
    like their inputs, with the number where one input is there twice."""
    numbers = [0] * len(inputs) if frame.frame is None else frames_from(frame.frame, len(inputs))
    pairs = zip(inputs, numbers, strict=True)
    return numbers, [f"{path} {number}" if inputs.count(path) > 1 else path for path, number in pairs]


def check_different(inputs: Sequence[str], numbers: Sequence[int]) -> None:
    """Raises ValueError if the same frame is given twice. numbers: of the frame in each of the inputs."""
    found = [(Path(path).resolve(), number) for path, number in zip(inputs, numbers, strict=True)]
    twice = next((path for k, path in enumerate(inputs) if found[k] in found[:k]), None)
    if twice is not None:
        way_out = f"pass folders that differ, or {option('views', 'N')} for frames of one folder"
        raise ValueError(f"{twice} is given twice: {way_out}")


def _numbered(source: Any, number: int) -> Frame:
    """A frame of a sequence by its number. A single frame is number 0."""
    frames = [source] if isinstance(source, Frame) else source
    if number >= len(frames):
        raise ValueError(f"{option('frame', number)}: there are {len(frames)} frames, counted from 0")
    return frames[number]


def load_several(frame: FrameOptions, inputs: Sequence[str], names: Sequence[str] = ()) -> list[Any]:
    """Sources of frames of one thing, all read with the same options. names: by which their poses are found in a file;
    the inputs themselves by default. Raises ValueError without poses."""
    from ..files.finding.folder_cameras import poses_of_inputs
    from ..files.frame_sources import check_posed

    check_inputs_alone(frame)
    frame.check_exist()
    poses: Sequence[Any] = [None] * len(inputs)
    if frame.poses is not None:
        poses = poses_of_inputs(frame.poses, names or inputs, frame.max_pixels)
    one = replace(frame, poses=None)
    found = [load(replace(one, input=path), sequence=True, pose=pose) for path, pose in zip(inputs, poses, strict=True)]
    check_posed(found)
    return found


def check_inputs_alone(frame: FrameOptions) -> None:
    """Raises ValueError for files of one frame beside several INPUTs."""
    if frame.depth or frame.color:
        raise ValueError(f"pass {option('depth')} or {option('color')} with one INPUT")


def view_of(
    kind: Kind, look: AppearanceGroup, place: ViewOptions, picture: PictureOptions, output: Path, *,
    is_film: bool, is_changed: bool,
) -> View:  # fmt: skip
    """The View of what is drawn. Raises ValueError or OSError. is_changed: whether something else than a single frame
    is seen by its own camera."""
    chosen, is_scene = look.look(), kind is not Kind.FRAMES
    lights = look.lights(shadow=picture.ground or is_scene)
    is_soft = picture.ground or any(light.is_soft for light in lights)
    is_photograph = chosen.is_plain and place == ViewOptions() and not (is_scene or is_changed or picture.ground)
    is_fast = is_film or (kind is Kind.CLOUD and not is_soft)
    samples = 1 if is_photograph else FILM if is_fast else STILL
    return place.view(chosen, lights, picture.finish(output, samples))


def check_stream(look: Appearance, is_stream: bool) -> None:
    """Raises ValueError for a filter over time where only one frame is drawn."""
    if look.temporal and not is_stream:
        fact = f"{option('temporal', True)} filters the frames of a sequence over time, and here is a single one"
        way_out = "pass a sequence, and write its frames to a film or to numbered files, such as %04d.png"
        raise ValueError(f"{fact}: leave it out, or {way_out}")


def check_align(aligns: bool, is_several: bool) -> None:
    """Raises ValueError for poses that are to be corrected of a single frame."""
    if aligns and not is_several:
        fact = f"{option('align', True)} corrects the poses of several frames of one thing, and here is a single one"
        way_out = f"pass {option('views', 'N')} or several INPUTs, or write the frames of a sequence to a film"
        raise ValueError(f"{fact}: {way_out}")


def check_look(look: Appearance, plain: Appearance = PLAIN) -> str | None:
    """The shading for all objects of a scene, None if each keeps its own. plain: of a command without options. Raises
    ValueError for other options about the look of objects: those of a scene have their own."""
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
