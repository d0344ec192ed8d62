"""The parts of a glTF file that is being written, numbered as they are added, and the bytes that they refer to."""

from __future__ import annotations

import json
from collections import defaultdict
from io import BytesIO
from pathlib import Path
from typing import Any
from urllib.parse import quote

import numpy as np
from numpy.typing import NDArray

from ...scene.appearance import NOT_LIT, Material
from ..access.atomic_write import FileSet
from .container import GENERATOR, IMAGE_BASED, LIGHTS, SPECULAR, UNLIT, pack
from .points import write_material

ARRAY_BUFFER, ELEMENT_ARRAY_BUFFER = 34962, 34963  # numbers of OpenGL
KINDS = {1: "SCALAR", 2: "VEC2", 3: "VEC3"}
COMPONENTS = {"f": 5126, "H": 5123, "I": 5125}  # by NumPy's type
WHITE = (1.0, 1.0, 1.0)
QUALITY = 92  # of JPEG
_DIELECTRIC = 0.04  # what glTF's materials reflect head-on


class Document:
    """The parts of a file by their kind, and its lights."""

    def __init__(self, path: Path, files: FileSet) -> None:
        self.gltf: dict[str, list[dict[str, Any]]] = defaultdict(list)  # numbered parts
        self.path, self.files = path, files
        self.is_binary = path.suffix.lower() == ".glb"
        self.lights: list[dict[str, Any]] = []
        self.around: list[dict[str, Any]] = []  # image-based lights
        self.known: dict[Any, int] = {}  # numbers of the parts that several nodes share: meshes, materials, pictures
        self._blob = bytearray()

    def add(self, kind: str, **values: Any) -> int:
        """Add a part without the values that are None. Returns its number."""
        self.gltf[kind].append({key: value for key, value in values.items() if value is not None})
        return len(self.gltf[kind]) - 1

    def attributes(self, normals: NDArray[np.float32] | None, held: dict[str, NDArray[Any]]) -> dict[str, int]:
        """Return the accessors of a primitive's attributes by their names."""
        at = held["POSITION"]
        bounds = {"max": at.max(0).tolist(), "min": at.min(0).tolist()}  # glTF requires them
        numbers = {key: self.accessor(one, **(bounds if one is at else {})) for key, one in held.items()}
        return numbers | ({} if normals is None else {"NORMAL": self.accessor(_unit(normals))})

    def corners(self, faces: NDArray[Any], count: int) -> int:
        """Return the accessor of the corners of triangles, of a number of vertices."""
        kind = np.uint16 if count < 0xFFFF else np.uint32
        return self.accessor(faces.astype(kind).reshape(-1, 1), ELEMENT_ARRAY_BUFFER)

    def accessor(self, values: NDArray[Any], target: int = ARRAY_BUFFER, **beside: Any) -> int:
        """Return the accessor of (n, width) values, behind those before."""
        view, kind = self.view(values.tobytes(), target), KINDS[values.shape[1]]
        component = COMPONENTS[values.dtype.char]
        return self.add("accessors", bufferView=view, componentType=component, count=len(values), type=kind, **beside)

    def view(self, data: bytes, target: int | None) -> int:
        """Return the buffer view of some bytes."""
        self._blob += bytes(-len(self._blob) % 4)
        start = len(self._blob)
        self._blob += data
        return self.add("bufferViews", buffer=0, byteOffset=start, byteLength=len(data), target=target)

    def material(
        self,
        material: Material,
        shading: str,
        color: tuple[float, float, float] = WHITE,
        texture: int | None = None,
        has_alpha: bool = False,
    ) -> int:
        """Return a material as close to ours as glTF's are; our own values stand in its extras."""
        said: dict[str, Any] = write_material(material)
        if shading not in ("phong", "none"):
            said["shading"] = shading
        key = ("material", color, texture, has_alpha, shading, material)
        if key not in self.known:
            # glTF's default metal would reflect no diffuse light in other viewers
            base: dict[str, Any] = {"baseColorFactor": [*color, 1.0], "metallicFactor": 0.0}
            alpha = 2 / (material.shininess + 2)  # that of a highlight as wide (Walter et al. 2007), squared
            base["roughnessFactor"] = round(alpha**0.25, 4)
            if texture is not None:
                base["baseColorTexture"] = {"index": texture}
            share = min(4 * alpha * material.specular / _DIELECTRIC, 1.0)  # with it as bright in the middle
            extensions: dict[str, Any] = {} if share == 1 else {SPECULAR: {"specularFactor": round(share, 4)}}
            self.known[key] = self.add(
                "materials",
                extensions=({UNLIT: {}} if shading in NOT_LIT else extensions) or None,
                extras=extras_of(said),
                pbrMetallicRoughness=base,
                alphaMode="MASK" if has_alpha else None,
                doubleSided=True,
            )
        return self.known[key]

    def texture(self, texture: NDArray[np.uint8]) -> int:
        """Return the texture of a picture, whose pixels stay as they are."""
        key = ("texture", id(texture))
        if key not in self.known:
            self.known[key] = self.add("textures", source=self.image(texture))
        return self.known[key]

    def photograph(self, picture: NDArray[np.uint8], file: str | None) -> int:
        """Return the texture of a frame's colours: a file that holds them, else a JPEG."""
        key = ("photograph", id(picture))
        if key not in self.known:
            source = self.image(picture[..., :3], "jpeg") if file is None else self.add("images", uri=quote(file))
            self.known[key] = self.add("textures", source=source)
        return self.known[key]

    def image(self, picture: NDArray[np.uint8], kind: str = "png") -> int:
        """Return the image of a picture, written as "png" or "jpeg"."""
        from PIL import Image  # only here

        file = BytesIO()
        Image.fromarray(picture).save(file, kind, **({"quality": QUALITY, "subsampling": 0} if kind == "jpeg" else {}))
        if self.is_binary:
            return self.add("images", mimeType=f"image/{kind}", bufferView=self.view(file.getvalue(), None))
        name = f"{self.path.stem}_{len(self.gltf['images'])}.{kind.replace('jpeg', 'jpg')}"
        self.files.stage(name).write_bytes(file.getvalue())
        return self.add("images", uri=quote(name))

    def finish(self) -> None:
        """Stages the buffer and, last, the file that names all others."""
        binary = f"{self.path.stem}.bin"
        if self._blob:
            self.add("buffers", uri=None if self.is_binary else quote(binary), byteLength=len(self._blob))
        if self.is_binary:
            text = json.dumps(self.document(), allow_nan=False).encode()
            self.files.stage(self.path.name).write_bytes(pack(text, bytes(self._blob)))
            return
        if self._blob:
            self.files.stage(binary).write_bytes(self._blob)
        self.files.stage(self.path.name).write_text(_lines(self.document()) + "\n", encoding="utf-8")

    def document(self) -> dict[str, Any]:
        """The whole file as JSON has it, without empty lists, in the order in which people read: bytes last."""
        for node in self.gltf["nodes"]:
            if not node["children"]:
                del node["children"]
        held = {name: {"lights": some} for name, some in ((LIGHTS, self.lights), (IMAGE_BASED, self.around)) if some}
        worn = {name for one in self.gltf["materials"] for name in one.get("extensions", ())}
        used = [name for name in (LIGHTS, IMAGE_BASED, UNLIT, SPECULAR) if name in held or name in worn]
        said: dict[str, Any] = {"asset": {"generator": GENERATOR, "version": "2.0"}}
        said |= {"extensionsUsed": used, "scene": 0}
        said |= {kind: self.gltf[kind] for kind in ("scenes", "nodes", "cameras")}
        said |= {"extensions": held} if held else {}
        said |= {kind: self.gltf[kind] for kind in ("meshes", "materials")} | self.gltf
        return {key: value for key, value in said.items() if value != []}


def _lines(value: Any, indent: str = "") -> str:
    """JSON with one line for each short value and for each part of a list."""
    text = json.dumps(value, ensure_ascii=False, allow_nan=False)
    inner = indent + "  "
    if len(text) <= 100 or not isinstance(value, dict | list):
        return text
    if isinstance(value, list):
        lines = [json.dumps(item, ensure_ascii=False) for item in value]
    else:
        lines = [f"{json.dumps(key)}: {_lines(item, inner)}" for key, item in value.items()]
    begin, end = "[]" if isinstance(value, list) else "{}"
    return begin + ",".join(f"\n{inner}{line}" for line in lines) + f"\n{indent}{end}"


def extras_of(said: dict[str, Any]) -> dict[str, Any] | None:
    """Return what extras hold, None for nothing."""
    return {"pointshade": said} if said else None


def _unit(normals: NDArray[np.float32]) -> NDArray[np.float32]:
    """Normals of unit length, as glTF requires. Those that have it already stay as they are."""
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    return np.where((np.abs(length - 1) < 1e-4) | (length == 0), normals, normals / np.maximum(length, 1e-30))
