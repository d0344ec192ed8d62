"""The scene graph: nodes with point objects, clouds, meshes and lights, as immutable values without GL."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING, Any, cast

import numpy as np
from numpy.typing import NDArray

from ..checks.arguments import check_color, check_type
from ..checks.foreign_arrays import Numbers
from ..notes.notes import Note, note_new_name, print_note
from ..notes.words import counted, option
from .appearance import Appearance
from .camera import IDENTITY, Camera, check_pose, orbit_pose
from .cloud import USUAL_FRONT, CloudStyle, PointCloud, Up, direction_of
from .environment import Environment, EnvironmentName, check_environment
from .frame import Frame, Preview
from .light import Light, transformed
from .node import Matrix, Node, NodeOptions, Placed, Way, check_nodes, contents_of, with_drawn
from .objects import Mesh, PointObject
from .shadow_cameras import Extent
from .values import Value, frozen, sphere_round

if TYPE_CHECKING:
    from typing_extensions import Unpack

FOV = 45.0  # degrees from top to bottom, of a scene without a camera


@dataclass(frozen=True, eq=False)
class Scene(Value, Preview):
    """A scene: nodes with their content, a camera, and light that belongs to no node.

    Parameters
    ----------
    nodes : sequence of Node
        Nodes at the top; the others are their children.
    camera : Camera, optional
        Camera unless `render` is given another; None is one that sees everything, turned like the pose.
    pose : (4, 4) float, optional
        Camera-to-world pose of that camera; None is the identity.
    ambient : (3,) float
        Linear RGB light from everywhere, where there is no environment.
    environment : Environment, optional
        Light from all around, unless `render` is given another; or "sky", "studio", or a picture that it takes.

    Raises
    ------
    TypeError
        For values of another kind.
    ValueError
        For impossible values, and for a node that is below itself.
    """

    nodes: tuple[Node, ...] = ()
    camera: Camera | None = None
    pose: NDArray[np.float64] = field(default_factory=lambda: check_pose(None))
    ambient: tuple[float, float, float] = (1.0, 1.0, 1.0)
    environment: Environment | None = None

    if TYPE_CHECKING:  # what may be passed is more than what is kept

        def __init__(
            self, nodes: Sequence[Node] = ..., camera: Camera | None = None, pose: Numbers | None = None,
            ambient: Numbers = ..., environment: Environment | Numbers | EnvironmentName | None = None,
        ) -> None: ...  # fmt: skip

    def __post_init__(self) -> None:
        object.__setattr__(self, "nodes", check_nodes(self.nodes, "scene nodes"))
        object.__setattr__(self, "pose", check_pose(self.pose, "scene pose"))
        if self.ambient is not Scene.ambient:
            object.__setattr__(self, "ambient", check_color(self.ambient, "scene ambient"))
        object.__setattr__(self, "environment", check_environment(self.environment))
        if self.camera is not None:
            check_type(self.camera, Camera, "scene camera")
        self._placed  # noqa: B018 - names the node that lies below itself

    def __repr__(self) -> str:
        """`Scene(4 nodes: 93 207 points in 1 frame, 12 triangles in 1 mesh, 2 lights)`: what is visible."""
        contents = [p.content for p in self.instances]
        sizes = (
            ([frame.points_known for one in contents for frame in one.frames], "point", "frame"),
            ([cloud.points_known for one in contents for cloud in one.clouds], "point", "cloud"),
            ([len(one.faces) for one in contents if not (one.frames or one.clouds)], "triangle", "mesh"),
        )
        found = [f"{counted(sum(some), of)} in {counted(len(some), kind)}" for some, of, kind in sizes if some]
        parts = ", ".join(found + [counted(len(self.lights), "light")] * bool(self.lights))
        return f"Scene({counted(sum(1 for _ in self.every_node()), 'node')}{parts and f': {parts}'})"

    def placed(self) -> Iterator[Placed]:
        """Yield all visible content with its place in the world, in the order of the nodes."""
        return iter(self._placed)

    @cached_property
    def _placed(self) -> tuple[Placed, ...]:
        """Raises ValueError for a node that is below itself."""
        found: list[Placed] = []
        above: set[int] = set()  # ids of the nodes on the way down
        stack: list[tuple[Node, Matrix | None, Way]] = []  # without a matrix: the way up, past the node
        stack.extend((node, IDENTITY, (None, k)) for k, node in reversed(list(enumerate(self.nodes))))
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
            world = parent @ node.transform if node.transform is not IDENTITY else parent
            found.extend(Placed(content, world, node, way) for content in contents_of(node))
            stack.extend((child, world, (way, k)) for k, child in reversed(list(enumerate(node.children))))
        return tuple(found)

    @cached_property
    def instances(self) -> tuple[Placed, ...]:
        """Return all visible content except lights."""
        return tuple(p for p in self._placed if not isinstance(p.content, Light))

    @property
    def things(self) -> tuple[Placed, ...]:
        """Older name of `instances`."""
        note_new_name("Scene.things", "Scene.instances")
        return self.instances

    @cached_property
    def bounds(self) -> tuple[NDArray[np.float64], float]:
        """Return the centre and the radius of a sphere around all content but stray points.

        The centre has shape (3,), world; the radius is 1 without any content.
        """
        centre, radius = sphere_round(self._main_corners)
        return frozen(centre), radius

    @cached_property
    def extent(self) -> Extent:
        """Return where all content but stray points lies, for the shadow views of lights."""
        members = (m for p in self.instances if p.content.frames for m in p.members)
        grain = max((m.grain for m in members), default=0.0)
        return Extent(self._main_corners if len(self._main_corners) else np.zeros((1, 3)), *self.bounds, grain)

    @cached_property
    def boxes(self) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
        """Return the corners of boxes around all content, (n, 3) world, and how many are each thing's."""
        corners = [p.corners for p in self.instances]
        return np.concatenate([np.zeros((0, 3)), *corners]), np.array([len(some) for some in corners], np.int64)

    @cached_property
    def _main_corners(self) -> NDArray[np.float64]:
        return np.concatenate([np.zeros((0, 3)), *(p.main_corners for p in self.instances)])

    @property
    def frames(self) -> tuple[()]:
        """Return no frames: those of a scene belong to its objects."""
        return ()

    @property
    def picture_camera(self) -> Camera | None:
        """Return the default camera for rendering, as of a frame: the scene's own."""
        return self.camera

    def framed(self) -> Scene:
        """Return the scene with a camera: its own, or one that sees everything, turned like its pose."""
        return self._framed if self.camera is None else self

    @cached_property
    def _framed(self) -> Scene:
        """The same object again: the pipeline sees that nothing has changed."""
        centre, radius = self.bounds
        pose = np.array(self.pose)
        # a twentieth farther than where the sphere around all touches the upper and lower edge
        pose[:3, 3] = centre - pose[:3, 2] * 1.05 * radius / math.sin(math.radians(FOV / 2))
        return replace(self, camera=Camera.from_fov(FOV, 640, 480), pose=pose)

    @property
    def points_known(self) -> int:
        """Return the number of points in the visible frames and clouds."""
        contents = (p.content for p in self.instances)
        return sum(part.points_known for one in contents for part in (*one.frames, *one.clouds))

    @property
    def pivot(self) -> NDArray[np.float64]:
        """Return the middle of all that is visible, (3,) world; of frames alone what they are known to turn about."""
        alone = self.instances[0] if len(self.instances) == 1 else None
        if alone is not None and alone.content.frames and alone.content.frame.about is not None:
            pose, scale = alone.rigid_axes
            return frozen(pose[:3, :3] @ (scale * np.array(alone.content.frame.about)) + pose[:3, 3])
        return self.bounds[0]

    @property
    def scale(self) -> float:
        """Return the distance by which the middle lies ahead of the camera; 1 if it does not."""
        ahead = float(self.pose[:3, 2] @ (self.pivot - self.pose[:3, 3]))
        return ahead if ahead > 0 else 1.0

    @property
    def upright(self) -> NDArray[np.float64]:
        """Return the axis that yaw turns about, (3,).

        It is the up of a cloud, or the world's y, as in glTF, or the camera's own y if that leans over 60 degrees.
        """
        for placed in self.instances:
            if placed.content.up_direction is not None:
                return placed.rigid_axes[0][:3, :3] @ placed.content.up_direction
        own = self.pose[:3, 1]
        return np.array([0.0, 1.0, 0.0]) if abs(own[1]) > 0.5 else own

    @cached_property
    def lights(self) -> tuple[Light, ...]:
        """Return the lights of the visible nodes, in world axes."""
        return tuple(transformed(p.content, p.world) for p in self._placed if isinstance(p.content, Light))

    @property
    def light_names(self) -> list[str]:
        """Return the names of the nodes of `lights`, in the same order."""
        return [p.node.name for p in self.placed() if isinstance(p.content, Light)]

    def every_node(self) -> Iterator[tuple[tuple[int, ...], Node]]:
        """Yield all nodes, hidden ones too, parents before children.

        Yields
        ------
        path : tuple of int
            Which child of which child: (2, 0) is the first child of the third node.
        node : Node
        """
        path: list[int] = []
        stack = [(0, k, node) for k, node in reversed(list(enumerate(self.nodes)))]
        while stack:
            depth, k, node = stack.pop()
            path[depth:] = [k]
            yield tuple(path), node
            stack.extend((depth + 1, k, child) for k, child in reversed(list(enumerate(node.children))))

    def with_node(self, path: tuple[int, ...], **changes: Unpack[NodeOptions]) -> Scene:
        """Return the scene with one node changed.

        Parameters
        ----------
        path : tuple of int
            Which child of which child, as in `every_node`.
        **changes
            New values of its fields, such as `visible=False` or `transform=...`.

        Raises
        ------
        ValueError
            If there is no such node.
        """
        levels = [self.nodes]
        for k in path:
            if not 0 <= k < len(levels[-1]):
                break
            levels.append(levels[-1][k].children)
        if not 0 < len(path) < len(levels):
            raise ValueError(f"the scene has no node at the path {path}")
        below = self.nodes
        for nodes, k in zip(levels[-2::-1], path[::-1], strict=True):
            below = (*nodes[:k], replace(nodes[k], **changes), *nodes[k + 1 :])
            changes = {"children": below}
        return replace(self, nodes=below)

    def with_every_node(self, changes: Callable[[Node], dict[str, Any]]) -> Scene:
        """Return the scene with all nodes changed.

        Parameters
        ----------
        changes : callable
            Given a node, returns the new values of its fields by name.
        """
        made: dict[int, Node] = {}
        for node in reversed([node for _, node in self.every_node()]):  # children before their parents
            if id(node) not in made:
                children = tuple(made[id(child)] for child in node.children)
                made[id(node)] = replace(node, children=children, **changes(node))
        return replace(self, nodes=tuple(made[id(node)] for node in self.nodes))


@lru_cache(maxsize=4)
def shaded(scene: Scene, shading: str | None) -> Scene:
    """Return the scene with one shading model for all objects; None leaves each object its own."""
    if shading is None:
        return scene
    return scene.with_every_node(lambda node: with_drawn(node, lambda part: part._shaded(shading)))


def lit_where_asked(scene: Scene) -> Scene:
    """Return the scene with light on clouds that show their own colours until it is asked for; itself without any."""
    if all(cloud.shading != "auto" for p in scene.instances for cloud in p.content.clouds):
        return scene
    kept = vars(scene)  # and not in a cache, which would keep the scene
    if "lit" not in kept:
        kept["lit"] = scene.with_every_node(lambda node: with_drawn(node, lit_if_asked))
    return kept["lit"]


def lit_if_asked(part: Any) -> Any:
    """Return what a node holds; such a cloud is lit."""
    return part.styled(shading="phong") if part.clouds and part.shading == "auto" else part


@lru_cache(maxsize=4)
def without_environment(scene: Scene) -> Scene:
    """Return the scene without light from all around but the ambient light."""
    return replace(scene, environment=None)


MARGIN = 1.08  # share of the distance from which the cloud fills the picture
ASIDE, ABOVE = 30.0, 25.0  # degrees from which a cloud is seen that no camera took


def scene_of(*clouds: PointCloud, names: Sequence[str] = ()) -> Scene:
    """Return the scene of clouds that lie in one world, upright as the first of them is.

    One that has a front, or y down (as a camera's), is seen from the front, others from above. names: of their nodes.
    """
    camera, pose = Camera.from_fov(FOV, 640, 480), _facing(clouds[0].up, clouds[0].front)
    if some := [cloud for cloud in clouds if len(cloud)]:
        corners = np.concatenate([cloud.main_corners for cloud in some])
        middle = (corners.min(0) + corners.max(0)) / 2
        away = max(_away(cloud, camera, pose[:3, :3], middle) for cloud in some)
        pose[:3, 3] += middle - pose[:3, 2] * max(MARGIN * away, 1e-6)  # where it sees all of them
    names = names or [""] * len(clouds)
    return Scene(tuple(Node(cloud, name=name) for cloud, name in zip(clouds, names, strict=True)), camera, pose)


def beside(
    sources: Sequence[Frame | PointObject | PointCloud | Scene], names: Sequence[str] = (), note: Note = print_note
) -> Scene:
    """Return the scene of clouds, meshes, scenes and frames, each at its own coordinates, seen upright as the first.

    names  of their nodes. note  is called with one sentence where they do not agree about what is up.
    """
    names, nodes, axes = names or [""] * len(sources), list[Node](), list[tuple[Up, Up | None]]()
    for source, name in zip(sources, names, strict=True):
        if isinstance(source, Scene):
            nodes.append(Node(name=name, children=source.nodes))
            ups = (one.content.up for one in source.instances if isinstance(one.content, Mesh))
            axes.append((cast("Up", next(filter(None, ups), "y")), None))  # y of glTF
        else:
            nodes.append(Node(PointObject(source) if isinstance(source, Frame) else source, name=name))
            is_cloud = isinstance(source, PointCloud)
            axes.append((source.up, source.front) if is_cloud else ("-y", "-z"))
    if len({up for up, _ in axes}) > 1:
        each = ", ".join(f"{name or 'one'} {up}" for name, (up, _) in zip(names, axes, strict=True))
        note(f"each lies at its own coordinates, and what points up is not the same in all of them: {each}")
    scenes = [one for one in sources if isinstance(one, Scene)]
    environment = next((one.environment for one in scenes if one.environment is not None), None)
    return seen_upright(Scene(tuple(nodes), environment=environment), *axes[0])


def dressed(scene: Scene, given: dict[str, Any]) -> Scene:
    """Return the scene of a mesh with a material and a shading. Raises ValueError for other options of a look."""
    if others := [option(name) for name in given if name not in ("material", "shading")]:
        raise ValueError(f"{', '.join(others)} is no option of a mesh: leave it out")
    return scene.with_every_node(lambda node: with_drawn(node, lambda part: replace(part, **given))) if given else scene


def styled(cloud: PointCloud, given: dict[str, Any]) -> PointCloud:
    """Return a cloud with options of `render`, those that were given. Raises ValueError for those that it has not."""
    check_of_clouds(given)
    return cloud.styled(**given) if given else cloud


def given_by(look: Appearance, plain: Appearance | None = None) -> dict[str, Any]:
    """Return the options of a look that are others than those of a plain one, by name."""
    plain = plain or Appearance()
    return {name: one for name, one in look.options.items() if np.ndim(one) or one != getattr(plain, name)}


def is_of_clouds(name: str) -> bool:
    """Return whether clouds have this option of a look."""
    return name in CloudStyle.__annotations__


def check_of_clouds(given: Iterable[str]) -> None:
    """Raises ValueError for options of a look that clouds have not."""
    if others := [option(name) for name in given if not is_of_clouds(name)]:
        are, them = ("is", "it") if len(others) == 1 else ("are", "them")
        raise ValueError(f"{', '.join(others)} {are} for frames, and this is a point cloud: leave {them} out")


def _away(cloud: PointCloud, camera: Camera, turn: NDArray[np.float64], middle: NDArray[np.float64]) -> float:
    """Return how far before the middle one sees all of a cloud but stray points."""
    x, y, z = ((cloud.main_points + (cloud.origin - middle)) @ turn).T
    reach = cloud.reach(1 - cloud.stray)
    half = (camera.width - 1) / 2 / camera.fx, (camera.height - 1) / 2 / camera.fy  # of the picture, at depth 1
    across = [(np.abs(one) + reach * math.hypot(1, side)) / side for one, side in zip((x, y), half, strict=True)]
    return float(np.quantile(np.maximum(*across) - z, 1 - cloud.stray))


def seen_upright(scene: Scene, up: Up, front: Up | None = None) -> Scene:
    """Return the scene with a camera that sees all of it upright, from the front or from above."""
    camera, pose = Camera.from_fov(FOV, 640, 480), _facing(up, front)
    corners = np.concatenate([np.zeros((0, 3)), *(one.main_corners for one in scene.instances)])
    if len(corners):
        middle = (corners.min(0) + corners.max(0)) / 2
        x, y, z = ((corners - middle) @ pose[:3, :3]).T
        sides = np.abs(x) * 2 * camera.fx / camera.width, np.abs(y) * 2 * camera.fy / camera.height
        away = float((np.maximum(*sides) - z).max())
        pose[:3, 3] += middle - pose[:3, 2] * max(MARGIN * away, 1e-6)
    return replace(scene, camera=camera, pose=pose)


def _facing(up: Up, front: Up | None) -> NDArray[np.float64]:
    """Return the pose of a camera at the world's origin that sees what has these axes upright."""
    ahead, down = -direction_of(front or USUAL_FRONT[up]), -direction_of(up)
    pose = np.eye(4)
    pose[:3, :3] = np.stack([np.cross(down, ahead), down, ahead], -1)
    return pose if front or up == "-y" else orbit_pose(pose, (0, 0, 0), ASIDE, ABOVE)
