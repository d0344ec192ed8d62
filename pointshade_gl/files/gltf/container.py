"""The outside of a glTF file: JSON, or the two chunks of a GLB, and whether this reader may read it at all."""

from __future__ import annotations

import struct
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from urllib.parse import unquote

from ...notes.words import cut, shown
from ..access.content import note_read, parse_json, read_bytes, read_head
from ..access.limits import SCENE_BYTES, SCENE_TEXT
from .decode import decode

LIGHTS, UNLIT, QUANTIZED = "KHR_lights_punctual", "KHR_materials_unlit", "KHR_mesh_quantization"
IMAGE_BASED = "EXT_lights_image_based"
KNOWN = (LIGHTS, IMAGE_BASED, UNLIT, QUANTIZED)
SPECULAR = "KHR_materials_specular"  # written for other programs: our own values say it better
GENERATOR = "pointshade_gl"  # what our files say of who wrote them
_MAGIC, _JSON, _BIN = b"glTF", b"JSON", b"BIN\0"


def read_container(path: Path, max_pixels: float) -> tuple[SimpleNamespace, memoryview | None]:
    """Return the parts of a file, see `decode`, and a GLB's binary chunk. Raises ValueError for other than glTF 2.0.

    All files that it names count as read.
    """
    is_binary = read_head(path).startswith(_MAGIC)
    data = memoryview(read_bytes(path, max_pixels, SCENE_BYTES if is_binary else SCENE_TEXT))
    text, blob = _split(data) if is_binary else (data, None)
    try:
        raw = parse_json(str(text, "utf-8-sig"), max_pixels)
    except UnicodeDecodeError:
        what = "is a GLB whose JSON is" if is_binary else "is neither glTF nor GLB: it is"
        raise ValueError(f"{what} not text in UTF-8") from None
    _check_version(raw)
    try:
        gltf = decode(raw)
    except ValueError as error:
        raise ValueError(f"is not valid glTF 2.0: {error}") from None
    unknown = [name for name in gltf.extensionsRequired or () if name not in KNOWN]
    if unknown:
        raise ValueError(f"requires the extension {cut(', '.join(unknown))}: known are {', '.join(KNOWN)}")
    named = [one.uri for one in (*(gltf.images or ()), *(gltf.buffers or ())) if one and one.uri]
    note_read(path.parent / unquote(uri) for uri in named if not uri.startswith("data:"))
    return gltf, blob


def _split(data: memoryview) -> tuple[memoryview, memoryview | None]:
    """The JSON and the binary chunk of a GLB."""
    if len(data) < 20:
        raise ValueError(f"is a truncated GLB of {len(data)} bytes")
    version, length = struct.unpack_from("<II", data, 4)
    if version != 2:
        raise ValueError(f"is a GLB of version {version}, expected 2")
    if length > len(data):
        raise ValueError(f"is a truncated GLB: it has {len(data)} of {length} bytes")
    chunks: dict[bytes, memoryview] = {}
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
    """A GLB of JSON and the bytes that it refers to; without bytes there is no second chunk."""
    chunks = [(_JSON, text + b" " * (-len(text) % 4)), (_BIN, blob + bytes(-len(blob) % 4))]
    body = b"".join(struct.pack("<I4s", len(data), kind) + data for kind, data in chunks if data)
    return struct.pack("<4sII", _MAGIC, 2, 12 + len(body)) + body


def _check_version(raw: Any) -> None:
    asset = raw.get("asset") if isinstance(raw, dict) else None
    if not isinstance(asset, dict) or "version" not in asset:
        raise ValueError("is not glTF: it has no asset.version")
    for key in ("version", "minVersion"):
        version = asset.get(key, "2.0")
        version = version if isinstance(version, str) else shown(version)
        if version.split(".")[0] != "2" or (key == "minVersion" and version != "2.0"):
            raise ValueError(f"is glTF of {key} {version[:20]}, expected 2.0")
