"""The public face: frames and scenes in, pictures out. Checks its input, owns the context, keeps to its thread."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from os import PathLike

import moderngl
import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..estimation.ground_plane import LIGHT as GROUND_LIGHT
from ..estimation.ground_plane import up_of
from ..gpu.context.context import Context
from ..gpu.core.steps import Steps
from ..gpu.drawables import Drawable
from ..messages.errors import ContextError
from ..messages.formatting import shown
from ..messages.validation import check_choice, check_count, check_type
from ..pipeline.findings import findings, highlights, lights, weights
from ..pipeline.pipeline import Pipeline
from ..pipeline.report import explain, explain_lights
from ..scene.appearance import SHADINGS, Look, Material
from ..scene.camera import Camera, check_pose
from ..scene.frame import Frame
from ..scene.graph import Scene
from ..scene.level_of_detail import MERGE, check_merge
from ..scene.light import Light, check_lights
from ..scene.noise import Choice
from ..scene.normal_methods import check_method
from ..scene.placed import Placed
from ..scene.point_cloud import PointCloud, cloud_of
from ..scene.render_settings import Finish
from ..scene.view import viewing_pose
from .notebook import Picture
from .request import FilePath, Scenes, loaded, seen_by

RASTERIZERS = ("auto", "points", "compute")
UNLIT = Material(ambient=1, diffuse=0, specular=0)  # shows a point's own colour


class Renderer:
    """Draws pictures, and owns the OpenGL context unless it is given one. Use it in the thread that made it.

    Each call pays only for what has changed since the last: another light runs only the light pass, another camera
    keeps the normals, the same Frame object is not uploaded twice. `steps` counts what ran.

    A frame of more than 33 million points, or larger than a texture may be, is drawn in tiles, which take turns on the
    GPU: its memory there is bounded. Each new view of it uploads it again, and estimates its normals again.

    context  a moderngl.Context of the caller's. The caller keeps it: what is set and bound in it changes no picture and
             is left as it was. None makes one off screen.
    device   which GPU, counted by EGL (Linux)
    rasterizer  "points" draws splats as GL points (OpenGL 3.3), "compute" by a compute shader (4.3), which leaves sizes
             other than 1 and round splats to the points; "auto" is compute where the driver has it
    merge    of the compute rasteriser: 2x2 or 4x4 pixels on one plane, to within this share of 1/z, are drawn as
             one splat. Colours and normals stay those of the pixels. 0 draws each pixel by itself.

    Raises ContextError without OpenGL 3.3, TypeError or ValueError for arguments of another kind.
    """

    def __init__(
        self, context: moderngl.Context | None = None, device: int = 0, rasterizer: str = "auto", merge: float = MERGE
    ):
        check_choice("rasterizer", rasterizer, RASTERIZERS)
        check_merge(merge)
        if not isinstance(context, moderngl.Context | None):
            raise TypeError(f"context must be a moderngl.Context, got {shown(context)}")
        check_count(device, "device")
        self.context = Context(context, device)
        can_compute = self.context.gl.version_code >= 430 and rasterizer != "points"
        if rasterizer == "compute" and not can_compute:
            name = self.context.renderer
            self.context.release()
            raise ContextError(f"the compute rasteriser needs OpenGL 4.3, {name} offers less: use rasterizer='points'")
        self._scenes = Scenes()
        self.steps = Steps(self.context.gl, self.context.is_software)  # what ran, how often, and how long it took
        self._new_pipeline = partial(Pipeline, self.context, self.steps, can_compute, merge)
        self._pipeline = self._new_pipeline()

    @property
    def choice(self) -> Choice | None:
        """What estimated the last normals, and why."""
        return self._pipeline.gpu_scene.frames.choice

    @property
    def weights(self) -> dict[Frame, float]:
        """How much each frame of the last picture counts where several show the same: 1 if it is a primary view."""
        return weights(self._pipeline.gpu_scene.drawn)

    def explain(self, names: Sequence[str] = ()) -> list[str]:
        """What drew the last picture, and why, in lines: estimators, and what several frames of one thing agree on.

        names  of these frames; by default their numbers

        It reads from the GPU how far the points are trusted: a picture costs nothing more unless this is called.
        """
        with self._in_use():
            drawn = self._pipeline.gpu_scene.drawn
            return explain(findings(drawn), names) + explain_lights(lights(drawn), highlights(drawn))

    def render(
        self,
        frame: Frame | Sequence[Frame] | Scene | FilePath,
        light: Light | Sequence[Light] | None = None,
        material: Material | None = None,
        camera: Camera | None = None,
        pose: ArrayLike | None = None,
        normals: str | ArrayLike = "auto",
        shading: str = "phong",
        size: float | ArrayLike | str | None = None,
        *,
        splat: str = "footprint",
        max_depth_step: float | str | None = None,
        noise: float | ArrayLike | str | None = None,
        yaw: float = 0.0,
        pitch: float = 0.0,
        dolly: float = 0.0,
        upsample: str = "vote",
        normals_at: str = "source",
        flying: str = "keep",
        temporal: bool = False,
        unlight: bool = False,
        remove_highlights: bool = False,
        samples: int = 1,
        background: str | Sequence[float] | None = None,
        ground: bool | Sequence[float] = False,
        ground_height: float | None = None,
    ) -> NDArray[np.uint8]:
        """The frame, lit, seen by a camera: (h, w, 4) uint8 sRGB; alpha is 0 where nothing was drawn.

        Several frames of one thing, in a sequence, are drawn as one object, by their poses: where they see the same
        they are averaged, points that others see through are left out, and exposures are matched. A frame whose depth
        contradicts the others only fills gaps, and a note names it. Unless others are given, camera and pose are those
        of the first. See `live_set` for several streams.

        The array is a Picture: a notebook shows it. A Scene may take the place of the frame. With a scene only light
        (which replaces its own) and who looks may be passed, because its objects have a look of their own. A path or a
        built-in name is read each time, as on the command line: load once what is drawn often.

        light    one Light or several; None is the default Light
        camera   who looks; None is the frame's own camera, at the colours' size if they are larger than the depth. Its
                 size is the picture's.
        pose     (4, 4) camera-to-world of that camera; None is the frame's own pose
        normals  a method (see `estimate_normals`), or (h, w, 3) floats in the frame's camera axes
        shading  "none", "flat", "gouraud" or "phong"
        size     splat size in source pixels: a number, or (h, w), 1 = the point's own pixel, 0 hides it; None is 1;
                 "fill" is 1 and closes gaps, see `Look`
        splat    "footprint" carries the pixel's square into the view, and ends where the surface does; "round" the
                 circle round it; "mesh" draws the triangles between neighbouring pixels (see `Look`)
        max_depth_step, noise  as for `estimate_normals`
        yaw, pitch, dolly  move the frame's own camera around its pivot, as in `orbit_pose`; not with a pose
        upsample "vote" brings a depth that is smaller than the colours to their size; "none" draws its own points
        normals_at  of several frames: "source" estimates normals in each and mixes them, "target" in the view
        flying   "snap" puts pixels that hang between two surfaces onto the nearer one; "keep" draws them where they
                 hang, see `Look`
        temporal True filters noisy depth and its normals over time, for the frames of a stream: less flicker where
                 neither has changed, see `Look`
        unlight  True divides the light in the picture out of its colours, as far as the picture tells it, see `Look`
        remove_highlights  True takes the highlights in the picture out of its colours, as far as it tells them, see
                 `Look`
        samples  how many pictures are averaged, each seen from another place within the pixels (and from other places
                 of lights with a radius or an angle): smooth outlines, textures and shadows. 1 is a single picture,
                 seen from the middle of each pixel: unlit and from the frame's own camera it is the photograph.
        background  a colour: a name, "#rrggbb", or linear RGB; None is transparent. Alpha is the share of the pixel
                 that is covered, and colours are not multiplied by it.
        ground   True puts a ground under the object, on which only shadows are seen: those of lights that cast them.
                 Without a light there is one that does, with soft shadows. Where the frame itself shows a floor, the
                 ground goes on from there. Up is up from that floor, else up in the frame's picture, as no frame says
                 more, and the world's y in a scene; (3,) in world axes says it otherwise.
        ground_height  where the ground lies along up, metres (world units) from the world's origin: -1.2 is 1.2 m below
                 the frame's camera; None finds a floor, or what lies lowest

        Averages and backgrounds are mixed in linear light. Over a transparent background shadows are black, and their
        alpha is the share of the light that they take.

        Raises ValueError or TypeError for arguments that do not fit, before anything is drawn, and OSError for a path
        that cannot be read.
        """
        frame = loaded(frame)
        with self._in_use():
            self.draw(
                frame, light, material, camera, pose, normals, shading, size,
                splat=splat, max_depth_step=max_depth_step, noise=noise, upsample=upsample, normals_at=normals_at,
                flying=flying, temporal=temporal, unlight=unlight, remove_highlights=remove_highlights, yaw=yaw,
                pitch=pitch, dolly=dolly, samples=samples, background=background, ground=ground,
                ground_height=ground_height,
            )  # fmt: skip
            return self._pipeline.read().view(Picture)

    def draw(
        self,
        frame: Frame | Sequence[Frame] | Scene | FilePath,
        light: Light | Sequence[Light] | None = None,
        material: Material | None = None,
        camera: Camera | None = None,
        pose: ArrayLike | None = None,
        normals: str | ArrayLike = "auto",
        shading: str = "phong",
        size: float | ArrayLike | str | None = None,
        *,
        splat: str = "footprint",
        max_depth_step: float | str | None = None,
        noise: float | ArrayLike | str | None = None,
        yaw: float = 0.0,
        pitch: float = 0.0,
        dolly: float = 0.0,
        upsample: str = "vote",
        normals_at: str = "source",
        flying: str = "keep",
        temporal: bool = False,
        unlight: bool = False,
        remove_highlights: bool = False,
        samples: int = 1,
        background: str | Sequence[float] | None = None,
        ground: bool | Sequence[float] = False,
        ground_height: float | None = None,
    ) -> moderngl.Texture:
        """As `render`, but the picture stays on the GPU: an RGBA8 texture, top row first.

        It belongs to this renderer and holds the picture until the next call. If that shows the same with more samples,
        only those are drawn that are missing.
        """
        finish = Finish(samples, background, ground, ground_height)
        material = Material() if material is None else material
        frame = loaded(frame)
        geometry = normals, shading, size, splat, max_depth_step, noise, upsample, normals_at, flying
        options = material, *geometry, temporal, unlight, remove_highlights
        scene = self._scenes.of(frame, options)
        lights = check_lights(light if light is not None else scene.lights or (GROUND_LIGHT if finish.ground else None))
        if finish.ground is True:
            source = scene if isinstance(frame, Scene) else scene.things[0].content.frame
            finish = replace(finish, ground=tuple(self.steps.run("up", up_of, source)))
        seen = seen_by(frame, scene, camera, pose, yaw, pitch, dolly)
        with self._in_use():
            return self._pipeline.draw(scene, lights, *seen, finish).color

    def render_depth(
        self,
        frame: Frame | Sequence[Frame] | Scene | FilePath,
        camera: Camera | None = None,
        pose: ArrayLike | None = None,
        normals: str | ArrayLike = "auto",
        size: float | ArrayLike | str | None = None,
        *,
        yaw: float = 0.0,
        pitch: float = 0.0,
        dolly: float = 0.0,
        splat: str = "footprint",
        max_depth_step: float | str | None = None,
        noise: float | ArrayLike | str | None = None,
        upsample: str = "vote",
        flying: str = "keep",
        temporal: bool = False,
    ) -> NDArray[np.float32]:
        """The depth of the picture that `render` draws: (h, w) float32 metres along the axis; 0 where nothing is seen.

        Where "auto" smooths noise, this is the smoothed depth. With clean depth and the frame's own camera it is
        `frame.depth`, to a share of 1e-5. Arguments and errors are those of `render`.
        """
        frame = loaded(frame)
        geometry = normals, "phong", size, splat, max_depth_step, noise, upsample, "source", flying
        scene = self._scenes.of(frame, (Material(), *geometry, temporal, False, False))
        seen = seen_by(frame, scene, camera, pose, yaw, pitch, dolly)
        with self._in_use():
            return self._pipeline.read_surfaces(scene, *seen)[..., 3].copy()

    def find_surface(
        self, x: float, y: float, camera: Camera, pose: ArrayLike, reach: int = 4
    ) -> tuple[int, int, float] | None:
        """The pixel nearest to (x, y), `reach` pixels away at most, that shows a surface of what was drawn last, and
        the depth there: metres along the axis of a camera at a pose (4, 4). None if there is none.

        Few pixels leave the GPU, and what was drawn stays.
        """
        left, top = max(round(x) - reach, 0), max(round(y) - reach, 0)
        right, bottom = min(round(x) + reach + 1, camera.width), min(round(y) + reach + 1, camera.height)
        if left >= right or top >= bottom:
            return None
        with self._in_use():
            depth = self._pipeline.read_depth(camera, check_pose(pose), (left, top, right - left, bottom - top))
        v, u = np.nonzero(depth)
        if not len(u):
            return None
        nearest = np.argmin((left + u - x) ** 2 + (top + v - y) ** 2)
        u, v = int(u[nearest]), int(v[nearest])
        return left + u, top + v, float(depth[v, u])

    def render_normals(self, scene: Scene) -> NDArray[np.float32]:
        """Unit normals of what a scene's camera sees: (h, w, 3) float32, its axes; NaN where nothing is to be lit."""
        framed = check_type(scene, Scene, "scene").framed()
        with self._in_use():
            surfaces = self._pipeline.read_surfaces(framed, *seen_by(framed, framed, None, None, 0, 0, 0))
        return np.where(surfaces[..., :3].any(-1, keepdims=True), surfaces[..., :3], np.float32(np.nan))

    def render_points(
        self,
        frame: Frame | FilePath,
        light: Light | Sequence[Light] | None = None,
        material: Material | None = None,
        pose: ArrayLike | None = None,
        normals: str | ArrayLike = "auto",
        shading: str = "flat",
        *,
        yaw: float = 0.0,
        pitch: float = 0.0,
        dolly: float = 0.0,
        max_depth_step: float | str | None = None,
        noise: float | ArrayLike | str | None = None,
        flying: str = "keep",
        temporal: bool = False,
        unlight: bool = False,
        remove_highlights: bool = False,
    ) -> PointCloud:
        """All points of a frame in the world, with the depth and the light that `render` draws them with.

        pose     (4, 4) camera-to-world of who looks: highlights and the default light depend on it; None is the
                 frame's own pose
        shading  "none" keeps the picture's own colours; any other lights each point once, as "flat" does
        The other arguments, and the errors, are those of `render`.
        """
        frame = check_type(loaded(frame), Frame, "frame")
        check_choice("shading", shading, SHADINGS)
        material = UNLIT if shading == "none" else Material() if material is None else material
        options = {"max_depth_step": max_depth_step, "noise": noise, "upsample": "none", "flying": flying}
        options |= {"temporal": temporal, "unlight": unlight, "remove_highlights": remove_highlights}
        scene = self._scenes.of_frames((frame,), Look(material, normals, "flat", **options))
        lights, pose = check_lights(light), viewing_pose(frame, pose, yaw, pitch, dolly)
        with self._in_use():
            return cloud_of(frame, *self._pipeline.read_points(scene, lights, pose))

    def estimate_normals(
        self,
        frame: Frame | FilePath,
        method: str = "auto",
        *,
        max_depth_step: float | str | None = None,
        noise: float | ArrayLike | str | None = None,
        flying: str = "keep",
        temporal: bool = False,
    ) -> NDArray[np.float32]:
        """Unit normals of a frame or its folder: (h, w, 3) float32, camera axes, towards the camera; NaN without
        depth, and where depths are so far apart that float32 has no normal for them.

        method          "auto" measures the noise of the depth and chooses "star" (sharp at edges, for clean depth) or
                        "adaptive" (planes as wide as the noise requires); where most depths are missing, as of LiDAR in
                        a picture, "sparse" (planes across the gaps, noise or not). "star-borrow" is a little better and
                        slower than "star". Classical: "triangles-1", "-2", "-4", "-8" (the mean over at most that many
                        triangles), "central", "one-sided", "plane-fit-3" to "plane-fit-13".
        max_depth_step  for triangles: a neighbour further in depth belongs to another surface. Metres, or "3%" of the
                        pixel's depth; None is no limit. The others find edges by themselves.
        noise           for auto and adaptive: standard deviation of the depth in metres, a number or (h, w), or a
                        sensor's name ("kinect"); or what `describe` and --explain print, such as
                        "1.5mm,shared=2,steps=1mm"; None measures it
        flying          for auto and adaptive: "snap" estimates pixels between two surfaces on one of them, see `Look`
        temporal        for auto and adaptive: True filters the frames of a stream over time, see `Look`

        Raises ValueError for an unknown method and for invalid noise or step. `choice` says what ran, and why.
        """
        if isinstance(frame, str | PathLike):
            from ..files.frames.frame_files import load_frame

            frame = load_frame(frame)
        check_type(frame, Frame, "frame")
        look = Look(
            normals=check_method(method), max_depth_step=max_depth_step, noise=noise, flying=flying, temporal=temporal
        )
        look = look.for_frame(frame.depth)
        with self._in_use():
            normals = self._pipeline.gpu_scene.read_normals(frame, look)[..., :3].copy()
        normals[(frame.depth == 0) | ~normals.any(-1)] = np.nan
        return normals

    @contextmanager
    def prepared(self, scene: Scene, camera: Camera, pose: NDArray[np.float64]) -> Iterator[dict[Placed, Drawable]]:
        """All things of a scene on the GPU, as fine as this view of them needs, for who reads them: a page."""
        with self._in_use():
            yield self._pipeline.prepare_all(scene, camera, pose)

    def release(self) -> None:
        """Frees everything this renderer made, in reverse order. Called again it does nothing."""
        if self.context.is_released:
            return
        if not self.context.is_gone:  # with its context a caller has freed all that was in it
            with self.context.in_use():
                self._pipeline.release()
        self.context.release()

    def __enter__(self) -> Renderer:
        self.context.check()
        return self

    def __exit__(self, *_: object) -> None:
        self.release()

    @contextmanager
    def _in_use(self) -> Iterator[None]:
        """The context is ready for this renderer's passes. What fails half way leaves nothing half made."""
        with self.context.in_use():
            try:
                yield
            except (ValueError, TypeError):  # of arguments that do not fit: nothing was begun
                raise
            except BaseException:
                before, self._pipeline = self._pipeline, self._new_pipeline()
                before.release()
                raise
