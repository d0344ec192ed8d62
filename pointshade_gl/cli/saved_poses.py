"""`pointshade render --save-poses`: writes the poses with which several frames were drawn as one object."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Annotated

import typer

from ..files.access.written_suffixes import POSES
from ..messages.formatting import counted, option
from ..rendering.renderer import Renderer
from ..scene.option_fields import VIEW
from .inputs import Together

SavePoses = Annotated[
    Path | None,
    typer.Option(
        metavar="FILE",
        help=f"Also write the poses that --align found: a {', '.join(POSES)} of TUM's form, which --poses reads.",
        rich_help_panel=VIEW,
    ),
]


def check_saved(path: Path, aligns: bool, is_set: bool) -> None:
    """Raises ValueError or OSError unless poses can be written there, and some are corrected. is_set: of one object."""
    from ..files.writing.poses import check_poses_path

    if not aligns:
        raise ValueError(f"{option('save_poses')} writes the poses that {option('align', True)} finds: add it")
    if not is_set:  # once the frames of a sequence are aligned one after the other, their poses are written, too
        raise ValueError(
            f"{option('save_poses')} writes the poses of frames that are drawn as one object: pass "
            f"{option('views', 'N')} or several INPUTs"
        )
    check_poses_path(path)


def poses_saver(path: Path | None, together: Together) -> Callable[[Renderer], None]:
    """A function for after each picture: with a path, it writes the poses of the first."""
    waiting = [path] if path is not None else []

    def save(renderer: Renderer) -> None:
        if not waiting:
            return
        from ..files.writing.poses import save_poses

        found, to = renderer.aligned, waiting.pop()
        save_poses(to, [found.get(frame, frame) for frame in together.frames], together.numbers)
        print(f"{to}: {counted(len(together.frames), 'pose')}")

    return save
