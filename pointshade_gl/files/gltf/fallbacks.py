"""Writes what other programs draw of a point object, which to them is an empty node: a mesh or points of each frame."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from ...scene.appearance import Look
from ...scene.frame import NEUTRAL, Frame
from ...scene.objects import PointObject
from ...scene.values import srgb_to_linear
from ..frames.color_files import read_color
from .cameras_and_lights import FLIP, Matrix
from .clouds import POINTS, linear_colors
from .document import WHITE, Document
from .frame_surfaces import frame_points, frame_surface

Fallback = Literal["mesh", "points"] | None
MOST_POINTS = 400_000  # vertices of one object: all of a frame of 640x480
IN_GLTF = ".png", ".jpg", ".jpeg"  # pictures that glTF knows
GREY = (srgb_to_linear(NEUTRAL / 255.0).item(),) * 3  # of a frame without colours


def write_fallback(
    document: Document, points: PointObject, written: Mapping[Frame, dict[str, Any]], kind: Fallback
) -> list[tuple[int, Matrix]]:
    """Return the mesh of each frame and its place below the object's node.

    written  the extras of each frame: they name the folder that holds its colours
    """
    most = max(1, MOST_POINTS // len(points.frames))
    found = []
    for frame in points.frames:
        key = ("fallback", id(frame.depth), id(frame.color), frame.camera, points.look)
        if key not in document.known:
            primitive = _triangles(document, frame, points.look, written[frame], most) if kind == "mesh" else None
            primitive = primitive or _points(document, frame, points.look, most)
            document.known[key] = document.add("meshes", primitives=[primitive])
        found.append((document.known[key], frame.pose @ FLIP))
    return found


def _triangles(
    document: Document, frame: Frame, look: Look, said: Mapping[str, Any], most: int
) -> dict[str, Any] | None:
    """Return the primitive of a frame's surface; None where no pixels lie on one, as in sparse depth."""
    normals = None if isinstance(look.normals, str) else np.asarray(look.normals, np.float32)
    surface = frame_surface(frame, most, look.depth_step, normals)
    if not len(surface.faces):
        return None
    held = {"POSITION": surface.positions}
    texture, color = None, GREY
    if frame.color is not None:
        held["TEXCOORD_0"] = surface.uv
        texture = document.photograph(frame.color, _file_of(frame.color, said, document))
        color = WHITE
    return {
        "attributes": document.attributes(surface.normals, held),
        "indices": document.corners(surface.faces, len(surface.positions)),
        "material": document.material(look.material, look.shading, color, texture),
    }


def _file_of(color: NDArray[np.uint8], said: Mapping[str, Any], document: Document) -> str | None:
    """Return the picture that holds a frame's colours, if it is written with the file or lies where it can be named."""
    name = said.get("color", f"{said.get('frame')}/color.png")
    if document.is_binary:
        return None
    if document.files.holds(name):
        return name
    path = document.files.folder / name
    if path.suffix.lower() not in IN_GLTF or not path.is_file():
        return None
    return name if np.array_equal(read_color(path), color) else None


def _points(document: Document, frame: Frame, look: Look, most: int) -> dict[str, Any]:
    """Return the primitive of a frame's points, whose normals no program needs."""
    positions, (u, v) = frame_points(frame, most)
    held: dict[str, NDArray[Any]] = {"POSITION": positions}
    if frame.color is not None:
        (height, width), colors = frame.depth.shape, frame.color
        row = ((v + 0.5) * colors.shape[0] / height).astype(np.intp)
        column = ((u + 0.5) * colors.shape[1] / width).astype(np.intp)
        held["COLOR_0"] = linear_colors(colors[row, column, :3])
    color = GREY if frame.color is None else WHITE
    material = document.material(look.material, "none", color)  # without normals they are not lit
    return {"mode": POINTS, "attributes": document.attributes(None, held), "material": material}
