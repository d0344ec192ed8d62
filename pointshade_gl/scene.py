"""The scene graph: point objects among meshes and lights. Plain frozen values; glTF and the GPU are elsewhere.

World axes are what the nodes' transforms make them; cameras look along z with y down, as everywhere in this project.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .camera import Camera, check_pose
from .frame import Frame
from .normals import check_normals_option
from .shading import SHADINGS, SPLATS, Light, Material, check_choice, check_sizes

Matrix = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class PointObject:
    """A frame as an object of the scene: each of its pixels with a depth is a splat that is lit like all else.

    The options are those of `Renderer.render`. The frame's own pose places it under the node's transform.
    """

    frame: Frame
    material: Material = field(default_factory=Material)
    normals: str | ArrayLike = "auto"
    shading: str = "phong"
    size: float | ArrayLike | None = None
    splat: str = "footprint"
    max_depth_step: float | str | None = None
    noise: float | ArrayLike | str | None = None

    def __post_init__(self) -> None:
        check_choice("shading", self.shading, SHADINGS)
        check_choice("splat", self.splat, SPLATS)
        check_normals_option(self.normals, self.frame.depth.shape)
        check_sizes(self.size, self.frame.depth.shape)

    @property
    def options(self) -> tuple[Any, ...]:
        """What may be told for every pixel."""
        return self.normals, self.size, self.noise


@dataclass(frozen=True, eq=False)
class Mesh:
    """Triangles.

    positions  (n, 3) float, node axes
    faces      (m, 3) int, corners of the triangles; their front is counter-clockwise, both sides are drawn
    normals    (n, 3) float; None gives every triangle its own (flat facets)
    uv         (n, 2) float, (0, 0) is the texture's upper left corner (as in glTF); None without a texture
    color      linear RGB, multiplied with the texture
    texture    (h, w, 3|4) uint8 sRGB; None is white
    """

    positions: NDArray[np.float32]
    faces: NDArray[np.uint32]
    normals: NDArray[np.float32] | None = None
    uv: NDArray[np.float32] | None = None
    color: tuple[float, float, float] = (1.0, 1.0, 1.0)
    texture: NDArray[np.uint8] | None = None
    material: Material = field(default_factory=Material)
    shading: str = "phong"

    def __post_init__(self) -> None:
        points = _array(self.positions, "mesh positions", np.float32, (None, 3))
        faces = np.asarray(self.faces)
        if faces.ndim != 2 or faces.shape[1] != 3 or faces.dtype.kind not in "iu":
            raise ValueError(f"mesh faces must have shape (m, 3) and whole numbers, got {faces.shape} {faces.dtype}")
        if faces.size and (faces.min() < 0 or faces.max() >= len(points)):
            raise ValueError(
                f"mesh faces must name one of the {len(points)} positions, got {faces.min()} to {faces.max()}"
            )
        object.__setattr__(self, "positions", points)
        object.__setattr__(self, "faces", np.ascontiguousarray(faces, dtype=np.uint32))
        for name, width in (("normals", 3), ("uv", 2)):
            if getattr(self, name) is not None:
                values = _array(getattr(self, name), f"mesh {name}", np.float32, (len(points), width))
                object.__setattr__(self, name, values)
        if self.texture is not None:
            texture = np.ascontiguousarray(self.texture)
            if texture.ndim != 3 or texture.shape[2] not in (3, 4) or texture.dtype != np.uint8 or 0 in texture.shape:
                raise ValueError(f"mesh texture must be (h, w, 3|4) uint8, got {texture.shape} {texture.dtype}")
            if self.uv is None:
                raise ValueError("a mesh with a texture needs uv, one (u, v) for each position")
            object.__setattr__(self, "texture", texture)
        check_choice("shading", self.shading, SHADINGS)


@dataclass(frozen=True, eq=False)
class Node:
    """A named place in the scene: its content and its children move with its transform.

    transform  (4, 4) node-to-parent; for a point object a rotation, a translation and one scale for all axes
    content    a PointObject, a Mesh, a Light (placed by the node: its position and direction are in node axes), several
               of them, or nothing
    visible    False hides the node and all below it
    shadow     whether the node's content casts shadows
    """

    content: PointObject | Mesh | Light | tuple[PointObject | Mesh | Light, ...] | None = None
    name: str = ""
    transform: ArrayLike = field(default_factory=lambda: np.eye(4))
    children: tuple[Node, ...] = ()
    visible: bool = True
    shadow: bool = True

    def __post_init__(self) -> None:
        matrix = np.array(self.transform, dtype=np.float64)
        where = f"node {self.name!r}"
        for item in self.content if isinstance(self.content, tuple) else (self.content,):
            if not isinstance(item, PointObject | Mesh | Light | None):
                kind = type(item).__name__
                raise TypeError(f"{where}: its content must be a PointObject, a Mesh, a Light or several, got {kind}")
        if matrix.shape != (4, 4):
            raise ValueError(f"{where}: its transform must have shape (4, 4), got {matrix.shape}")
        if not np.isfinite(matrix).all():
            raise ValueError(f"{where}: its transform holds NaN or infinite numbers")
        if np.abs(matrix[3] - (0, 0, 0, 1)).max() > 1e-9:
            raise ValueError(f"{where}: the last row of its transform must be (0, 0, 0, 1), got {matrix[3].tolist()}")
        if abs(np.linalg.det(matrix[:3, :3])) < 1e-30:
            raise ValueError(f"{where}: its transform has a scale of zero")
        matrix.flags.writeable = False
        object.__setattr__(self, "transform", matrix)
        object.__setattr__(self, "children", tuple(self.children))


@dataclass(frozen=True, eq=False)
class Placed:
    """Content of a node with its place in the world."""

    content: Any
    world: Matrix  # (4, 4) node-to-world
    node: Node
    path: tuple[int, ...]  # which child of which child


@dataclass(frozen=True, eq=False)
class Scene:
    """Nodes, and who looks at them.

    camera   who looks when `render` is told nothing else; None is one that sees everything, turned as the pose is
    pose     (4, 4) camera-to-world of it
    ambient  linear RGB light from everywhere
    """

    nodes: tuple[Node, ...] = ()
    camera: Camera | None = None
    pose: ArrayLike | None = None
    ambient: tuple[float, float, float] = (1.0, 1.0, 1.0)

    def __post_init__(self) -> None:
        object.__setattr__(self, "nodes", tuple(self.nodes))
        object.__setattr__(self, "pose", check_pose(self.pose))
        for _ in self.placed():
            pass  # names the node that lies below itself

    def placed(self) -> Iterator[Placed]:
        """All visible content in the order of the nodes. Raises ValueError for a node that is below itself."""
        stack: list[tuple[Node, Matrix, tuple[int, ...], tuple[Node, ...]]] = []
        stack.extend((node, np.eye(4), (k,), ()) for k, node in reversed(list(enumerate(self.nodes))))
        while stack:
            node, parent, path, above = stack.pop()
            if any(node is other for other in above):
                raise ValueError(f"node {node.name!r} is below itself: a scene has no cycles")
            if not node.visible:
                continue
            world = parent @ np.asarray(node.transform)
            contents = node.content if isinstance(node.content, tuple) else (node.content,)
            yield from (Placed(content, world, node, path) for content in contents if content is not None)
            below = [(child, world, (*path, k), (*above, node)) for k, child in enumerate(node.children)]
            stack.extend(below[::-1])

    @property
    def points_known(self) -> int:
        """How many points the visible frames have."""
        return sum(p.content.frame.points_known for p in self.placed() if isinstance(p.content, PointObject))

    @property
    def pivot(self) -> NDArray[np.float64]:
        """(3,) the middle of all that is visible, world."""
        from .placement import bounding_sphere

        return bounding_sphere([p for p in self.placed() if not isinstance(p.content, Light)])[0]

    @property
    def scale(self) -> float:
        """How far the middle lies ahead of the camera; 1 when it does not."""
        pose = np.asarray(self.pose)
        ahead = float(pose[:3, 2] @ (self.pivot - pose[:3, 3]))
        return ahead if ahead > 0 else 1.0

    @property
    def upright(self) -> NDArray[np.float64]:
        """(3,) what yaw turns round: the world's y, as in glTF; the camera's own y where it leans beyond 60 degrees."""
        own = np.asarray(self.pose)[:3, 1]
        return np.array([0.0, 1.0, 0.0]) if abs(own[1]) > 0.5 else own

    @property
    def lights(self) -> list[Light]:
        """Those of the visible nodes, in world axes."""
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

    def every_node(self) -> Iterator[tuple[tuple[int, ...], Node]]:
        """All nodes with their paths, hidden ones too, parents before children."""
        stack: list[tuple[tuple[int, ...], Node]] = []
        stack.extend(((k,), node) for k, node in reversed(list(enumerate(self.nodes))))
        while stack:
            path, node = stack.pop()
            yield path, node
            stack.extend(((*path, k), child) for k, child in reversed(list(enumerate(node.children))))

    def with_node(self, path: tuple[int, ...], **changes: Any) -> Scene:
        """The scene with one node changed (`visible=False`, `transform=...`)."""

        def changed(nodes: tuple[Node, ...], rest: tuple[int, ...]) -> tuple[Node, ...]:
            node = nodes[rest[0]]
            new = (
                replace(node, **changes) if len(rest) == 1 else replace(node, children=changed(node.children, rest[1:]))
            )
            return (*nodes[: rest[0]], new, *nodes[rest[0] + 1 :])

        return replace(self, nodes=changed(self.nodes, path))


def _array(value: Any, name: str, dtype: Any, shape: tuple[int | None, ...]) -> NDArray[Any]:
    array = np.ascontiguousarray(value, dtype=dtype)
    if array.ndim != len(shape) or any(want not in (None, got) for want, got in zip(shape, array.shape, strict=False)):
        wanted = ", ".join("n" if want is None else str(want) for want in shape)
        raise ValueError(f"{name} must have shape ({wanted}), got {array.shape}")
    if not np.isfinite(array).all():
        raise ValueError(f"{name} must be finite")
    array.flags.writeable = False
    return array
