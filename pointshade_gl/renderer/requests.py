"""What is drawn, by whom it is seen and how; the array into which a picture is read, and how notebooks show it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from functools import cached_property
from os import PathLike
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..checks.arguments import as_given, check_type, is_a
from ..checks.foreign_arrays import Numbers
from ..notes.words import shown
from ..scene.appearance import (
    Appearance,
    AppearanceOptions,
    ColorOptions,
    FormOptions,
    Material,
    NamedOptions,
    SurfaceOptions,
)
from ..scene.camera import Camera, check_pose
from ..scene.cloud import PointCloud
from ..scene.environment import Environment, check_environment
from ..scene.frame import Frame
from ..scene.graph import (
    Scene,
    given_by,
    lit_if_asked,
    lit_where_asked,
    scene_of,
    shaded,
    styled,
    without_environment,
)
from ..scene.light import Light, check_lights
from ..scene.node import Node
from ..scene.objects import PointObject, check_frames
from ..scene.option_fields import takes
from ..scene.settings import SIMPLE, LinearOptions, OutputOptions, OutputSettings
from ..scene.viewpoint import MoveOptions, View, is_turned, viewing_pose

if TYPE_CHECKING:
    from typing_extensions import Unpack

FilePath = str | PathLike[str]
Turns = tuple[float, float, float]
STRAIGHT: Turns = 0.0, 0.0, 0.0


class RenderOptions(NamedOptions, MoveOptions, OutputOptions, total=False):
    """The options of `render` that are passed by name only."""


class PassOptions(NamedOptions, MoveOptions, LinearOptions, total=False):
    """Those of `render_passes`."""


class DepthOptions(MoveOptions, FormOptions, SurfaceOptions, total=False):
    """Those of `render_depth`."""


class PointsOptions(MoveOptions, SurfaceOptions, ColorOptions, total=False):
    """Those of `render_points`."""

    align: bool


class RequestOptions(AppearanceOptions, MoveOptions, OutputOptions, total=False):
    """All options of a request."""

    light: Light | Sequence[Light] | None
    material: Material | None
    camera: Camera | None
    pose: Numbers | None


GROUPS = Appearance, View, OutputSettings  # whose fields these options are


@dataclass(frozen=True, eq=False)
class RenderRequest:
    """One picture: all that decides how it looks.

    source  what is drawn: the same objects that the caller passed, so that the pipeline knows what has not changed
    lights  None: the scene's own, or the default light
    look    of frames; the objects of a scene have their own
    camera  who looks; None: the source's own camera
    pose    (4, 4) of that camera; None: the source's own, moved by `turns`
    turns   yaw, pitch and dolly
    finish  what is made of the light
    coarse  how many times larger the pixels of shadow maps are: of pictures that are looked at while things move
    """

    source: Frame | Sequence[Frame] | Scene | PointCloud
    lights: Sequence[Light] | None = None
    look: Appearance = Appearance()
    camera: Camera | None = None
    pose: Numbers | None = None
    turns: Turns = STRAIGHT
    finish: OutputSettings = SIMPLE
    coarse: int = 1

    @classmethod
    @takes(RequestOptions, *GROUPS)
    def of(cls, source: Source, **options: Unpack[RequestOptions]) -> RenderRequest:
        """Return the request for what `render` takes: the one door at which its arguments are checked.

        A request is returned as it is; a path or a built-in name is read. Raises TypeError or ValueError for anything
        that does not fit, OSError for a path that cannot be read.
        """
        given: dict[str, Any] = {}
        for name, value in options.items():  # this runs for each picture, so it calls next to nothing
            default = _DEFAULTS[name]
            if value is default or (value is None and name == "material"):
                continue
            kind = type(value)
            if (kind is not str and kind is not Material) or value != default:
                given[name] = value
        if type(source) is RenderRequest:
            if given:
                raise TypeError(f"a request has all its options: leave out {', '.join(given)}")
            return source
        if type(source) is not Frame:
            view = _made_of(View, given)
            turns = is_turned(view.pose, view.yaw, view.pitch)
            source = check_source(loaded(turnable(source, given) if turns else source))
        if "environment" in given:
            given["environment"] = _found(given["environment"])
        if isinstance(source, PointCloud):
            source = styled(source, {name: given.pop(name) for name in [*given] if name in _NAMES[Appearance]})
        look, view, finish = _PLAIN[Appearance], _PLAIN[View], _PLAIN[OutputSettings]
        if not given.keys() <= _OF_NO_GROUP:
            view = _made_of(View, given)
            if not given.keys() <= _OF_VIEW:
                look, finish = _made_of(Appearance, given), _made_of(OutputSettings, given)
        if look is not _PLAIN[Appearance] and isinstance(source, Scene):
            names = (name for name in given if name in _NAMES[Appearance])
            raise ValueError(f"the objects of a scene have a look of their own: leave out {', '.join(names)}")
        lights = check_lights(given["light"]) if "light" in given else None
        camera = check_type(given["camera"], Camera, "camera") if "camera" in given else None
        turns = (view.yaw, view.pitch, view.dolly) if view.yaw or view.pitch or view.dolly else STRAIGHT
        drawn: Any = source
        if type(source) is not Frame:
            drawn = _lit_where_asked(source, lights, finish)
        request = cls(drawn, lights, look, camera, view.pose, turns, finish)
        if type(source) is Frame:
            request.__dict__["frames"] = (source,)
        return request

    @classmethod
    def seen(
        cls, source: Frame | Sequence[Frame] | Scene | PointCloud, view: View, pivot: Numbers | None = None
    ) -> RenderRequest:
        """Return the request for a source that a view shows. The camera turns around pivot, (3,) world."""
        if isinstance(source, PointCloud):
            source = scene_of(styled(source, given_by(view.look)))
        is_scene = isinstance(source, Scene)
        camera, pose = view.seen(source if is_scene else check_frames(source)[0], pivot)
        look = Appearance() if is_scene else view.look
        source = _lit_where_asked(source, view.lights or None, view.finish)
        return cls(source, view.lights or None, look, camera, pose, STRAIGHT, view.finish)

    @cached_property
    def frames(self) -> tuple[Frame, ...]:
        """Return the frames of one thing that are drawn; none if it is a scene or a cloud.

        Raises TypeError or ValueError for anything else.
        """
        source = self.source
        if isinstance(source, Frame):
            return (source,)
        return () if isinstance(source, Scene | PointCloud) else check_frames(source)

    def subject(self, scene: Scene) -> Frame | Scene:
        """Return what the viewer turns around: of frames the first, else the scene that was made of the source."""
        return self.frames[0] if self.frames else scene

    @property
    def as_shown(self) -> RenderRequest:
        """Return the request for what is drawn: surfaces with their normals, where colours are no light."""
        if self.finish.show == "light":
            return self
        source, look = self.source, replace(self.look.as_taken, shading="phong")
        if look.missing == "photo":  # which has no surface
            look = replace(look, missing="complete")
        if isinstance(source, PointCloud):
            source = styled(source, {"shading": "phong"})
        elif isinstance(source, Scene):
            source = without_environment(shaded(source, "phong"))
        return replace(self, source=source, lights=(), look=look, finish=self.finish.of_numbers)

    def lights_of(self, scene: Scene) -> tuple[Light, ...]:
        """Return the lights: those given, else the scene's own, else one, unless there is an environment; that of a
        ground casts shadows."""
        given: Any = self.lights
        if given is not None:
            return given if given.__class__ is tuple else check_lights(given)  # `of` has checked a tuple
        if scene.lights or self.environment_of(scene):
            return scene.lights
        if not self.finish.ground:
            return check_lights(None)
        from ..estimation.ground import LIGHT  # only here

        return check_lights(LIGHT)

    def environment_of(self, scene: Scene) -> Environment | None:
        """Return the light from all around: that given, else the scene's own, else none."""
        return check_environment(self.finish.environment) or scene.environment

    def seen_by(self, scene: Scene) -> tuple[Camera, NDArray[np.float64]]:
        """Return who looks at the scene that was made of the source. Raises TypeError or ValueError."""
        camera = scene.camera if self.camera is None else self.camera
        if type(camera) is not Camera:
            camera = check_type(camera, Camera, "camera")
        if self.turns is STRAIGHT and self.pose is not None:
            return camera, check_pose(self.pose)
        return camera, viewing_pose(self.subject(scene), self.pose, *self.turns)

    @property
    def view(self) -> View:
        """Return how it is seen and drawn, for other sources."""
        yaw, pitch, dolly = self.turns
        lights = self.lights or ()
        return View(lights, self.pose, yaw=yaw, pitch=pitch, dolly=dolly, look=self.look, finish=self.finish)


Source = Frame | Sequence[Frame] | Scene | PointCloud | FilePath | RenderRequest


class Scenes:
    """Makes scenes of frames, and keeps the last one: the same object shows the pipeline that nothing has changed."""

    def __init__(self) -> None:
        self._last: tuple[tuple[Frame, ...], Appearance, Scene] | None = None
        self._cloud: tuple[PointCloud, Scene] | None = None

    def of(self, request: RenderRequest) -> Scene:
        """Return what a request draws, with a camera."""
        source, last = request.source, self._last
        if last is not None and last[0][0] is source and not last[0][1:] and last[1] is request.look:
            return last[2]
        if isinstance(source, Scene):
            return source.framed()
        return self.of_cloud(source) if isinstance(source, PointCloud) else self.of_frames(request.frames, request.look)

    def of_cloud(self, cloud: PointCloud) -> Scene:
        """Return the scene of a cloud, with a camera; the last one again if nothing has changed."""
        if self._cloud is None or not self._cloud[0].is_like(cloud):
            self._cloud = cloud, scene_of(cloud).framed()
        return self._cloud[1]

    def of_frames(self, frames: tuple[Frame, ...], look: Appearance) -> Scene:
        """Return the scene of one object; the last one again if nothing has changed."""
        if self._last is None or self._last[0] != frames or not look.is_uniform or self._last[1] != look:
            first = frames[0]
            scene = Scene((Node(PointObject(frames, look=look)),), first.picture_camera, first.pose)
            self._last = (frames, look, scene) if look.is_uniform else None
            return scene
        return self._last[2]


def loaded(source: Any) -> Any:
    """Return the frame, frames or scene itself; of a path or a built-in name, what is there."""
    if not is_a(source, str, PathLike):
        return source
    from ..files.access.known_names import WHOLE, builtin_name
    from ..files.frame_sources import load_any, open_source  # which import the readers of all files

    return open_source(source) if builtin_name(source) == WHOLE else load_any(source)


def turnable(source: Any, options: Mapping[str, Any]) -> Any:
    """Return the source; of the built-in object all sides, unless options are of one frame alone."""
    if not is_a(source, str, PathLike):
        return source
    from ..files.access.known_names import VASE, WHOLE, builtin_name

    if builtin_name(source) != VASE:
        return source
    look = _made_of(Appearance, {name: value for name, value in options.items() if value is not None})
    return source if look.splat == "mesh" or not look.is_uniform else WHOLE


def load_all_sides() -> dict[int, Frame]:
    """Read the frames of the built-in object, by their numbers."""
    from ..files.access.known_names import WHOLE
    from ..files.frame_sources import open_source, views_of

    return views_of(open_source(WHOLE), None)


def _found(environment: Any) -> Any:
    """Return the environment that a file or a name stands for."""
    if not is_a(environment, str, PathLike):
        return environment
    from ..files.pictures.hdr_files import find_environment  # which imports the readers of pictures

    return find_environment(environment)


def check_source(source: Any) -> Frame | Sequence[Frame] | Scene | PointCloud:
    """Return the source. Raises TypeError or ValueError for anything but a frame, several, a scene or a cloud."""
    if isinstance(source, Frame | Scene | PointCloud):
        return source
    if is_a(source, Sequence) and not is_a(source, bytes):
        return check_frames(source)
    expected = "frame must be a Frame, a sequence of frames, a Scene, a PointCloud or a path"
    raise TypeError(f"{expected}, got {shown(source)}")


_DEFAULTS: dict[str, Any] = dict.fromkeys(RequestOptions.__annotations__) | {
    one.name: one.default for group in GROUPS for one in fields(group)
}
_NAMES = {group: [one.name for one in fields(group)] for group in GROUPS}
_PLAIN: dict[type, Any] = {group: group() for group in GROUPS}  # shared: a picture without options makes none
_OF_NO_GROUP = {"light", "camera"}
_OF_VIEW = {*_OF_NO_GROUP, "pose", "yaw", "pitch", "dolly"}


def _lit_where_asked(source: Any, lights: Sequence[Light] | None, finish: OutputSettings) -> Any:
    """Return a source with light on trained splats, if the picture or the scene has a light that is not the default."""
    is_asked = lights is not None or finish.environment is not None or bool(finish.ambient_occlusion)
    if isinstance(source, PointCloud):
        return lit_if_asked(source) if is_asked else source
    if isinstance(source, Scene) and (is_asked or source.lights or source.environment is not None):
        return lit_where_asked(source)
    return source


def _made_of(group: type, given: dict[str, Any]) -> Any:
    """Return a group with those of the options that are its fields."""
    own = {name: given[name] for name in _NAMES[group] if name in given}
    return group(**own) if own else _PLAIN[group]


def output_array(out: Any, camera: Camera) -> NDArray[np.uint8]:
    """Return the array itself; of a tensor or a buffer one in its memory.

    Raises TypeError or ValueError for what a picture of this camera cannot be read into.
    """
    wanted = camera.height, camera.width, 4
    expected = f"out must be an array of shape {wanted}, uint8 and in C order, that can be written to"
    array: NDArray[Any] = out if is_a(out, np.ndarray) else as_given(out, expected)
    if not array.ndim:
        raise TypeError(f"{expected}, got {shown(out)}")
    if array is not out and not np.may_share_memory(array, as_given(out, expected)):
        raise TypeError(f"{expected}, got a {type(out).__name__}, of which NumPy has a copy only")
    if array.dtype != np.uint8:
        raise TypeError(f"{expected}, got {array.dtype}")
    if array.shape != wanted:
        raise ValueError(f"{expected}, got shape {array.shape}")
    if not array.flags.c_contiguous:
        raise ValueError(f"{expected}, got one in another order, with strides {array.strides}")
    if not array.flags.writeable:
        raise ValueError(f"{expected}, got a read-only one")
    return array


class Picture(np.ndarray):
    """An array that a notebook shows as a picture, as long as it is one: (h, w, 3|4) uint8."""

    def __array_wrap__(self, array: Any, context: Any = None, return_scalar: bool = False) -> Any:
        """What NumPy makes of it: a single number, such as its mean, is a plain one, which `round` and JSON take."""
        return super().__array_wrap__(array, context) if array.ndim else array[()]

    def _repr_png_(self) -> bytes | None:
        if self.dtype != np.uint8 or self.ndim != 3 or self.shape[2] not in (3, 4) or not self.size:
            return None  # the notebook prints the numbers
        from ..files.pictures.picture_files import encode_png

        return encode_png(np.asarray(self))
