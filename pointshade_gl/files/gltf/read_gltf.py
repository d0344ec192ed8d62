"""Reads a glTF file as a scene: visits the nodes, parents first, then builds them, children first."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np

from ...checks.arguments import check_positive
from ...notes.notes import Note, print_note
from ...notes.words import as_python, cut, option
from ...scene.frame import Frame
from ...scene.graph import Scene
from ...scene.light import Light
from ...scene.node import Node
from ...scene.objects import PointObject
from ..access.content import PARTS, FilePath, check_limit
from ..access.folders import Folder
from ..access.known_names import builtin_scene
from . import buffers
from .buffers import GENERATOR, KNOWN, LIGHTS, SPECULAR, GltfParts
from .cameras_and_lights import (
    FLIP,
    LUMENS,
    Matrix,
    camera_pose,
    local_matrix,
    read_camera,
    read_environment,
    read_light,
)
from .meshes import Meshes
from .stored_points import KEYS, read_points

_NODE_KEYS = (*KEYS, "visible", "shadow", "fallback", "content", "turned", "sheared")


def load_scene(path: FilePath, allow_outside: bool, max_pixels: float, notes: Note | None) -> Scene:
    """See the package, which imports this module when it is first needed."""
    file = builtin_scene(path)
    check_positive(max_pixels, option("max_pixels", beside_file=True))
    folder = Folder(file.parent, allow_outside, file.parent)
    with as_python(), buffers.naming_part(str(file)):  # extras have the names of Python's options
        gltf, blob = buffers.read_container(file, max_pixels)
        return _Reader(GltfParts(folder, gltf, blob, notes or print_note, max_pixels)).scene()


class _Reader:
    def __init__(self, parts: GltfParts) -> None:
        self.gltf, self.note, self.parts = parts.gltf, parts.note, parts
        self._is_ours = self.gltf.asset.generator == GENERATOR
        self._is_blenders = "Blender" in (self.gltf.asset.generator or "")
        self.meshes = Meshes(parts)
        self.frames: dict[str, Frame] = {}
        self.parents: dict[int, int | None] = {}  # in the order of the walk
        self.places: dict[int, Matrix] = {}  # node-to-parent
        self.cameras: list[tuple[int, Matrix]] = []  # nodes with one, node-to-world
        self.objects: dict[int, PointObject | None] = {}  # by node
        self.exposure = 1.0
        self.loose: dict[int | None, list[Any]] = {}  # by node: content that stands below it in the file

    def scene(self) -> Scene:
        self._note_what_is_left_out()
        gltf = self.gltf
        count = len(gltf.nodes or ())
        check_limit(count, f"has {count} nodes", self.parts.max_pixels, PARTS)
        chosen = buffers.pick(gltf.scenes, gltf.scene or 0, "scene") if gltf.scenes or gltf.scene is not None else None
        ours = buffers.options(chosen.extras if chosen else None, ("ambient", "exposure", "pose"))
        self.exposure = buffers.numbers(ours.get("exposure", 1), (), "exposure").item()
        if self._is_blenders and LIGHTS in (gltf.extensions or {}):
            units = f"{LUMENS:g} lumens a watt, as Blender writes them"
            self.note(f"lights are taken as {units}; the scene's exposure is a factor")
        if chosen:
            roots = chosen.nodes or []
        else:  # of a file without scenes: all nodes without a parent
            children = {child for node in gltf.nodes or () if node for child in node.children or ()}
            roots = [k for k in range(count) if k not in children]
        self._walk(roots)
        camera, pose, taken = None, buffers.numbers(ours.get("pose", FLIP), (4, 4), "pose"), None
        for index, world in self.cameras:
            with buffers.naming_part(self._label(index)):
                number = self._node(index).camera
                if camera is None and (seen := self._camera(number)):
                    camera, pose, taken = seen, camera_pose(world), index
                else:
                    self.note(f"{self._label(index)}: camera {number} is left out, the first perspective one is taken")
        nodes = self._build(roots, taken)
        ambient = buffers.numbers(ours.get("ambient", (1, 1, 1)), (3,), "ambient").tolist()
        is_turned = any(self._is_turned(self._node(root)) for root in roots)
        axes = FLIP[:3, :3] if is_turned else np.eye(3)
        environment = read_environment(chosen, self.parts, self.exposure, axes)
        return Scene(nodes, camera, pose, (ambient[0], ambient[1], ambient[2]), environment)

    def _note_what_is_left_out(self) -> None:
        known = (*KNOWN, SPECULAR) if self._is_ours else KNOWN
        unread = [str(name) for name in self.gltf.extensionsUsed or () if name not in known]
        if unread:
            self.note(f"the extension{'s' * (len(unread) > 1)} {cut(', '.join(unread))} cannot be read")
        if self.gltf.animations:
            self.note("animations are not played")
        if self.gltf.skins:
            self.note("skins are not applied: their meshes stand in the pose they were modelled in")

    def _node(self, index: Any) -> SimpleNamespace:
        return buffers.pick(self.gltf.nodes, index, "node")

    def _label(self, index: int) -> str:
        return buffers.label("node", index, self._node(index).name)

    def _walk(self, roots: list[int]) -> None:
        """Visits all nodes below the roots. Raises ValueError for one that it meets twice: nodes form trees."""
        flat = np.eye(4)
        stack: list[tuple[Any, int | None, Matrix, Matrix]] = [(root, None, flat, flat) for root in roots[::-1]]
        while stack:
            index, parent, above, place = stack.pop()
            with buffers.naming_part("the scene" if parent is None else self._label(parent)):
                node = self._node(index)
                if index in self.parents:
                    raise ValueError(self._met_twice(index, parent))
            self.parents[index] = parent
            with buffers.naming_part(self._label(index)):
                place = place @ (flat if parent is None and self._is_turned(node) else local_matrix(node))
                is_half = self._is_half(node)  # then the rest of the place is that of the node below
                self.places[index] = flat if is_half else place
                world = above @ self.places[index]
            if node.camera is not None:
                self.cameras.append((index, world))
            stack += [(k, index, world, place if is_half else flat) for k in (node.children or [])[::-1]]

    def _is_turned(self, node: SimpleNamespace) -> bool:
        """Whether a node only turns our scene for other programs."""
        return self._is_ours and buffers.switch(buffers.options(node.extras, _NODE_KEYS), "turned", False)

    def _is_half(self, node: SimpleNamespace) -> bool:
        """Whether a node and the only one below it are one of ours, sheared."""
        return len(node.children or ()) == 1 and buffers.switch(
            buffers.options(node.extras, _NODE_KEYS), "sheared", False
        )

    def _met_twice(self, index: int, parent: int | None) -> str:
        above = parent
        while above is not None and above != index:
            above = self.parents[above]
        if above is not None:
            return f"its child {self._label(index)} is also above it: a scene has no cycles"
        return f"its child {self._label(index)} has another parent already: a glTF node has one"

    def _camera(self, index: Any) -> Any:
        """A perspective camera; None for an orthographic one."""
        camera = buffers.pick(self.gltf.cameras, index, "camera")
        with buffers.naming_part(buffers.label("camera", index, camera.name)):
            return None if camera.type == "orthographic" else read_camera(camera, self.parts.max_pixels)

    def _build(self, roots: list[int], camera: int | None) -> tuple[Node, ...]:
        """The nodes. One that holds only the scene's camera becomes the scene's pose; those for other programs go."""
        built: dict[int, tuple[Node, ...]] = {}
        for index in self.parents:
            with buffers.naming_part(self._label(index)):
                self.objects[index] = self._object(index)
        for index in reversed(self.parents):
            node = self._node(index)
            with buffers.naming_part(self._label(index)):
                ours, above = buffers.options(node.extras, _NODE_KEYS), self.parents[index]
                # other programs draw it in the place of the point object above it
                is_extra = (
                    buffers.switch(ours, "fallback", False) and above is not None and self.objects[above] is not None
                )
                meshes = () if is_extra or node.mesh is None else self.meshes[node.mesh]
                own = () if is_extra else (self.objects[index], *meshes, self._light(node, ours))
                content = tuple(one for one in own if one is not None)
                content += () if is_extra else tuple(self.loose.pop(index, ()))
                children = tuple(child for k in node.children or () for child in built.pop(k))
                if not children and above is not None and buffers.switch(ours, "content", False):
                    self.loose.setdefault(above, [])[:0] = content  # those below come last first
                    content, is_extra = (), True
                is_extra |= index == camera or (above is None and self._is_turned(node)) or self._is_half(node)
                if is_extra and not content and (not children or index != camera):
                    built[index] = children
                    continue
                held = content[0] if len(content) == 1 else content or None
                switches = {key: buffers.switch(ours, key) for key in ("visible", "shadow")}
                built[index] = (Node(held, node.name or "", self.places[index], children, **switches),)
        return tuple(node for root in roots for node in built[root])

    def _object(self, index: int) -> PointObject | None:
        """The point object of a node; None without one, or if its files are missing and a mesh stands for it."""
        node = self._node(index)
        try:
            return read_points(buffers.options(node.extras, _NODE_KEYS), self.parts, self.frames)
        except FileNotFoundError as error:
            below = [buffers.options(self._node(child).extras, _NODE_KEYS) for child in node.children or ()]
            if not any(buffers.switch(ours, "fallback", False) for ours in below):
                raise
            self.note(f"{self._label(index)}: {error}: what other programs see is drawn in its place")
            return None

    def _light(self, node: SimpleNamespace, ours: dict[str, Any]) -> Light | None:
        found = buffers.named_light(self.gltf, node, LIGHTS, "light")
        if found is None:
            return None
        index, light = found
        with buffers.naming_part(f"light {index}"):
            if isinstance(light, dict) and "range" in light:
                self.note(f"light {index}: its range is not used, it falls with the square of the distance")
            return read_light(light, self.exposure, buffers.switch(ours, "shadow"), self._is_blenders)
