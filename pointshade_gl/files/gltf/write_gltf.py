"""Writes a scene as glTF: one glTF node for each node, and more below it for what glTF cannot hold in one."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from functools import singledispatchmethod
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from ...checks.arguments import check_choice, check_path, check_type
from ...scene.appearance import Appearance, Material
from ...scene.camera import shortest_turn
from ...scene.cloud import PointCloud
from ...scene.frame import NEUTRAL, Frame
from ...scene.graph import Scene
from ...scene.light import UPPER_LEFT, Light
from ...scene.node import Node, contents_of
from ...scene.objects import Mesh, PointObject
from ...scene.triangles import TO_GLTF, frame_surface
from ...scene.values import srgb_to_linear
from ..access.atomic_write import FileSet, check_place, name_key, naming_written
from ..access.content import FilePath
from ..access.known_names import SCENE_SUFFIXES, check_suffix
from ..frames.assembly import read_color
from .buffers import IMAGE_BASED, LIGHTS, SPLATS, naming_part
from .cameras_and_lights import (
    FLIP,
    Matrix,
    Units,
    light_place,
    looking_along,
    transform_of,
    unsheared,
    write_camera,
    write_environment,
    write_light,
)
from .meshes import POINTS, cloud_attributes, cloud_extras, linear_colors, place_of
from .stored_points import WHITE, GltfDocument, extras_of, write_points

SPLATS_AS_TRAINED = {
    "kernel": "ellipse", "colorSpace": "srgb_rec709_display", "projection": "perspective", "sortingMethod": "zDepth",
}  # fmt: skip


Fallback = Literal["mesh", "points"] | None
MOST_POINTS = 400_000  # vertices of one object: all of a frame of 640x480
IN_GLTF = ".png", ".jpg", ".jpeg"  # pictures that glTF knows
GREY = (srgb_to_linear(NEUTRAL / 255.0).item(),) * 3  # of a frame without colours


def write_fallback(
    document: GltfDocument, points: PointObject, written: Mapping[Frame, dict[str, Any]], kind: Fallback
) -> list[tuple[int, Matrix]]:
    """Return each frame's mesh, the place of it, below the node; written extras name the folder of its colours."""
    most = max(1, MOST_POINTS // len(points.frames))
    found = []
    for frame in points.frames:
        key = ("fallback", id(frame.depth), id(frame.color), frame.camera, points.look)
        if key not in document.known:
            primitive = _triangles_of(document, frame, points.look, written[frame], most) if kind == "mesh" else None
            primitive = primitive or _points(document, frame, points.look, most)
            document.known[key] = document.add("meshes", primitives=[primitive])
        found.append((document.known[key], frame.pose @ FLIP))
    return found


def _triangles_of(
    document: GltfDocument, frame: Frame, look: Appearance, ours: Mapping[str, Any], most: int
) -> dict[str, Any] | None:
    """Return the primitive of a frame's surface; None where no pixels lie on one, as in sparse depth."""
    normals = None if isinstance(look.normals, str) else np.asarray(look.normals, np.float32)
    surface = frame_surface(frame, most, look.depth_step, normals)
    if not len(surface.faces):
        return None
    held = {"POSITION": surface.positions}
    texture, color = None, GREY
    if frame.color is not None:
        held["TEXCOORD_0"] = surface.uv
        texture = document.photograph(frame.color, _file_of(frame.color, ours, document))
        color = WHITE
    return {
        "attributes": document.attributes(surface.normals, held),
        "indices": document.corners(surface.faces, len(surface.positions)),
        "material": document.material(look.material, look.shading, color, texture),
    }


def _file_of(color: NDArray[np.uint8], ours: Mapping[str, Any], document: GltfDocument) -> str | None:
    """Return the picture that holds a frame's colours, if it is written with the file or lies where it can be named."""
    name = ours.get("color", f"{ours.get('frame')}/color.png")
    if document.is_binary:
        return None
    if document.files.holds(name):
        return name
    path = document.files.folder / name
    if path.suffix.lower() not in IN_GLTF or not path.is_file():
        return None
    return name if np.array_equal(read_color(path), color) else None


def _points(document: GltfDocument, frame: Frame, look: Appearance, most: int) -> dict[str, Any]:
    """Return the primitive of a frame's points, whose normals no program needs."""
    v, u = np.nonzero(frame.depth)
    every = math.ceil(len(v) / most)
    v, u = v[::every], u[::every]
    (x, y), z = frame.camera.ray_at(u, v), frame.depth[v, u]
    held: dict[str, NDArray[Any]] = {"POSITION": np.stack([x * z, y * z, z], -1).astype(np.float32) * TO_GLTF}
    if frame.color is not None:
        (height, width), colors = frame.depth.shape, frame.color
        row = ((v + 0.5) * colors.shape[0] / height).astype(np.intp)
        column = ((u + 0.5) * colors.shape[1] / width).astype(np.intp)
        held["COLOR_0"] = linear_colors(colors[row, column, :3])
    color = GREY if frame.color is None else WHITE
    material = document.material(look.material, "none", color)  # without normals they are not lit
    return {"mode": POINTS, "attributes": document.attributes(None, held), "material": material}


NO_NAME = r"\W+"  # not in the names of folders
_LEANING = 0.5  # cosine: a scene whose y points down by as much is turned for other programs
_REACHES = 1e-3, 1e6  # nearest, in radii of the scene, and farthest distance at which lights are matched


def save_scene(path: FilePath, scene: Scene, fallback: Fallback, light_units: Units) -> None:
    """See the package, which imports this module when it is first needed."""
    path, scene = check_path(path), check_type(scene, Scene, "scene")
    if fallback is not None:
        check_choice("fallback", fallback, get_args(get_args(Fallback)[0]))
    check_choice("light_units", light_units, get_args(Units))
    check_suffix(path, SCENE_SUFFIXES)
    check_place(path)
    with naming_written(path), FileSet(path.parent) as files:
        document = GltfDocument(path, files)
        _Writer(document, fallback, light_units).scene(scene)
        document.finish()
        files.commit()


class _Writer:
    def __init__(self, document: GltfDocument, fallback: Fallback, units: Units) -> None:
        self.document = document
        self.fallback: Fallback = fallback
        self.units: Units = units
        self.frames: dict[Frame, dict[str, Any]] = {}
        self.folders: set[str] = set()
        self.above: dict[int, int] = {}  # by node: one more above it, where one cannot hold a shear

    def scene(self, scene: Scene) -> None:
        """Numbers the nodes from above, each before those below it."""
        self.middle, self.radius = scene.bounds
        self.viewer = scene.framed().pose
        nodes = self.document.gltf["nodes"]
        roots: list[int] = []
        stack: list[tuple[Node, list[int], Matrix, bool]] = [(n, roots, np.eye(4), True) for n in scene.nodes[::-1]]
        while stack:
            node, siblings, above, is_shown = stack.pop()
            world, is_shown = above @ node.transform, is_shown and node.visible
            with naming_part(f"node {node.name!r}" if node.name else f"node {len(nodes)}"):
                number = self.node(node, world, is_shown)
            siblings.append(self.above.pop(number, number))
            below = nodes[number]["children"]
            stack += [(child, below, world, is_shown) for child in node.children[::-1]]
        ours: dict[str, Any] = {}
        if scene.ambient != (1.0, 1.0, 1.0):
            ours["ambient"] = list(scene.ambient)
        pose = np.asarray(scene.pose)
        if scene.camera is not None:
            self.document.add("cameras", **write_camera(scene.camera))
            roots.append(self.add_node("camera", pose @ FLIP, camera=0))
        elif not np.array_equal(pose, FLIP):
            ours["pose"] = pose.tolist()
        is_turned = bool(roots) and _is_upside_down(scene)
        if is_turned:
            top = self.add_node("y up", _upright_turn(scene), {"turned": True})
            nodes[top]["children"] = roots
            roots = [top]
        extensions = None
        if scene.environment is not None:
            turn = {"rotation": [1, 0, 0, 0]} if is_turned else {}
            self.document.environments.append(write_environment(scene.environment, self.document.image) | turn)
            extensions = {IMAGE_BASED: {"light": 0}}
        self.document.add("scenes", extensions=extensions, extras=extras_of(ours), nodes=roots or None)

    def node(self, node: Node, world: Matrix, is_shown: bool) -> int:
        """One of our nodes with its content, without its children."""
        contents = contents_of(node)
        lights = [item for item in contents if isinstance(item, Light)]
        drawn: list[Any] = [item for item in contents if not isinstance(item, Light)]
        points = [item for item in drawn if item.frames]
        here = [item for item in drawn if not item.frames and len(item.corners)]  # others draw nothing
        # of clouds those whose points a glTF node cannot hold in its own axes
        clouds = [item for item in here if (place_of(item) != np.eye(4)).any()]
        matrix = node.transform
        if len(clouds) == len(contents) == 1 and not node.children:
            matrix = matrix @ place_of(clouds.pop())
        here = [item for item in here if item not in clouds]
        switches = {name: False for name in ("visible", "shadow") if not getattr(node, name)}
        values: dict[str, Any] = {"extras": dict(switches)}
        objects: list[tuple[int, PointObject]] = []  # number of the glTF node that holds each
        index = len(self.document.gltf["nodes"])
        if here:
            values["mesh"] = self.mesh(tuple(here))
        if points:
            objects.append((index, points[0]))
            values["extras"] |= self.points(points.pop(0), node.name)
        if lights and np.array_equal(light_place(lights[0]), np.eye(4)) and not _is_viewers(lights[0]):
            values["extensions"] = self.light(lights.pop(0), world, node.shadow)
        self.add_node(node.name, matrix, **values)
        below = self.document.gltf["nodes"][index]["children"]
        shadow = {} if node.shadow else {"shadow": False}
        for item in points:
            below.append(self.add_node("", np.eye(4), shadow | self.points(item, node.name)))
            objects.append((below[-1], item))
        below += [self.add_node("", place_of(item), dict(shadow), mesh=self.mesh((item,))) for item in clouds]
        below += [self.below(item, world) for item in lights]
        if self.fallback and is_shown:
            for holder, item in objects:
                held, name = self.document.gltf["nodes"][holder]["children"], f"{node.name} {self.fallback}".lstrip()
                for mesh, place in write_fallback(self.document, item, self.frames, self.fallback):
                    held.append(self.add_node(name, place, {"fallback": True}, mesh=mesh))
        return index

    def add_node(self, name: str, matrix: Matrix, extras: dict[str, Any] | None = None, **values: Any) -> int:
        place, above = transform_of(matrix), None
        if place is None:
            above, matrix = unsheared(matrix)
            place = transform_of(matrix) or {}
        values |= {"extras": extras_of(extras or {})} | place
        index = self.document.add("nodes", name=name or None, **values, children=[])
        if above is not None:
            self.above[index] = self.add_node("", above, {"sheared": True})
            self.document.gltf["nodes"][self.above[index]]["children"].append(index)
        return index

    def points(self, points: PointObject, name: str) -> dict[str, Any]:
        folders = [self.folder(name) for _ in points.frames]
        files = self.document.files
        return write_points(points, files.folder, folders, files.stage, self.frames)

    def folder(self, name: str) -> str:
        path = self.document.path  # of room.gltf and room.glb each
        file = path.name.replace(".", "_") if self.document.is_binary else path.stem
        plain = f"{file}_{re.sub(NO_NAME, '_', name) or 'points'}"
        folder, k = plain, 1
        while name_key(folder) in self.folders:
            k += 1
            folder = f"{plain}_{k}"
        self.folders.add(name_key(folder))
        return folder

    def below(self, light: Light, world: Matrix) -> int:
        """A light that its node cannot hold: it looks another way, or stands elsewhere."""
        place, extras, held = light_place(light), None, self.light(light, world, True)
        if _is_viewers(light):
            towards = np.linalg.solve(world[:3, :3], self.viewer[:3, :3] @ UPPER_LEFT)
            place, extras = looking_along(towards), {"content": True}
        return self.add_node("", place, extras, extensions=held)

    def light(self, light: Light, world: Matrix, node_casts: bool) -> dict[str, Any]:
        way = 1.0  # from the light to the middle of what the scene draws
        if light.position is not None:
            way = float(np.linalg.norm(world[:3, :3] @ light.position + world[:3, 3] - self.middle))
        reach = np.clip(way, _REACHES[0] * self.radius, _REACHES[1]).item()
        self.document.lights.append(write_light(light, node_casts, reach, self.units))
        return {LIGHTS: {"light": len(self.document.lights) - 1}}

    def mesh(self, parts: tuple[Mesh | PointCloud, ...]) -> int:
        known = self.document.known
        if parts not in known:
            known[parts] = self.document.add("meshes", primitives=[self.primitive(one) for one in parts])
        return known[parts]

    @singledispatchmethod
    def primitive(self, mesh: Mesh) -> dict[str, Any]:
        document, picture = self.document, mesh.texture
        attributes = document.attributes(mesh.normals, {"POSITION": mesh.positions})
        if mesh.uv is not None:
            attributes["TEXCOORD_0"] = document.accessor(mesh.uv)
        if mesh.colors is not None:
            attributes["COLOR_0"] = document.accessor(linear_colors(mesh.colors))
        texture = None if picture is None else document.texture(picture)
        has_alpha = picture is not None and picture.shape[2] == 4
        return {
            "attributes": attributes,
            "indices": document.corners(mesh.faces, len(mesh.positions)),
            "material": document.material(mesh.material, mesh.shading, mesh.color, texture, has_alpha),
        }

    @primitive.register
    def _(self, cloud: PointCloud) -> dict[str, Any]:
        primitive = {"mode": POINTS, "attributes": self.document.attributes(cloud.normals, cloud_attributes(cloud))}
        is_plain = cloud.shading in ("phong", "auto") and cloud.material == Material()
        material = None if is_plain else self.document.material(cloud.material, cloud.shading)
        beside = {"material": material, "extras": extras_of(cloud_extras(cloud))}
        if cloud.gaussians is not None:
            primitive["extensions"] = {SPLATS: SPLATS_AS_TRAINED}
        return primitive | {key: value for key, value in beside.items() if value is not None}


def _is_viewers(light: Light) -> bool:
    """Return whether a light has no place and no direction: it shines from the viewer's upper left."""
    return light.position is None and light.direction is None


def _known_up(scene: Scene) -> NDArray[np.float64] | None:
    """Return where up is, (3,) unit, world, by what says so first; None if nothing does."""
    for placed in scene.instances:
        if placed.content.up_direction is not None:
            return placed.rigid_axes[0][:3, :3] @ placed.content.up_direction
    return None


def _is_upside_down(scene: Scene) -> bool:
    """Return whether the world's y points down, where glTF's points up: in the picture, or by a thing's own up."""
    up = _known_up(scene)
    return bool(scene.pose[1, 1] > _LEANING) if up is None else bool(up[1] < -_LEANING)


def _upright_turn(scene: Scene) -> Matrix:
    """Return the pose, (4, 4), of a world whose y points down: what is known to be up points up. Environments, which
    are turned with it, only know half turns."""
    up, turn = _known_up(scene), FLIP.copy()
    if up is not None and scene.environment is None:
        turn[:3, :3] = shortest_turn(FLIP[:3, :3] @ up, np.array([0.0, 1.0, 0.0])) @ FLIP[:3, :3]
    return turn
