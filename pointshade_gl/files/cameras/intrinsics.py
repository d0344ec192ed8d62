"""Intrinsics as a file states them, and the camera that follows from them for the depth image."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from ...notes.notes import Note
from ...notes.words import option
from ...scene.camera import Camera

Size = tuple[int, int]  # width, height
Numbers = tuple[float, float, float, float]  # fx, fy, cx, cy

NORMALIZED = (1, 1)  # the size of a picture whose sides have length 1: MoGe's, or a file that gives angles of view
_WIDEST = 150  # degrees from top to bottom: a wider pinhole camera is a mistake
_SAME_VIEW = 0.02  # pictures whose aspect ratios differ by less may show the same, at different sizes


@dataclass(frozen=True)
class Intrinsics:
    """What a source states about a camera; None = nothing.

    name          of the source, for messages
    numbers       fx, fy, cx, cy in pixels, pixel centres at integers; fy is NaN if pixels are square, cx and cy are
                  NaN if only the focal length is known
    size          (width, height) of the picture that they are for; NORMALIZED fits any
    depth_scale   raw depth values per metre
    depth_kind    one of depth_kinds.KINDS
    baseline      metres between the cameras of a disparity
    doffs         pixels to add to a disparity, where the two principal points differ (Middlebury)
    alternatives  other cameras of the same source, such as that of the colour picture
    """

    name: str
    numbers: Numbers
    size: Size | None = None
    depth_scale: float | None = None
    depth_kind: str | None = None
    baseline: float | None = None
    doffs: float | None = None
    alternatives: tuple[Intrinsics, ...] = ()


def merged(given: Intrinsics, filed: Intrinsics | None) -> Intrinsics:
    """Return the given camera; what it does not state about the depth comes from the other."""
    if filed is None:
        return given
    names = ("depth_scale", "depth_kind", "baseline", "doffs")
    unsaid: dict[str, Any] = {key: getattr(filed, key) for key in names if getattr(given, key) is None}
    return replace(given, **unsaid)


def place_camera(intrinsics: Intrinsics, depth: Size, color: Size | None, note: Note) -> Camera:
    """The camera of the depth picture; sizes are (width, height). Raises ValueError if it fits neither picture."""
    chosen = next((one for one in (intrinsics, *intrinsics.alternatives) if one.size == depth), intrinsics)
    size = chosen.size or _guess_size(chosen, depth, color, note)
    turned = size[1], size[0]
    if size != NORMALIZED and not _fits(size, depth, color) and _fits(turned, depth, color):
        chosen, size = _turned(chosen, size, note), turned
    if min(size) < 1:
        raise ValueError(f"{chosen.name}: intrinsics are for {_text(size)} pixels: there is no such picture")
    if size != NORMALIZED and not _fits(size, depth, color):
        seen = f"depth is {_text(depth)} and " + (f"color is {_text(color)}" if color else "there is no color")
        raise ValueError(
            f"{chosen.name}: intrinsics are for {_text(size)} pixels, but {seen}: "
            "pass the intrinsics of one of the two pictures"
        )
    fx, fy, cx, cy = chosen.numbers
    if math.isnan(fy):
        fy = fx * (depth[0] / depth[1] if size == NORMALIZED else 1)
    if math.isnan(cx):
        cx, cy = (size[0] - 1) / 2, (size[1] - 1) / 2
    try:
        camera = Camera(fx, fy, cx, cy, *size)
    except ValueError as error:
        raise ValueError(f"{chosen.name}: {error}") from None
    angle = math.degrees(2 * math.atan(camera.height / 2 / abs(camera.fy)))
    if angle > _WIDEST:
        note(
            f"{chosen.name} has fy {camera.fy:g} px for {_text(size)}, which sees {angle:.0f} degrees: "
            f"if that is wrong, pass {option('intrinsics', 'fx,fy,cx,cy')} or {option('fov', 'DEGREES')}"
        )
    if size == depth:
        return camera
    if size != NORMALIZED:
        what = f"the color of {_text(size)}" if size == color else f"{_text(size)} pixels"
        note(f"{Path(chosen.name).name} is for {what}, scaled to the depth's {_text(depth)}")
    return camera.resized(*depth)


def _fits(size: Size, depth: Size, color: Size | None) -> bool:
    """Return whether a camera of this size is that of one of the pictures."""
    return min(size) > 0 and (size in (depth, color) or shows_the_same(size, depth))


def _turned(intrinsics: Intrinsics, size: Size, note: Note) -> Intrinsics:
    """Return the camera of a picture that was turned since: upright ones clockwise, as telephones do, others back."""
    (fx, fy, cx, cy), (width, height) = intrinsics.numbers, size
    center = (height - 1 - cy, cx) if width > height else (cy, width - 1 - cx)
    note(
        f"{intrinsics.name} is for {_text(size)} and the picture is turned: the camera is turned, too; "
        f"pass {option('intrinsics', 'fx,fy,cx,cy')} if that is wrong"
    )
    return replace(intrinsics, numbers=(fx if math.isnan(fy) else fy, fx, *center))


def shows_the_same(size: Size, depth: Size) -> bool:
    """Return whether a picture of another size may be the depth picture made smaller or larger."""
    return abs(size[0] / size[1] * depth[1] / depth[0] - 1) < _SAME_VIEW


def _guess_size(intrinsics: Intrinsics, depth: Size, color: Size | None, note: Note) -> Size:
    """Return the picture whose middle is nearest to the principal point, among those that contain it."""
    cx, cy = intrinsics.numbers[2:]
    if math.isnan(cx):
        note(f"{intrinsics.name}: the principal point is taken as the middle of the depth picture")
        return depth

    def distance(size: Size) -> float:
        return max(abs(cx / size[0] - 0.5), abs(cy / size[1] - 0.5))

    size = min((depth, color or depth), key=distance)  # the depth when both are as near
    if not distance(size) <= 0.5:
        raise ValueError(
            f"{intrinsics.name}: the principal point ({cx:g}, {cy:g}) must lie in the depth picture of {_text(depth)}"
        )
    if color and color != depth:
        which = "depth" if size == depth else "color"
        note(f"{intrinsics.name}: no picture size is given, taken as for the {which} picture of {_text(size)}")
    return size


def _text(size: Size) -> str:
    return f"{size[0]}x{size[1]}"
