"""Small glTF files for the tests, made without the library that reads them."""

from __future__ import annotations

import base64
import json
import struct
from pathlib import Path
from typing import Any

import numpy as np

CORNERS = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0)], np.float32)
BLOB = CORNERS.tobytes() + np.array([0, 1, 2], np.uint16).tobytes()


def data_uri(data: bytes, kind: str = "application/octet-stream") -> str:
    return f"data:{kind};base64,{base64.b64encode(data).decode()}"


def document(**changes: Any) -> dict[str, Any]:
    """One triangle in a node called "leaf"."""
    return {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"name": "leaf", "mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"},
            {"bufferView": 1, "componentType": 5123, "count": 3, "type": "SCALAR"},
        ],
        "bufferViews": [
            {"buffer": 0, "byteLength": 36},
            {"buffer": 0, "byteOffset": 36, "byteLength": 6},
        ],
        "buffers": [{"byteLength": 42, "uri": data_uri(BLOB)}],
    } | changes


def with_arrays(arrays: dict[str, tuple[np.ndarray, dict[str, Any]]], **primitive: Any) -> dict[str, Any]:
    """A mesh of these arrays: attributes by their names, "indices", and what else their accessors say."""
    codes = {"b": 5120, "B": 5121, "h": 5122, "H": 5123, "I": 5125, "f": 5126}
    kinds = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4"}
    blob, views, accessors = b"", [], []
    for array, beside in arrays.values():
        blob += bytes(-len(blob) % 4)
        views.append({"buffer": 0, "byteOffset": len(blob), "byteLength": array.nbytes})
        width = 1 if array.ndim == 1 else array.shape[1]
        known = {"componentType": codes[array.dtype.char], "type": kinds[width], "count": len(array)}
        accessors.append({"bufferView": len(views) - 1} | known | beside)
        blob += array.tobytes()
    numbers = {name: k for k, name in enumerate(arrays)}
    primitive |= {"indices": numbers.pop("indices")} if "indices" in numbers else {}
    return document(
        meshes=[{"primitives": [{"attributes": numbers} | primitive]}],
        accessors=accessors,
        bufferViews=views,
        buffers=[{"byteLength": len(blob), "uri": data_uri(blob)}],
    )


def write_gltf(folder: Path, data: dict[str, Any], name: str = "scene.gltf") -> Path:
    path = folder / name
    path.write_text(json.dumps(data))
    return path


def glb(data: dict[str, Any], blob: bytes) -> bytes:
    """The container as in its specification: header, a chunk of JSON, a chunk of bytes."""
    text = json.dumps(data).encode()
    text += b" " * (-len(text) % 4)
    blob += bytes(-len(blob) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(blob), b"BIN\0") + blob
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks
