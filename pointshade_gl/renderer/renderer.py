"""The public face: frames and scenes in, pictures out. Checks its input, owns the context, keeps to its thread."""

from __future__ import annotations

import warnings
import weakref
from collections.abc import Callable, Generator, Sequence
from contextlib import AbstractContextManager, contextmanager
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any, Literal, get_args

import moderngl
import numpy as np
from numpy.typing import NDArray

from ..checks.arguments import Progress, check_choice, check_count, check_type, is_a
from ..checks.foreign_arrays import Exporter, Numbers
from ..gpu.context.caller_state import textures
from ..gpu.context.context import Context
from ..gpu.core.steps import Steps
from ..gpu.core.view_images import Drawable
from ..notes.errors import Cancelled, ContextError, is_expected
from ..notes.notes import Note, taken_by
from ..notes.words import shown
from ..pipeline.pipeline import LitPoints, Pipeline
from ..scene.appearance import NOT_LIT, Material, Shading
from ..scene.camera import Camera, check_pose
from ..scene.cloud import PointCloud, cloud_of
from ..scene.environment import EnvironmentLight
from ..scene.frame import Frame
from ..scene.graph import Scene
from ..scene.light import Light, at_upper_left, check_lights
from ..scene.node import Placed
from ..scene.noise import Choice, Method
from ..scene.objects import check_frames
from ..scene.option_fields import takes
from ..scene.passes import OF_LIGHT, OF_SURFACES, PASSES, Passes, check_passes, kind_of, surface_layers
from ..scene.settings import SIMPLE, OutputSettings
from ..scene.triangles import meshes_of
from ..scene.values import ColorScale, linear_to_bytes
from ..scene.visible import MERGE, check_merge
from .estimates import Estimates
from .requests import (
    GROUPS,
    STRAIGHT,
    DepthOptions,
    FilePath,
    PassOptions,
    Picture,
    PointsOptions,
    RenderOptions,
    RenderRequest,
    Scenes,
    Source,
    loaded,
    output_array,
)

if TYPE_CHECKING:
    from typing_extensions import Unpack


Rasterizer = Literal["auto", "points", "compute"]
RASTERIZERS: tuple[Rasterizer, ...] = get_args(Rasterizer)
OVERLAP = 2  # pixels by which meshes of several frames reach over one another


class Renderer(Estimates):
    """Draw pictures, and own the OpenGL context unless one is given. Use it in the thread that made it.

    Each call pays only for what has changed since the last: another light runs only the light pass, another camera
    keeps the normals, the same Frame object is not uploaded twice. `steps` counts what ran.

    On one machine and driver the same call gives the same picture, to the bit, whatever was drawn before. Only streams
    remember: `temporal` averages over earlier frames, and frames of one `source` share a decision about their noise.

    A frame of more than 33 million points, or larger than a texture may be, is drawn in tiles, which take turns on the
    GPU: its memory there is bounded. Each new view of it uploads it again, and estimates its normals again.

    Parameters
    ----------
    context : moderngl.Context, optional
        A context of the caller's, who keeps it: what is set and bound in it changes no picture and is left as it was.
        None makes one off screen.
    device : int
        Which GPU, counted by EGL (Linux).
    rasterizer : {"auto", "points", "compute"}
        "points" draws splats as GL points (OpenGL 3.3), "compute" by a compute shader (4.3), which leaves sizes other
        than 1 and round splats to the points; "auto" is compute where the driver has it.
    merge : float
        Of the compute rasteriser on software drivers: 2x2 or 4x4 pixels on one plane, to within this share of 1/z, are
        drawn as one splat. Colours and normals stay those of the pixels. 0 draws each pixel by itself, as GPUs do.

    Raises
    ------
    ContextError
        Without OpenGL 3.3.
    TypeError, ValueError
        For arguments of another kind.
    """

    def __init__(
        self, context: moderngl.Context | None = None, device: int = 0, rasterizer: Rasterizer = "auto",
        merge: float = MERGE,
    ):  # fmt: skip
        check_choice("rasterizer", rasterizer, RASTERIZERS)
        check_merge(merge)
        if not is_a(context, moderngl.Context, type(None)):
            raise TypeError(f"context must be a moderngl.Context, got {shown(context)}")
        check_count(device, "device")
        self.context = Context(context, device)
        weakref.finalize(self, _free_dropped, self.context).atexit = False
        try:
            self._start(rasterizer, merge)
        except BaseException:
            self.context.release()
            raise

    def _start(self, rasterizer: Rasterizer, merge: float) -> None:
        can_compute = self.context.gl.version_code >= 430 and rasterizer != "points"
        if rasterizer == "compute" and not can_compute:
            name = self.context.renderer
            raise ContextError(f"the compute rasteriser needs OpenGL 4.3, {name} offers less: use rasterizer='points'")
        self._scenes, self._guard = Scenes(), _Guard(self.context, self._start_anew)
        self.steps = Steps(self.context.gl, self.context.is_software)  # what ran, how often, and how long it took
        self._new_pipeline = partial(Pipeline, self.context, self.steps, can_compute, merge)
        self._pipeline = self._new_pipeline()

    @property
    def choice(self) -> Choice | None:
        """Return what estimated the last normals, and why."""
        return self._pipeline.gpu_scene.frames.choice

    @property
    def exposure(self) -> float:
        """Return by how many stops the light of the last picture was multiplied."""
        return self._pipeline.exposure

    @property
    def fill(self) -> float:
        """Return the share of light from all around that was mixed into the light of the last picture."""
        return self._pipeline.fill

    @property
    def surroundings(self) -> EnvironmentLight:
        """Return what was around the objects of the last picture; its environment, and whether things hid its light."""
        return self._pipeline.environment_light

    @property
    def color_scale(self) -> ColorScale | None:
        """Return what the colours of the last picture stand for; `show`, `low`, `high`; None where they are light."""
        return self._pipeline.scale

    @property
    def weights(self) -> dict[Frame, float]:
        """Return how much each frame of the last picture counts where several show the same; 1 for a primary view."""
        from ..pipeline.report import weights  # only here

        return weights(self._pipeline.gpu_scene.drawn)

    def explain(self, names: Sequence[str] = ()) -> list[str]:
        """Return what drew the last picture, and why, in lines: estimators, and what several frames agree on.

        It reads from the GPU how far the points are trusted: a picture costs nothing more unless this is called.

        Parameters
        ----------
        names : sequence of str
            Names of the frames of one object; by default their numbers.
        """
        from ..pipeline.report import explain, explain_alignment, explain_lights, findings, lights

        with self._in_use():
            gpu_scene = self._pipeline.gpu_scene
            drawn = gpu_scene.drawn
            found = lights(drawn) + [(f"photograph {k}", one) for k, one in enumerate(gpu_scene.photo_lights)]
            poses = self._pipeline.alignment_of(drawn)
            aligned = [line for one in poses.values() for line in explain_alignment(one.given, one.fits, names)]
            return explain(findings(drawn), names) + aligned + explain_lights(found)

    @property
    def aligned(self) -> dict[Frame, Frame]:
        """Return the frames of the last picture whose poses were corrected, by what was given."""
        poses = self._pipeline.alignment_of(self._pipeline.gpu_scene.drawn)
        return {given: frame for one in poses.values() for given, frame in zip(one.given, one.frames, strict=True)}

    @takes(RenderOptions, *GROUPS)
    def render(
        self, frame: Source, light: Light | Sequence[Light] | None = None, material: Material | None = None,
        camera: Camera | None = None, pose: Numbers | None = None, normals: Method | Numbers = "auto",
        shading: Shading = "phong", point_size: float | Numbers | str | None = None, *,
        out: NDArray[Any] | Exporter | None = None, notes: Note | None = None, progress: Progress | None = None,
        **options: Unpack[RenderOptions]
    ) -> NDArray[np.uint8]:  # fmt: skip
        """Draw a frame, lit, as a camera sees it.

        Several frames of one thing, in a sequence, are drawn as one object, by their poses: where they see the same
        they are averaged, points that others see through are left out, and exposures are matched. A frame whose depth
        contradicts the others only fills gaps, and a note names it. Unless others are given, camera and pose are those
        of the first. See `live_set` for several streams.

        A Scene may take the place of the frame. With a scene only light (which replaces its own) and who looks may be
        passed, because its objects have a look of their own. A path or a built-in name is read each time, as on the
        command line: load once what is drawn often.

        Parameters
        ----------
        frame : Frame, sequence of Frame, Scene, path or RenderRequest
            What is drawn. A request has all other options.
        light : Light or sequence of Light, optional
            None is the default Light; beside an environment, which is light itself, there is none.
        camera : Camera, optional
            Who looks; None is the frame's own camera, at the colours' size if they are larger than the depth. Its size
            is the picture's.
        out : (h, w, 4) uint8, optional
            Where the picture is written, in place of a new array: any array in C order that shares its memory, such as
            a tensor of PyTorch on the CPU. It is written only once the picture is done.
        notes : callable, optional
            Called with one sentence for each note; None logs them ("pointshade_gl"), which prints them to stderr.
        progress : callable, optional
            Called with two ints, how many steps are done and how many there are: the samples, and of several frames
            each twice, prepared and compared. It is called when the GPU has done them, which takes a little longer. If
            it returns False, the work ends with `Cancelled`; None and all else go on.

        Returns
        -------
        (h, w, 4) uint8
            sRGB; alpha is 0 where nothing was drawn. The array is a Picture: a notebook shows it; with `out` it is that
            array, or of a tensor one in its memory. Averages and backgrounds are mixed in linear light. Over a
            transparent background shadows are black, and their alpha is the share of the light that they take.

        Raises
        ------
        ValueError, TypeError
            For arguments that do not fit, before anything is drawn.
        OSError
            For a path that cannot be read.
        Cancelled
            If `progress` returns False. The renderer can be used afterwards, as after any error.
        """
        with taken_by(notes):
            request = RenderRequest.of(
                frame, light=light, material=material, camera=camera, pose=pose, normals=normals, shading=shading,
                point_size=point_size, **options,
            ).as_shown  # fmt: skip
            scene = self._scenes.of(request)
            place = None if out is None else output_array(out, request.seen_by(scene)[0])
            with self._guard:
                self._draw(request, scene, progress)
                if self.steps.waits:
                    self.steps.finish()
                picture = self._pipeline.read(place)
            return picture.view(Picture) if place is None else picture

    @takes(RenderOptions, *GROUPS, like=render)
    def draw(
        self, frame: Source, light: Light | Sequence[Light] | None = None, material: Material | None = None,
        camera: Camera | None = None, pose: Numbers | None = None, normals: Method | Numbers = "auto",
        shading: Shading = "phong", point_size: float | Numbers | str | None = None, *, notes: Note | None = None,
        progress: Progress | None = None, **options: Unpack[RenderOptions]
    ) -> moderngl.Texture:  # fmt: skip
        """Draw as `render` does, but leave the picture on the GPU: an RGBA8 texture, top row first.

        It belongs to this renderer and holds the picture until the next call. If that shows the same with more samples,
        only those are drawn that are missing.
        """
        with taken_by(notes):
            request = RenderRequest.of(
                frame, light=light, material=material, camera=camera, pose=pose, normals=normals, shading=shading,
                point_size=point_size, **options,
            ).as_shown  # fmt: skip
            with self._guard:
                texture = self._draw(request, self._scenes.of(request), progress)
                textures.program = None  # a caller may bind it, and draw on it
                return texture

    @takes(PassOptions, *GROUPS, like=render)
    def render_passes(
        self, frame: Source, light: Light | Sequence[Light] | None = None, material: Material | None = None,
        camera: Camera | None = None, pose: Numbers | None = None, normals: Method | Numbers = "auto",
        shading: Shading = "phong", point_size: float | Numbers | str | None = None, *,
        passes: str | Sequence[str] = "all", notes: Note | None = None, progress: Progress | None = None,
        **options: Unpack[PassOptions]
    ) -> Passes:  # fmt: skip
        """Draw a picture in layers: what each light adds to it, and what is seen where. `save_passes` writes them.

        Light is linear, not cut off at 1, multiplied by alpha, and as strong as the lights are: passes have no
        exposure, fill, tone or background. All lights, ambient, environment and unlit add up to the beauty. It raises
        as `render`.

        Parameters
        ----------
        passes : str or sequence of str
            "all", or some of these names, in a sequence or with commas between them.

            - "beauty": the picture, red, green, blue and alpha; alpha has the shadows on a ground, too.
            - "light": light_1, light_2 ... what each light adds, in their order; "unshadowed": without its shadows;
              "shadow": the share of it that shadows take, 0 to 1.
            - "ambient", "environment": the light from all around. One of them is 0.
            - "unlit": objects that are shown in their own colours.
            - "ground": alpha of the shadows on the ground.
            - "albedo": the objects' own colours, linear.
            - "normal", "normal_world": unit, the camera's or the world's axes; NaN where there is none.
            - "depth": metres along the camera's axis; 0 where nothing is seen. "position": world; NaN there.
            - "certainty": of the normals, c from 0 to 1: they are off by about sqrt(1 / c - 1) / 2 radians.
            - "ao": the share of the light from all around that near things leave.
            - "object_id": which object of the scene is seen, from 1; 0 is none.

        Returns
        -------
        Passes
            A dict of float32 arrays: (h, w, 4) beauty; (h, w, 3) light, albedo, normals and positions; (h, w) all
            others. Light and albedo are the mean of all samples, the others are seen from the middle of each pixel. It
            also has the `camera` and the `pose` of the picture, and `objects`, the names of those that are counted.
        """
        names = check_passes(passes)
        with taken_by(notes):
            request = RenderRequest.of(
                frame, light=light, material=material, camera=camera, pose=pose, normals=normals, shading=shading,
                point_size=point_size, **options,
            )  # fmt: skip
            request = replace(request, finish=request.finish.of_passes)
            surfaces = replace(request, finish=replace(request.finish, show="normals")).as_shown
            layers: dict[str, NDArray[np.float32]] = {}
            with self._guard:
                scene = self._scenes.of(request)
                seen = request.seen_by(scene)
                if any(name in names for name in OF_SURFACES):
                    read = self._pipeline.read_data(self._scenes.of(surfaces), *seen, request.finish.near)
                    layers |= surface_layers(names, *read, *seen)
                if "albedo" in names:
                    layers["albedo"] = self._pipeline.read_colors(scene, *seen, request.finish.samples)
                if any(name in names for name in OF_LIGHT):
                    lit = self._settled(request, scene)
                    layers |= self._pipeline.read_layers(scene, lit[0], *seen, *lit[1:], names, progress)
            objects = (p.node.name for p in scene.instances)
        found = sorted(layers, key=lambda name: (PASSES.index(kind_of(name)), len(name), name))
        return Passes({name: layers[name] for name in found}, *seen, objects)

    def _draw(self, request: RenderRequest, scene: Scene, progress: Progress | None) -> moderngl.Texture:
        """Draw the scene that was made of a request's source."""
        lights, finish, source = self._settled(request, scene)
        seen = request.seen_by(scene)
        return self._pipeline.draw(scene, lights, *seen, finish, source, progress, request.coarse).color

    def _settled(self, request: RenderRequest, scene: Scene) -> tuple[tuple[Light, ...], OutputSettings, Frame | Scene]:
        """Return the lights of the scene that was made of a request's source, how it is finished, and what it shows."""
        finish, lights = request.finish, request.lights_of(scene)
        if finish.exposure == "sensor" and not request.frames:  # a scene's lights were made for it
            finish = replace(finish, exposure=0.0)
        source = request.subject(scene)
        if finish.ground is True:
            from ..estimation.ground import up_and_floor  # only here

            finish = replace(finish, ground=tuple(self.steps.run("up", up_and_floor, source)[0].tolist()))
        return lights, finish, source

    @takes(DepthOptions, *GROUPS, like=render)
    def render_depth(
        self, frame: Source, camera: Camera | None = None, pose: Numbers | None = None,
        normals: Method | Numbers = "auto", point_size: float | Numbers | str | None = None, *,
        notes: Note | None = None, progress: Progress | None = None, **options: Unpack[DepthOptions]
    ) -> NDArray[np.float32]:  # fmt: skip
        """Return the depth of the picture that `render` draws.

        Where "auto" smooths noise, this is the smoothed depth. With clean depth and the frame's own camera it is
        `frame.depth`, to a share of 1e-5. It raises as `render`.

        Returns
        -------
        (h, w) float32
            Metres along the axis; 0 where nothing is seen.
        """
        with taken_by(notes):
            request = RenderRequest.of(
                frame, camera=camera, pose=pose, normals=normals, point_size=point_size, **options
            )  # fmt: skip
            return self._surfaces(request, progress)[..., 3].copy()

    def find_surface(
        self, x: float, y: float, camera: Camera, pose: Numbers, reach: int = 4
    ) -> tuple[int, int, float] | None:
        """Return the pixel nearest to a place that shows a surface of what was drawn last, and the depth there.

        Few pixels leave the GPU, and what was drawn stays.

        Parameters
        ----------
        x, y : float
            The place, pixels.
        camera : Camera
            Who looks.
        pose : (4, 4)
            Its camera-to-world.
        reach : int
            How far from the place, pixels.

        Returns
        -------
        (column, row, depth) or None
            Depth in metres along the camera's axis; None if there is no surface.
        """
        left, top = max(round(x) - reach, 0), max(round(y) - reach, 0)
        right, bottom = min(round(x) + reach + 1, camera.width), min(round(y) + reach + 1, camera.height)
        if left >= right or top >= bottom:
            return None
        with self._in_use():
            part = self._pipeline.read_part(camera, check_pose(pose), (left, top, right - left, bottom - top))
        depth = part[..., 3]
        v, u = np.nonzero(depth)
        if not len(u):
            return None
        nearest = np.argmin((left + u - x) ** 2 + (top + v - y) ** 2)
        u, v = int(u[nearest]), int(v[nearest])
        return left + u, top + v, float(depth[v, u])

    def read_surface(self, column: int, row: int, camera: Camera, pose: Numbers) -> NDArray[np.float32] | None:
        """Return the normal and the depth of what was drawn last, at one pixel, which alone leaves the GPU.

        Parameters
        ----------
        column, row : int
            The pixel.
        camera : Camera
            Who looks.
        pose : (4, 4)
            Its camera-to-world.

        Returns
        -------
        (4,) float32 or None
            Unit normal, the camera's axes, 0 where there is none; depth along the camera's axis. None where there is no
            surface.
        """
        if not (0 <= column < camera.width and 0 <= row < camera.height):
            return None
        with self._in_use():
            (found,) = self._pipeline.read_part(camera, check_pose(pose), (column, row, 1, 1))[0]
        length = np.linalg.norm(found[:3])  # as certain as the normal is
        return np.append(found[:3] / max(length, 1e-6), abs(found[3])) if found[3] else None

    @takes(DepthOptions, *GROUPS, like=render)
    def render_normals(
        self, frame: Source, camera: Camera | None = None, pose: Numbers | None = None,
        normals: Method | Numbers = "auto", point_size: float | Numbers | str | None = None, *,
        notes: Note | None = None, progress: Progress | None = None, **options: Unpack[DepthOptions]
    ) -> NDArray[np.float32]:  # fmt: skip
        """Return the normals of the picture that `render` draws: those that its light falls on.

        Those of a frame's own pixels are `estimate_normals`. It raises as `render`.

        Returns
        -------
        (h, w, 3) float32
            Unit normals, the axes of the camera that looks; NaN where nothing is to be lit.
        """
        with taken_by(notes):
            request = RenderRequest.of(
                frame, camera=camera, pose=pose, normals=normals, point_size=point_size, **options
            )  # fmt: skip
            found = self._surfaces(request, progress)[..., :3]
        length = np.linalg.norm(found, axis=-1, keepdims=True)  # as certain as the normal is
        return np.divide(found, length, out=np.full_like(found, np.nan), where=length > 0)

    def _surfaces(self, request: RenderRequest, progress: Progress | None) -> NDArray[np.float32]:
        """Return (h, w, 4), read-only: normals and depth of what a request shows."""
        if request.look.missing == "photo":  # which has no depth
            request = replace(request, look=replace(request.look, missing="complete"))
        scene = self._scenes.of(request)
        seen = request.seen_by(scene)
        with self._in_use():
            return self._pipeline.read_surfaces(scene, *seen, progress)

    @takes(PointsOptions, *GROUPS, like=render)
    def render_points(
        self, frame: Frame | Sequence[Frame] | FilePath | RenderRequest, light: Light | Sequence[Light] | None = None,
        material: Material | None = None, pose: Numbers | None = None, normals: Method | Numbers = "auto",
        shading: Shading = "phong", *, notes: Note | None = None, progress: Progress | None = None,
        **options: Unpack[PointsOptions]
    ) -> PointCloud:  # fmt: skip
        """Return all points of a frame in the world, with the depth and the light that `render` draws them with.

        Of several frames of one thing it returns each place once, by the points of the frame that has them most densely
        there. Points that other frames see through are left out. It raises as `render`.

        Parameters
        ----------
        frame : Frame, sequence of Frame, path or RenderRequest
            Whose points.
        pose : Numbers, optional
            (4, 4) camera-to-world of who looks: highlights and the default light depend on it; None is the frame's own
            pose.
        shading : {"none", "flat", "gouraud", "phong", "edl"}, default "phong"
            "none" and "edl" keep the picture's own colours; any other lights each point once, as "flat" does.
        """
        with taken_by(notes):
            request = RenderRequest.of(
                _some(loaded(frame)), light=light, material=material, pose=pose, normals=normals, shading=shading,
                **options,
            )  # fmt: skip
            return cloud_of(self._lit_points(request, progress)[0])

    @takes(PointsOptions, *GROUPS, like=render)
    def render_mesh(
        self, frame: Frame | Sequence[Frame] | FilePath | RenderRequest, light: Light | Sequence[Light] | None = None,
        material: Material | None = None, pose: Numbers | None = None, normals: Method | Numbers = "auto",
        shading: Shading = "phong", *, notes: Note | None = None, progress: Progress | None = None,
        **options: Unpack[PointsOptions]
    ) -> Scene:  # fmt: skip
        """Return the surface of a frame as a textured mesh in the world, cut where depth jumps, for `save_scene`.

        Its places, normals and light are those of `render_points`: of several frames each has a mesh of what it shows
        best. The texture is light already, so programs show it unlit. Where the colours are larger than the depth,
        the texture is as large, and is the lit picture that the frame's own camera sees. It raises as `render`.

        Parameters
        ----------
        frame : Frame, sequence of Frame, path or RenderRequest
            Whose surface.
        pose : Numbers, optional
            (4, 4) camera-to-world of who looks: it is the camera of the scene, and as in `render_points`.
        shading : {"none", "flat", "gouraud", "phong", "edl"}, default "phong"
            As in `render_points`.

        Returns
        -------
        Scene
            A `Mesh` of each frame that shows something, with the shading "none", and a camera.
        """
        with taken_by(notes):
            request = RenderRequest.of(
                _some(loaded(frame)), light=light, material=material, pose=pose, normals=normals, shading=shading,
                **options,
            )  # fmt: skip
            found, (camera, pose) = self._lit_points(request, progress, OVERLAP)
            lights = [at_upper_left(one, pose) for one in check_lights(request.lights)]
            look = replace(request.look, align=False, shading="none" if request.look.shading in NOT_LIT else "phong")
            seen = replace(request, lights=lights, turns=STRAIGHT, look=look, finish=SIMPLE)
            pictures = (self._textured(points, seen) for points in found)
            return meshes_of(pictures, camera, pose, request.look.depth_step)

    def _lit_points(
        self, request: RenderRequest, progress: Progress | None, overlap: int = 0
    ) -> tuple[list[LitPoints], tuple[Camera, NDArray[np.float64]]]:
        """Return the points of each frame that a request draws, lit, and who looks at them."""
        scene = self._scenes.of_frames(check_frames(_some(request.source)), request.look.of_points)
        camera, pose = request.seen_by(scene)
        with self._in_use():
            lights = check_lights(request.lights)
            return self._pipeline.read_points(scene, lights, pose, progress, overlap), (camera, pose)

    def _textured(self, points: LitPoints, seen: RenderRequest) -> tuple[Frame, NDArray[np.float32], NDArray[np.uint8]]:
        """Return a frame with its surface and its picture."""
        frame, surface, light = points
        if frame.picture_camera is not frame.camera:
            return frame, surface, self.render(replace(seen, source=frame, camera=None, pose=frame.pose))
        colors = linear_to_bytes(np.clip(light, 0, 1))
        colors[..., 3] = np.where(surface[..., 3], 255, 0)
        return frame, surface, colors

    @contextmanager
    def prepared(
        self, scene: Scene, camera: Camera, pose: NDArray[np.float64]
    ) -> Generator[dict[Placed, Drawable], None, None]:
        """Put all objects of a scene on the GPU, as fine as a view of them needs, for a reader such as a page.

        Parameters
        ----------
        scene : Scene
            What is prepared.
        camera : Camera
            Who looks.
        pose : (4, 4)
            Its camera-to-world.
        """
        with self._in_use():
            yield self._pipeline.prepare_all(scene, camera, pose)

    def release(self) -> None:
        """Free everything this renderer made, in reverse order. Called again it does nothing.

        A Renderer with a context of its own that nobody holds any more is freed, too, with a ResourceWarning.
        """
        if self.context.is_released:
            return
        if not self.context.is_gone:  # with its context a caller has freed all that was in it
            with self.context.in_use():
                self._pipeline.release()
        self._scenes = Scenes()
        self.context.release()

    def __enter__(self) -> Renderer:
        self.context.check()
        return self

    def __exit__(self, *_: object) -> None:
        self.release()

    def _in_use(self) -> AbstractContextManager[None]:
        """The context is ready for this renderer's passes. What fails half way leaves nothing half made."""
        return self._guard

    def _start_anew(self, error: BaseException) -> None:
        """Free what a failed call has left half made: not arguments that do not fit, or an end between two steps."""
        is_misfit = isinstance(error, ValueError | TypeError) and is_expected(error)
        if not (is_misfit or isinstance(error, Cancelled)):
            before, self._pipeline = self._pipeline, self._new_pipeline()
            before.release()


class _Guard:
    """What `with` needs to draw by a Renderer."""

    def __init__(self, context: Context, failed: Callable[[BaseException], None]):
        self._context, self._failed = context.in_use(), weakref.WeakMethod(failed)

    def __enter__(self) -> None:
        self._context.__enter__()

    def __exit__(self, kind: Any, error: BaseException | None, trace: Any) -> None:
        failed = None if error is None else self._failed()
        try:
            if error is not None and failed is not None:
                failed(error)
        finally:
            self._context.__exit__(kind, error, trace)


def _free_dropped(context: Context) -> None:
    """Free what a Renderer leaves behind that was not released, and warn as Python does of files."""
    if context.drop():
        hint = "draw in `with ps.Renderer() as renderer:`, or call its release()"
        warnings.warn(f"unclosed Renderer: {hint}", ResourceWarning, stacklevel=3, source=context)


def _some(source: Any) -> Any:
    """Return a request, or what may be one frame or several. Raises TypeError for scenes and clouds."""
    return check_type(source, Frame, "frame") if isinstance(source, Scene | PointCloud) else source
