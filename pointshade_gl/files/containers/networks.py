"""Reads frames from arrays whose names are known (array_roles.ROLES), as networks, renderers and data sets write them.

Shapes    (h, w), (h, w, c) or (c, h, w); one frame or several (n, ...); any axes of length 1 before.
Points    (h, w, 3): z is the depth, and the camera is fitted to x/z and y/z. Beside poses they may be in the world's
          axes: whichever a pinhole camera sees.
Cameras   a 3x3 matrix in pixels, or normalised (cx and cy up to 1, corners at 0 and 1: MoGe); or a focal length in
          pixels, with the principal point in the middle unless the file says it.
Poses     "extrinsics" and "w2c" are world-to-camera, "poses" and "c2w" camera-to-world, all with OpenCV's axes.
Valid     where mask is true, where sky is not, and where the confidence is high enough, see `array_frames`.
"""

from __future__ import annotations

from ...notes.notes import Note, once
from ...notes.words import option
from ..access.limits import MAX_PIXELS, PARTS, check_limit, check_pixels
from ..arrays.array_roles import MAYBE_ERROR, MAYBE_INVERSE, SURFACES, find_roles, is_named, list_arrays
from ..arrays.stored_arrays import Stored
from ..cameras.intrinsics import Intrinsics
from .array_frames import Assembly
from .contents import Frames
from .items import NUMBERS, PLANES, Item

_LONGEST = 4  # times as high as wide is a picture of depth at most


def open_arrays(
    name: str,
    arrays: dict[str, Stored],
    note: Note,
    max_pixels: float = MAX_PIXELS,
    is_transposed: bool = False,
    usual: Intrinsics | None = None,
) -> Frames:
    """The frames that arrays of these names make. Raises ValueError if none is a depth, or if it has too many pixels.

    name           of the file, for messages
    is_transposed  (w, h) instead of (h, w), and so on: MATLAB's arrays in HDF5
    usual          the camera if the arrays do not say it
    """
    roles = find_roles(arrays)
    items = {role: Item(role, arrays[key]) for role, key in roles.items()}
    surface = next((role for role in SURFACES if role in items and items[role].lead is not None), None)
    if surface is None:
        listed = list_arrays({key: array.shape for key, array in arrays.items()})
        raise ValueError(
            f"{name} has no array called depth or points, only {listed or 'nothing'}: "
            f"save the depth alone as .npy and pass it as {option('depth', 'FILE')}"
        )
    _check_surface(name, roles[surface], items[surface], max_pixels)
    for role, item in list(items.items()):
        if not _fits(role, item, items[surface]):
            note(f"{name}: {list_arrays({roles[role]: item.array.shape})} does not fit the depth and is not used")
            del items[role]
    _doubt_depth(name, roles[surface], surface, items, usual, note)
    _doubt_confidence(name, roles, items, note)
    assembly = Assembly(name, items, surface, is_transposed, usual, once(note), max_pixels)
    return Frames(items[surface].count, assembly.read)


def _check_surface(name: str, key: str, item: Item, max_pixels: float) -> None:
    """Raises ValueError for too many pixels or frames, and if the last axis seems to count frames."""
    height, width = item.size
    check_pixels(width, height, f"{name}/{key}", max_pixels)
    check_limit(item.count, f"{name} has {item.count} frames", max_pixels, PARTS)
    if item.count > 1 and _LONGEST * width < min(height, item.count):
        raise ValueError(
            f"{name}: {list_arrays({key: item.array.shape})} must have the shape (h, w) or (n, h, w): "
            "move the axis that counts frames to the front"
        )


def _fits(role: str, item: Item, surface: Item) -> bool:
    """Return whether an array is for one or for all frames, and of the depth's size if it belongs to its pixels."""
    if role in NUMBERS:
        return True
    is_same = role not in (*PLANES, "normals") or item.size == surface.size
    return item.lead is not None and item.count in (1, surface.count) and is_same


def _doubt_depth(
    name: str, key: str, surface: str, items: dict[str, Item], usual: Intrinsics | None, note: Note
) -> None:
    """Print a note if the numbers may be inverse: by their name, or as videos of floats without a camera often are."""
    is_video = surface == "depth" and items[surface].count > 1 and items[surface].array.dtype.kind == "f"
    has_camera = usual is not None or "intrinsics" in items or "focal" in items
    if is_named(key, MAYBE_INVERSE) or (is_video and not has_camera):
        kind = option("depth_kind", "inverse")
        note(f"{name}: {key} is read as distances; pass {kind} for Depth Anything, DepthCrafter or MiDaS")


def _doubt_confidence(name: str, roles: dict[str, str], items: dict[str, Item], note: Note) -> None:
    """Leave out confidence that may be an error instead."""
    key = roles.get("confidence", "")
    if "confidence" in items and is_named(key, MAYBE_ERROR) and items["confidence"].array.dtype.kind == "f":
        note(f"{name}: {key} is not used, it may be an expected error as UniDepth's is")
        del items["confidence"]
