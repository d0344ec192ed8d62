"""The scene graph: point objects among meshes and lights. Plain frozen values; glTF and the GPU are elsewhere.

World axes are what the nodes' transforms make them; cameras look along z with y down, as everywhere in this project.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .bounds import median, sphere_round
from .camera import Camera, check_pose
from .checks import LARGEST, as_array, check_color, check_flag, check_type, items_of
from .consensus import MOST_FRAMES
from .frame import Frame
from .light import Light
from .look import SPLATS, Look, Material
from .mesh import Mesh
from .preview import Preview
from .shadow_views import Extent
from .wording import counted, option, shown

Matrix = NDArray[np.float64]
FOV = 45.0  # degrees from top to bottom, of a scene without a camera
ROUNDING = 1e-12  # a scale this near to 1 is 1
Way = tuple[Any, int]  # from a root to a node: the way to its parent, None for a root, and which child it is


@dataclass(frozen=True, eq=False)
class PointObject:
    """A frame as an object of the scene: each of its pixels with a depth is a splat, lit like everything else.

    frame   or several frames of one thing, in a sequence: they are drawn as one object, by their poses, each from its
            depth's own points. Afterwards the first is `frame`, and these are the `others`.
    look    how it is drawn; instead of a look its values may be passed: `PointObject(frame, shading="flat", size=2)`

    The frame's own pose places it under the node's transform.

    Raises TypeError or ValueError as `Look` and `Look.for_frame`, and for no frames, too many, or with several frames
    for options that are arrays and for splat="mesh".
    """

    frame: Frame
    look: Look
    others: tuple[Frame, ...] = ()

    def __init__(
        self,
        frame: Frame | Sequence[Frame],
        material: Material | None = None,
        *,
        look: Look | None = None,
        others: Sequence[Frame] = (),
        **options: Any,
    ):
        if look is not None and (material is not None or options):
            raise TypeError("pass a look, or its values one by one, not both")
        if look is None:
            look = Look(Material() if material is None else material, **options)
        check_type(look, Look, "look")
        more = items_of(others)
        if more is None:
            raise TypeError(f"others must be a sequence of frames, got {shown(others)}")
        frame, *rest = check_frames((*check_frames(frame), *more))
        if rest and not look.is_uniform:
            raise ValueError("normals, size and noise of several frames must hold for all: arrays belong to one frame")
        if rest and look.splat == "mesh":
            forms = option("splat", *SPLATS[:-1])
            raise ValueError(f"a mesh is that of one frame, got {1 + len(rest)}: merge them with {forms}")
        object.__setattr__(self, "frame", frame)
        object.__setattr__(self, "look", look.for_frame(frame.depth))
        object.__setattr__(self, "others", tuple(rest))

    def __repr__(self) -> str:
        return f"PointObject({self.frame if self.is_single else counted(len(self.frames), 'frame')})"

    @property
    def is_single(self) -> bool:
        """One frame, not several of one thing."""
        return not self.others

    @property
    def frames(self) -> tuple[Frame, ...]:
        """All of them."""
        return self.frame, *self.others

    @property
    def members(self) -> tuple[PointObject, ...]:
        """Each frame as an object of its own."""
        return (self,) if self.is_single else self._members  # keeping itself, it would outlive its last use

    @cached_property
    def _members(self) -> tuple[PointObject, ...]:
        return tuple(PointObject(frame, look=self.look) for frame in self.frames)

    @property
    def points_known(self) -> int:
        """How many points the frames have."""
        return sum(frame.points_known for frame in self.frames)

    @cached_property
    def scale(self) -> float:
        """The frame's scale; of several, the median."""
        return median([frame.scale for frame in self.frames])


def check_frames(frames: Frame | Sequence[Frame]) -> tuple[Frame, ...]:
    """One frame or several as a tuple. Raises TypeError for anything else, ValueError for none or too many."""
    items = [frames] if isinstance(frames, Frame) else frames
    if not isinstance(items, Sequence) or isinstance(items, str | bytes):
        raise TypeError(f"frame must be a Frame or a sequence of frames, got {shown(frames)}")
    if not 1 <= len(items) <= MOST_FRAMES:
        raise ValueError(f"an object has 1 to {MOST_FRAMES} frames, got {len(items)}")
    return tuple(check_type(item, Frame, "frame" if len(items) == 1 else f"frame {k}") for k, item in enumerate(items))


@dataclass(frozen=True, eq=False)
class Node:
    """A named place in the scene: its content and its children move with its transform.

    transform  (4, 4) node-to-parent; for a point object a rotation, a translation and one scale for all axes
    content    a PointObject, a Mesh, a Light (placed by the node: its position and direction are in node axes), several
               of them, or nothing
    visible    False hides the node and all below it
    shadow     whether the node's content casts shadows

    Raises TypeError or ValueError, naming the node, for anything else.
    """

    content: PointObject | Mesh | Light | tuple[PointObject | Mesh | Light, ...] | None = None
    name: str = ""
    transform: ArrayLike = field(default_factory=lambda: np.eye(4))
    children: tuple[Node, ...] = ()
    visible: bool = True
    shadow: bool = True

    def __post_init__(self) -> None:
        where = self.title
        if not isinstance(self.name, str):
            raise TypeError(f"{where}: its name must be a text")
        if isinstance(self.content, list):
            object.__setattr__(self, "content", tuple(self.content))
        for item in self.content if isinstance(self.content, tuple) else (self.content,):
            if not isinstance(item, PointObject | Mesh | Light | None):
                got = shown(item)
                raise TypeError(f"{where}: its content must be a PointObject, a Mesh, a Light or several, got {got}")
        matrix = as_array(self.transform, f"{where}: its transform must be numbers of shape (4, 4)")
        if matrix.shape != (4, 4):
            raise ValueError(f"{self.title}: its transform must have shape (4, 4), got {matrix.shape}")
        if not np.isfinite(matrix).all():
            raise ValueError(f"{where}: its transform holds NaN or infinite numbers")
        if np.abs(matrix).max() > LARGEST:
            raise ValueError(f"{where}: its transform must be below {LARGEST:g}, got {np.abs(matrix).max():g}")
        if np.abs(matrix[3] - (0, 0, 0, 1)).max() > 1e-9:
            raise ValueError(
                f"{self.title}: the last row of its transform must be (0, 0, 0, 1), got {matrix[3].tolist()}"
            )
        if abs(np.linalg.det(matrix[:3, :3])) < 1e-30:
            raise ValueError(f"{self.title}: its transform has a scale of zero")
        matrix.flags.writeable = False
        object.__setattr__(self, "transform", matrix)
        object.__setattr__(self, "children", _check_nodes(self.children, f"{where}: its children"))
        for name in ("visible", "shadow"):
            object.__setattr__(self, name, check_flag(getattr(self, name), f"{where}: {name}"))

    def __repr__(self) -> str:
        """`Node('vase', PointObject(...), 2 children)`."""
        content = "" if self.content is None else f", {self.content}"
        count = len(self.children)
        children = f", {count} child{'' if count == 1 else 'ren'}" if count else ""
        return f"Node({shown(self.name)}{content}{children})"

    @property
    def title(self) -> str:
        """How messages call it."""
        return f"node {shown(self.name)}"


def _check_nodes(nodes: Any, name: str) -> tuple[Node, ...]:
    items = items_of(nodes)
    for item in [nodes] if items is None else items:
        if items is None or not isinstance(item, Node):
            raise TypeError(f"{name} must be Nodes in a tuple or a list, got {shown(item)}")
    return tuple(items or ())


@dataclass(frozen=True, eq=False)
class Placed:
    """Content of a node with its place in the world."""

    content: Any
    world: Matrix  # (4, 4) node-to-world
    node: Node
    way: Way

    @cached_property
    def path(self) -> tuple[int, ...]:
        """Which child of which child the node is."""
        path, way = [], self.way
        while way is not None:
            way, k = way
            path.append(k)
        return tuple(path[::-1])

    @cached_property
    def axes(self) -> Matrix:
        """(4, 4) to the world from the axes of the content's points; those of a point object are its camera's axes, of
        several frames those of the first."""
        return self.world @ self.content.frame.pose if isinstance(self.content, PointObject) else self.world

    @property
    def members(self) -> tuple[Placed, ...]:
        """Each frame of a point object as if it was placed by itself."""
        return (self,) if self.content.is_single else self._members

    @cached_property
    def _members(self) -> tuple[Placed, ...]:
        return tuple(Placed(member, self.world, self.node, self.way) for member in self.content.members)

    @cached_property
    def corners(self) -> NDArray[np.float64]:
        """(n, 3) corners of a box round the content, of each frame one, world; (0, 3) when it has no points."""
        content: PointObject | Mesh = self.content
        if isinstance(content, PointObject) and not content.is_single:
            return np.concatenate([member.corners for member in self.members])
        if isinstance(content, PointObject):
            reach = content.look.farthest_reach
            return self._to_world(content.frame.corners if reach <= 0.5 else content.frame.splat_corners(reach))
        return self._to_world(content.corners)

    @cached_property
    def main_corners(self) -> NDArray[np.float64]:
        """The same without a frame's stray points."""
        is_frame = isinstance(self.content, PointObject)
        if is_frame and not self.content.is_single:
            return np.concatenate([member.main_corners for member in self.members])
        return self._to_world(self.content.frame.main_corners) if is_frame else self.corners

    @property
    def grain(self) -> float:
        """How wide a pixel of a frame is at its median distance, world units."""
        camera = self.content.frame.camera
        return self.content.scale * self.rigid_axes[1] / (0.5 * (abs(camera.fx) + abs(camera.fy)))

    def seen_from(self, pose: Matrix) -> Matrix:
        """(4, 4) the rigid pose of somebody in the world, as the frames of a point object have theirs."""
        seen = np.linalg.inv(self.world) @ pose
        seen[:3, :3] /= np.cbrt(np.linalg.det(seen[:3, :3]))
        return seen

    def _to_world(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        return points @ self.axes[:3, :3].T + self.axes[:3, 3]

    @cached_property
    def rigid_axes(self) -> tuple[Matrix, float]:
        """`axes` as rotation and translation, (4, 4), and the one scale that the node gives a point object.

        Raises ValueError for what a point object cannot have: a scale that differs by axis, a shear, a mirror.
        """
        linear = self.world[:3, :3]
        scale = float(np.cbrt(np.linalg.det(linear)))
        if scale <= 0 or np.abs(linear.T @ linear / scale**2 - np.eye(3)).max() > 0.01:
            raise ValueError(
                f"{self.node.title}: a point object takes rotation, translation and one scale for all axes, "
                f"got {np.round(linear, 4).tolist()}"
            )
        scale = 1.0 if abs(scale - 1) < ROUNDING else scale
        rigid = self.axes.copy()
        rigid[:3, :3] /= scale
        rigid.flags.writeable = False
        return rigid, scale


@dataclass(frozen=True, eq=False)
class Scene(Preview):
    """Nodes, and who looks at them.

    camera   who looks unless `render` is given another; None is a camera that sees everything, turned like the pose
    pose     (4, 4) camera-to-world of that camera
    ambient  linear RGB light from everywhere

    Raises TypeError or ValueError for anything else, and for a node that is below itself.
    """

    nodes: tuple[Node, ...] = ()
    camera: Camera | None = None
    pose: ArrayLike | None = None
    ambient: tuple[float, float, float] = (1.0, 1.0, 1.0)

    def __post_init__(self) -> None:
        object.__setattr__(self, "nodes", _check_nodes(self.nodes, "scene nodes"))
        object.__setattr__(self, "pose", check_pose(self.pose, "scene pose"))
        object.__setattr__(self, "ambient", check_color(self.ambient, "scene ambient"))
        if self.camera is not None:
            check_type(self.camera, Camera, "scene camera")
        self._placed  # noqa: B018 - names the node that lies below itself

    def __repr__(self) -> str:
        """`Scene(4 nodes: 93 207 points in 1 frame, 12 triangles in 1 mesh, 2 lights)`: what is visible."""
        meshes = [p.content for p in self._placed if isinstance(p.content, Mesh)]
        frames = sum(len(p.content.frames) for p in self._placed if isinstance(p.content, PointObject))
        found = {
            f"{counted(self.points_known, 'point')} in {counted(frames, 'frame')}": frames,
            f"{counted(sum(len(m.faces) for m in meshes), 'triangle')} in {counted(len(meshes), 'mesh')}": len(meshes),
            counted(len(self.lights), "light"): len(self.lights),
        }
        parts = ", ".join(text for text, count in found.items() if count)
        return f"Scene({counted(sum(1 for _ in self.every_node()), 'node')}{parts and f': {parts}'})"

    def placed(self) -> Iterator[Placed]:
        """All visible content in the order of the nodes."""
        return iter(self._placed)

    @cached_property
    def _placed(self) -> tuple[Placed, ...]:
        """Raises ValueError for a node that is below itself."""
        found: list[Placed] = []
        above: set[int] = set()  # ids of the nodes on the way down
        stack: list[tuple[Node, Matrix | None, Way]] = []  # without a matrix: the way up, past the node
        stack.extend((node, np.eye(4), (None, k)) for k, node in reversed(list(enumerate(self.nodes))))
        while stack:
            node, parent, way = stack.pop()
            if parent is None:
                above.remove(id(node))
                continue
            if id(node) in above:
                raise ValueError(f"{node.title} is below itself: a scene has no cycles")
            if not node.visible:
                continue
            above.add(id(node))
            stack.append((node, None, way))
            world = parent @ np.asarray(node.transform)
            contents = node.content if isinstance(node.content, tuple) else (node.content,)
            found.extend(Placed(content, world, node, way) for content in contents if content is not None)
            stack.extend((child, world, (way, k)) for k, child in reversed(list(enumerate(node.children))))
        return tuple(found)

    @cached_property
    def things(self) -> tuple[Placed, ...]:
        """All visible content except lights."""
        return tuple(p for p in self._placed if not isinstance(p.content, Light))

    @cached_property
    def bounds(self) -> tuple[NDArray[np.float64], float]:
        """Centre (3,) and radius of a sphere round all things but stray points, world; radius 1 without any."""
        return sphere_round(self._main_corners)

    @cached_property
    def extent(self) -> Extent:
        """Where all things but stray points lie, for the views of lights."""
        members = (m for p in self.things if isinstance(p.content, PointObject) for m in p.members)
        grain = max((m.grain for m in members), default=0.0)
        return Extent(self._main_corners if len(self._main_corners) else np.zeros((1, 3)), *self.bounds, grain)

    @cached_property
    def _main_corners(self) -> NDArray[np.float64]:
        return np.concatenate([np.zeros((0, 3)), *(p.main_corners for p in self.things)])

    def framed(self) -> Scene:
        """The scene with a camera: its own, or one that sees everything, turned like its pose."""
        if self.camera is not None:
            return self
        centre, radius = self.bounds
        pose = np.array(self.pose)
        pose[:3, 3] = centre - pose[:3, 2] * 1.05 * radius / math.sin(math.radians(FOV / 2))
        return replace(self, camera=Camera.from_fov(FOV, 640, 480), pose=pose)

    @property
    def points_known(self) -> int:
        """How many points the visible frames have."""
        return sum(p.content.points_known for p in self.placed() if isinstance(p.content, PointObject))

    @property
    def pivot(self) -> NDArray[np.float64]:
        """(3,) the middle of all that is visible, world."""
        return self.bounds[0]

    @property
    def scale(self) -> float:
        """How far the middle lies ahead of the camera; 1 when it does not."""
        pose = np.asarray(self.pose)
        ahead = float(pose[:3, 2] @ (self.pivot - pose[:3, 3]))
        return ahead if ahead > 0 else 1.0

    @property
    def upright(self) -> NDArray[np.float64]:
        """(3,) what yaw turns round: the world's y, as in glTF; the camera's own y if it leans over 60 degrees."""
        own = np.asarray(self.pose)[:3, 1]
        return np.array([0.0, 1.0, 0.0]) if abs(own[1]) > 0.5 else own

    @cached_property
    def lights(self) -> list[Light]:
        """The lights of the visible nodes, in world axes."""
        found = []
        for p in self.placed():
            if isinstance(p.content, Light):
                light, turn, changes = p.content, p.world[:3, :3], {}
                if light.position is not None:
                    changes["position"] = tuple(turn @ light.position + p.world[:3, 3])
                if light.direction is not None:
                    changes["direction"] = tuple(turn @ light.direction)
                found.append(replace(light, **changes))
        return found

    @property
    def light_names(self) -> list[str]:
        """The names of their nodes, in the same order."""
        return [p.node.name for p in self.placed() if isinstance(p.content, Light)]

    def every_node(self) -> Iterator[tuple[tuple[int, ...], Node]]:
        """All nodes with their paths, hidden ones too, parents before children."""
        path: list[int] = []
        stack = [(0, k, node) for k, node in reversed(list(enumerate(self.nodes)))]
        while stack:
            depth, k, node = stack.pop()
            path[depth:] = [k]
            yield tuple(path), node
            stack.extend((depth + 1, k, child) for k, child in reversed(list(enumerate(node.children))))

    def with_node(self, path: tuple[int, ...], **changes: Any) -> Scene:
        """The scene with one node changed (`visible=False`, `transform=...`).

        path  which child of which child, as in `every_node`. Raises ValueError if there is no node.
        """
        nodes = self.nodes
        for k in path:
            if not 0 <= k < len(nodes):
                raise ValueError(f"the scene has no node at the path {path}")
            nodes = nodes[k].children
        if not path:
            raise ValueError(f"the scene has no node at the path {path}")
        levels = [self.nodes]
        for k in path[:-1]:
            levels.append(levels[-1][k].children)
        for nodes, k in zip(levels[::-1], path[::-1], strict=True):
            new = replace(nodes[k], **changes)
            changes = {"children": (*nodes[:k], new, *nodes[k + 1 :])}
        return replace(self, nodes=changes["children"])

    def with_every_node(self, changes: Callable[[Node], dict[str, Any]]) -> Scene:
        """The scene with all nodes changed, each by the values that the function gives for it."""
        made: dict[int, Node] = {}
        stack = [*self.nodes]
        while stack:
            node = stack[-1]
            waiting = [child for child in node.children if id(child) not in made]
            if id(node) in made or not waiting:
                stack.pop()
                if id(node) not in made:
                    children = tuple(made[id(child)] for child in node.children)
                    made[id(node)] = replace(node, children=children, **changes(node))
            stack.extend(waiting if id(node) not in made else [])
        return replace(self, nodes=tuple(made[id(node)] for node in self.nodes))
