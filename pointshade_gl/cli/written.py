"""What commands write beside pictures: pages, maps, clouds, poses; and the options of the finished picture."""

from __future__ import annotations

import time
from collections.abc import Callable, Generator, Mapping, Sequence
from contextlib import closing, contextmanager
from dataclasses import dataclass, fields
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, cast

import numpy as np
import typer
from numpy.typing import NDArray

from ..checks.arguments import Count
from ..files.access.known_names import CLOUD_NORMALS, FILMS, PAGES, POINTS, POSE_LISTS, check_suffix, is_numbered
from ..files.frames.sequences import FrameSequence
from ..files.pictures.picture_files import check_writable, save_image
from ..files.writing.film import BACKGROUND
from ..files.writing.maps_and_points import check_points_path, save_depth, save_normals, save_points
from ..notes.notes import once, print_note
from ..notes.words import counted, option
from ..renderer.renderer import Renderer
from ..renderer.requests import RenderRequest
from ..renderer.series import Job, jobs_of, write_numbered
from ..scene.appearance import Look
from ..scene.cloud import PointCloud
from ..scene.environment import Environment
from ..scene.frame import Frame
from ..scene.graph import Scene, given_by
from ..scene.noise import describe
from ..scene.option_fields import LIGHT, PAGE, PICTURE, SETS
from ..scene.settings import FILM, STILL, Finish
from ..scene.viewpoint import View
from .inputs import MergedViews, check_stream
from .option_groups import FieldOptions, LookGroup, NormalOptions, cli_option, environment_from, group_of, typed
from .options import FilmOptions, FrameOptions, ViewOptions
from .output import open_renderer, print_line, progress, report, spinner, warn_skipped

if TYPE_CHECKING:
    from ..page.parts import QualityName

NAMES = "exact", "small"  # of page/parts.py, which imports NumPy


def is_page(output: Path) -> bool:
    """Whether a page is to be written there."""
    return output.suffix.lower() in PAGES


@dataclass(frozen=True)
class PageOptions:
    """How a page is written."""

    quality: str | None = cli_option(
        "Of an .html: exact, or small (a third smaller, colours as JPEG).", metavar="NAME", known=NAMES, panel=PAGE
    )
    title: str | None = cli_option("Of an .html. Default: INPUT.", metavar="TEXT", panel=PAGE)

    @property
    def exactness(self) -> QualityName:
        """The quality that was typed, or the first."""
        return cast("QualityName", self.quality or NAMES[0])

    def check(self, output: Path, film: FilmOptions) -> None:
        """Raises ValueError or OSError unless a page can be written there, of a frame that no option moves."""
        from ..page.page_file import check_page_path

        check_page_path(output)
        if film.turntable is not None:
            raise ValueError(f"{output} is moved by who looks at it: leave out {option('turntable')}")

    def check_none(self, output: Path) -> None:
        """Raises ValueError if one was given for an output that is no page."""
        given = [name for name, value in vars(self).items() if value is not None]
        if given:
            raise ValueError(f"{output} is no page: leave out {', '.join(map(option, given))}, or write an .html")

    def write_film(
        self,
        frames: Sequence[Frame],
        view: View,
        output: Path,
        frame: FrameOptions,
        film: FilmOptions,
        device: int,
        after_each: Callable[[Renderer], None],
    ) -> None:
        """Writes the page in which frames of a sequence play. The size of the picture is that of its points, too."""
        from ..files.access.atomic_write import written_whole
        from ..page.films import draw_film, frames_of
        from ..page.page_file import largest_of

        frames = frames_of(frames, film.frames)
        title = self._title(frame)
        start = time.perf_counter()
        with open_renderer(device, output) as renderer, progress(len(frames) + 1) as advance:
            largest = largest_of(RenderRequest.seen(frames[0], view))

            def after_all(done: int, all: int) -> None:
                advance(done, all)
                after_each(renderer)

            text = draw_film(
                renderer, frames, view, film.fps, quality=self.exactness, largest=largest, title=title,
                count=Count(after_all), skipped=warn_skipped,
            )  # fmt: skip
            with written_whole(output) as temporary:
                temporary.write_text(text, encoding="utf-8")
            what = f"a page of {output.stat().st_size / 1e6:.2f} MB in which {len(frames)} frames play"
            report(output, what, renderer, time.perf_counter() - start)

    def _title(self, frame: FrameOptions) -> str:
        return Path(str(frame.input or frame.depth or "vase")).stem if self.title is None else self.title

    def write(
        self, source: Any, view: View, output: Path, frame: FrameOptions, line: str, device: int,
        after_each: Callable[[Renderer], None],
    ) -> None:  # fmt: skip
        """Writes the page. A size smaller than that of the source is that of the points in the page, too.

        line  as `page_line` makes it
        """
        from ..page.page_file import largest_of, write_page

        request = RenderRequest.seen(source, view)
        title = self._title(frame)
        start = time.perf_counter()
        with open_renderer(device, output) as renderer, spinner("writing"):
            largest = largest_of(request)
            write_page(renderer, output, request, quality=self.exactness, largest=largest, title=title, command=line)
            after_each(renderer)
            report(output, f"a page of {output.stat().st_size / 1e6:.2f} MB", renderer, time.perf_counter() - start)


# what lies behind a picture in formats without alpha
_OPAQUE = {".jpg": "black", ".jpeg": "black"} | dict.fromkeys(FILMS, "#{:02x}{:02x}{:02x}".format(*BACKGROUND))


@dataclass(frozen=True)
class EnvironmentOptions(group_of(typed(Finish, (LIGHT,), None))):
    """Light from all around, and how light above white is shown."""

    @classmethod
    def of(cls, finish: Finish) -> EnvironmentOptions:
        """What is typed for a finish, as far as words can say it; its values need not be texts."""
        values = {one.name: finish.options.get(one.name) for one in fields(cls)}
        return cls(**{name: _as_typed(value) for name, value in values.items()})

    def chosen(self) -> dict[str, Any]:
        """The values that were typed, by the names of the fields of Finish. Raises ValueError or OSError."""
        chosen = self.values_of(Finish)
        if "environment" in chosen:
            chosen["environment"] = environment_from(chosen["environment"])
        return chosen


@dataclass(frozen=True)
class PictureOptions(group_of(typed(Finish, (PICTURE,), None)), EnvironmentOptions):
    """How a picture is finished."""

    def finish(self, output: Path, samples: int) -> Finish:
        """The Finish of pictures. Raises ValueError for values that do not fit the output. samples: unless typed."""
        suffix, chosen = output.suffix.lower(), self.chosen()
        if self.background == "transparent" and suffix in _OPAQUE:
            raise ValueError(f"{output} cannot be transparent: write a .png, or leave out {option('background')}")
        if "samples" not in chosen:
            chosen["samples"] = samples
        if "background" not in chosen and (chosen["samples"] > 1 or self.ground):
            chosen["background"] = _OPAQUE.get(suffix)
        return Finish(**{"exposure": "sensor", **chosen})

    def check_none(self, output: Path) -> None:
        """Raises ValueError if one was given for an output that is no picture."""
        given = [name for name, value in vars(self).items() if value is not None and value is not False]
        if given:
            raise ValueError(f"{output} is no picture: leave out {', '.join(map(option, given))}")


def _as_typed(value: Any) -> Any:
    """The value as it is typed; None: no words say it."""
    if isinstance(value, Environment):
        return value.name or None
    if isinstance(value, bool):
        return "yes" if value else "no"
    return None if isinstance(value, tuple) else value


def view_of(
    look: LookGroup,
    place: ViewOptions,
    picture: PictureOptions,
    output: Path,
    *,
    is_scene: bool,
    is_film: bool,
    is_changed: bool,
    is_cloud: bool = False,
) -> View:
    """The View of what is drawn. Raises ValueError or OSError.

    is_scene    whether it is a scene, as of point clouds
    is_changed  whether something else than a single frame is seen by its own camera
    """
    chosen = look.look()
    is_photograph = chosen.is_plain and place == ViewOptions() and not (is_scene or is_changed)
    lights = look.lights(shadow=picture.ground or is_scene)
    is_hard = not picture.ground and not any(light.is_soft for light in lights)
    samples = 1 if is_photograph and not picture.ground else FILM if is_film or (is_cloud and is_hard) else STILL
    return place.view(chosen, lights, picture.finish(output, samples))


SavePoses = Annotated[
    Path | None,
    typer.Option(
        metavar="FILE",
        help=f"Also write the poses that --align found: a {', '.join(POSE_LISTS)} of TUM's form, which --poses reads.",
        rich_help_panel=SETS,
    ),
]


def check_saved(path: Path, aligns: bool) -> None:
    """Raises ValueError or OSError unless poses can be written there, and some are corrected."""
    from ..files.writing.maps_and_points import check_poses_path

    if not aligns:
        raise ValueError(f"{option('save_poses')} writes the poses that {option('align', True)} finds: add it")
    check_poses_path(path)


def poses_saver(path: Path | None, together: MergedViews) -> Callable[[Renderer], None]:
    """A function for after each picture: with a path, it writes the poses of the first."""
    waiting = [path] if path is not None else []

    def save(renderer: Renderer) -> None:
        if waiting:
            found = renderer.aligned
            poses = (found.get(frame, frame).pose for frame in together.frames)
            _save_poses(waiting.pop(), dict(zip(together.numbers, poses, strict=True)))

    return save


@contextmanager
def poses_saved(
    path: Path | None, jobs: Generator[Job, None, None], source: object
) -> Generator[Generator[Job, None, None], None, None]:
    """The jobs of a film of a source; with a path, the poses of their frames are written when all are drawn."""
    poses: dict[int, NDArray[np.float64]] = {}

    def noted() -> Generator[Job, None, None]:
        with closing(jobs):
            for number, request in jobs:
                if isinstance(request.source, Frame):
                    own = source.parts[number].number if isinstance(source, FrameSequence) else number
                    poses[own] = request.source.pose
                yield number, request

    yield noted()
    if path is not None:
        _save_poses(path, poses)


def _save_poses(path: Path, poses: Mapping[int, NDArray[np.float64]]) -> None:
    from ..files.writing.maps_and_points import save_numbered_poses

    save_numbered_poses(path, poses)
    print_line(f"{path}: {counted(len(poses), 'pose')}")


def check_cloud_output(output: Path, axes: str | None) -> None:
    """Raises ValueError or OSError unless the normals of a point cloud can be written there."""
    check_suffix(output, CLOUD_NORMALS, "the suffix of a point cloud's normals")
    if output.suffix.lower() in POINTS:
        check_points_path(output, axes)
        return
    if axes is not None:
        raise ValueError(f"{option('axes')} turns the points of a .ply, {output} holds normals alone: leave it out")
    check_writable(output)


def check_unlit(output: Path, *groups: FieldOptions) -> None:
    """Raises ValueError for options of pictures, which do not change the points of a cloud."""
    given = [name for group in groups for name in group.changed if name != "noise"]
    if given:
        fact = f"{output} holds the points of a cloud in their own colours"
        raise ValueError(f"{fact}, without light: leave out {', '.join(map(option, given))}")


def write_cloud(cloud: PointCloud, look: Look, output: Path, axes: Any, device: int) -> None:
    """Writes a cloud with normals to a .ply, or the normals, (n, 3), to an .npy.

    look  its noise is what the normals are estimated with. Raises ValueError for other options of normals.
    """
    noise = look.noise
    if not isinstance(noise, float | None):
        raise ValueError(f"{option('noise')} of a point cloud is one number of world units, got {noise}")
    if others := [name for name in given_by(look, NormalOptions().look()) if name != "noise"]:
        raise ValueError(f"{', '.join(map(option, others))} is for frames: of a point cloud leave it out")
    with open_renderer(device, output) as renderer:
        start = time.perf_counter()
        with spinner("estimating normals"):
            made = renderer.with_normals(cloud, noise=noise)
            spent = time.perf_counter() - start
            _save_cloud(output, made, axes)
        report(output, _what(made), renderer, spent)


def _save_cloud(output: Path, cloud: PointCloud, axes: Any) -> None:
    if output.suffix.lower() in POINTS:
        save_points(output, cloud, axes)
        return
    assert cloud.normals is not None
    save_image(output, np.where(cloud.normals.any(1, keepdims=True), cloud.normals, np.float32(np.nan)))


def _what(cloud: PointCloud) -> str:
    known = 0 if cloud.normals is None else int(np.count_nonzero(cloud.normals.any(1)))
    return counted(len(cloud), "point") + f", {counted(known, 'normal')}"


Source = Frame | Scene | Sequence[Frame]


def write_normals(source: Source, view: View, output: Path, axes: Any, bits: Any, explain: bool, device: int) -> None:
    """Writes normals by the method and the options of a view's look, as `save_normals` does."""

    def draw(renderer: Renderer, request: RenderRequest) -> Any:
        normals = renderer.estimate_normals(request)
        if explain and renderer.choice:
            print(describe(renderer.choice))
        return normals

    def what(normals: Any) -> str:
        return f"{np.isfinite(normals).all(-1).sum()} normals by {view.look.normals}"

    _write_files(source, view, output, draw, partial(save_normals, axes=axes, bits=bits), what, device, FilmOptions())


def write_depth(source: Source, view: View, output: Path, device: int) -> None:
    """Writes the depth that a view shows, as `save_depth` does."""

    def draw(renderer: Renderer, request: RenderRequest) -> Any:
        depth = renderer.render_depth(request)
        if not depth.any():
            note("nothing is in view, the depth is empty")
        return depth

    def what(depth: Any) -> str:
        known = depth[depth > 0]
        return f"{depth.shape[1]}x{depth.shape[0]} pixels, {known.size} with depth"

    note = once(print_note)
    if output.suffix.lower() == ".png":
        note(f"{output} holds millimetres, nearly black in picture viewers: 1.5 m is 1500 of 65535")
    _write_files(source, view, output, draw, partial(save_depth, notes=note), what, device, FilmOptions())


def write_points(
    source: Source,
    view: View,
    output: Path,
    axes: Any,
    film: FilmOptions,
    device: int,
    after_each: Callable[[Renderer], None],
) -> None:
    """Writes the points of frames in the light of a view, as `save_points` does. tell: called after each."""

    def draw(renderer: Renderer, request: RenderRequest) -> Any:
        cloud = renderer.render_points(request)
        after_each(renderer)
        return cloud

    save = partial(save_points, axes=axes)
    _write_files(source, view, output, draw, save, lambda cloud: f"{len(cloud)} points", device, film)


def _write_files(
    source: Any,
    view: View,
    output: Path,
    draw: Callable[[Renderer, RenderRequest], Any],
    save: Callable[[Path, Any], None],
    what: Callable[[Any], str],
    device: int,
    film: FilmOptions,
) -> None:
    """Writes what `draw` makes of a source to a file, or of each of its frames to a file with the frame's number.

    what  says what was drawn, for the line that is printed

    Raises ValueError for a name without a number where there are many frames, and with one where there is one.
    """
    many, turntable = is_numbered(output), film.turntable
    check_stream(view.look, many and turntable is None)
    if turntable is None and many and isinstance(source, Frame | Scene):
        raise ValueError(f"{output} is a name for many files, but INPUT is a single frame: leave out the number")
    if turntable is not None and not many:
        raise ValueError(f"many files need a number in the name, such as %04d{output.suffix}, got {output}")
    with open_renderer(device, output) as renderer:
        start = time.perf_counter()
        if many:
            jobs, count = jobs_of(source, view, turntable, film.frames, warn_skipped, renderer)
            with progress(count) as advance:
                count, first = write_numbered(jobs, partial(draw, renderer), save, output, Count(advance, count))
            spent = time.perf_counter() - start
            text = f"{count} files, the first of {what(first)}"
        else:
            with spinner("rendering"):
                made = draw(renderer, RenderRequest.seen(source, view))
                spent = time.perf_counter() - start
                save(output, made)
            text = what(made)
        report(output, text, renderer, spent)
