"""The values of scenes: what is where; what is refused, and which node the error names."""

import math

import numpy as np
import pytest

import pointshade_gl as ps

from ..support.frames import single_pixel, sphere

SQUARE = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], np.float32)
FACES = np.array([(0, 1, 2), (0, 2, 3)])
MESH = ps.Mesh(SQUARE, FACES)
LIGHT = ps.Light(direction=(0, 0, -1))


def moved(x, y, z):
    matrix = np.eye(4)
    matrix[:3, 3] = x, y, z
    return matrix


def scaled(*factors):
    return np.diag([*factors, 1.0])


def test_a_child_moves_with_its_parents():
    turn = np.array([(0, -1, 0, 0), (1, 0, 0, 0), (0, 0, 1, 0), (0, 0, 0, 1.0)])
    leaf = ps.Node(MESH, "leaf", moved(1, 0, 0))
    scene = ps.Scene((ps.Node(None, "root", moved(0, 0, 5), (ps.Node(LIGHT, "middle", turn, (leaf,)),)),))
    middle, below = scene.placed()
    assert (middle.content, middle.path, below.content, below.path) == (LIGHT, (0, 0), MESH, (0, 0, 0))
    np.testing.assert_allclose(below.world @ (0, 0, 0, 1), (0, 1, 5, 1), atol=1e-12)


def test_content_comes_in_the_order_of_the_nodes_and_all_of_a_node():
    first = ps.Node((MESH, LIGHT), "first", children=(ps.Node(LIGHT, "below"),))
    scene = ps.Scene((first, ps.Node(MESH, "second"), ps.Node(None, "empty")))
    assert [(type(p.content).__name__, p.node.name) for p in scene.placed()] == [
        ("Mesh", "first"), ("Light", "first"), ("Light", "below"), ("Mesh", "second"),
    ]  # fmt: skip


def test_what_is_hidden_hides_all_below_it():
    hidden = ps.Node(MESH, "hidden", children=(ps.Node(MESH, "below"),), visible=False)
    scene = ps.Scene((hidden, ps.Node(MESH, "shown")))
    assert [p.node.name for p in scene.placed()] == ["shown"]
    assert [p.node.name for p in scene.with_node((0,), visible=True).placed()] == ["hidden", "below", "shown"]


def test_one_node_may_stand_below_several_parents():
    leaf = ps.Node(MESH, "leaf")
    scene = ps.Scene((ps.Node(None, "a", moved(1, 0, 0), (leaf,)), ps.Node(None, "b", moved(2, 0, 0), (leaf,))))
    assert [p.world[0, 3] for p in scene.placed()] == [1, 2]


def test_a_node_below_itself_is_named():
    node = ps.Node(None, "loop")
    object.__setattr__(node, "children", (ps.Node(None, "between", children=(node,)),))
    with pytest.raises(ValueError, match="node 'loop' is below itself"):
        ps.Scene((node,))


def test_with_node_changes_one_node_and_nothing_else():
    leaf, other = ps.Node(MESH, "leaf"), ps.Node(LIGHT, "other")
    scene = ps.Scene((ps.Node(None, "root", children=(other, leaf)),), ps.Camera(50, 50, 1, 1, 4, 3))
    changed = scene.with_node((0, 1), transform=moved(0, 0, 1), shadow=False)
    new = changed.nodes[0].children[1]
    np.testing.assert_array_equal(new.transform, moved(0, 0, 1))
    assert (new.name, new.content, new.shadow) == ("leaf", MESH, False)
    assert changed.nodes[0].children[0] is other and changed.camera == scene.camera
    assert scene.nodes[0].children[1] is leaf and leaf.shadow


def test_with_every_node_changes_them_all_and_shared_ones_once():
    leaf = ps.Node(MESH, "leaf")
    scene = ps.Scene((ps.Node(None, "a", children=(leaf, leaf)), ps.Node(None, "b", children=(leaf,))))
    seen = []

    def changes(node):
        seen.append(node.name)
        return {"name": node.name.upper()}

    changed = scene.with_every_node(changes)
    assert [(path, node.name) for path, node in changed.every_node()] == [
        ((0,), "A"), ((0, 0), "LEAF"), ((0, 1), "LEAF"), ((1,), "B"), ((1, 0), "LEAF")
    ]  # fmt: skip
    assert changed.nodes[0].children[0] is changed.nodes[1].children[0] and sorted(seen) == ["a", "b", "leaf"]
    assert leaf.name == "leaf"


def test_scenes_deeper_than_pythons_stack_are_walked_and_changed():
    node = ps.Node(MESH, "last")
    for _ in range(5000):
        node = ps.Node(None, "", children=(node,))
    scene = ps.Scene((node,))
    (placed,) = scene.placed()
    assert placed.path == (0,) * 5001 == list(scene.every_node())[-1][0]
    assert list(scene.with_node(placed.path, name="new").every_node())[-1][1].name == "new"
    assert not list(scene.with_every_node(lambda node: {"visible": False}).placed())


@pytest.mark.parametrize(
    ("transform", "complaint"),
    [
        (np.eye(3), r"shape \(4, 4\), got \(3, 3\)"),
        (np.full((4, 4), math.nan), "NaN or infinite"),
        (scaled(1, 0, 1), "a scale of zero"),
        (np.diag([1, 1, 1, 2.0]), "last row"),
    ],
)
def test_an_impossible_transform_names_its_node(transform, complaint):
    with pytest.raises(ValueError, match=f"node 'tilted': .*{complaint}"):
        ps.Node(MESH, "tilted", transform)


def test_the_callers_arrays_may_change_afterwards_and_the_scenes_may_not():
    transform = np.eye(4)
    node = ps.Node(None, "", transform)
    transform[0, 3] = 7
    assert node.transform[0, 3] == 0
    with pytest.raises(ValueError, match="read-only"):
        node.transform[0, 3] = 1


@pytest.mark.parametrize(
    ("values", "complaint"),
    [
        ({"positions": SQUARE[:, :2]}, r"positions must have shape \(n, 3\)"),
        ({"positions": np.full((4, 3), math.inf)}, "positions must be finite"),
        ({"faces": FACES.ravel()}, r"faces must have shape \(m, 3\)"),
        ({"faces": FACES.astype(float)}, "whole numbers"),
        ({"faces": FACES + 1}, "one of the 4 positions, got 1 to 4"),
        ({"faces": FACES - 1}, "got -1 to 2"),
        ({"normals": SQUARE[:3]}, r"normals must have shape \(4, 3\)"),
        ({"uv": SQUARE}, r"uv must have shape \(4, 2\)"),
        ({"texture": np.zeros((2, 2, 3), np.uint8)}, "needs uv"),
        ({"texture": np.zeros((2, 2), np.uint8), "uv": SQUARE[:, :2]}, "texture must be"),
        ({"shading": "toon"}, "unknown shading"),
    ],
)
def test_impossible_meshes_are_refused_in_words(values, complaint):
    with pytest.raises(ValueError, match=complaint):
        ps.Mesh(**{"positions": SQUARE, "faces": FACES} | values)


@pytest.mark.parametrize(
    "values",
    [{"shading": "toon"}, {"splat": "square"}, {"normals": "none"}, {"point_size": -1}, {"normals": np.ones((2, 3))}],
)
def test_impossible_point_objects_are_refused(values):
    with pytest.raises(ValueError, match=next(iter(values))):
        ps.PointObject(single_pixel(), **values)


def test_a_scene_without_anything_is_a_scene():
    assert list(ps.Scene().placed()) == []


@pytest.mark.parametrize("depth", [10, 300, 3000, 0.01])
def test_one_stray_pixel_moves_no_bounds(depth):
    frame = sphere()
    stray = frame.depth.copy()
    stray[60, 80] = depth
    plain, spoilt = (
        ps.Scene((ps.Node(ps.PointObject(ps.Frame(None, d, frame.camera))),)).bounds for d in (frame.depth, stray)
    )
    np.testing.assert_allclose(spoilt[0], plain[0], atol=1e-3)
    assert spoilt[1] == pytest.approx(plain[1], rel=1e-3)


def test_bounds_hold_all_points_where_none_is_stray():
    frame = sphere()
    np.testing.assert_array_equal(frame.main_corners, frame.corners)
    slanted = ps.Frame(None, np.linspace(1, 9, 160 * 120).reshape(120, 160), frame.camera)
    np.testing.assert_array_equal(slanted.main_corners, slanted.corners)
