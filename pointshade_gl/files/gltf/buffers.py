"""Reads buffers, accessors and images of a glTF file, only from the scene's folder and up to a size limit."""

from __future__ import annotations

import base64
from io import BytesIO
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from urllib.parse import unquote, unquote_to_bytes

import numpy as np
from numpy.typing import NDArray

from ...notes.notes import Note
from ...notes.words import cut, shown
from ..access.content import followed, read_bytes
from ..access.limits import SCENE_BYTES, SCENE_CORNERS, SCENE_PIXELS, check_limit
from ..access.safe_paths import Folder
from ..frames.color_files import read_color, to_color
from ..pictures.picture_files import decode_image
from .checks import label, pick, telling

_TYPES = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
_WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}


def inside(folder: Folder, text: Any) -> Path:
    """The file or folder that a scene names, links followed. Raises ValueError if outside, OSError if missing."""
    path = folder.check(folder.named(text))
    if not path.exists():
        raise FileNotFoundError(f"{shown(text)} does not exist in {folder.path}")
    return followed(path)


class Parts:
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
        with telling(f"accessor {index}"):
            if accessor.type not in types or accessor.componentType not in _TYPES:
                kind = f"{cut(accessor.type)} of component type {accessor.componentType}"
                raise ValueError(f"is {kind}, expected {' or '.join(types)}")
            dtype, width = np.dtype(_TYPES[accessor.componentType]), _WIDTHS[accessor.type]
            values = self._elements(accessor.bufferView, accessor.byteOffset, accessor.count, dtype, width)
            if accessor.sparse is not None:
                values = self._changed(accessor, values)
            if accessor.normalized and dtype.kind != "f":
                values = np.maximum(values.astype(np.float32) / np.iinfo(dtype).max, -1)
            return values

    def picture(self, index: Any) -> NDArray[np.uint8]:
        """(h, w, 3|4) uint8 of an image."""
        image = pick(self.gltf.images, index, "image")
        if index not in self._pictures:
            with telling(label("image", index, image.name)):
                self._pictures[index] = self._decoded(image)
        return self._pictures[index]

    def count_corners(self, count: int) -> None:
        """Raises ValueError if the meshes that were read have more corners and indices than a scene may have."""
        self._corners += count
        what = f"with it the scene has {self._corners} corners and indices"
        check_limit(self._corners, what, self.max_pixels, SCENE_CORNERS)

    def count_pixels(self, count: int) -> None:
        """Raises ValueError if the textures and frames that were read have more pixels than a scene may have."""
        self._pixels += count
        what = f"with it the scene's pictures have {self._pixels} pixels"
        check_limit(self._pixels, what, self.max_pixels, SCENE_PIXELS)

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

    def _changed(self, accessor: SimpleNamespace, values: NDArray[Any]) -> NDArray[Any]:
        """The values with those that a sparse accessor replaces."""
        sparse = accessor.sparse
        if sparse is None or sparse.indices is None or sparse.values is None:
            raise ValueError("its sparse part has no indices or no values")
        kind = _TYPES.get(sparse.indices.componentType)
        if kind is None or kind[1] != "u":
            raise ValueError(f"its sparse indices are of component type {sparse.indices.componentType}")
        where = self._elements(sparse.indices.bufferView, sparse.indices.byteOffset, sparse.count, np.dtype(kind), 1)
        if where.max() >= len(values):
            raise ValueError(f"its sparse indices name element {where.max()} of {len(values)}")
        dtype = np.dtype(_TYPES[accessor.componentType])
        new = self._elements(sparse.values.bufferView, sparse.values.byteOffset, sparse.count, dtype, values.shape[1])
        values[where[:, 0]] = new
        return values

    def _view(self, index: Any) -> tuple[memoryview, int | None]:
        """The bytes of a buffer view, and the distance of its elements."""
        view = pick(self.gltf.bufferViews, index, "buffer view")
        with telling(f"buffer view {index}"):
            data = self._buffer(view.buffer)
            start, length = view.byteOffset or 0, view.byteLength
            if length is None or length < 1 or start < 0 or start + length > len(data):
                raise ValueError(f"{length} bytes at byte {start} do not fit into a buffer of {len(data)} bytes")
            return data[start : start + length], view.byteStride

    def _buffer(self, index: Any) -> memoryview:
        buffer = pick(self.gltf.buffers, index, "buffer")
        if index not in self._buffers:
            with telling(f"buffer {index}"):
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
            self._files[path] = memoryview(read_bytes(path, self.max_pixels, SCENE_BYTES))
        return self._files[path]

    def _file(self, uri: str) -> Path:
        path = inside(self.folder, unquote(uri))
        if not path.is_file():
            raise ValueError(f"{shown(uri)} is not a file")
        return path
