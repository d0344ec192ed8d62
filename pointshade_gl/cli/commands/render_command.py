"""`pointshade render`: what comes out depends on what -o ends with: a picture, a series of them, a page or points."""

from __future__ import annotations

import time
from collections.abc import Callable, Generator, Mapping
from contextlib import AbstractContextManager, closing
from dataclasses import dataclass, replace
from functools import cached_property, partial
from pathlib import Path
from typing import Any

from numpy.typing import NDArray

from ...checks.arguments import Count
from ...files.access import known_names as names
from ...files.access.known_names import check_suffix, is_numbered
from ...files.gltf import save_scene
from ...files.input_kinds import Kind
from ...files.pictures.picture_files import check_writable, save_image
from ...files.writing import maps_and_points as files
from ...files.writing.film import check_series, is_series
from ...notes.notes import print_note
from ...notes.words import counted, option
from ...renderer.renderer import Renderer
from ...renderer.requests import RenderRequest
from ...renderer.series import Job, jobs_of, write_series
from ...scene.appearance import LIT_EARLY
from ...scene.option_fields import LIGHT, PAGE, PICTURE, SETS, Cli, keys_of
from ...scene.passes import ALL, PASSES, Passes, check_passes
from ...scene.settings import LinearOptions
from ...scene.viewpoint import View, check_turntable, moves_camera
from .. import inputs, options
from ..command_lines import page_line
from ..inputs import Inputs, Loaded
from ..option_groups import AppearanceGroup, NormalOptions, check_folders, cli_option
from ..output import explainer, new_beside, open_renderer, print_line, progress, report, spinner, warn_skipped
from ..written import write_cloud, write_files


@dataclass(frozen=True, kw_only=True)
class RenderCommand:
    """What was typed."""

    frame: options.FrameOptions
    look: AppearanceGroup
    place: options.ViewOptions
    picture: options.PictureOptions
    film: options.FilmOptions
    page: options.PageOptions
    written: options.RenderOutput = None
    others: options.MoreOptions
    save_poses: Path | None = cli_option(
        f"Also write the poses that --align found: a {', '.join(names.POSE_LISTS)} of TUM's form, which --poses reads.",
        Cli(SETS, "FILE"),
    )
    unlight_all: bool = cli_option(
        "The frames of INPUT are photographs of one view, each under its own light: draw their common albedo.",
        Cli(LIGHT),
        default=False,
    )
    explain: options.Explain = False
    axes: str | None = cli_option(
        "What x, y, z are in a .ply: opencv (right, down, forward, the world of the poses of frames), opengl (right, "
        "up, towards the viewer, as in MeshLab) or blender (right, forward, up). Default: opengl of frames, of a point "
        "cloud its own.",
        Cli(PAGE, "opencv|opengl|blender"),
    )
    passes: str | None = cli_option(
        f"Layers of an .exr, for compositors: all, or some of {', '.join(PASSES)}. Default: beauty.",
        Cli(PICTURE, "all|NAME,NAME...", (ALL, *PASSES)),
    )
    points: bool = cli_option("Write points to a .glb or .gltf, not their surface.", Cli(PAGE), default=False)
    small: bool = cli_option("Take longer to write a smaller PNG.", Cli(PICTURE), default=False)
    run: options.RunOptions

    @cached_property
    def output(self) -> Path:
        """Where to write: unless that was typed, to a new file in the working directory, called like INPUT."""
        if self.written is not None:
            return self.written
        suffix = names.LAYERED[0] if self.passes else ".png" if self.film.turntable is None else names.FILMS[0]
        return new_beside(self.frame.title, suffix)

    @property
    def suffix(self) -> str:
        return self.output.suffix.lower()

    @cached_property
    def inputs(self) -> Inputs:
        return Inputs(self.frame, self.others)

    def check_inputs(self) -> None:
        """Raises ValueError for several INPUTs where there can be one, and for one where several are needed."""
        others, turntable = self.others, self.film.turntable
        is_sequence = turntable is None and is_series(self.output)
        check_folders(others.more or [])
        if turntable is not None:
            check_turntable(turntable)
        if others.more and (others.views is not None or is_sequence):
            fact = "several INPUTs are drawn as one object, in a picture, a turntable or a file of points"
            raise ValueError(f"{fact}: pass one INPUT to {self.output}")
        if self.inputs.kind is Kind.CLOUD and (others.views is not None or self.unlight_all):
            name = "unlight_all" if self.unlight_all else "views"
            raise ValueError(f"{option(name)} is about frames, and {self.frame.input} is a point cloud: leave it out")
        if self.unlight_all and (others.is_set or is_sequence):
            raise ValueError(f"{option('unlight_all', True)} makes one frame of a folder: write one picture of it")
        if self.inputs.kind is Kind.FRAMES:
            inputs.check_align(self.look.align, others.is_set or is_sequence or self.suffix in names.PAGES)
        if self.suffix in names.LAYERED:
            check_passes(self.passes or ALL)
            if given := [name for name in self.picture.changed if name not in keys_of(LinearOptions)]:
                fact = f"{self.output} holds linear light, as strong as the lights are"
                raise ValueError(f"{fact}: leave out {', '.join(map(option, given))}")
        elif self.passes is not None:
            raise ValueError(f"{option('passes')} are layers of an .exr, and {self.output} has none: write an .exr")
        if self.save_poses is not None:
            if not self.look.align:
                raise ValueError(f"{option('save_poses')} writes the poses that {option('align', True)} finds: add it")
            files.check_poses_path(self.save_poses)

    def completed(self) -> RenderCommand:
        """The same, of all sides of the built-in object where a picture or a film shows them."""
        is_drawn = self.suffix not in names.POINTS and not self.unlight_all and self.look.splat != "mesh"
        turns = self.suffix in names.PAGES or moves_camera(self.film.turntable) or inputs.is_turned(self.place)
        frame, others = inputs.with_all_sides(self.frame, self.others, is_drawn and turns)
        needs_title = self.suffix in names.PAGES and self.page.title is None
        page = replace(self.page, title=Path(self.frame.title).stem) if needs_title else self.page
        return replace(self, frame=frame, others=others, page=page, written=self.output)

    def view(self) -> View:
        """From where, under which lights and how it is drawn. Raises ValueError or OSError."""
        is_film = self.suffix not in names.PAGES and (self.film.turntable is not None or is_series(self.output))
        is_changed = self.others.is_set or moves_camera(self.film.turntable)
        kind, look = self.inputs.kind, self.look
        return inputs.view_of(kind, look, self.place, self.picture, self.output, is_film=is_film, is_changed=is_changed)

    def note_alike(self) -> None:
        """A note where a shading looks like phong, as each pixel is a point."""
        is_moved = self.place != options.ViewOptions() or moves_camera(self.film.turntable)
        is_single = self.inputs.kind is Kind.FRAMES and not self.others.is_set
        if self.look.shading in LIT_EARLY and is_single and not is_moved:
            shading, turned = option("shading", self.look.shading), option("yaw", 20)
            print_note(f"{shading} looks like phong from the frame's own camera: each pixel is a point. Try {turned}")

    def note_front(self, view: View) -> None:
        """A note where the front of the built-in object stands for all of it: in a file of points, and in shadows."""
        tells = self.suffix in names.POINTS or any(light.shadow for light in view.lights)
        if tells and inputs.is_front(self.frame, self.others):
            print_note(f"this is the front of the {names.VASE} alone: {names.WHOLE} has all sides")

    def load(self, view: View, sequence: bool) -> tuple[Loaded, Callable[[Renderer], None]]:
        """What is drawn, and what is to be called after each picture."""
        if self.unlight_all:
            photos = inputs.load_photographs(self.frame)
            with self.renderer() as renderer:
                loaded = Loaded(replace(photos[0], color=inputs.albedo_of(renderer, photos, self.explain)))
        else:
            plays = sequence and (self.film.turntable is None or view.look.temporal)
            loaded = self.inputs.load(view.look, AppearanceGroup().look(), plays)
        explain = explainer(self.explain, loaded.names)
        waiting = [self.save_poses] if self.save_poses is not None and loaded.frames else []

        def after_each(renderer: Renderer) -> None:
            explain(renderer)
            if waiting:
                poses = (renderer.aligned.get(frame, frame).pose for frame in loaded.frames)
                _save_poses(waiting.pop(), dict(zip(loaded.numbers, poses, strict=True)))

        return loaded, after_each

    def renderer(self) -> AbstractContextManager[Renderer]:
        """A renderer that draws to the outputs, as a context manager."""
        return open_renderer(self.run.device, self.output, self.save_poses)


@options.spread
def render(asked: RenderCommand) -> None:
    """Light a frame, point clouds or a scene (.gltf, .glb, 'demo'): a picture. Without INPUT: the built-in vase.

    Without -o, write a new file here: NAME.png of INPUT, or NAME.mp4 of a turntable.

    Write all frames of a sequence, or a turntable, to an .mp4, a .gif or numbered files such as %04d.png.

    Write an .exr for compositors, with --passes in layers: each light, normals, depth and more.

    Write an .html to look at in a browser: there the light and the object can be moved, and a sequence plays.

    Write the surface of a frame to a .glb or .gltf: a mesh, cut where depth jumps, whose texture is the lit picture (or
    not lit: --shading none).

    Write points to a .ply, or with --points to a .glb or .gltf, in world coordinates: those of a frame, or of --views
    each place once, lit alike; those of a point cloud in their own colours, with normals.
    """
    asked = asked.completed()
    asked.check_inputs()
    view = asked.view()
    asked.note_front(view)
    if asked.suffix in names.POINTS:
        _write_points(asked, view)
        return
    if asked.points:
        raise ValueError(f"{option('points', True)} is about a .glb or .gltf, {asked.output} is none: leave it out")
    if asked.axes is not None:
        raise ValueError(f"{option('axes')} turns the points of a .ply, {asked.output} holds none: leave it out")
    if asked.suffix in names.PAGES:
        _write_page(asked, view)
        return
    if asked.suffix in names.LAYERED:
        asked.page.check_none(asked.output)
        _write_passes(asked, view)
        return
    asked.page.check_none(asked.output)
    if asked.film.turntable is not None or is_series(asked.output):
        _write_series(asked, view)
    else:
        _write_picture(asked, view)


def _write_picture(asked: RenderCommand, view: View) -> None:
    inputs.check_stream(view.look, False)
    asked.note_alike()
    check_suffix(asked.output, names.RENDERED)
    check_writable(asked.output)
    if asked.film.frames is not None:
        many = f"write an .mp4, a .gif or %04d{asked.suffix}"
        raise ValueError(f"{option('frames')} is for many pictures and {asked.output} is one: {many}")
    loaded, after_each = asked.load(view, sequence=False)
    with asked.renderer() as renderer, spinner("rendering"):
        start = time.perf_counter()
        image = renderer.render(RenderRequest.seen(loaded.source, view))
        spent = time.perf_counter() - start
        if loaded.legend is not None:
            from ...viewer.overlay import draw_legend

            image = draw_legend(loaded.legend, image)
        save_image(asked.output, image, asked.small)
        after_each(renderer)
        if not image.any():
            print_note("nothing is in view, the picture is empty")
        what = f"{image.shape[1]}x{image.shape[0]} pixels"
        if loaded.source.points_known:  # meshes alone have none
            what += f" from {loaded.source.points_known} points"
        report(asked.output, what, renderer, spent)


def _write_passes(asked: RenderCommand, view: View) -> None:
    """The layers of a picture in one file; of a sequence or a turntable in numbered files."""
    output, is_many = asked.output, is_numbered(asked.output)
    files.check_passes_path(names.first_of(output))
    asked.note_alike()
    if asked.film.frames is not None and not is_many:
        raise ValueError(f"{option('frames')} is for many pictures and {output} is one: write %04d{asked.suffix}")
    if asked.save_poses is not None and is_many:
        raise ValueError(f"{option('save_poses')} is for pictures, films and one {asked.suffix}: leave it out")
    loaded, after_each = asked.load(view, sequence=is_many)

    def draw(renderer: Renderer, request: RenderRequest) -> Passes:
        made = renderer.render_passes(request, passes=asked.passes or "beauty")
        after_each(renderer)
        return made

    def what(made: Passes) -> str:
        return f"{made.camera.width}x{made.camera.height} pixels, {', '.join(made)}"

    loaded = loaded._replace(frames=())  # whose scene turns round its middle
    write_files(loaded, view, output, asked.run.device, draw, files.save_passes, what, asked.film)


def _write_series(asked: RenderCommand, view: View) -> None:
    """Many pictures: a film, or numbered files, of a sequence or a turntable."""
    film = asked.film
    asked.note_alike()
    if is_numbered(asked.output):
        check_suffix(asked.output, names.NUMBERED)
    check_series(asked.output)
    loaded, after_each = asked.load(view, sequence=True)
    inputs.check_stream(view.look, loaded.plays)
    poses: dict[int, NDArray[Any]] = {}
    with asked.renderer() as renderer:
        start = time.perf_counter()
        jobs, count = jobs_of(loaded.source, view, film.turntable, film.frames, warn_skipped, renderer)
        jobs = _noted(jobs, loaded.source, poses) if loaded.plays else jobs
        with progress(count, after=partial(after_each, renderer)) as advance:
            count, (width, height) = write_series(renderer, jobs, asked.output, film.fps, advance, count)
        if asked.save_poses is not None and loaded.plays:
            _save_poses(asked.save_poses, poses)
        spent = time.perf_counter() - start
        report(asked.output, f"{count} pictures of {width}x{height} pixels", renderer, spent)


def _noted(jobs: Generator[Job, None, None], source: Any, poses: dict[int, NDArray[Any]]) -> Generator[Job, None, None]:
    """The jobs of a film of a sequence, which are given to `poses`, by the numbers that files of poses have."""
    with closing(jobs):
        for number, request in jobs:
            frame: Any = request.source
            poses[source.parts[number].number] = frame.pose
            yield number, request


def _save_poses(path: Path, poses: Mapping[int, NDArray[Any]]) -> None:
    files.save_numbered_poses(path, poses)
    print_line(f"{path}: {counted(len(poses), 'pose')}")


def _write_page(asked: RenderCommand, view: View) -> None:
    """A page of one object or scene, or one in which the frames of a sequence play. A size smaller than that of the
    source is that of the points in the page, too."""
    from ...files.access.atomic_write import written_whole
    from ...page.films import draw_film, frames_of
    from ...page.page_file import check_page_path, draw_page, largest_of

    output, film, quality = asked.output, asked.film, asked.page.exactness
    check_page_path(output)
    if film.turntable is not None:
        raise ValueError(f"{output} is moved by who looks at it: leave out {option('turntable')}")
    loaded, after_each = asked.load(view, sequence=True)
    inputs.check_stream(view.look, loaded.plays)
    inputs.check_align(view.look.align, loaded.plays or asked.others.is_set)
    if film.frames is not None and not loaded.plays:
        raise ValueError(f"{output} shows one thing that nothing moves: leave out {option('frames')}")
    source = frames_of(loaded.source, film.frames) if loaded.plays else loaded.source
    title = asked.page.title or Path(asked.frame.title).stem
    start = time.perf_counter()
    with asked.renderer() as renderer:
        request = RenderRequest.seen(source[0] if loaded.plays else source, view)
        largest = largest_of(request)
        if loaded.plays:
            plays = f" in which {len(source)} frames play"
            with progress(len(source) + 1, after=partial(after_each, renderer)) as advance:
                text = draw_film(
                    renderer, source, view, film.fps, quality=quality, largest=largest, title=title,
                    count=Count(advance), skipped=warn_skipped,
                )  # fmt: skip
        else:
            plays, line = "", page_line(asked.inputs, asked.look, asked.picture, asked.unlight_all)
            with spinner("writing"):
                text = draw_page(renderer, request, quality=quality, largest=largest, title=title, command=line)
                after_each(renderer)
        with written_whole(output) as temporary:
            temporary.write_text(text, encoding="utf-8")
        what = f"a page of {output.stat().st_size / 1e6:.2f} MB{plays}"
        report(output, what, renderer, time.perf_counter() - start)


def _write_points(asked: RenderCommand, view: View) -> None:
    """The points or the surface of a frame, or of each of a sequence, in world coordinates; a cloud's, with normals."""
    output, film, is_set = asked.output, asked.film, asked.others.is_set
    if asked.save_poses is not None and not is_set:
        fact = f"{option('save_poses')} is for several views, pictures and films"
        raise ValueError(f"{fact}; {output} holds one thing: leave it out")
    asked.picture.check_none(output)
    asked.page.check_none(output)
    files.check_points_path(names.first_of(output), asked.axes)
    if view.picture_size is not None:
        raise ValueError(f"{output} holds no picture, {option('picture_size')} is of a picture: leave it out")
    if asked.inputs.kind is Kind.CLOUD:
        _check_cloud(asked)
        look = NormalOptions(noise=asked.look.noise).look()
        write_cloud(inputs.load(asked.frame, scene=True), look, output, asked.axes, asked.run.device)
        return
    if asked.inputs.kind is not Kind.FRAMES:
        raise ValueError(f"{output} holds the points of frames, {asked.frame.input} is a scene: write a picture")
    loaded, after_each = asked.load(view, sequence=is_numbered(output))
    if loaded.frames and (is_numbered(output) or film.turntable is not None):
        raise ValueError(f"the points of several views are one cloud: write one file, such as out{output.suffix}")
    is_surface = asked.suffix in names.SCENE_SUFFIXES and not asked.points

    def draw(renderer: Renderer, request: RenderRequest) -> Any:
        made = renderer.render_mesh(request) if is_surface else renderer.render_points(request)
        after_each(renderer)
        return made

    def what(made: Any) -> str:
        if is_surface:
            return counted(sum(len(one.content.faces) for one in made.nodes), "triangle")
        return f"{len(made)} points"

    axes: Any = asked.axes
    save = save_scene if is_surface else partial(files.save_points, axes=axes)
    write_files(loaded, view, output, asked.run.device, draw, save, what, film)


def _check_cloud(asked: RenderCommand) -> None:
    """Raises ValueError for what does not change the points of a cloud."""
    film = asked.film
    if asked.others.more:
        raise ValueError(f"{asked.output} holds the points of one cloud: pass one INPUT")
    if is_numbered(asked.output) or film.turntable is not None or film.frames is not None:
        raise ValueError(f"a point cloud is one file of points: write it to one, such as out{asked.output.suffix}")
    if given := [name for group in (asked.look, asked.place) for name in group.changed if name != "noise"]:
        fact = f"{asked.output} holds the points of a cloud in their own colours"
        raise ValueError(f"{fact}, without light: leave out {', '.join(map(option, given))}")
