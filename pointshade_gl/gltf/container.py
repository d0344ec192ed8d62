"""The outside of a glTF file: JSON, or the two chunks of a GLB, and whether this reader may read it at all."""

from __future__ import annotations

import json
import struct
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any

from ..files.content import read_head

if TYPE_CHECKING:
    from pygltflib import GLTF2

LIGHTS, UNLIT, QUANTIZED = "KHR_lights_punctual", "KHR_materials_unlit", "KHR_mesh_quantization"
KNOWN = (LIGHTS, UNLIT, QUANTIZED)
_MAGIC, _JSON, _BIN = b"glTF", b"JSON", b"BIN\0"


def library() -> ModuleType:
    """pygltflib, an optional extra. Raises ValueError without it."""
    try:
        import pygltflib
    except ImportError:
        raise ValueError("scene files need the extra gltf: pip install 'pointshade-gl[gltf]'") from None
    return pygltflib


def read_container(path: Path) -> tuple[GLTF2, bytes | None]:
    """The parts of a file as pygltflib's objects, and the binary chunk of a GLB.

    Raises OSError for what is no file, ValueError for what is no glTF 2.0 or requires an unknown extension.
    """
    pygltflib = library()
    is_binary = read_head(path).startswith(_MAGIC)
    data = path.read_bytes()
    text, blob = _split(data) if is_binary else (data, None)
    try:
        raw = json.loads(text.decode("utf-8-sig"), object_hook=_drop_odd_extras)
    except UnicodeDecodeError:
        what = "is a GLB whose JSON is" if is_binary else "is neither glTF nor GLB: it is"
        raise ValueError(f"{what} no text in UTF-8") from None
    except (ValueError, RecursionError) as error:
        raise ValueError(f"is not valid JSON: {error}") from None
    _check_version(raw)
    try:
        gltf = pygltflib.GLTF2.from_json(json.dumps(raw), infer_missing=True)
    except Exception as error:  # the library raises of everything for values of the wrong type
        raise ValueError(f"is not valid glTF 2.0: {error}") from None
    unknown = [name for name in gltf.extensionsRequired or () if name not in KNOWN]
    if unknown:
        raise ValueError(f"requires the extension {', '.join(map(str, unknown))}: known are {', '.join(KNOWN)}")
    return gltf, blob


def _split(data: bytes) -> tuple[bytes, bytes | None]:
    """The JSON and the binary chunk of a GLB."""
    if len(data) < 20:
        raise ValueError(f"is a truncated GLB of {len(data)} bytes")
    version, length = struct.unpack_from("<II", data, 4)
    if version != 2:
        raise ValueError(f"is a GLB of version {version}, expected 2")
    if length > len(data):
        raise ValueError(f"is a truncated GLB: it has {len(data)} of {length} bytes")
    chunks: dict[bytes, bytes] = {}
    place = 12
    while place + 8 <= length:
        size, kind = struct.unpack_from("<I4s", data, place)
        if place + 8 + size > length:
            raise ValueError(f"is a broken GLB: a chunk of {size} bytes reaches beyond its end")
        chunks.setdefault(kind, data[place + 8 : place + 8 + size])
        place += 8 + size
    if _JSON not in chunks:
        raise ValueError("is a GLB without a JSON chunk")
    return chunks[_JSON], chunks.get(_BIN)


def pack(text: bytes, blob: bytes) -> bytes:
    """A GLB of JSON and of the bytes that it speaks of; without any there is no second chunk."""
    chunks = [(_JSON, text + b" " * (-len(text) % 4)), (_BIN, blob + bytes(-len(blob) % 4))]
    body = b"".join(struct.pack("<I4s", len(data), kind) + data for kind, data in chunks if data)
    return struct.pack("<4sII", _MAGIC, 2, 12 + len(body)) + body


def _drop_odd_extras(item: dict[str, Any]) -> dict[str, Any]:
    """glTF allows extras of any type, pygltflib objects only."""
    if not isinstance(item.get("extras", {}), dict):
        del item["extras"]
    return item


def _check_version(raw: Any) -> None:
    asset = raw.get("asset") if isinstance(raw, dict) else None
    if not isinstance(asset, dict) or "version" not in asset:
        raise ValueError("is no glTF: it has no asset.version")
    for key in ("version", "minVersion"):
        version = asset.get(key, "2.0")
        if str(version).split(".")[0] != "2" or (key == "minVersion" and version != "2.0"):
            raise ValueError(f"is glTF of {key} {version}, expected 2.0")
