"""JSON becomes the parts of a glTF file: every value that is read has the type that glTF gives it."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

from ...notes.words import shown

_WHOLE = 2**63  # no larger number is needed
_NAMES = {float: "a number", str: "a text", bool: "true or false", int: "a whole number", list: "a list"}
_NAMED = {"name": str, "extensions": dict, "extras": object}
_TEXTURE = {"index": int, "texCoord": int}
_INDICES = {"bufferView": int, "byteOffset": int, "componentType": int}
_PRIMITIVE = {"attributes": {"": int}, "indices": int, "mode": int, "material": int, "targets": list, "extras": object}
_SPARSE = {"count": int, "indices": _INDICES, "values": _INDICES}
_TRANSFORM = {"matrix": [float], "rotation": [float], "scale": [float], "translation": [float]}
_NODE = _TRANSFORM | {"mesh": int, "camera": int, "children": [int]}
DOCUMENT: dict[str, Any] = {  # what is read: an object by its keys ("": any), a list by its item, other values by type
    "asset": {"version": str, "minVersion": str, "generator": str},
    "extensions": dict,
    "extensionsUsed": [str],
    "extensionsRequired": [str],
    "scene": int,
    "scenes": [_NAMED | {"nodes": [int]}],
    "nodes": [_NAMED | _NODE],
    "meshes": [_NAMED | {"primitives": [_PRIMITIVE]}],
    "materials": [
        _NAMED | {"alphaMode": str, "pbrMetallicRoughness": {"baseColorFactor": [float], "baseColorTexture": _TEXTURE}}
    ],
    "textures": [_NAMED | {"source": int}],
    "images": [_NAMED | {"uri": str, "bufferView": int}],
    "cameras": [_NAMED | {"type": str, "perspective": {"yfov": float, "aspectRatio": float}}],
    "accessors": [_NAMED | _INDICES | {"count": int, "type": str, "normalized": bool, "sparse": _SPARSE}],
    "bufferViews": [{"buffer": int, "byteOffset": int, "byteLength": int, "byteStride": int}],
    "buffers": [{"uri": str, "byteLength": int}],
    "animations": object,  # only their presence matters
    "skins": object,
}


def decode(value: Any, kind: Any = DOCUMENT, place: str = "") -> Any:
    """Return known keys as parts with attributes, None if missing. Raises ValueError, with the place, by wrong type."""
    if kind is object:
        return value
    if isinstance(kind, list):
        return _list(value, kind[0], place)
    if not isinstance(kind, dict):
        return _plain(value, kind, place)
    if not isinstance(value, dict):
        raise ValueError(f"{place} must be an object, got {shown(value)}")
    before = f"{place}." if place else ""
    if "" in kind:
        return {key: None if item is None else decode(item, kind[""], before + key) for key, item in value.items()}
    known = {key: decode(value[key], kind[key], before + key) for key in kind if value.get(key) is not None}
    return SimpleNamespace(**(dict.fromkeys(kind) | known))


def _list(value: Any, kind: Any, place: str) -> list[Any]:
    """Return the list. A numbered part of the file may be null: `pick` refuses it where it is used."""
    may_be_null = "." not in place
    return [
        None if item is None and may_be_null else decode(item, kind, f"{place}[{k}]")
        for k, item in enumerate(_plain(value, list, place))
    ]


def _plain(value: Any, kind: type, place: str) -> Any:
    """Return a value without parts, whole numbers as int."""
    is_number = kind in (int, float)
    fits = isinstance(value, (int, float) if is_number else kind) and isinstance(value, bool) == (kind is bool)
    if not fits or (kind is int and not (value % 1 == 0 and abs(value) <= _WHOLE)):
        raise ValueError(f"{place} must be {_NAMES.get(kind, 'an object')}, got {shown(value)}")
    return int(value) if kind is int else value
