"""Point objects and their frames in the extras of glTF nodes; and the parts of a file that is being written."""

from __future__ import annotations

import json
from collections import defaultdict
from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from io import BytesIO
from pathlib import Path
from typing import Any
from urllib.parse import quote
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from ...notes.notes import Note
from ...notes.words import shown
from ...scene.appearance import NOT_LIT, SWITCHES, Appearance, Material
from ...scene.frame import Frame
from ...scene.objects import MOST_FRAMES, PointObject
from ..access.atomic_write import FileSet
from ..access.content import IN_JSON, MAX_PIXELS, SCENE_FRAMES, check_limit, split_numbers
from ..access.folders import Folder
from ..access.known_names import FRAMES
from ..arrays.numpy_files import read_npy
from ..frames.frame_files import load_frame
from ..pictures.picture_files import save_image
from . import buffers
from .buffers import GENERATOR, IMAGE_BASED, LIGHTS, SPECULAR, SPLATS, UNLIT, GltfParts
from .cameras_and_lights import FLIP

_NUMBERS = ("fov", "depth_scale", "baseline", "near", "far")
_FILES = ("depth", "color", "intrinsics", "pose")  # options of load_frame that may name a file
FRAME_KEYS = ("frame", *_FILES, *_NUMBERS, "depth_kind", "channel")

# Where the frames of read scenes came from, with absolute paths: saving names these files instead of writing them anew.
_sources: WeakKeyDictionary[Frame, dict[str, Any]] = WeakKeyDictionary()


def read_frame(ours: dict[str, Any], folder: Folder, note: Note, max_pixels: float = MAX_PIXELS) -> Frame:
    """The frame that extras describe. `save_scene` describes it in the same way. Raises ValueError or OSError."""
    given = dict(ours)
    for key in _FILES:
        value = given.get(key)
        # a text of four numbers is intrinsics; everywhere else "1.5" is the name of a file
        if isinstance(value, str) and not (key == "intrinsics" and split_numbers(value)):
            given[key] = buffers.inside(folder, value)
    for key in _NUMBERS:
        if key in given:
            given[key] = buffers.numbers(given[key], (), key).item()
    place = given.pop("frame", None)
    if place not in (*FRAMES, None):
        place = buffers.inside(folder, place)
        if not place.is_dir():
            given.setdefault("depth", place)
            place = None
    pose = given.pop("pose", None)
    placed = pose if isinstance(pose, Path) else buffers.numbers(FLIP if pose is None else pose, (4, 4), "pose")
    fenced = Folder(place, folder.allow_outside, folder.path) if isinstance(place, Path) else place
    frame = load_frame(fenced, **given, pose=placed, max_pixels=max_pixels, notes=note)
    _sources[frame] = given | {key: value for key, value in (("frame", place), ("pose", pose)) if value is not None}
    return frame


def write_frame(frame: Frame, folder: Path, name: str, stage: Callable[[str], Path]) -> dict[str, Any]:
    """The extras that name a frame: its source, or files staged under this name. Raises ValueError without a point."""
    if ours := _refer(frame, folder):
        return ours
    if not frame.points_known:
        raise ValueError("its frame has no known depth, nothing to write")
    if frame.color is not None:
        save_image(stage(f"{name}/color.png"), frame.color)
    save_image(stage(f"{name}/depth.npy"), frame.depth)
    camera = {key: getattr(frame.camera, key) for key in ("width", "height", "fx", "fy", "cx", "cy")}
    stage(f"{name}/intrinsics.json").write_text(json.dumps(camera | {"depth_scale": 1.0}, indent=2) + "\n")
    return {"frame": name} | ({} if np.array_equal(frame.pose, FLIP) else {"pose": frame.pose.tolist()})


def _refer(frame: Frame, folder: Path) -> dict[str, Any] | None:
    """Return the extras by which a frame was read, if a file in this folder can use them; else None."""
    ours = _sources.get(frame)
    if ours is None:
        return None
    root = folder.resolve()
    if any(isinstance(value, Path) and not value.is_relative_to(root) for value in ours.values()):
        return None
    named = {key: value.relative_to(root).as_posix() for key, value in ours.items() if isinstance(value, Path)}
    return ours | named


# options of an Appearance by their names in files
OBJECT_KEYS = {
    "size" if name == "point_size" else name: name
    for name in Appearance().options
    if name not in (*SWITCHES, "material")
}
KEYS = (*FRAME_KEYS, "frames", *OBJECT_KEYS, *SWITCHES, "material")


def read_points(ours: dict[str, Any], parts: GltfParts, frames: dict[str, Frame]) -> PointObject | None:
    """The point object that a node's extras describe; None without one. Raises ValueError or OSError. frames: those
    that the file has named before, so that none is loaded twice."""
    described = _describe(ours)
    if not described:
        alone = [key for key in ours if key in KEYS]
        if alone:
            raise ValueError(f"its extras have {', '.join(alone)}, but no frame")
        return None
    found = []
    for k, of_frame in enumerate(described):
        key, count = json.dumps(of_frame, sort_keys=True), len(frames) + 1
        with _naming_frame(k, len(described)):
            if key not in frames:
                check_limit(count, f"with it the scene has {count} frames", parts.max_pixels, SCENE_FRAMES)
                frames[key] = read_frame(of_frame, parts.folder, parts.note, parts.max_pixels)
                parts.count_pixels(frames[key].depth.size)
        found.append(frames[key])
    of_object = {name: _value(key, ours[key], parts) for key, name in OBJECT_KEYS.items() if key in ours}
    of_object |= {key: buffers.switch(ours, key) for key in SWITCHES if key in ours}
    return PointObject(found, read_material(ours.get("material", {})), **of_object)


def _describe(ours: dict[str, Any]) -> list[dict[str, Any]]:
    """Return what a node's extras state about each frame; nothing for none. Raises ValueError."""
    alone = {key: ours[key] for key in FRAME_KEYS if key in ours}
    if "frames" not in ours:
        return [alone] if "frame" in ours or "depth" in ours else []
    if alone:
        raise ValueError(f"its extras have frames, so {', '.join(alone)} belong into each of them")
    several = ours["frames"]
    if not isinstance(several, list) or not 1 <= len(several) <= MOST_FRAMES:
        got = f"{len(several)} of them" if isinstance(several, list) else shown(several)
        raise ValueError(f"its frames must be a list of 1 to {MOST_FRAMES}, got {got}")
    found = []
    for k, one in enumerate(several):
        with _naming_frame(k, len(several)):
            found.append(buffers.options({"pointshade": one}, FRAME_KEYS))
            if "frame" not in found[-1] and "depth" not in found[-1]:
                raise ValueError(f"it must name a frame, got {shown(one)}")
    return found


def _naming_frame(k: int, count: int) -> AbstractContextManager[None]:
    """Name the frame in errors inside, if it is one of several."""
    return nullcontext() if count == 1 else buffers.naming_part(f"frame {k} of {count}")


def read_material(ours: Any) -> Material:
    """A Material of an object's values. Raises ValueError."""
    known = ("ambient", "diffuse", "specular", "shininess")
    if not isinstance(ours, dict) or not set(ours) <= set(known):
        raise ValueError(f"its material must be an object of {', '.join(known)}, got {shown(ours)}")
    return Material(**{key: buffers.numbers(value, (), f"material {key}").item() for key, value in ours.items()})


def _value(key: str, value: Any, parts: GltfParts) -> Any:
    """An option of an object: a name, numbers, or the array of the .npy file that it names."""
    if isinstance(value, str):
        return read_npy(buffers.inside(parts.folder, value), parts.max_pixels) if value.endswith(".npy") else value
    if isinstance(value, list):
        try:
            return np.asarray(value, np.float64)
        except (TypeError, ValueError, OverflowError):
            raise ValueError(f"{key} must be numbers, got {shown(value)}") from None
    if value is not None:
        buffers.numbers(value, (), key)
    return value


def write_points(
    points: PointObject,
    folder: Path,
    names: list[str],  # of the folders, one for each frame
    stage: Callable[[str], Path],
    written: dict[Frame, dict[str, Any]],  # extras of each frame before, so that none is written twice
) -> dict[str, Any]:
    """Return the extras of a point object; its frames and arrays are staged as files. Raises ValueError without one."""
    for k, (frame, name) in enumerate(zip(points.frames, names, strict=True)):
        if frame not in written:
            with _naming_frame(k, len(points.frames)):
                written[frame] = write_frame(frame, folder, name, stage)
    several = [written[frame] for frame in points.frames]
    ours: dict[str, Any] = dict(several[0]) if points.is_single else {"frames": several}
    for key, name in OBJECT_KEYS.items():
        value = getattr(points.look, name)
        if np.ndim(value):
            ours[key] = f"{names[0]}/{key}.npy"
            save_image(stage(ours[key]), np.asarray(value, np.float32))
        elif value != getattr(Appearance(), name):
            ours[key] = value
    ours |= {key: True for key in SWITCHES if getattr(points.look, key)}
    material = write_material(points.look.material)
    return ours | ({"material": material} if material else {})


def write_material(material: Material) -> dict[str, float]:
    """Those values that differ from the default."""
    return {key: value for key, value in vars(material).items() if value != getattr(Material(), key)}


ARRAY_BUFFER, ELEMENT_ARRAY_BUFFER = 34962, 34963  # numbers of OpenGL
KINDS = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4"}
COMPONENTS = {"f": 5126, "H": 5123, "I": 5125}  # by NumPy's type
WHITE = (1.0, 1.0, 1.0)
QUALITY = 92  # of JPEG
_DIELECTRIC = 0.04  # what glTF's materials reflect head-on


class GltfDocument:
    """The parts of a file by their kind, and its lights."""

    def __init__(self, path: Path, files: FileSet) -> None:
        self.gltf: dict[str, list[dict[str, Any]]] = defaultdict(list)  # numbered parts
        self.path, self.files = path, files
        self.is_binary = path.suffix.lower() == ".glb"
        self.lights: list[dict[str, Any]] = []
        self.environments: list[dict[str, Any]] = []  # image-based lights
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
        written = {key: self.accessor(one, **(bounds if one is at else {})) for key, one in held.items()}
        if normals is not None:  # of unit length, as glTF requires; those that have it already stay as they are
            length = np.linalg.norm(normals, axis=1, keepdims=True)
            is_unit = (np.abs(length - 1) < 1e-4) | (length == 0)
            written["NORMAL"] = self.accessor(np.where(is_unit, normals, normals / np.maximum(length, 1e-30)))
        return written

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
        self._blob += bytes(-len(self._blob) % 4)
        start = len(self._blob)
        self._blob += data
        return self.add("bufferViews", buffer=0, byteOffset=start, byteLength=len(data), target=target)

    def material(
        self, material: Material, shading: str, color: tuple[float, float, float] = WHITE,
        texture: int | None = None, has_alpha: bool = False,
    ) -> int:  # fmt: skip
        """Return a material as close to ours as glTF's are; our own values stand in its extras."""
        ours: dict[str, Any] = write_material(material)
        if shading not in ("phong", "none"):
            ours["shading"] = shading
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
                extras=extras_of(ours),
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
            self.files.stage(self.path.name).write_bytes(buffers.pack(text, bytes(self._blob)))
            return
        if self._blob:
            self.files.stage(binary).write_bytes(self._blob)
        self.files.stage(self.path.name).write_text(_lines(self.document()) + "\n", encoding="utf-8", errors=IN_JSON)

    def document(self) -> dict[str, Any]:
        """The whole file as JSON has it, without empty lists, in the order in which people read: bytes last."""
        for node in self.gltf["nodes"]:
            if not node["children"]:
                del node["children"]
        held = {
            name: {"lights": some} for name, some in ((LIGHTS, self.lights), (IMAGE_BASED, self.environments)) if some
        }
        worn = {name for one in self.gltf["materials"] for name in one.get("extensions", ())}
        worn |= {
            name for mesh in self.gltf["meshes"] for one in mesh["primitives"] for name in one.get("extensions", ())
        }
        used = [name for name in (LIGHTS, IMAGE_BASED, UNLIT, SPECULAR, SPLATS) if name in held or name in worn]
        ours: dict[str, Any] = {"asset": {"generator": GENERATOR, "version": "2.0"}}
        ours |= {"extensionsUsed": used, "scene": 0}
        ours |= {kind: self.gltf[kind] for kind in ("scenes", "nodes", "cameras")}
        ours |= {"extensions": held} if held else {}
        ours |= {kind: self.gltf[kind] for kind in ("meshes", "materials")} | self.gltf
        return {key: value for key, value in ours.items() if value != []}


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


def extras_of(ours: dict[str, Any]) -> dict[str, Any] | None:
    """Return what extras hold, None for nothing."""
    return {"pointshade": ours} if ours else None
