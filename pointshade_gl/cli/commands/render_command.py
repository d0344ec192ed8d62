"""`pointshade render`: what -o ends with says what comes out: a picture, a series of them, a page or points."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from ...files.access.known_names import FILMS, NUMBERED, POINTS, RENDERED, check_suffix, first_of, is_numbered
from ...files.pictures.picture_files import check_writable, save_image
from ...files.writing.film import check_series, is_series
from ...notes.notes import print_note
from ...notes.words import option
from ...renderer.renderer import Renderer
from ...renderer.requests import RenderRequest
from ...scene.appearance import LIT_EARLY
from ...scene.graph import Scene
from ...scene.viewpoint import View, check_turntable, moves_camera
from ..command_lines import page_line
from ..inputs import (
    MergedViews,
    are_clouds,
    as_one_frame,
    as_scene,
    check_align,
    check_stream,
    load,
    load_clouds,
    load_photographs,
    load_together,
    load_views,
)
from ..option_groups import LookGroup, NormalOptions, check_folders
from ..options import (
    Device,
    Explain,
    FilmOptions,
    FrameOptions,
    MoreInputs,
    Overwrite,
    PointAxes,
    Quiet,
    RenderOutput,
    Small,
    UnlightAll,
    ViewOptions,
    Views,
    spread,
)
from ..output import explainer, in_turn, new_beside, open_renderer, progress, report, spinner, warn_skipped
from ..written import PageOptions, PictureOptions, SavePoses, check_saved, is_page, poses_saved, poses_saver, view_of


@dataclass(frozen=True)
class RenderCommand:
    """What was typed. more: INPUTs after the first."""

    frame: FrameOptions
    look: LookGroup
    place: ViewOptions
    picture: PictureOptions
    film: FilmOptions
    page: PageOptions
    written: RenderOutput = None
    more: MoreInputs = None
    views: Views = None
    save_poses: SavePoses = None
    unlight_all: UnlightAll = False
    explain: Explain = False
    axes: PointAxes = None
    small: Small = False
    overwrite: Overwrite = False
    device: Device = 0
    quiet: Quiet = False

    @cached_property
    def output(self) -> Path:
        """Where to write: unless that was typed, to a new file in the working directory, called like INPUT."""
        if self.written is not None:
            return self.written
        return new_beside(self.frame, ".png" if self.film.turntable is None else FILMS[0])

    @cached_property
    def are_clouds(self) -> bool:
        """Whether the INPUTs are point clouds. Raises ValueError where only some are."""
        return are_clouds(self.frame, self.more or [])

    @cached_property
    def is_scene(self) -> bool:
        """Whether INPUT is one."""
        from ...files.frame_sources import is_scene

        return is_scene(self.frame.input)

    @property
    def is_set(self) -> bool:
        """Whether several frames, or clouds, are drawn as one object."""
        return bool(self.more) or self.views is not None

    def check_inputs(self) -> None:
        """Raises ValueError for several INPUTs where there can be one, and for one where several are needed."""
        check_folders(self.more or [])
        if self.film.turntable is not None:
            check_turntable(self.film.turntable)
        is_sequence = self.film.turntable is None and is_series(self.output)
        if self.more and (self.views is not None or is_sequence):
            raise ValueError(
                "several INPUTs are drawn as one object, in a picture, a turntable or a file of points: pass one INPUT "
                f"to {self.output}"
            )
        if self.are_clouds and (self.views is not None or self.unlight_all):
            name = "unlight_all" if self.unlight_all else "views"
            raise ValueError(f"{option(name)} is about frames, and {self.frame.input} is a point cloud: leave it out")
        if self.unlight_all and (self.more or self.views is not None or is_sequence):
            raise ValueError(f"{option('unlight_all', True)} makes one frame of a folder: write one picture of it")
        if not (self.are_clouds or self.is_scene):
            check_align(self.look.align, self.is_set or is_sequence or is_page(self.output))
        if self.save_poses is not None:
            check_saved(self.save_poses, self.look.align)

    def view(self) -> View:
        """From where, under which lights and how it is drawn. Raises ValueError or OSError."""
        turns = self.film.turntable is not None
        return view_of(
            self.look, self.place, self.picture, self.output,
            is_scene=self.are_clouds or (not self.is_set and self.is_scene), is_cloud=self.are_clouds,
            is_film=not is_page(self.output) and (turns or is_series(self.output)),
            is_changed=self.is_set or moves_camera(self.film.turntable),
        )  # fmt: skip

    def note_alike(self) -> None:
        """A note where a shading is asked for that cannot be told from phong, as each pixel is a point."""
        is_moved = self.place != ViewOptions() or moves_camera(self.film.turntable)
        if self.look.shading in LIT_EARLY and not (is_moved or self.is_set or self.are_clouds or self.is_scene):
            shading, turned = option("shading", self.look.shading), option("yaw", 20)
            print_note(f"{shading} looks like phong from the frame's own camera: each pixel is a point. Try {turned}")

    def read(self, view: View, is_many: bool = False) -> tuple[Any, Callable[[Renderer], None]]:
        """What is drawn, and what is to be called after each picture."""
        source = self.load(view, sequence=is_many and self.film.turntable is None)
        if isinstance(source, MergedViews):
            return source.scene, in_turn(explainer(self.explain, source.names), poses_saver(self.save_poses, source))
        source = source if self.more else as_scene(source, view.look, LookGroup().look())
        return source, explainer(self.explain)

    def load(self, view: View, sequence: bool) -> Any:
        """What INPUT names, or frames that are one object."""
        if self.more and self.are_clouds:
            return load_clouds(self.frame, view.look, LookGroup().look(), self.more)
        if self.unlight_all:
            photos = load_photographs(self.frame)
            with open_renderer(self.device, self.output) as renderer:
                return as_one_frame(renderer, photos, self.explain)
        if self.more:
            return load_together(self.frame, view.look, self.more)
        if self.views is not None:
            return load_views(self.frame, view.look, self.views)
        return load(self.frame, sequence=sequence, scene=True)


@spread
def render(asked: RenderCommand) -> None:
    """Light a frame, point clouds or a scene (.gltf, .glb, 'demo'): a picture. Without INPUT: the built-in vase.

    Without -o, write a new file here: NAME.png of INPUT, or NAME.mp4 of a turntable.

    Write all frames of a sequence, or a turntable, to an .mp4, a .gif or numbered files such as %04d.png.

    Write an .html to look at in a browser: there the light and the object can be moved, and a sequence plays.

    Write points to a .ply or .glb, in world coordinates: those of a frame, or of --views each place once, lit (or not:
    --shading none); those of a point cloud in their own colours, with normals.
    """
    asked.check_inputs()
    view = asked.view()
    if asked.output.suffix.lower() in POINTS:
        _write_points(asked, view)
        return
    if asked.axes is not None:
        raise ValueError(f"{option('axes')} turns the points of a .ply, {asked.output} holds none: leave it out")
    if is_page(asked.output):
        _write_page(asked, view)
    elif asked.film.turntable is not None or is_series(asked.output):
        _write_series(asked, view)
    else:
        _write_picture(asked, view)


def _write_picture(asked: RenderCommand, view: View) -> None:
    check_stream(view.look, False)
    asked.note_alike()
    _check_picture(asked.output, asked.film)
    asked.page.check_none(asked.output)
    source, after_each = asked.read(view)
    with open_renderer(asked.device, asked.output, asked.save_poses) as renderer, spinner("rendering"):
        start = time.perf_counter()
        image = renderer.render(RenderRequest.seen(source, view))
        spent = time.perf_counter() - start
        save_image(asked.output, image, asked.small)
        after_each(renderer)
        if not image.any():
            print_note("nothing is in view, the picture is empty")
        what = f"{image.shape[1]}x{image.shape[0]} pixels from {source.points_known} points"
        report(asked.output, what, renderer, spent)


def _check_picture(output: Path, film: FilmOptions) -> None:
    """Raises ValueError or OSError unless a single picture can be written there."""
    check_suffix(output, RENDERED)
    check_writable(output)
    if film.frames is not None:
        raise ValueError(
            f"{option('frames')} is for many pictures and {output} is one: write an .mp4, a .gif or %04d{output.suffix}"
        )


def _write_series(asked: RenderCommand, view: View) -> None:
    """Many pictures: a film, or numbered files, of a sequence or a turntable."""
    from ...renderer.series import jobs_of, write_series

    check_stream(view.look, asked.film.turntable is None)
    asked.note_alike()
    if is_numbered(asked.output):
        check_suffix(asked.output, NUMBERED)
    check_series(asked.output)
    asked.page.check_none(asked.output)
    source, after_each = asked.read(view, is_many=True)
    with open_renderer(asked.device, asked.output, asked.save_poses) as renderer:
        start = time.perf_counter()
        jobs, count = jobs_of(source, view, asked.film.turntable, asked.film.frames, warn_skipped, renderer)
        saved = asked.save_poses if asked.film.turntable is None else None
        with poses_saved(saved, jobs, source) as jobs, progress(count) as advance:

            def after_all(done: int, all: int) -> None:
                advance(done, all)
                after_each(renderer)

            count, (width, height) = write_series(renderer, jobs, asked.output, asked.film.fps, after_all, count)
        spent = time.perf_counter() - start
        report(asked.output, f"{count} pictures of {width}x{height} pixels", renderer, spent)


def _write_page(asked: RenderCommand, view: View) -> None:
    """A page of one object or scene, or one in which the frames of a sequence play."""
    asked.page.check(asked.output, asked.film)
    source, after_each = asked.read(view, is_many=True)
    plays = isinstance(source, Sequence)
    check_stream(view.look, plays)
    check_align(view.look.align, plays or asked.is_set)
    if plays:
        asked.page.write_film(source, view, asked.output, asked.frame, asked.film, asked.device, after_each)
        return
    if asked.film.frames is not None:
        raise ValueError(f"{asked.output} shows one thing that nothing moves: leave out {option('frames')}")
    line = page_line(asked.frame, asked.look, asked.picture, asked.more, asked.views, asked.unlight_all)
    asked.page.write(source, view, asked.output, asked.frame, line, asked.device, after_each)


def _write_points(asked: RenderCommand, view: View) -> None:
    """The points of a frame, or of each frame of a sequence, in world coordinates."""
    from ...files.writing.maps_and_points import check_points_path
    from ..written import write_points

    output, film = asked.output, asked.film
    if asked.save_poses is not None and not asked.is_set:
        raise ValueError(
            f"{option('save_poses')} is for several views, pictures and films; {output} holds points: leave it out"
        )
    asked.picture.check_none(output)
    asked.page.check_none(output)
    check_points_path(first_of(output), asked.axes)
    if view.picture_size is not None:
        raise ValueError(f"{output} holds points, {option('picture_size')} is of a picture: leave it out")
    if asked.are_clouds:
        _write_cloud(asked, view)
        return
    source = asked.load(view, sequence=is_numbered(output) and film.turntable is None)
    if isinstance(source, Scene):
        raise ValueError(f"{output} holds the points of frames, {asked.frame.input} is a scene: write a picture")
    after_each = explainer(asked.explain)
    if isinstance(source, MergedViews):
        if is_numbered(output) or film.turntable is not None:
            raise ValueError(f"the points of several views are one cloud: write one file, such as out{output.suffix}")
        after_each = in_turn(explainer(asked.explain, source.names), poses_saver(asked.save_poses, source))
        source = source.frames
    write_points(source, view, output, asked.axes, film, asked.device, after_each)


def _write_cloud(asked: RenderCommand, view: View) -> None:
    """The points of a cloud, with normals."""
    from ..written import check_unlit, write_cloud

    if asked.more:
        raise ValueError(f"{asked.output} holds the points of one cloud: pass one INPUT")
    if is_numbered(asked.output) or asked.film.turntable is not None or asked.film.frames is not None:
        raise ValueError(f"a point cloud is one file of points: write it to one, such as out{asked.output.suffix}")
    check_unlit(asked.output, asked.look, asked.place)
    look = NormalOptions(noise=asked.look.noise).look()
    write_cloud(load(asked.frame, scene=True), look, asked.output, asked.axes, asked.device)
