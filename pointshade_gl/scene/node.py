"""A node of the scene graph: a transform with content and child nodes that move with it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, TypedDict

import numpy as np
from numpy.typing import NDArray

from ..checks.arguments import check_flag, is_a, items_of
from ..checks.foreign_arrays import Numbers
from ..notes.words import shown
from .light import Light
from .mesh import Mesh
from .point_cloud import PointCloud
from .point_object import PointObject
from .rotation import check_matrix
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
    transform: NDArray[np.float64] = field(default_factory=lambda: np.eye(4))
    children: tuple[Node, ...] = ()
    visible: bool = True
    shadow: bool = True

    if TYPE_CHECKING:  # what may be passed is more than what is kept

        def __init__(
            self,
            content: Content | Sequence[Content] | None = None,
            name: str = ...,
            transform: Numbers = ...,
            children: Sequence[Node] = ...,
            visible: bool = ...,
            shadow: bool = ...,
        ) -> None: ...

    def __post_init__(self) -> None:
        where = self.title
        if not is_a(self.name, str):
            raise TypeError(f"{where}: its name must be a text")
        if isinstance(self.content, list):
            object.__setattr__(self, "content", tuple(self.content))
        for item in self.content if isinstance(self.content, tuple) else (self.content,):
            if not is_a(item, PointObject, PointCloud, Mesh, Light, type(None)):
                got = shown(item)
                known = "a PointObject, a PointCloud, a Mesh, a Light or several"
                raise TypeError(f"{where}: its content must be {known}, got {got}")
        matrix = check_matrix(self.transform, f"{where}: its transform")
        if np.abs(matrix[3] - (0, 0, 0, 1)).max() > 1e-9:
            raise ValueError(
                f"{self.title}: the last row of its transform must be (0, 0, 0, 1), got {matrix[3].tolist()}"
            )
        if abs(np.linalg.det(matrix[:3, :3])) < 1e-30:
            raise ValueError(f"{self.title}: its transform has a scale of zero")
        object.__setattr__(self, "transform", frozen(matrix))
        object.__setattr__(self, "children", check_nodes(self.children, f"{where}: its children"))
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
        """Return what messages call the node."""
        return f"node {shown(self.name)}"


def check_nodes(nodes: Any, name: str) -> tuple[Node, ...]:
    """Several nodes as a tuple. Raises TypeError for anything else."""
    items = items_of(nodes)
    for item in [nodes] if items is None else items:
        if items is None or not isinstance(item, Node):
            raise TypeError(f"{name} must be Nodes in a tuple or a list, got {shown(item)}")
    return tuple(items or ())
