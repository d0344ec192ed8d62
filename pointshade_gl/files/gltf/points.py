"""Reads and writes point objects, which are stored in the extras of glTF nodes."""

from __future__ import annotations

import json
from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path
from typing import Any

import numpy as np

from ...notes.words import shown
from ...scene.appearance import SWITCHES, Look, Material
from ...scene.frame import Frame
from ...scene.objects import MOST_FRAMES, PointObject
from ..access.limits import SCENE_FRAMES, check_limit
from ..arrays.array_files import read_npy
from ..pictures.picture_files import save_image
from .buffers import Parts, inside
from .checks import numbers, telling
from .extras import options, switch
from .frames import FRAME_KEYS, read_frame, write_frame

# options of a Look by their names in files
OBJECT_KEYS = {
    "size" if name == "point_size" else name: name for name in Look().options if name not in (*SWITCHES, "material")
}
KEYS = (*FRAME_KEYS, "frames", *OBJECT_KEYS, *SWITCHES, "material")


def read_points(said: dict[str, Any], parts: Parts, frames: dict[str, Frame]) -> PointObject | None:
    """The point object that a node's extras describe; None without one. Raises ValueError or OSError.

    frames  those that the file has named before, so that none is loaded twice
    """
    described = _describe(said)
    if not described:
        alone = [key for key in said if key in KEYS]
        if alone:
            raise ValueError(f"its extras have {', '.join(alone)}, but no frame")
        return None
    found = []
    for k, frame_said in enumerate(described):
        with _telling_frame(k, len(described)):
            found.append(_read_once(frame_said, parts, frames))
    object_said = {name: _value(key, said[key], parts) for key, name in OBJECT_KEYS.items() if key in said}
    object_said |= {key: switch(said, key) for key in SWITCHES if key in said}
    return PointObject(found, read_material(said.get("material", {})), **object_said)


def _describe(said: dict[str, Any]) -> list[dict[str, Any]]:
    """Return what a node's extras state about each frame; nothing for none. Raises ValueError."""
    alone = {key: said[key] for key in FRAME_KEYS if key in said}
    if "frames" not in said:
        return [alone] if "frame" in said or "depth" in said else []
    if alone:
        raise ValueError(f"its extras have frames, so {', '.join(alone)} belong into each of them")
    several = said["frames"]
    if not isinstance(several, list) or not 1 <= len(several) <= MOST_FRAMES:
        got = f"{len(several)} of them" if isinstance(several, list) else shown(several)
        raise ValueError(f"its frames must be a list of 1 to {MOST_FRAMES}, got {got}")
    found = []
    for k, one in enumerate(several):
        with _telling_frame(k, len(several)):
            found.append(options({"pointshade": one}, FRAME_KEYS))
            if "frame" not in found[-1] and "depth" not in found[-1]:
                raise ValueError(f"it must name a frame, got {shown(one)}")
    return found


def _telling_frame(k: int, count: int) -> AbstractContextManager[None]:
    """Name the frame in errors inside, if it is one of several."""
    return nullcontext() if count == 1 else telling(f"frame {k} of {count}")


def _read_once(said: dict[str, Any], parts: Parts, frames: dict[str, Frame]) -> Frame:
    """Return the frame; the same one for the same words."""
    key = json.dumps(said, sort_keys=True)
    if key not in frames:
        check_limit(len(frames) + 1, f"with it the scene has {len(frames) + 1} frames", parts.max_pixels, SCENE_FRAMES)
        frames[key] = read_frame(said, parts.folder, parts.note, parts.max_pixels)
        parts.count_pixels(frames[key].depth.size)
    return frames[key]


def read_material(said: Any) -> Material:
    """A Material of an object's values. Raises ValueError."""
    known = ("ambient", "diffuse", "specular", "shininess")
    if not isinstance(said, dict) or not set(said) <= set(known):
        raise ValueError(f"its material must be an object of {', '.join(known)}, got {shown(said)}")
    return Material(**{key: numbers(value, (), f"material {key}").item() for key, value in said.items()})


def _value(key: str, value: Any, parts: Parts) -> Any:
    """An option of an object: a name, numbers, or the array of the .npy file that it names."""
    if isinstance(value, str):
        return read_npy(inside(parts.folder, value), parts.max_pixels) if value.endswith(".npy") else value
    if isinstance(value, list):
        try:
            return np.asarray(value, np.float64)
        except (TypeError, ValueError, OverflowError):
            raise ValueError(f"{key} must be numbers, got {shown(value)}") from None
    if value is not None:
        numbers(value, (), key)
    return value


def write_points(
    points: PointObject,
    folder: Path,
    names: list[str],
    stage: Callable[[str], Path],
    written: dict[Frame, dict[str, Any]],
) -> dict[str, Any]:
    """Return the extras of a point object; its frames and arrays are staged as files. Raises ValueError without points.

    names    of the folders, one for each frame
    written  the extras that were written for each frame before, so that none is written twice
    """
    for k, (frame, name) in enumerate(zip(points.frames, names, strict=True)):
        if frame not in written:
            with _telling_frame(k, len(points.frames)):
                written[frame] = write_frame(frame, folder, name, stage)
    several = [written[frame] for frame in points.frames]
    said: dict[str, Any] = dict(several[0]) if points.is_single else {"frames": several}
    name = names[0]
    for key, name_in_look in OBJECT_KEYS.items():
        value = getattr(points.look, name_in_look)
        if np.ndim(value):
            save_image(stage(f"{name}/{key}.npy"), np.asarray(value, np.float32))
            said[key] = f"{name}/{key}.npy"
        elif value != getattr(Look(), name_in_look):
            said[key] = value
    said |= {key: True for key in SWITCHES if getattr(points.look, key)}
    material = write_material(points.look.material)
    return said | ({"material": material} if material else {})


def write_material(material: Material) -> dict[str, float]:
    """Those values that differ from the default."""
    return {key: value for key, value in vars(material).items() if value != getattr(Material(), key)}
