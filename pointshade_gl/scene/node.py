"""A node of the scene graph: a transform with content and child nodes; and the content placed in the world."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any, TypedDict

import numpy as np
from numpy.typing import NDArray

from ..checks.arguments import check_flag, is_a, items_of
from ..checks.foreign_arrays import Numbers
from ..notes.words import shown
from .camera import IDENTITY, check_matrix, is_rotation, moved
from .cloud import PointCloud
from .light import Light
from .objects import Mesh, PointObject
from .values import Value, frozen

Content = PointObject | PointCloud | Mesh | Light


class NodeOptions(TypedDict, total=False):
    """The fields of a Node."""

    content: Content | Sequence[Content] | None
    name: str
    transform: Numbers
    children: Sequence[Node]
    visible: bool
    shadow: bool


@dataclass(frozen=True, eq=False)
class Node(Value):
    """A named place in the scene: its content and its children move with its transform.

    Parameters
    ----------
    content : PointObject, PointCloud, Mesh, Light, or a sequence of them, optional
        What is drawn here. The position and direction of a light are in node axes.
    name : str
        Its name in messages and files.
    transform : (4, 4) float
        Node-to-parent; of a point object or a cloud a rotation, a translation and one scale for all axes. The default
        is the identity.
    children : sequence of Node
        Nodes below it.
    visible : bool
        False hides the node and all below it.
    shadow : bool
        Whether its content casts shadows.

    Raises
    ------
    TypeError, ValueError
        For anything else; the message names the node.
    """

    content: Content | tuple[Content, ...] | None = None
    name: str = ""
    transform: NDArray[np.float64] = field(default_factory=lambda: IDENTITY)
    children: tuple[Node, ...] = ()
    visible: bool = True
    shadow: bool = True

    if TYPE_CHECKING:  # what may be passed is more than what is kept

        def __init__(
            self, content: Content | Sequence[Content] | None = None, name: str = ..., transform: Numbers = ...,
            children: Sequence[Node] = ..., visible: bool = ..., shadow: bool = ...,
        ) -> None: ...  # fmt: skip

    def __post_init__(self) -> None:
        if not is_a(self.name, str):
            raise TypeError(f"{self.title}: its name must be a text")
        if isinstance(self.content, list):
            object.__setattr__(self, "content", tuple(self.content))
        for item in contents_of(self):
            if not is_a(item, PointObject, PointCloud, Mesh, Light, type(None)):
                known = "a PointObject, a PointCloud, a Mesh, a Light or several"
                raise TypeError(f"{self.title}: its content must be {known}, got {shown(item)}")
        if self.transform is not IDENTITY:
            object.__setattr__(self, "transform", _check_transform(self.transform, self.title))
        if self.children != ():
            object.__setattr__(self, "children", check_nodes(self.children, f"{self.title}: its children"))
        for name in ("visible", "shadow"):
            if getattr(self, name) is not True:
                object.__setattr__(self, name, check_flag(getattr(self, name), f"{self.title}: {name}"))

    def __repr__(self) -> str:
        """`Node('vase', PointObject(...), 2 children)`."""
        content = "" if self.content is None else f", {self.content}"
        count = len(self.children)
        children = f", {count} child{'' if count == 1 else 'ren'}" if count else ""
        return f"Node({shown(self.name)}{content}{children})"

    @property
    def title(self) -> str:
        """Return what messages call the node."""
        return f"node {shown(self.name)}"


def _check_transform(transform: Numbers, where: str) -> Matrix:
    matrix = check_matrix(transform, f"{where}: its transform")
    if np.abs(matrix[3] - (0, 0, 0, 1)).max() > 1e-9:
        raise ValueError(f"{where}: the last row of its transform must be (0, 0, 0, 1), got {matrix[3].tolist()}")
    if abs(np.linalg.det(matrix[:3, :3])) < 1e-30:
        raise ValueError(f"{where}: its transform has a scale of zero")
    return frozen(matrix)


def contents_of(node: Node) -> tuple[Content, ...]:
    """Return what a node holds: nothing, one thing or several."""
    parts = node.content if isinstance(node.content, tuple) else (node.content,)
    return tuple(part for part in parts if part is not None)


def clouds_in(node: Node) -> list[PointCloud]:
    """Return the clouds that a node holds."""
    return [cloud for part in contents_of(node) if not isinstance(part, Light) for cloud in part.clouds]


def with_drawn(node: Node, change: Callable[[Any], Any]) -> dict[str, Any]:
    """Return the content of a node after a change of all but its lights, for `Scene.with_every_node`."""
    return {"content": tuple(part if isinstance(part, Light) else change(part) for part in contents_of(node))}


def check_nodes(nodes: Any, name: str) -> tuple[Node, ...]:
    """Several nodes as a tuple. Raises TypeError for anything else."""
    items = items_of(nodes)
    for item in [nodes] if items is None else items:
        if items is None or not isinstance(item, Node):
            raise TypeError(f"{name} must be Nodes in a tuple or a list, got {shown(item)}")
    return tuple(items or ())


Matrix = NDArray[np.float64]
ROUNDING = 1e-12  # a scale this near to 1 is 1
SAME_PLACE = 1e-6  # share of a frame's scale by which poses may differ that are one
Way = tuple[Any, int]  # from a root to a node: the way to its parent, None for a root, and which child it is


@dataclass(frozen=True, eq=False)
class Placed:
    """The content of a node with its place in the world."""

    content: Any
    world: Matrix  # (4, 4) node-to-world
    node: Node
    way: Way

    @cached_property
    def path(self) -> tuple[int, ...]:
        """Which child of which child the node is."""
        path: list[int] = []
        way = self.way
        while way is not None:
            way, k = way
            path.append(k)
        return tuple(path[::-1])

    @cached_property
    def axes(self) -> Matrix:
        """Return (4, 4) to the world from the axes of the content's points; those of a point object are its camera's
        axes, of several frames those of the first."""
        own = self.content.pose_in_node
        return self.world if own is None else self.world @ own

    @property
    def members(self) -> tuple[Placed, ...]:
        """Return each frame of a point object as if it was placed alone."""
        return (self,) if self.content.is_single else self._members

    @cached_property
    def _members(self) -> tuple[Placed, ...]:
        return tuple(Placed(member, self.world, self.node, self.way) for member in self.content.members)

    @cached_property
    def corners(self) -> NDArray[np.float64]:
        """(n, 3) corners of a box round the content, of each frame one, world; (0, 3) when it has no points."""
        if not self.content.is_single:
            return np.concatenate([member.corners for member in self.members])
        return moved(self.content.corners, self.axes)

    @cached_property
    def main_corners(self) -> NDArray[np.float64]:
        """The same without stray points of frames and clouds."""
        if not self.content.is_single:
            return np.concatenate([member.main_corners for member in self.members])
        return moved(self.content.main_corners, self.axes)

    @property
    def grain(self) -> float:
        """Return how wide a pixel of a frame is at its median distance, world units."""
        camera = self.content.frame.camera
        return self.content.scale * self.rigid_axes[1] / (0.5 * (abs(camera.fx) + abs(camera.fy)))

    def seen_from(self, pose: Matrix) -> Matrix:
        """Return a world pose as a rigid pose, (4, 4), in the axes of a point object's frames."""
        seen = np.linalg.inv(self.world) @ pose
        seen[:3, :3] /= np.cbrt(np.linalg.det(seen[:3, :3]))
        return seen

    def is_own_view(self, pose: Matrix) -> bool:
        """Return whether somebody at a world pose sees a frame as its own camera does."""
        return np.allclose(self.rigid_axes[0], pose, rtol=0, atol=SAME_PLACE * self.content.frame.scale)

    @cached_property
    def rigid_axes(self) -> tuple[Matrix, float]:
        """Return `axes` as rotation and translation, (4, 4), and the one scale that the node gives a point object.

        Raises ValueError for what a point object cannot have: a scale that differs by axis, a shear, a mirror.
        """
        if self.world is IDENTITY:
            return frozen(self.axes.copy()), 1.0
        linear = self.world[:3, :3]
        scale = float(np.cbrt(np.linalg.det(linear)))
        if scale <= 0 or not is_rotation(linear / scale, 0.01):
            expected = "a point object takes rotation, translation and one scale for all axes"
            raise ValueError(f"{self.node.title}: {expected}, got {np.round(linear, 4).tolist()}")
        scale = 1.0 if abs(scale - 1) < ROUNDING else scale
        rigid = self.axes.copy()
        rigid[:3, :3] /= scale
        return frozen(rigid), scale
