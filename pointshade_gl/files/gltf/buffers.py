"""Reads a glTF file's JSON, extras, buffers, accessors and images, only from the scene's folder."""

from __future__ import annotations

import base64
import struct
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from io import BytesIO
from pathlib import Path
from types import SimpleNamespace
from typing import Any, TypeVar
from urllib.parse import unquote, unquote_to_bytes

import numpy as np
from numpy.typing import NDArray

from ...notes.errors import is_expected
from ...notes.notes import Note
from ...notes.words import cut, shown
from ..access import content
from ..access.content import SCENE_BYTES, SCENE_CORNERS, SCENE_PIXELS, SCENE_TEXT
from ..access.folders import Folder
from ..frames.assembly import read_color, to_color
from ..pictures.picture_files import decode_image

_WHOLE = 2**63  # no larger number is needed
_NAMES = {float: "a number", str: "a text", bool: "true or false", int: "a whole number", list: "a list"}
_NAMED = {"name": str, "extensions": dict, "extras": object}
_TEXTURE = {"index": int, "texCoord": int}
_INDICES = {"bufferView": int, "byteOffset": int, "componentType": int}
_PRIMITIVE = {"attributes": {"": int}, "indices": int, "mode": int, "material": int, "targets": list, "extras": object}
_PRIMITIVE |= {"extensions": dict}
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
    if isinstance(kind, list):  # a numbered part of the file may be null: `pick` refuses it where it is used
        may_be_null = "." not in place
        return [
            None if item is None and may_be_null else decode(item, kind[0], f"{place}[{k}]")
            for k, item in enumerate(_plain(value, list, place))
        ]
    if not isinstance(kind, dict):
        return _plain(value, kind, place)
    if not isinstance(value, dict):
        raise ValueError(f"{place} must be an object, got {shown(value)}")
    before = f"{place}." if place else ""
    if "" in kind:
        return {key: None if item is None else decode(item, kind[""], before + key) for key, item in value.items()}
    known = {key: decode(value[key], kind[key], before + key) for key in kind if value.get(key) is not None}
    return SimpleNamespace(**(dict.fromkeys(kind) | known))


def _plain(value: Any, kind: type, place: str) -> Any:
    """Return a value without parts, whole numbers as int."""
    is_number = kind in (int, float)
    fits = isinstance(value, (int, float) if is_number else kind) and isinstance(value, bool) == (kind is bool)
    if not fits or (kind is int and not (value % 1 == 0 and abs(value) <= _WHOLE)):
        raise ValueError(f"{place} must be {_NAMES.get(kind, 'an object')}, got {shown(value)}")
    return int(value) if kind is int else value


LIGHTS, UNLIT, QUANTIZED = "KHR_lights_punctual", "KHR_materials_unlit", "KHR_mesh_quantization"
SPLATS = "KHR_gaussian_splatting"
IMAGE_BASED = "EXT_lights_image_based"
KNOWN = (LIGHTS, IMAGE_BASED, UNLIT, QUANTIZED, SPLATS)
SPECULAR = "KHR_materials_specular"  # written for other programs: our own values are nearer
GENERATOR = "pointshade_gl"  # what our files name as their writer
_MAGIC, _JSON, _BIN = b"glTF", b"JSON", b"BIN\0"


def read_container(path: Path, max_pixels: float) -> tuple[SimpleNamespace, memoryview | None]:
    """Return the parts of a file, see `decode`, and a GLB's binary chunk. Raises ValueError for other than glTF 2.0."""
    is_binary = content.read_head(path).startswith(_MAGIC)
    data = memoryview(content.read_bytes(path, max_pixels, SCENE_BYTES if is_binary else SCENE_TEXT))
    text, blob = _split(data) if is_binary else (data, None)
    try:
        raw = content.parse_json(str(text, "utf-8-sig"), max_pixels)
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
    # all files that it names count as read
    named = [one.uri for one in (*(gltf.images or ()), *(gltf.buffers or ())) if one and one.uri]
    content.note_read(path.parent / unquote(uri) for uri in named if not uri.startswith("data:"))
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


Item = TypeVar("Item")
FAR = 1e30  # nothing in a scene is larger, and its cube still is a number


@contextmanager
def naming_part(part: str) -> Iterator[None]:
    """Every ValueError, TypeError and OSError inside begins with the part's name. Deep nesting is a ValueError."""
    try:
        yield
    except (ValueError, TypeError, OSError) as error:
        text = str(error).removeprefix("node '': ")  # a Node without a name; the part's number is known here
        if text.startswith((f"{part}:", f"{part} ")) or not is_expected(error):
            raise
        kind = type(error) if isinstance(error, OSError) else ValueError
        raise kind(f"{part}: {text}") from None
    except RecursionError:
        raise ValueError(f"{part}: is nested too deeply") from None


def pick(items: Sequence[Item | None] | None, index: Any, what: str) -> Item:
    """One of the file's numbered parts, or a ValueError."""
    items = items or ()
    if isinstance(index, bool) or not isinstance(index, int):
        raise ValueError(f"a {what} must be named by its number, got {shown(index)}")
    if not 0 <= index < len(items):
        raise ValueError(f"there is no {what} {index}, the file has {len(items)}")
    item = items[index]
    if item is None:
        raise ValueError(f"{what} {index} is null")
    return item


def label(what: str, index: int, name: str | None) -> str:
    """How messages call a part: by its name, else by its number."""
    return f"{what} {shown(name)}" if name else f"{what} {index}"


def numbers(value: Any, shape: tuple[int, ...], what: str) -> NDArray[np.float64]:
    """Numbers of that shape, finite and below FAR, or a ValueError."""
    try:
        array = np.asarray(value, np.float64).reshape(shape)
    except (TypeError, ValueError, OverflowError):
        expected = f"{int(np.prod(shape))} numbers" if shape else "a number"
        raise ValueError(f"{what} must be {expected}, got {shown(value)}") from None
    if not (np.abs(array) < FAR).all():  # NaN compares false
        raise ValueError(f"{what} must be finite and below {FAR:g}, got {shown(value)}")
    return array


_TYPES = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
_WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}


def inside(folder: Folder, text: Any) -> Path:
    """The file or folder that a scene names, links followed. Raises ValueError if outside, OSError if missing."""
    path = folder.check(folder.named(text))
    if not path.exists():
        raise FileNotFoundError(f"{shown(text)} does not exist in {folder.path}")
    return content.followed(path)


class GltfParts:
    """Numbered parts of one file. Every method raises ValueError or OSError, naming the part, for what is broken."""

    def __init__(
        self, folder: Folder, gltf: SimpleNamespace, blob: memoryview | None, note: Note, max_pixels: float
    ) -> None:
        self.folder, self.gltf, self.note, self.max_pixels = folder, gltf, note, max_pixels
        self._blob = blob
        self._files: dict[Path, memoryview] = {}
        self._buffers: dict[int, memoryview] = {}
        self._pictures: dict[int, NDArray[np.uint8]] = {}
        self._corners, self._pixels = 0, 0  # read so far

    def array(self, index: Any, types: tuple[str, ...]) -> NDArray[Any]:
        """(n, width) values of an accessor of one of the types; normalised integers become float32."""
        accessor = pick(self.gltf.accessors, index, "accessor")
        with naming_part(f"accessor {index}"):
            if accessor.type not in types or accessor.componentType not in _TYPES:
                kind = f"{cut(accessor.type)} of component type {accessor.componentType}"
                raise ValueError(f"is {kind}, expected {' or '.join(types)}")
            dtype, width = np.dtype(_TYPES[accessor.componentType]), _WIDTHS[accessor.type]
            values = self._elements(accessor.bufferView, accessor.byteOffset, accessor.count, dtype, width)
            if accessor.sparse is not None:
                self._change(accessor, values)
            if accessor.normalized and dtype.kind != "f":
                values = np.maximum(values.astype(np.float32) / np.iinfo(dtype).max, -1)
            return values

    def picture(self, index: Any) -> NDArray[np.uint8]:
        """(h, w, 3|4) uint8 of an image."""
        image = pick(self.gltf.images, index, "image")
        if index not in self._pictures:
            with naming_part(label("image", index, image.name)):
                self._pictures[index] = self._decoded(image)
        return self._pictures[index]

    def count_corners(self, count: int) -> None:
        """Raises ValueError if the meshes that were read have more corners and indices than a scene may have."""
        self._corners += count
        what = f"with it the scene has {self._corners} corners and indices"
        content.check_limit(self._corners, what, self.max_pixels, SCENE_CORNERS)

    def count_pixels(self, count: int) -> None:
        """Raises ValueError if the textures and frames that were read have more pixels than a scene may have."""
        self._pixels += count
        what = f"with it the scene's pictures have {self._pixels} pixels"
        content.check_limit(self._pixels, what, self.max_pixels, SCENE_PIXELS)

    def _decoded(self, image: SimpleNamespace) -> NDArray[np.uint8]:
        if image.uri is not None and not image.uri.startswith("data:"):
            picture = read_color(self._file(image.uri), self.max_pixels)
        else:
            data = self._view(image.bufferView)[0] if image.uri is None else self._fetch(image.uri)
            picture = to_color(decode_image(BytesIO(data), "its file", self.max_pixels), "its file")
        self.count_pixels(picture.shape[0] * picture.shape[1])
        return picture

    def _elements(self, view: Any, offset: int | None, count: Any, dtype: np.dtype, width: int) -> NDArray[Any]:
        data, stride = self._view(view)
        size, offset = dtype.itemsize * width, offset or 0
        stride = stride or size
        if count is None or count < 1 or offset < 0 or stride < size:
            raise ValueError(f"{count} elements of {size} bytes at byte {offset}, {stride} bytes apart, are impossible")
        end = offset + stride * (count - 1) + size
        if end > len(data):
            raise ValueError(f"it ends at byte {end} of a buffer view of {len(data)} bytes")
        self.count_corners(count)
        return np.ndarray((count, width), dtype, data, offset, (stride, dtype.itemsize)).astype(dtype.newbyteorder("="))

    def _change(self, accessor: SimpleNamespace, values: NDArray[Any]) -> None:
        """Replace the values that a sparse accessor replaces."""
        indices, new, count = accessor.sparse.indices, accessor.sparse.values, accessor.sparse.count
        if indices is None or new is None:
            raise ValueError("its sparse part has no indices or no values")
        kind = _TYPES.get(indices.componentType, "")
        if kind[1:2] != "u":
            raise ValueError(f"its sparse indices are of component type {indices.componentType}")
        where = self._elements(indices.bufferView, indices.byteOffset, count, np.dtype(kind), 1)
        if where.max() >= len(values):
            raise ValueError(f"its sparse indices name element {where.max()} of {len(values)}")
        dtype = np.dtype(_TYPES[accessor.componentType])
        values[where[:, 0]] = self._elements(new.bufferView, new.byteOffset, count, dtype, values.shape[1])

    def _view(self, index: Any) -> tuple[memoryview, int | None]:
        """The bytes of a buffer view, and the distance of its elements."""
        view = pick(self.gltf.bufferViews, index, "buffer view")
        with naming_part(f"buffer view {index}"):
            data = self._buffer(view.buffer)
            start, length = view.byteOffset or 0, view.byteLength
            if length is None or length < 1 or start < 0 or start + length > len(data):
                raise ValueError(f"{length} bytes at byte {start} do not fit into a buffer of {len(data)} bytes")
            return data[start : start + length], view.byteStride

    def _buffer(self, index: Any) -> memoryview:
        buffer = pick(self.gltf.buffers, index, "buffer")
        if index not in self._buffers:
            with naming_part(f"buffer {index}"):
                data = self._blob if buffer.uri is None else self._fetch(buffer.uri)
                if data is None or (buffer.uri is None and index != 0):
                    raise ValueError("has no uri, and the file has no binary chunk for it")
                if buffer.byteLength is None or not 0 <= buffer.byteLength <= len(data):
                    raise ValueError(f"has {len(data)} bytes, expected {buffer.byteLength}")
                self._buffers[index] = data[: buffer.byteLength]
        return self._buffers[index]

    def _fetch(self, uri: str) -> memoryview:
        """The bytes of a data URI, or of a file in the scene's folder, which is read once."""
        if uri.startswith("data:"):
            head, _, body = uri.partition(",")
            return memoryview(base64.b64decode(body) if head.endswith(";base64") else unquote_to_bytes(body))
        path = self._file(uri)
        if path not in self._files:
            self._files[path] = memoryview(content.read_bytes(path, self.max_pixels, SCENE_BYTES))
        return self._files[path]

    def _file(self, uri: str) -> Path:
        path = inside(self.folder, unquote(uri))
        if not path.is_file():
            raise ValueError(f"{shown(uri)} is not a file")
        return path


def options(extras: Any, known: Sequence[str]) -> dict[str, Any]:
    """What `extras` has under "pointshade", checked for unknown names; {} without it."""
    ours = extras.get("pointshade") if isinstance(extras, dict) else None
    if isinstance(ours, str):  # JSON, or the name of a frame
        is_json = ours.lstrip().startswith("{")
        ours = content.parse_json(ours, name="its extras 'pointshade': its text") if is_json else {"frame": ours}
    if ours is None:
        return {}
    if not isinstance(ours, dict):
        raise ValueError(f"its extras 'pointshade' must be an object, got {shown(ours)}")
    for key in ours:
        if key not in known:
            raise ValueError(f"its extras 'pointshade' have an unknown {shown(key)}: known are {', '.join(known)}")
    return ours


def named_light(gltf: SimpleNamespace, holder: Any, extension: str, what: str) -> tuple[int, Any] | None:
    """The number and the object of the light that a part's extension names; None without one. Raises ValueError."""
    held = (holder.extensions or {}).get(extension) if holder else None
    if held is None:
        return None
    lights = (gltf.extensions or {}).get(extension)
    lights = lights.get("lights") if isinstance(lights, dict) else None
    index = held.get("light") if isinstance(held, dict) else None
    return index, pick(lights if isinstance(lights, list) else [], index, what)  # type: ignore[return-value]


def switch(ours: dict[str, Any], key: str, default: bool = True) -> bool:
    """A switch of extras; Blender's older ones are 0 and 1."""
    value = ours.get(key, default)
    if not isinstance(value, int) or value not in (0, 1):
        raise ValueError(f"its extras: {key} must be true or false, got {shown(value)}")
    return bool(value)
