"""`pointshade render --save-poses`: writes the poses with which several frames were drawn as one object."""

from __future__ import annotations

from collections.abc import Callable, Generator, Mapping
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from numpy.typing import NDArray

from ..files.access.known_names import POSE_LISTS
from ..files.frames.sequences import FrameSequence
from ..notes.words import counted, option
from ..renderer.renderer import Renderer
from ..renderer.series import Job
from ..scene.frame import Frame
from ..scene.option_fields import SETS
from .inputs import Together
from .output import print_line

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


def poses_saver(path: Path | None, together: Together) -> Callable[[Renderer], None]:
    """A function for after each picture: with a path, it writes the poses of the first."""
    waiting = [path] if path is not None else []

    def save(renderer: Renderer) -> None:
        if waiting:
            found = renderer.aligned
            poses = (found.get(frame, frame).pose for frame in together.frames)
            _save(waiting.pop(), dict(zip(together.numbers, poses, strict=True)))

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
        _save(path, poses)


def _save(path: Path, poses: Mapping[int, NDArray[np.float64]]) -> None:
    from ..files.writing.maps_and_points import save_numbered_poses

    save_numbered_poses(path, poses)
    print_line(f"{path}: {counted(len(poses), 'pose')}")
