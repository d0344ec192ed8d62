"""Converts glTF meshes with their materials, and clouds, which are primitives of points."""

from __future__ import annotations

from collections.abc import Mapping
from functools import singledispatch
from types import SimpleNamespace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...notes.words import cut
from ...scene.cloud import PointCloud
from ...scene.gaussians import CONSTANT, Gaussians
from ...scene.objects import Mesh
from ...scene.values import linear_to_bytes, srgb_to_linear
from .buffers import SPLATS, UNLIT, GltfParts, label, naming_part, numbers, options, pick
from .cameras_and_lights import Matrix
from .stored_points import read_material

POINTS = 0  # the mode of a primitive
UP = "y"  # in glTF
FARTHEST = 16  # extents from zero: float32 keeps a millionth of the extent there
SINGLES = {"_SIZE": "sizes", "_CONFIDENCE": "confidence"}  # attributes of one number for each point
_ATTRIBUTES = {key: (name, "SCALAR") for key, name in SINGLES.items()} | {
    "NORMAL": ("normals", "VEC3"),
    "_SEEN_FROM": ("seen_from", "VEC3"),
}
_KEYS = ("splat", "size", "up", "front", "seen_from")
_WHITE = 1.0, 1.0, 1.0


def read_cloud(parts: GltfParts, primitive: SimpleNamespace, look: dict[str, Any], part: str) -> PointCloud:
    """The points of a primitive, with the look of its material, see `Meshes`. Raises ValueError."""
    held = primitive.attributes
    ours = options(primitive.extras, _KEYS)
    if look.pop("texture", None) is not None:
        parts.note(f"{part}: its texture is not drawn, it has points")
    look.pop("channel", None)
    color = look.pop("color", _WHITE)
    each: dict[str, Any] = {"positions": _floats(parts, held["POSITION"], "VEC3")}
    each |= {name: _floats(parts, held[key], kind) for key, (name, kind) in _ATTRIBUTES.items() if key in held}
    each |= {name: one[:, 0] for name, one in each.items() if one.shape[1] == 1}
    if "COLOR_0" in held or color != _WHITE:
        linear = _shares(parts, held["COLOR_0"]) if "COLOR_0" in held else np.ones_like(each["positions"])
        each["colors"] = linear_to_bytes(np.clip(np.nan_to_num(linear[:, :3] * np.float32(color)), 0, 1))
    chosen: NDArray[Any] | slice = slice(None)
    if primitive.indices is not None:
        chosen, least = parts.array(primitive.indices, ("SCALAR",))[:, 0], min(map(len, each.values()))
        if chosen.dtype.kind != "u" or chosen.max() >= least:
            raise ValueError(f"its indices must name one of {least} points, got {chosen.max()}")
        each = {name: one[chosen] for name, one in each.items()}
    if "seen_from" in ours:
        each["seen_from"] = numbers(ours.pop("seen_from"), (3,), "seen_from")
    if SPLATS in (primitive.extensions or {}):
        each["gaussians"] = _trained(parts, held, chosen)
        ours, look = {"splat": "gaussian", **ours}, {"shading": "auto", **look}
    return PointCloud(**each, **look, up=ours.pop("up", UP), point_size=ours.pop("size", None), **ours)


def _trained(parts: GltfParts, held: Mapping[str, Any], chosen: NDArray[Any] | slice) -> Gaussians:
    """What the attributes of KHR_gaussian_splatting hold. Raises ValueError where some are missing."""

    def read(name: str, kind: str) -> NDArray[np.float32]:
        if f"{SPLATS}:{name}" not in held:
            raise ValueError(f"it has no {SPLATS}:{name}")
        values = parts.array(held[f"{SPLATS}:{name}"], (kind,))[chosen]
        most = np.iinfo(values.dtype).max if values.dtype.kind in "iu" else 1
        return values.astype(np.float32) / np.float32(most)

    names = [f"SH_DEGREE_{degree}_COEF_{k}" for degree in (1, 2, 3) for k in range(2 * degree + 1)]
    count = next((n for n in (15, 8, 3) if f"{SPLATS}:{names[n - 1]}" in held), 0)
    harmonics = np.stack([read(name, "VEC3") for name in names[:count]], 1) if count else None
    base = 0.5 + np.float32(CONSTANT) * read("SH_DEGREE_0_COEF_0", "VEC3")
    opacities = read("OPACITY", "SCALAR")[:, 0].clip(0, 1)
    return Gaussians(read("SCALE", "VEC3"), read("ROTATION", "VEC4"), opacities, base, harmonics)


def splat_attributes(held: Gaussians) -> dict[str, NDArray[np.float32]]:
    """The arrays of trained splats by their names, beside positions."""
    lengths = np.linalg.norm(held.rotations, axis=1, keepdims=True)
    values = {
        "ROTATION": held.rotations / np.where(lengths > 0, lengths, 1), "SCALE": held.scales,
        "OPACITY": held.opacities[:, None], "SH_DEGREE_0_COEF_0": (held.base - 0.5) / np.float32(CONSTANT),
    }  # fmt: skip
    if held.harmonics is not None:
        names = [f"SH_DEGREE_{degree}_COEF_{k}" for degree in (1, 2, 3) for k in range(2 * degree + 1)]
        values |= {
            name: one.astype(np.float32) for name, one in zip(names, held.harmonics.swapaxes(0, 1), strict=False)
        }
    return {f"{SPLATS}:{name}": one for name, one in values.items()}


def _floats(parts: GltfParts, index: Any, kind: str) -> NDArray[np.float32]:
    return parts.array(index, (kind,)).astype(np.float32)


def _shares(parts: GltfParts, index: Any) -> NDArray[Any]:
    """Return colours of 0 to 1: whole numbers are shares of the largest, also where the accessor does not state it."""
    values = parts.array(index, ("VEC3", "VEC4"))
    return values / np.float32(np.iinfo(values.dtype).max) if values.dtype.kind in "iu" else values


@singledispatch
def place_of(part: Any) -> Matrix:
    """(4, 4) the place below our node of a glTF node that holds the points as float32; triangles are in place."""
    return np.eye(4)


@place_of.register
def cloud_place(cloud: PointCloud) -> Matrix:
    """The same of a cloud, whose points may lie far from zero."""
    place = np.eye(4)
    place[:3, 3] = cloud.origin
    low, high = cloud.positions.min(0), cloud.positions.max(0)
    if cloud.positions.dtype == np.float64 and (np.maximum(-low, high) > FARTHEST * (high - low).max()).any():
        place[:3, 3] += np.rint((low + high) / 2)
    return place


def cloud_attributes(cloud: PointCloud) -> dict[str, NDArray[Any]]:
    """The arrays of the primitive by their names, but normals."""
    shift = cloud_place(cloud)[:3, 3] - cloud.origin
    held: dict[str, NDArray[Any]] = {"POSITION": (cloud.positions - shift).astype(np.float32)}
    if cloud.colors is not None:
        held["COLOR_0"] = linear_colors(cloud.colors)
    if cloud.gaussians is not None:
        held |= splat_attributes(cloud.gaussians)
    for key, name in SINGLES.items():
        if getattr(cloud, name) is not None:
            held[key] = getattr(cloud, name)[:, None]
    if cloud.seen_from is not None and cloud.seen_from.ndim == 2:
        held["_SEEN_FROM"] = (cloud.seen_from - shift).astype(np.float32)
    return held


def linear_colors(colors: NDArray[np.uint8]) -> NDArray[np.float32]:
    """Return sRGB colours (n, 3) as linear ones: float32, as trimesh takes glTF's 16 bits for 8."""
    return srgb_to_linear(np.arange(256) / 255).astype(np.float32)[colors]


def cloud_extras(cloud: PointCloud) -> dict[str, Any]:
    """What extras hold of the cloud: all that differs from the default."""
    values = {
        "splat": (cloud.splat, "disc" if cloud.gaussians is None else "gaussian"),
        "size": (cloud.point_size, None),
        "up": (cloud.up, UP),
    }
    values["front"] = cloud.front, None
    ours: dict[str, Any] = {key: value for key, (value, usual) in values.items() if value != usual}
    if cloud.seen_from is not None and cloud.seen_from.ndim == 1:
        ours["seen_from"] = (cloud.seen_from - (cloud_place(cloud)[:3, 3] - cloud.origin)).tolist()
    return ours


TRIANGLES, STRIP, FAN = 4, 5, 6
_MATERIAL_KEYS = ("ambient", "diffuse", "specular", "shininess", "shading")


class Meshes:
    """The meshes of one file, each read once; nodes that show the same one share it."""

    def __init__(self, parts: GltfParts) -> None:
        self._parts = parts
        self._read: dict[int, tuple[Mesh | PointCloud, ...]] = {}
        self._materials: dict[int | None, dict[str, Any]] = {None: {}}

    def __getitem__(self, index: Any) -> tuple[Mesh | PointCloud, ...]:
        """One for each primitive that has triangles or points. Raises ValueError or OSError."""
        mesh = pick(self._parts.gltf.meshes, index, "mesh")
        if index not in self._read:
            found = []
            for k, primitive in enumerate(mesh.primitives or ()):
                part = label("mesh", index, mesh.name) + (f" primitive {k}" if len(mesh.primitives) > 1 else "")
                with naming_part(part):
                    found.append(self._primitive(primitive, part))
            self._read[index] = tuple(mesh for mesh in found if mesh is not None)
        return self._read[index]

    def _primitive(self, primitive: SimpleNamespace, part: str) -> Mesh | PointCloud | None:
        parts, held = self._parts, primitive.attributes or {}
        mode = TRIANGLES if primitive.mode is None else primitive.mode
        if mode not in (POINTS, TRIANGLES, STRIP, FAN) or held.get("POSITION") is None:
            what = "no positions" if held.get("POSITION") is None else "lines"
            parts.note(f"{part} is left out: it has {what}, only triangles and points are drawn")
            return None
        if primitive.targets:
            parts.note(f"{part}: its morph targets are not drawn")
        if mode == POINTS:
            return read_cloud(parts, primitive, dict(self._material(primitive.material)), part)
        points = _floats(parts, held["POSITION"], "VEC3")
        if primitive.indices is None:
            corners = np.arange(len(points), dtype=np.uint32)
            parts.count_corners(len(corners))
        else:
            corners = parts.array(primitive.indices, ("SCALAR",))[:, 0]
        faces = triangles(corners, mode)
        parts.count_corners(max(faces.size - len(corners), 0))  # strips and fans have three for each
        if not len(faces):
            parts.note(f"{part} is left out: it has no triangle")
            return None
        look = dict(self._material(primitive.material))
        channel = look.pop("channel", 0)
        uv = held.get(f"TEXCOORD_{channel}")
        if uv is None and "texture" in look:
            parts.note(f"{part}: its texture is not drawn, it has no TEXCOORD_{channel}")
            del look["texture"]
        each = {"normals": (held.get("NORMAL"), "VEC3"), "uv": (uv, "VEC2")}
        look |= {name: _floats(parts, one, kind) for name, (one, kind) in each.items() if one is not None}
        if held.get("COLOR_0") is not None:
            linear = np.nan_to_num(_shares(parts, held["COLOR_0"])[:, :3])
            look["colors"] = linear_to_bytes(np.clip(linear, 0, 1))
        return Mesh(points, faces, **look)

    def _material(self, index: Any) -> dict[str, Any]:
        """Fields of Mesh that a material decides, and the channel of its texture's coordinates."""
        if index not in self._materials:
            material = pick(self._parts.gltf.materials, index, "material")
            part = label("material", index, material.name)
            if material.alphaMode not in (None, "OPAQUE"):
                self._parts.note(f"{part}: its transparency ({cut(material.alphaMode)}) is not drawn")
            with naming_part(part):
                ours = dict(options(material.extras, _MATERIAL_KEYS))
                look: dict[str, Any] = {"shading": "none"} if UNLIT in (material.extensions or {}) else {}
                look |= {"shading": ours.pop("shading")} if "shading" in ours else {}
                look["material"] = read_material(ours)
                base = material.pbrMetallicRoughness
                if base is not None and base.baseColorFactor is not None:
                    red, green, blue, _ = numbers(base.baseColorFactor, (4,), "baseColorFactor").tolist()
                    look["color"] = (red, green, blue)
                if base is not None and base.baseColorTexture is not None:
                    look["texture"] = self._texture(base.baseColorTexture.index, material.alphaMode or "OPAQUE")
                    look["channel"] = base.baseColorTexture.texCoord or 0
            self._materials[index] = look
        return self._materials[index]

    def _texture(self, index: Any, alpha_mode: str) -> NDArray[np.uint8]:
        texture = pick(self._parts.gltf.textures, index, "texture")
        with naming_part(label("texture", index, texture.name)):
            picture = self._parts.picture(texture.source)
        return np.ascontiguousarray(picture[..., :3]) if alpha_mode == "OPAQUE" else picture


def triangles(corners: NDArray[Any], mode: int) -> NDArray[np.uint32]:
    """(m, 3) corners of the triangles of a list, a strip or a fan, in the winding that glTF gives them."""
    corners = corners.astype(np.uint32)
    if mode == TRIANGLES:
        if len(corners) % 3:
            raise ValueError(f"its triangles have {len(corners)} corners, expected a multiple of 3")
        return corners.reshape(-1, 3)
    k = np.arange(max(0, len(corners) - 2))
    rows = [k, k + 1 + k % 2, k + 2 - k % 2] if mode == STRIP else [k + 1, k + 2, 0 * k]
    return corners[np.column_stack(rows)]
