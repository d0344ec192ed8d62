"""The pipeline: a frame and lights in, a lit picture out."""

from __future__ import annotations

import inspect
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import wraps
from typing import TYPE_CHECKING, Concatenate, ParamSpec, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .camera import Camera, check_pose, view_matrix
from .checks import check_choice
from .culling import MERGE, check_merge
from .errors import ContextError
from .estimators import check_method, check_normals, parse_max_depth_step
from .frame import Frame
from .gpu.compute_splats import ComputeSplatPass
from .gpu.context import Context
from .gpu.light import LightPass
from .gpu.resolve import ResolvePass
from .gpu.splats import SplatPass
from .gpu.steps import Steps
from .gpu.surface import SurfacePass
from .gpu.textures import FrameTextures, Target
from .light import Light, at_upper_left, check_lights, light_rows
from .look import SHADINGS, SPLATS, Material, check_sizes
from .noise import Choice, parse_noise
from .notebook import Picture
from .scene import Node, PointObject, Scene

if TYPE_CHECKING:
    import moderngl

    from .scene_renderer import SceneRenderer

RASTERIZERS = ("auto", "points", "compute")
NEAR = 0.001  # share of the frame's scale: what comes closer to the viewer is cut away


class Renderer:
    """Owns the passes, and the OpenGL context unless it is given one. Use it in the thread that made it.

    Each call pays only for what has changed since the last: another light runs only the light pass, another camera
    keeps the normals, the same Frame object is not uploaded twice. `steps` counts what ran.

    context  a moderngl.Context of the caller's; it stays hers, with her framebuffer bound again after each call, but
             with all enable flags (depth test, blending) off. None makes one off screen.
    device   which GPU, counted by EGL (Linux)
    rasterizer  "points" draws splats as GL points (OpenGL 3.3), "compute" by a compute shader (4.3), which leaves sizes
             other than 1 and round splats to the points; "auto" is compute where it can be had
    merge    of the compute rasteriser: 2x2 or 4x4 pixels that lie on one plane, but for this share of 1/z, are carried
             into the view as one splat. Colours and normals stay those of the pixels. 0 carries each by itself.

    Raises ContextError when no OpenGL 3.3 can be had.
    """

    def __init__(
        self, context: moderngl.Context | None = None, device: int = 0, rasterizer: str = "auto", merge: float = MERGE
    ):
        check_choice("rasterizer", rasterizer, RASTERIZERS)
        self.context = Context(context, device)
        self._can_compute = self.context.gl.version_code >= 430 and rasterizer != "points"
        if rasterizer == "compute" and not self._can_compute:
            name = self.context.renderer
            raise ContextError(f"the compute rasteriser needs OpenGL 4.3, {name} offers less: take the points")
        self._merge = check_merge(merge)
        self._rasterizers: dict[str, SplatPass | ComputeSplatPass] = {}  # made when they are first used
        with self.context.gl as gl:
            self._surface = SurfacePass(gl)
            self.resolve = ResolvePass(gl)
            self.light = LightPass(gl)
        self.steps = Steps(self.context.gl, self.context.is_software)
        self._scenes: SceneRenderer | None = None
        self.choice: Choice | None = None  # what estimated the last normals, and why
        self._frames: list[FrameTextures] = []
        self._target: Target | None = None

    def render(
        self,
        frame: Frame | Scene,
        light: Light | Sequence[Light] | None = None,
        material: Material | None = None,
        camera: Camera | None = None,
        pose: ArrayLike | None = None,
        normals: str | ArrayLike = "auto",
        shading: str = "phong",
        size: float | ArrayLike | None = None,
        *,
        splat: str = "footprint",
        max_depth_step: float | str | None = None,
        noise: float | ArrayLike | str | None = None,
    ) -> NDArray[np.uint8]:
        """The frame, lit, seen by a camera: (h, w, 4) uint8 sRGB; alpha is 0 where nothing was drawn.

        The array is a Picture: a notebook shows it. In place of a frame there may be a Scene; of the options it takes
        light (instead of its own), camera and pose, for its objects have the others themselves.

        light    one Light or several; None is the default Light
        camera   who looks; None is the frame's own camera. Its size is the picture's.
        pose     (4, 4) camera-to-world of that camera; None is the frame's own pose
        normals  a method (see `estimate_normals`), or (h, w, 3) floats in the frame's camera axes
        shading  "none", "flat", "gouraud" or "phong"
        size     splat size in source pixels: a number, or (h, w), 1 = the point's own pixel, 0 hides it; None is 1
        splat    "footprint" carries the pixel's square into the view, "round" the circle round it
        max_depth_step, noise  as for `estimate_normals`

        Raises ValueError or TypeError for arguments that do not fit, before anything is drawn.
        """
        self.draw(
            frame, light, material, camera, pose, normals, shading, size,
            splat=splat, max_depth_step=max_depth_step, noise=noise,
        )  # fmt: skip
        with self._in_use():
            assert self._target is not None  # drawn just now
            return self._target.read().view(Picture)

    def draw(
        self,
        frame: Frame | Scene,
        light: Light | Sequence[Light] | None = None,
        material: Material | None = None,
        camera: Camera | None = None,
        pose: ArrayLike | None = None,
        normals: str | ArrayLike = "auto",
        shading: str = "phong",
        size: float | ArrayLike | None = None,
        *,
        splat: str = "footprint",
        max_depth_step: float | str | None = None,
        noise: float | ArrayLike | str | None = None,
    ) -> moderngl.Texture:
        """As `render`, but the picture stays on the GPU: an RGBA8 texture, top row first.

        It belongs to this renderer and holds the picture until the next call.
        """
        if isinstance(frame, Scene):
            return self.draw_scene(frame, light, camera, pose)
        if not isinstance(frame, Frame):
            raise TypeError(f"frame must be a Frame or a Scene, got {type(frame).__name__}: load_frame reads one")
        lights = check_lights(light)
        material, camera = material or Material(), camera or frame.camera
        target_pose = frame.pose if pose is None else check_pose(pose)
        view = view_matrix(frame.pose, target_pose)
        sizes = check_sizes(size, frame.depth.shape)
        check_choice("shading", shading, SHADINGS)
        check_choice("splat", splat, SPLATS)
        if any(one.shadow or one.is_spot for one in lights):
            options = {"size": size, "splat": splat, "max_depth_step": max_depth_step, "noise": noise}
            shown = Node(PointObject(frame, material, normals=normals, shading=shading, **options))
            return self.draw_scene(Scene((shown,)), lights, camera, target_pose)
        run, stamp = self.steps.run, self.steps.stamp
        with self._in_use():
            (textures,) = self.upload([frame])
            self.find_normals(textures, frame, normals, max_depth_step, noise)
            target = self.fit_target(camera)
            self.steps.forget("surfaces")  # a scene's, of which the target is now taken
            way = textures, frame.camera, target, camera, view
            splats, known_views = self.rasterizer(sizes, splat), stamp("splats")
            inputs = camera, view, sizes, splat, id(textures), stamp("surface", textures)
            run("splats", inputs, splats.draw, *way, NEAR * frame.scale, sizes, splat)
            if shading == "phong":
                rows = light_rows([at_upper_left(x, target_pose) for x in lights], target_pose)
                if stamp("splats") > known_views:  # a new view, lit at once: most see one light only
                    lit = self.light.inputs(rows, material)
                    run("resolve", None, self.resolve.draw_lit, *way, splats.look_up, lit)
                else:
                    inputs, options = (shading, stamp("splats")), (shading, splats.look_up, 1 / 65535)
                    run("resolve", inputs, self.resolve.draw_surfaces, target.surfaces, *way, *options)
                    run("light", None, self.light.draw_pixels, target, camera, rows, material)
            else:
                rows, eye = (
                    light_rows([at_upper_left(x, target_pose) for x in lights], frame.pose),
                    np.linalg.inv(view)[:3, 3],
                )
                if shading != "none":
                    run("light", None, self.light.draw_points, textures, frame.camera, eye, rows, material)
                run("resolve", None, self.resolve.draw_picture, *way, shading, splats.look_up)
            return target.color

    def draw_scene(
        self,
        scene: Scene,
        light: Light | Sequence[Light] | None = None,
        camera: Camera | None = None,
        pose: ArrayLike | None = None,
    ) -> moderngl.Texture:
        """A scene, left on the GPU as by `draw`.

        light   in place of the scene's own lights; a scene without any gets the default Light
        camera  who looks; None is the scene's camera
        pose    (4, 4) camera-to-world of that camera; None is the scene's pose
        """
        from .scene_renderer import SceneRenderer  # of no use to single frames

        lights = None if light is None else check_lights(light)
        with self._in_use():
            self._scenes = self._scenes or SceneRenderer(self)
            self.steps.forget("splats")  # a single frame's, of which the target is now taken
            return self._scenes.draw(scene, lights, camera, None if pose is None else check_pose(pose)).color

    def estimate_normals(
        self,
        frame: Frame,
        method: str = "auto",
        *,
        max_depth_step: float | str | None = None,
        noise: float | ArrayLike | str | None = None,
    ) -> NDArray[np.float32]:
        """Unit normals of a frame: (h, w, 3) float32, camera axes, towards the camera; NaN without depth.

        method          "auto" measures the noise of the depth and takes "star" (sharp at edges, for clean depth) or
                        "adaptive" (planes as wide as the noise asks). "star-borrow" is a little better and slower than
                        "star". Classical: "triangles-1", "-2", "-4", "-8" (the mean over at most that many triangles),
                        "central", "one-sided", "plane-fit-3" to "plane-fit-13".
        max_depth_step  for triangles: a neighbour further in depth belongs to another surface. Metres, or "3%" of the
                        pixel's depth; None is no limit. The others find edges by themselves.
        noise           for auto and adaptive: standard deviation of the depth in metres, a number or (h, w), or a
                        sensor's name ("kinect"); None measures it

        Raises ValueError for an unknown method and for noise or a step that is none. What ran and why is in `choice`.
        """
        with self._in_use():
            (textures,) = self.upload([frame])
            self.find_normals(textures, frame, method, max_depth_step, noise)
            normals = textures.read_normals()
        normals[frame.depth == 0] = np.nan
        return normals

    def release(self) -> None:
        """Frees everything this renderer made, in reverse order."""
        self.steps.forget()
        with self._in_use():
            passes = self._scenes, self.light, self.resolve, *self._rasterizers.values(), self._surface
            for item in (self._target, *self._frames, *passes):
                if item is not None:
                    item.release()
        self.context.release()

    def __enter__(self) -> Renderer:
        return self

    def __exit__(self, *_: object) -> None:
        self.release()

    @contextmanager
    def _in_use(self) -> Iterator[moderngl.Context]:
        """This renderer's context, current; afterwards the caller's framebuffer is bound again."""
        self.context.check()
        with self.context.gl as gl:
            bound = gl.detect_framebuffer()
            try:
                yield gl
            finally:
                bound.use()

    def upload(self, frames: list[Frame]) -> list[FrameTextures]:
        """The textures of each frame. Those that no frame has a use for are taken for new ones, or freed."""
        free = [kept for kept in self._frames if not any(kept.frame is frame for frame in frames)]
        wanted: list[FrameTextures] = []
        for frame in frames:
            kept = next((one for one in self._frames if one.frame is frame and one not in wanted), None)
            kept = kept or next((one for one in free if one.fits(frame)), None)
            if kept in free:
                free.remove(kept)
            wanted.append(self._new_textures(frame) if kept is None else kept)
            self.steps.run("upload", (frame,), wanted[-1].upload, frame, of=wanted[-1])
        for one in free:
            self._frames.remove(one)
            self.steps.forget(of=one)
            one.release()
        return wanted

    def _new_textures(self, frame: Frame) -> FrameTextures:
        self._frames.append(FrameTextures(self.context.gl, frame))
        return self._frames[-1]

    def find_normals(
        self,
        textures: FrameTextures,
        frame: Frame,
        normals: str | ArrayLike,
        max_depth_step: float | str | None = None,
        noise: float | ArrayLike | str | None = None,
    ) -> None:
        if isinstance(normals, str):
            check_method(normals)
            options = normals, parse_max_depth_step(max_depth_step), parse_noise(noise, frame.depth)
            inputs = *options, self.steps.stamp("upload", textures)
            args = textures, frame.camera, *options
            self.choice = self.steps.run("surface", inputs, self._surface.run, *args, of=textures)
        else:
            own = check_normals(normals, frame.depth.shape)
            inputs = own, self.steps.stamp("upload", textures)
            self.steps.run("surface", inputs, textures.write_normals, own, frame.depth, of=textures)
            self.choice = Choice("the caller's")

    def rasterizer(self, sizes: NDArray[np.float32], splat: str) -> SplatPass | ComputeSplatPass:
        computed = self._can_compute and splat == "footprint" and (sizes == 1).all()
        kind, context = "compute" if computed else "points", self.context
        if kind not in self._rasterizers:
            options = self._merge, context.is_software
            self._rasterizers[kind] = ComputeSplatPass(context.gl, *options) if computed else SplatPass(context.gl)
        return self._rasterizers[kind]

    def fit_target(self, camera: Camera) -> Target:
        if self._target is None or self._target.size != (camera.width, camera.height):
            if self._target is not None:
                self._target.release()
            self._target = None  # stays so when the new one does not fit the GPU
            self.steps.forget("splats")
            self.steps.forget("surfaces")
            self._target = Target(self.context.gl, camera.width, camera.height)
        return self._target


_mine = threading.local()  # one Renderer a thread, made when it is first needed
_P = ParamSpec("_P")
_R = TypeVar("_R")


def _by_shared_renderer(method: Callable[Concatenate[Renderer, _P], _R]) -> Callable[_P, _R]:
    """The method as a function, called on a Renderer that this thread keeps."""

    @wraps(method)
    def function(*args: _P.args, **options: _P.kwargs) -> _R:
        if not hasattr(_mine, "renderer"):
            _mine.renderer = Renderer()
        return method(_mine.renderer, *args, **options)

    signature = inspect.signature(method)
    without_self = list(signature.parameters.values())[1:]
    function.__signature__ = signature.replace(parameters=without_self)  # type: ignore[attr-defined]
    return function


render = _by_shared_renderer(Renderer.render)
estimate_normals = _by_shared_renderer(Renderer.estimate_normals)
