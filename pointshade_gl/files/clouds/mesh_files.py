"""Meshes of PLY files as scenes, with the colours, normals and textures of their corners; and .obj without faces."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...checks.arguments import LARGEST
from ...notes.notes import Note
from ...notes.words import counted, shown
from ...scene.graph import Scene, seen_upright
from ...scene.node import Node
from ...scene.objects import Mesh
from ..access.content import CLOUD_TEXT, SCENE_CORNERS, FilePath, check_limit, naming, read_bytes
from ..access.folders import Folder
from ..arrays.numpy_files import parse_numbers
from ..arrays.ply_and_pcd import FACES, Ply, read_ply
from ..frames.assembly import read_color
from .cloud_columns import CloudOptions, FoundPoints, check_points, found_in, side_by_side
from .placing import colors_of, placed, to_metres, units_of, up_of

VERTEX = "vertex"
_CORNERS = ("vertex_indices", "vertex_index")
_UVS = (("s", "t"), ("u", "v"), ("texture_u", "texture_v"), ("texcoord_u", "texcoord_v"), ("texture_s", "texture_t"))
_RED = ("red", "green", "blue")
_CREASE = np.cos(np.radians(40))  # a face that leans further from the mean of its corner's faces is flat there
_MOST_AROUND = 64  # faces around a vertex that are compared with each other
_NUMBERS = 3, 4, 6, 7  # of a vertex of .obj: a place, with a weight, with a colour


class _Faces(NamedTuple):
    """Triangles: their corners, the face that each is of, and where its corners stand in the list of all faces."""

    corners: NDArray[np.int64]  # (m, 3)
    face: NDArray[np.int64]  # (m,)
    places: NDArray[np.int64]  # (m, 3)

    def only(self, rows: NDArray[Any]) -> _Faces:
        return _Faces(*(one[rows] for one in self))


class _Shape(NamedTuple):
    """The arrays of a mesh: triangles, and what each vertex has."""

    faces: NDArray[np.int64]
    positions: NDArray[Any]
    normals: NDArray[Any] | None
    colors: NDArray[Any] | None
    uv: NDArray[Any] | None

    def with_vertices(self, rows: NDArray[Any], faces: NDArray[np.int64], **changed: Any) -> _Shape:
        """These vertices alone, in this order, and other triangles of them."""
        each = {name: one[rows] for name, one in self._asdict().items() if name != "faces" and one is not None}
        return self._replace(faces=faces, **(each | changed))

    def apart(self, **changed: Any) -> _Shape:
        """Each corner of each triangle as a vertex of its own."""
        return self.with_vertices(self.faces.ravel(), np.arange(self.faces.size).reshape(-1, 3), **changed)


def read_mesh(path: Path, options: CloudOptions, allow_outside: bool, note: Note) -> tuple[Scene, FoundPoints]:
    """The mesh of a PLY file as a scene, and what the file holds. Raises ValueError for one that is broken."""
    name, ply = str(path), read_ply(path, options.max_pixels)
    with naming(path, "cannot be read as a mesh", (ValueError,)):
        rows = ply.elements.get(VERTEX, np.empty(0, []))
        check_points(len(rows), path, options.max_pixels)
        found = found_in({key: rows[key] for key in rows.dtype.names or ()}, f"PLY, {ply.form}", options)
        faces = _faces(ply, len(found))
        check_limit(faces.corners.size, f"{path} has {faces.corners.size} corners", options.max_pixels, SCENE_CORNERS)
        faces = _known(found, faces, name, note)
        found.keep_field(options.color_by)
        to_metres(found, name, note)
        positions, origin = placed(found, name, note)
        up = up_of(found, positions, origin, options.up, name, note)
        uv = next(
            (np.stack([rows[one] for one in two], -1) for two in _UVS if {*two} <= {*(rows.dtype.names or ())}), None
        )
        shape = _Shape(
            faces.corners, positions, units_of(found, name, note), colors_of(found, options, up, name, note), uv
        )
        if shape.normals is None:
            shape = _smoothed(shape)
        if options.color_by is None and shape.colors is None:
            shape = _colored(shape, faces, ply)
        textured = _textured(shape, faces, ply, Folder(path.parent, allow_outside, path.parent), options, name, note)
    place = np.eye(4)
    place[:3, 3] = origin
    meshes = [
        Mesh(one.positions, one.faces, one.normals, one.uv, texture=picture, colors=one.colors, up=up)
        for one, picture in textured
    ]
    scene = Scene((Node(meshes, path.stem, place),))
    return seen_upright(scene, up, found.front if up == found.up else None), found


def _faces(ply: Ply, count: int) -> _Faces:
    """The triangles of all faces and strips. Raises ValueError for corners that are none of so many vertices."""
    parts = list[_Faces]()
    for element in FACES:
        held = ply.lists.get(element, {})
        listed = next((held[one] for one in _CORNERS if one in held), None)
        if listed is not None:
            parts.append(_of_strips(listed[1]) if element == FACES[1] else _of_polygons(*listed))
    if not parts:
        raise ValueError(f"its faces have no {_CORNERS[0]}")
    faces = _Faces(*(np.concatenate(one) for one in zip(*parts, strict=True)))
    wrong = faces.corners[(faces.corners < 0) | (faces.corners >= count)]
    if wrong.size:
        raise ValueError(f"a face names the vertex {wrong[0]}, and there are {count}, counted from 0")
    return faces


def _of_polygons(lengths: NDArray[np.int64], corners: NDArray[Any]) -> _Faces:
    starts, parts = np.cumsum(lengths) - lengths, list[tuple[NDArray[Any], NDArray[Any]]]()
    for many in np.unique(lengths):
        of = np.flatnonzero(lengths == many)
        k = np.arange(1, many - 1)
        fan = np.stack([0 * k, k, k + 1], -1)  # (many - 2, 3)
        parts.append((of.repeat(len(k)), (starts[of, None, None] + fan).reshape(-1, 3)))
    face, places = (np.concatenate(one) for one in zip(*parts, strict=True))
    return _Faces(corners[places].astype(np.int64), face, places)


def _of_strips(corners: NDArray[Any]) -> _Faces:
    """Triangles of strips that end with -1."""
    corners = corners.astype(np.int64)
    first = np.arange(max(len(corners) - 2, 0))
    ends = np.flatnonzero(corners == -1)
    starts = np.concatenate([[0], ends + 1])
    within = first - starts[np.searchsorted(starts, first, "right") - 1]
    places = np.stack([first, first + 1 + within % 2, first + 2 - within % 2], -1)
    places = places[(corners[places] != -1).all(1)]
    return _Faces(corners[places], np.full(len(places), -1), places)


def _known(found: FoundPoints, faces: _Faces, name: str, note: Note) -> _Faces:
    """Without the triangles of which a corner is nowhere."""
    good = np.asarray((np.abs(found.positions) <= LARGEST).all(1))
    kept = np.asarray(good[faces.corners].all(1))
    if not kept.all():
        lost = counted(int((~kept).sum()), "triangle")
        note(f"{name}: {lost} of {len(kept)} have a corner that lies nowhere (NaN or infinite): left out")
        found.positions = np.where(good[:, None], found.positions, found.positions[np.argmax(good)])
    if not kept.any():
        raise ValueError("none of its faces is a triangle with three corners that are somewhere")
    return faces.only(kept)


def _smoothed(shape: _Shape) -> _Shape:
    """With normals that are the mean of the faces around a vertex; beside a crease, of those on its own side."""
    corners, points = shape.faces.ravel(), shape.positions.astype(np.float64)
    a, b, c = points[shape.faces].transpose(1, 0, 2)
    large = np.cross(b - a, c - a)  # as long as the face is large
    flat = _units(large)
    mean = _units(np.stack([np.bincount(corners, large[:, k].repeat(3), len(points)) for k in range(3)], -1))
    is_creased = np.zeros(len(points), bool)
    is_creased[corners[(flat.repeat(3, 0) * mean[corners]).sum(-1) < _CREASE]] = True
    beside = np.flatnonzero(is_creased[corners])
    beside = beside[np.argsort(corners[beside], kind="stable")]
    own = _on_one_side(corners[beside], flat[beside // 3], large[beside // 3])
    rows = np.concatenate([np.arange(len(points)), corners[beside]])
    corners = corners.copy()
    corners[beside] = len(points) + np.arange(len(beside))
    normals = np.concatenate([mean, own]).astype(np.float32)
    return shape.with_vertices(rows, corners.reshape(-1, 3), normals=normals)


def _on_one_side(vertices: NDArray[Any], flat: NDArray[Any], large: NDArray[Any]) -> NDArray[np.float64]:
    """(n, 3) the mean normal of faces around a vertex that face as each of them does; by vertex in order."""
    _, start, many = np.unique(vertices, return_index=True, return_counts=True)
    rounds, start, many = int(many.max(initial=0)), start.repeat(many), many.repeat(many)
    found = np.zeros_like(flat)
    for k in range(min(rounds, _MOST_AROUND)):
        other = start + k % many
        alike = (flat * flat[other]).sum(-1)
        weight = np.where((np.abs(alike) > _CREASE) & (k < many), np.sign(alike), 0)  # files turn some faces over
        found += weight[:, None] * large[other]
    return np.where(found.any(-1, keepdims=True), _units(found), flat)


def _units(vectors: NDArray[Any]) -> NDArray[np.float64]:
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.nan_to_num(vectors / np.linalg.norm(vectors, axis=-1, keepdims=True))


def _colored(shape: _Shape, faces: _Faces, ply: Ply) -> _Shape:
    rows = ply.elements.get(FACES[0])
    if rows is None or not {*_RED} <= {*(rows.dtype.names or ())} or (faces.face < 0).any():
        return shape
    table = side_by_side([rows[one] for one in _RED])
    colors = np.rint(table * 255).astype(np.uint8) if table.dtype.kind == "f" else table.astype(np.uint8)
    return shape.apart(colors=colors[faces.face].repeat(3, 0))


def _textured(
    shape: _Shape, faces: _Faces, ply: Ply, folder: Folder, options: CloudOptions, name: str, note: Note
) -> list[tuple[_Shape, NDArray[np.uint8] | None]]:
    """The parts of a mesh, each with its picture: MeshLab names these in comments."""
    names = [line.split(None, 1)[1].strip() for line in ply.comments if re.match(r"(?i)texturefile\s+\S", line)]
    held, rows = ply.lists.get(FACES[0], {}), ply.elements.get(FACES[0])
    if names and "texcoord" in held:
        lengths, numbers = held["texcoord"]
        corners = next(held[one][0] for one in _CORNERS if one in held)
        if not np.array_equal(lengths, 2 * corners):
            note(f"{name}: its texture is not drawn, some of its faces have no place in it")
            names = []
        else:  # of each corner of each face one place, in the order of the corners
            shape = shape.apart(uv=numbers.reshape(-1, 2)[faces.places.ravel()])
    if not names or shape.uv is None or options.color_by is not None:
        return [(shape._replace(uv=None), None)]
    shape = shape._replace(uv=shape.uv * (1, -1) + (0, 1))  # v points up there
    number = np.zeros(len(faces.face), np.int64)
    if rows is not None and "texnumber" in (rows.dtype.names or ()):
        number = rows["texnumber"][faces.face].astype(np.int64).clip(0, len(names) - 1)
    parts = list[tuple[_Shape, NDArray[np.uint8] | None]]()
    for k in np.unique(number).tolist():
        part = shape._replace(faces=shape.faces[number == k])
        picture = _picture(folder, names[k], options, name, note)
        # colours beside a texture are often a grey that nobody chose
        parts.append((part._replace(uv=None) if picture is None else part._replace(colors=None), picture))
    return parts


def _picture(folder: Folder, text: str, options: CloudOptions, name: str, note: Note) -> NDArray[np.uint8] | None:
    try:
        picture = read_color(folder.check(folder.named(text)), options.max_pixels)
    except (OSError, ValueError) as error:
        note(f"{name}: its texture {shown(text)} is not drawn: {error}")
        return None
    return np.ascontiguousarray(picture[..., :3])


def read_obj_points(path: FilePath, note: Note, options: CloudOptions) -> FoundPoints:
    """The vertices of an .obj file. Raises ValueError for one without any."""
    data = read_bytes(path, options.max_pixels, CLOUD_TEXT)
    with naming(path, "cannot be read as a point cloud", (ValueError,)):
        tables = {kind: _obj_table(data, kind) for kind in (b"v", b"vn")}
        points, normals = tables[b"v"], tables[b"vn"]
        check_points(len(points), path, options.max_pixels)
        found = FoundPoints("OBJ", points[:, :3], up="y", up_from="usual in OBJ files", up_is_guessed=True)
        found.colors = points[:, -3:] if points.shape[1] >= 6 else None
        found.normals = normals[:, :3] if len(normals) == len(points) else None
        return found


def _obj_table(data: bytes, kind: bytes) -> NDArray[np.float64]:
    lines = re.findall(rb"(?m)^[ \t]*" + kind + rb"[ \t]+([^\r\n#]*)", data)
    widths = {len(line.split()) for line in lines}
    numbers = parse_numbers(b" ".join(lines).decode("ascii", "replace"))
    if not lines and kind == b"vn":
        return np.empty((0, 3))
    if len(widths) != 1 or widths - {*_NUMBERS} or len(numbers) != len(lines) * max(widths):
        raise ValueError(f"its lines that begin with {kind.decode()} must hold 3 numbers each, or 6 with a colour")
    return numbers.reshape(len(lines), -1)
