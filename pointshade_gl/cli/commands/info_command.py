"""`pointshade info` and `bench`: what is in a file and how it would be read, what draws, how fast and well."""

from __future__ import annotations

import json
import time
from pathlib import Path
from typing import Annotated, Any

import typer

from ...files.clouds.load_cloud import check_cloud_options, check_frame_options, cloud_facts
from ...files.depth.depth_kinds import METRIC
from ...files.frames.frame_files import examine, facts
from ...files.pictures.picture_files import check_writable, save_image
from ...notes.version import __version__
from ...notes.words import counted, option
from ...renderer.series import contact_sheet
from ...scene.cloud import axes_in_words
from ...scene.noise import MUCH_WRONG, Choice, describe, describe_wrong
from .. import options
from ..inputs import check_frame
from ..output import open_renderer, print_line, report, spinner


@options.spread
def info(
    frame: options.FrameOptions, output: options.SheetOutput = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON, for programs.")] = False, *,
    run: options.RunOptions
) -> None:  # fmt: skip
    """Print what is in a file or folder, and how it would be read; without INPUT, what draws: GL vendor, limits."""
    if frame.named is frame:
        if frame.holds_points:
            show_cloud(frame, output, as_json)
        else:
            check_frame(frame)
            check_frame_options(frame.cloud_options, frame.input)
            frame.check_exist()
            show_input(frame, output, as_json, run.device)
        return
    if output:
        raise ValueError(f"a contact sheet shows a frame: pass INPUT, as in `pointshade info vase -o {output}`")
    with open_renderer(run.device) as renderer:
        limits = {"pointshade_gl": __version__, **renderer.context.limits()}
        if as_json:
            print(json.dumps({name.replace(" ", "_"): value for name, value in limits.items()}, indent=1))
        else:
            print("\n".join(f"{name:16s}{limits[name]}" for name in limits))


@options.spread
def bench(how: options.BenchOptions, device: options.Device = 0, quiet: options.Quiet = False) -> None:
    """Measure the speed, accuracy and robustness of every estimator: charts and results.json."""
    from ...bench.command import bench as bench_estimators
    from ...bench.command import bench_speed, research

    quick, output = how.quick, how.output
    if how.against is not None and not how.speed:
        raise ValueError(f"{option('against')} compares speeds: add {option('speed', True)}")
    if how.against is not None:
        about = research("against", "speed_against").bench_against(how.against, quick, device)
    elif how.speed:
        about = bench_speed(output, quick, device)
    elif how.views:
        about = research("views", "several_views").bench_views(output, quick, how.seed, device)
    elif how.images:
        about = research("images", "lit_pictures").bench_images(output, quick, how.only or [], how.seed, device)
    else:
        about = bench_estimators(output, quick, how.only or [], how.seed, device)
    print(about)


_KINECT_STEP = 0.0025, 0.0034  # between these lies 1/z's rounding of a first Kinect, in 1/m


def show_input(frame: options.FrameOptions, output: Path | None, as_json: bool, device: int) -> None:
    """Prints what was found, and writes a contact sheet if there is an output. Raises as reading the input does."""
    if output:
        check_writable(output)
    examined = examine(frame.input, **frame.load_options)
    with open_renderer(device, output) as renderer, spinner("measuring the noise"):
        renderer.estimate_normals(examined.frame)
        noise = _noise(renderer.choice)
        if noise.get("bumps"):  # only these sensors' depth is searched, where its normals are made calm for light
            renderer.render(examined.frame)
            noise["wrong"] = renderer.choice.wrong if renderer.choice else 0.0
        found = {**facts(examined), "noise": noise, "assumed": examined.notes}
        _print_facts(found, _sentences(found), as_json)
        if output:
            start = time.perf_counter()
            save_image(output, contact_sheet(renderer, examined.frame))
            if not as_json:
                report(output, "colour, depth, normals, lit", renderer, time.perf_counter() - start)


def _noise(choice: Choice | None) -> dict[str, Any]:
    """What was measured on the depth; lengths in metres."""
    assert choice is not None, "normals were estimated"
    found = {"estimator": choice.method, "found": describe(choice)}
    if (noise := choice.noise) is None:
        return found
    rounded = noise.domain == "1/z" and _KINECT_STEP[0] < noise.step < _KINECT_STEP[1]
    return found | {
        "sigma": noise.sigma,
        "share": noise.share,
        "bumps": noise.bumps or None,
        "rounding": noise.step or None,
        "rounding_of": noise.domain or None,
        "sensor": "first Kinect or PrimeSense" if rounded else None,
    }


Facts = dict[str, list[str]]  # subjects, with one line for each thing to know about them


def _print_facts(found: dict[str, Any], words: Facts, as_json: bool) -> None:
    """Print them for a program, or for the eye: the subject on the left of its first line."""
    lines = [f"{'' if k else subject:10s}{line}" for subject, known in words.items() for k, line in enumerate(known)]
    print_line(json.dumps(found, indent=1) if as_json else "\n".join(lines))


def _sentences(found: dict[str, Any]) -> Facts:
    depth, color, camera, poses, noise = (found[key] for key in ("depth", "color", "camera", "poses", "noise"))
    frames, (near, far) = found["frames"], depth["range"]
    size = f", {color['size'][0]}x{color['size'][1]}" if color["size"] else ""
    estimator, _, found_noise = noise["found"].partition(": ")
    numbers = ", ".join(f"{key} {camera[key]:g}" for key in ("fx", "fy", "cx", "cy"))
    return {
        "frames": [f"{frames['count']}" + (f"; number {frames['shown']} is shown" if frames["count"] > 1 else "")],
        "depth": [
            f"{depth['file'] or 'an array'}, {depth['stored']}",
            f"{_unit(depth['kind'], depth['units_per_metre'])} ({depth['why']})",
            f"{near:.4g} to {far:.4g} m, median {depth['median']:.4g} m, {depth['missing']:.1%} missing",
        ],
        "color": [f"{color['file'] or ('in the same file' if size else 'none')}{size}"],
        "camera": [
            f"{numbers}; it sees {camera['fov'][0]:g} degrees across, {camera['fov'][1]:g} from top to bottom",
            f"from {camera['from']}",
        ],
        "poses": [f"{poses['count']} from {poses['from']}" if poses["count"] else "none"],
        "noise": [
            *found_noise.split(", "),
            *([f"like a {noise['sensor']}"] if noise.get("sensor") else []),
            *([describe_wrong(noise["wrong"])] if noise.get("wrong", 0) >= MUCH_WRONG else []),
        ],
        "normals": [f"by {estimator}"],
        "notes": found["assumed"] or ["none"],
        "verdict": [_verdict(found["fit"], bool(color["size"]))],
    }


def _verdict(fit: dict[str, Any], has_color: bool) -> str:
    """Whether colour, depth and camera fit, as far as can be seen."""
    if fit["doubts"]:
        return f"these do not fit as they are: {'; '.join(fit['doubts'])}"
    if fit["compared"]:
        return "these fit: the edges of colour and depth lie on each other, and the camera is of this size"
    return f"these fit by their sizes; {'there are few edges to compare' if has_color else 'there is no colour'}"


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


def show_cloud(frame: options.FrameOptions, output: Path | None, as_json: bool) -> None:
    """Prints what was found. Raises as reading the cloud does."""
    if output:
        raise ValueError(f"a contact sheet shows a frame, and {frame.input} is a point cloud: leave out -o {output}")
    assert frame.input is not None
    check_cloud_options([name for name, value in frame.load_options.items() if value is not None], frame.input)
    found = cloud_facts(frame.input, max_pixels=frame.max_pixels, **frame.cloud_options)
    _print_facts(found, _cloud_sentences(found), as_json)


_FEW = 8  # places that are listed


def _cloud_sentences(found: dict[str, Any]) -> Facts:
    share, places, up = found["normals"], found["seen_from"], found["up"]
    low, high = (", ".join(f"{one:.10g}" for one in corner) for corner in found["box"])
    sides = " x ".join(f"{side:g}" for side in found["extent"])
    extent = [f"{sides}, spacing about {found['spacing']:g}", f"from {low} to {high}, without stray points"]
    if strays := found["strays"]:
        extent.append(f"{counted(strays, 'stray point')}, far from all others; {option('clean', True)} leaves out such")
    path = [f"and {counted(len(places) - _FEW, 'more place')}"] if len(places) > _FEW else []
    return {
        "points": [f"{counted(found['points'], 'point')}, {found['format']}"],
        "extent": extent if found["points"] else ["none"],
        "origin": [", ".join(f"{one:.10g}" for one in found["origin"]) + f"; positions are {found['stored_as']}"],
        "up": [f"{up['axis']} ({up['why']})"],
        **({"axes": [axes_in_words(up["axis"], found["front"])]} if found["front"] else {}),
        "color": [f"{'yes' if found['colors'] else 'none'}; {option('color_by')} {', '.join(found['color_by'])}"],
        "normals": ["none" if not share else "yes" if share == 1 else f"of {share:.0%} of the points"],
        "sizes": ["yes" if found["sizes"] else "none"],
        "seen from": [", ".join(f"{one:.10g}" for one in place) for place in places[:_FEW]] + path or ["unknown"],
        "notes": found["assumed"] or ["none"],
    }
