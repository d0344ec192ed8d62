"""Saves the picture that a window shows, and tells the command line that makes the same."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING

from ..files.pictures.picture_files import save_image
from .command import render_line
from .redrawing import most_samples

if TYPE_CHECKING:
    from .viewer import Viewer


def save_picture(viewer: Viewer) -> Path | None:
    """Writes the picture to a new file in the working directory: its name; None if that fails, which is said."""
    camera = viewer.window.fit(viewer.own_camera)
    if camera is None:
        return None
    path = next(p for k in range(1, 1_000_000) if not (p := Path(f"pointshade_{k:04d}.png")).exists())
    samples = most_samples(viewer, camera)
    try:
        save_image(path, viewer.screen.read(viewer, camera, samples))
    except OSError as error:
        viewer.say(f"not saved: {error}")
        return None
    if camera == viewer.camera:
        viewer.redrawing.refining.samples = samples
    _tell(viewer, path.absolute(), *render_line(viewer, camera, samples, path.name))
    return path


def _tell(viewer: Viewer, path: Path, line: str, left_out: str) -> None:
    sys.stdout.write(f"{path}\n" + (f"{line}\n" if line else ""))
    if line:
        viewer.window.copy(line)
    said = "the command that makes it is in the clipboard" if line else ""
    said += f"; it leaves out: {left_out}" if line and left_out else left_out
    viewer.say(f"saved {path}" + (f"\n{said}" if viewer.opened.typed else ""))
