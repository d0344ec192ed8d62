"""What `pointshade info INPUT` prints: what is in a file or folder, and how it would be read."""

from __future__ import annotations

import json
import time
from pathlib import Path
from typing import Any

from ..files.depth.depth_kinds import METRIC
from ..files.frames.frame_files import examine, facts
from ..files.pictures.picture_files import check_writable, save_image
from ..renderer.series import contact_sheet
from ..scene.noise import Choice, describe
from .options import FrameOptions
from .output import open_renderer, print_line, report, spinner

_KINECT_STEP = 0.0025, 0.0034  # between these lies 1/z's rounding of a first Kinect, in 1/m


def show_input(frame: FrameOptions, output: Path | None, as_json: bool, device: int) -> None:
    """Prints what was found, and writes a contact sheet if there is an output. Raises as reading the input does."""
    if output:
        check_writable(output)
    examined = examine(frame.input, **frame.load_options)
    with open_renderer(device, output) as renderer, spinner("measuring the noise"):
        renderer.estimate_normals(examined.frame)
        found = {**facts(examined), "noise": _noise(renderer.choice), "assumed": examined.notes}
        print_line(json.dumps(found, indent=1) if as_json else "\n".join(_lines(found)))
        if output:
            start = time.perf_counter()
            save_image(output, contact_sheet(renderer, examined.frame))
            if not as_json:
                report(output, "colour, depth, normals, lit", renderer, time.perf_counter() - start)


def _noise(choice: Choice | None) -> dict[str, Any]:
    """What was measured on the depth; lengths in metres."""
    assert choice is not None, "normals were estimated"
    noise = choice.noise
    if noise is None:
        return {"estimator": choice.method, "found": describe(choice)}
    rounded = noise.domain == "1/z" and _KINECT_STEP[0] < noise.step < _KINECT_STEP[1]
    return {
        "estimator": choice.method,
        "found": describe(choice),
        "sigma": noise.sigma,
        "share": noise.share,
        "rounding": noise.step or None,
        "rounding_of": noise.domain or None,
        "sensor": "first Kinect or PrimeSense" if rounded else None,
    }


def _lines(found: dict[str, Any]) -> list[str]:
    """The facts for the eye: a subject, then one line for each thing to know about it."""
    lines: list[str] = []
    for subject, said in _sentences(found):
        lines += [f"{subject if k == 0 else '':10s}{line}" for k, line in enumerate(said)]
    return lines


def _sentences(found: dict[str, Any]) -> list[tuple[str, list[str]]]:
    depth, color, camera, poses, noise = (found[key] for key in ("depth", "color", "camera", "poses", "noise"))
    frames, (near, far) = found["frames"], depth["range"]
    size = f", {color['size'][0]}x{color['size'][1]}" if color["size"] else ""
    estimator, _, found_noise = noise["found"].partition(": ")
    numbers = ", ".join(f"{key} {camera[key]:g}" for key in ("fx", "fy", "cx", "cy"))
    return [
        ("frames", [f"{frames['count']}" + (f"; number {frames['shown']} is shown" if frames["count"] > 1 else "")]),
        (
            "depth",
            [
                f"{depth['file'] or 'an array'}, {depth['stored']}",
                f"{_unit(depth['kind'], depth['units_per_metre'])} ({depth['why']})",
                f"{near:.4g} to {far:.4g} m, median {depth['median']:.4g} m, {depth['missing']:.1%} missing",
            ],
        ),
        ("color", [f"{color['file'] or ('in the same file' if size else 'none')}{size}"]),
        (
            "camera",
            [
                f"{numbers}; it sees {camera['fov'][0]:g} degrees across, {camera['fov'][1]:g} from top to bottom",
                f"from {camera['from']}",
            ],
        ),
        ("poses", [f"{poses['count']} from {poses['from']}" if poses["count"] else "none"]),
        ("noise", found_noise.split(", ") + ([f"like a {noise['sensor']}"] if noise.get("sensor") else [])),
        ("normals", [f"by {estimator}"]),
        ("notes", found["assumed"] or ["none"]),
    ]


def _unit(kind: str, scale: float | None) -> str:
    """What one raw value is."""
    if kind in METRIC:
        unit = "without a scale" if scale is None else "in metres" if scale == 1 else f"with {scale:g} values per metre"
        return f"{kind} {unit}"
    if kind == "disparity" and scale != 1:
        return f"disparity with {scale:g} values per pixel"
    if kind == "inverse":
        return "inverse depth" + (f", z = {scale:.4g} / value" if scale else " without a scale")
    return f"kind {kind}"
