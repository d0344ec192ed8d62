"""What was estimated about a picture's objects, and in plain text how it was drawn and why."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..estimation.alignment import Fit
from ..estimation.light_fit import FoundLight, describe_light
from ..estimation.multi_view import SetReport, is_primary
from ..gpu.clouds.cloud_objects import PlacedCloud
from ..gpu.clouds.cloud_planes import FitRadius
from ..gpu.drawables import Drawables
from ..gpu.points.point_objects import ShownSet
from ..notes.words import counted
from ..scene.frame import Frame
from ..scene.noise import Choice, describe


class CloudFinding(NamedTuple):
    """What was drawn of a cloud: how many of its points, how far they lie apart, and how their planes were found.

    fit  None where they have none, as balls of a given size
    """

    points: int
    drawn: int
    spacing: float
    fit: FitRadius | None


Finding = Choice | SetReport | CloudFinding


def findings(drawn: Drawables) -> list[tuple[str, Finding]]:
    """Return, by object, which method estimated its normals, or what its several frames agree on."""
    found: list[tuple[str, Finding]] = []
    for p, thing in drawn.items():
        if isinstance(thing, ShownSet):
            found.append((p.node.name, thing.report()))
        elif isinstance(thing, PlacedCloud):
            points = thing.points
            found.append((p.node.name, CloudFinding(len(thing.cloud), points.count, points.spacing, points.fit)))
        else:
            found += [(p.node.name, choice) for choice in thing.choices]
    return found


def lights(drawn: Drawables) -> list[tuple[str, FoundLight]]:
    """Return the light that was found in each frame whose shading is to be removed, by the name of its object."""
    found = ((p.node.name, view.textures.light) for p, thing in drawn.items() for view in thing.views)
    return [(name, light) for name, light in found if light]


def weights(drawn: Drawables) -> dict[Frame, float]:
    """Return the weight of each frame where several show the same surface: 1 if it is a primary view."""
    return {frame: weight for thing in drawn.values() for frame, weight in thing.weights.items() if frame}


NOTED_EXPOSURE = 0.02  # a frame's exposure differs by so much from the mean before it is worth telling
TINTED = 0.03  # and its channels by so much from each other
LEAST = 5e-4  # share of the points that is worth a number
MOST = 5  # frames that a line names


def explain(findings: Sequence[tuple[str, Finding]], names: Sequence[str] = ()) -> list[str]:
    """Describe, in lines, what was found about the objects of a picture; each by its name where there are several.

    names  of the frames of objects that have several; by default their numbers
    """
    lines = []
    for name, found in findings:
        prefix = f"{name or 'object'}: " if len(findings) > 1 else ""
        if isinstance(found, CloudFinding):
            own = _explain_cloud(found)
        else:
            own = explain_set(found, names) if isinstance(found, SetReport) else [describe(found)]
        lines += [prefix + line for line in own]
    return lines


def _explain_cloud(found: CloudFinding) -> list[str]:
    """Describe a cloud. Its lengths are world units, of which nobody says that they are metres."""
    share = "all" if found.drawn == found.points else f"an even sample, {counted(found.drawn, 'point')}"
    apart = f", about {found.spacing:.3g} apart" if found.spacing else ""
    lines = [f"cloud: {counted(found.points, 'point')}, drawn: {share}{apart}"]
    if found.fit is not None:
        noise = f"noise of {found.fit.noise:.2g}" if found.fit.noise else "no noise that could be told from the surface"
        lines.append(f"planes: fitted within {found.fit.length:.3g} of each point; {noise} was measured")
    return lines


def explain_lights(lights: Sequence[tuple[str, FoundLight]]) -> list[str]:
    """Describe, in lines, which light was found in the frames of a picture; equal lines once."""
    found = [(name, describe_light(one)) for name, one in lights]
    several = len({name for name, _ in found}) > 1
    return list(dict.fromkeys(f"{name or 'object'}: {line}" if several else line for name, line in found))


def explain_set(report: SetReport, names: Sequence[str] = ()) -> list[str]:
    """Describe several frames of one object in lines. Raises ValueError for another number of names."""
    count = len(report.points)
    if names and len(names) != count:
        raise ValueError(f"names must be one for each of the {counted(count, 'frame')}, got {len(names)}")
    names = names or [str(k) for k in range(count)]
    return [
        *_explain_normals(report.choices),
        f"band: depths within {100 * report.band:.2g} % of each other are one surface",
        _explain_gains(report.gains, names),
        _explain_trust(report, names),
        _explain_primary(report.importances, names),
    ]


def explain_alignment(given: Sequence[Frame], fits: Sequence[Fit], names: Sequence[str] = ()) -> list[str]:
    """Describe in lines how the poses of frames were corrected."""
    names = names or [str(k) for k in range(len(fits))]
    leading = [name for name, fit in zip(names, fits, strict=True) if fit.leads]
    placed = sum(fit.placed and not fit.leads for fit in fits)
    stays = f"that of frame {leading[0]} stays" if len(leading) == 1 else f"those of frames {', '.join(leading)} stay"
    lines = [f"aligned: {placed} of {counted(len(fits) - len(leading), 'pose')} corrected; {stays}"]
    for k, (frame, fit) in enumerate(zip(given, fits, strict=True)):
        if fit.leads:
            continue
        by = f"by {1e3 * fit.moved:.3g} mm and {turn_between(frame.pose, fit.pose):.2g} degrees"
        how = by if fit.placed else "not at all"
        spread = f"depths differ by {100 * fit.before:.2g} % before, {100 * fit.after:.2g} % after"
        spread = spread if np.isfinite(fit.before) and np.isfinite(fit.after) else "nothing to compare"
        lines.append(f"aligned: frame {names[k]} {how}; overlap {fit.overlap:.0%}, {spread}, {fit.agrees:.0%} agree")
    return lines


def turn_between(pose: NDArray[np.float64], other: NDArray[np.float64]) -> float:
    """Return the angle between two poses, degrees."""
    turn = pose[:3, :3].T @ other[:3, :3]
    sine = np.linalg.norm([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]]) / 2
    return float(np.degrees(np.arctan2(sine, (np.trace(turn) - 1) / 2)))


def _explain_normals(choices: Sequence[Choice]) -> list[str]:
    """Describe each method that ran in a line, with the frame whose noise is the median."""
    lines = []
    for method in dict.fromkeys(choice.method for choice in choices):
        same = [one for one in choices if one.method == method]
        same.sort(key=lambda one: one.noise.relative if one.noise else 0.0)
        middle = "typical of " if same[0].noise else ""
        lines.append(f"{describe(same[len(same) // 2])} ({middle}{counted(len(same), 'frame')})")
    return lines


def _explain_gains(gains: NDArray[np.float64], names: Sequence[str]) -> str:
    off = np.abs(np.log(gains)).max(1)
    noted = [int(k) for k in np.argsort(-off, kind="stable") if off[k] > np.log1p(NOTED_EXPOSURE)]
    if not noted:
        return "gains: none, the exposures are equal"
    listed = [f"{names[k]} by {_gain(gains[k])}" for k in noted[:MOST]]
    return f"gains: to match exposures, colours are multiplied in {_frames_in_words(listed, len(noted) - MOST)}"


def _gain(gain: NDArray[np.float64]) -> str:
    if np.ptp(np.log(gain)) > TINTED:
        return "{:.2f} (red), {:.2f} (green), {:.2f} (blue)".format(*gain)
    return f"{np.exp(np.log(gain).mean()):.2f}"


def _explain_trust(report: SetReport, names: Sequence[str]) -> str:
    shares = report.distrusted / np.maximum(report.points, 1)
    overall = report.distrusted.sum() / max(int(report.points.sum()), 1)
    text = f"distrusted: {_percent(overall)} of the points: other views see through them, or they fly at an edge"
    worst = [int(k) for k in np.argsort(-shares, kind="stable") if shares[k] > max(1.5 * overall, LEAST)]
    listed = [f"{names[k]} ({_percent(shares[k])})" for k in worst[:MOST]]
    return f"{text}; most in {_frames_in_words(listed, len(worst) - MOST)}" if listed else text


def _percent(share: float) -> str:
    few = "0 %" if not share else f"under {100 * LEAST:g} %"
    return few if share < LEAST else f"{float(f'{100 * share:.2g}'):g} %"


def _explain_primary(importances: NDArray[np.float64], names: Sequence[str]) -> str:
    primary = [name for name, carries in zip(names, is_primary(importances), strict=True) if carries]
    if len(primary) == len(importances):
        return f"primary views: all {len(primary)}"
    rest = len(importances) - len(primary)
    named = _frames_in_words(primary[:MOST], len(primary) - MOST)
    return f"primary views: {named}; {counted(rest, 'other')} may fill gaps"


def _frames_in_words(names: Sequence[str], more: int) -> str:
    """Return `frame 3`, `frames 3, 5 and 7`, `frames 3, 5 and 4 more`."""
    *first, last = [*names, f"{more} more"] if more > 0 else names
    return f"frames {', '.join(first)} and {last}" if first else f"frame {last}"
