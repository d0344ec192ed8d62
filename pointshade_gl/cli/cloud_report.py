"""What `pointshade info CLOUD` prints: what is in the file of a point cloud, and how it would be read."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from ..files.clouds.load_cloud import check_cloud_options, cloud_facts
from ..notes.words import counted, option
from ..scene.cloud import axes_in_words
from .options import FrameOptions
from .output import print_line


def show_cloud(frame: FrameOptions, output: Path | None, as_json: bool) -> None:
    """Prints what was found. Raises as reading the cloud does."""
    if output:
        raise ValueError(f"a contact sheet shows a frame, and {frame.input} is a point cloud: leave out -o {output}")
    assert frame.input is not None
    check_cloud_options([name for name, value in frame.load_options.items() if value is not None], frame.input)
    found = cloud_facts(frame.input, max_pixels=frame.max_pixels, **frame.cloud_options)
    print_line(json.dumps(found, indent=1) if as_json else "\n".join(_lines(found)))


def _lines(found: dict[str, Any]) -> list[str]:
    lines: list[str] = []
    for subject, said in _sentences(found):
        lines += [f"{subject if k == 0 else '':10s}{line}" for k, line in enumerate(said)]
    return lines


def _sentences(found: dict[str, Any]) -> list[tuple[str, list[str]]]:
    """A subject, then one line for each thing to know about it."""
    share, places = found["normals"], found["seen_from"]
    low, high = (", ".join(f"{one:.10g}" for one in corner) for corner in found["box"])
    return [
        ("points", [f"{counted(found['points'], 'point')}, {found['format']}"]),
        (
            "extent",
            [
                " x ".join(f"{side:g}" for side in found["extent"]) + f", spacing about {found['spacing']:g}",
                f"from {low} to {high}, without stray points",
            ]
            if found["points"]
            else ["none"],
        ),
        ("origin", [", ".join(f"{one:.10g}" for one in found["origin"]) + f"; positions are {found['stored_as']}"]),
        ("up", [f"{found['up']['axis']} ({found['up']['why']})"]),
        *([("axes", [axes_in_words(found["up"]["axis"], found["front"])])] if found["front"] else []),
        ("color", [f"{'yes' if found['colors'] else 'none'}; {option('color_by')} {', '.join(found['color_by'])}"]),
        ("normals", ["none" if not share else "yes" if share == 1 else f"of {share:.0%} of the points"]),
        ("sizes", ["yes" if found["sizes"] else "none"]),
        ("seen from", [", ".join(f"{one:g}" for one in place) for place in places] or ["unknown"]),
        ("notes", found["assumed"] or ["none"]),
    ]
