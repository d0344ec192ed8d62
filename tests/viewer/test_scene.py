"""A scene in the window: the mouse takes its lights in turn, keys switch its shadows and nodes."""

import numpy as np
import pytest

import pointshade_gl as ps

from ..support import frames
from ..support.viewing import move, press, quiet, shown

FLOOR = ps.Mesh(
    [(-1, 0.5, 0.5), (1, 0.5, 0.5), (1, 0.5, 2.5), (-1, 0.5, 2.5)], [(0, 2, 1), (0, 3, 2)], [(0, -1, 0)] * 4
)
BEHIND = ps.Light(direction=(0, 0.3, 1), color=(0.2, 0.4, 1), shadow=True)
ABOVE = ps.Light(position=(0, -1, 1), direction=(0, 1, 0), cone=(20, 40), color=(1, 0.8, 0.5), shadow=True)


@pytest.fixture
def viewer(open_viewer):
    ball = ps.Node(ps.PointObject(frames.sphere()), "ball", children=(ps.Node(name="empty"),))
    nodes = (ball, ps.Node(FLOOR, "floor"), ps.Node(ABOVE, "lamp"), ps.Node(BEHIND, "sun"))
    return open_viewer(ps.Scene(nodes, camera=frames.CAMERA))


def test_the_first_light_follows_the_mouse_and_keeps_its_kind(viewer):
    assert viewer.held.is_spot and viewer.lights == (BEHIND,)
    before = shown(quiet(viewer))
    move(viewer, (160, 120), (250, 40))
    assert (shown(quiet(viewer)) != before).any()
    held = viewer.state.light(viewer.stage, viewer.pose, viewer.held)
    assert held.is_spot and held.cone == ABOVE.cone and held.shadow
    to_middle = np.array([0, 0, viewer.stage.pivot[2]]) - held.position
    assert np.dot(to_middle, held.direction) / np.linalg.norm(to_middle) == pytest.approx(1, abs=1e-3)


def test_tab_holds_the_next_light_and_leaves_the_last_where_it_is(viewer):
    move(viewer, (160, 120), (250, 40))
    left = viewer.state.light(viewer.stage, viewer.pose, viewer.held)
    before = shown(quiet(viewer)).astype(int)
    press(viewer, "TAB")
    assert viewer.held == BEHIND and viewer.lights == (left,)
    held = viewer.state.light(viewer.stage, viewer.pose, viewer.held)
    assert held.direction == pytest.approx(np.array(BEHIND.direction) / np.linalg.norm(BEHIND.direction), abs=1e-6)
    assert np.abs(shown(quiet(viewer)) - before)[30:].mean() < 1  # the marker has moved, the light has not
    press(viewer, "TAB")
    assert viewer.held == left and len(viewer.lights) == 1


def test_s_turns_all_shadows_off_and_on(viewer):
    assert viewer.state.shadows
    shaded = shown(quiet(viewer)).astype(int)
    press(viewer, "S")
    bright = shown(quiet(viewer)).astype(int)
    assert (bright.sum(-1) >= shaded.sum(-1) - 6).mean() > 0.99 and (bright > shaded + 10).any()


def test_a_node_is_hidden_and_shown_without_anything_being_uploaded_again(viewer):
    full = shown(quiet(viewer))
    scene, uploads = viewer.frame, viewer.renderer.steps.counts["upload"]
    (path,) = [path for path, node in scene.every_node() if node.name == "floor"]
    viewer.frame = scene.with_node(path, visible=False)
    assert (shown(quiet(viewer)) != full).any()
    viewer.frame = scene
    assert (shown(quiet(viewer)) == full).all()
    assert viewer.renderer.steps.counts["upload"] == uploads


def test_the_panel_lists_the_nodes(open_viewer, viewer):
    pytest.importorskip("imgui_bundle")
    press(viewer, "G")
    for _ in range(4):
        viewer.step(wait=False)
    assert viewer.state.panel and viewer.drawn > 0


def test_keys_for_shading_show_everything_in_one_model_and_phong_leaves_each_its_own(viewer):
    own = shown(quiet(viewer))
    for name in "123":
        press(viewer, name)
        assert (shown(quiet(viewer)) != own).any()
    press(viewer, "4")
    assert (shown(quiet(viewer)) == own).all()
    press(viewer, "B")
    assert (shown(quiet(viewer)) != own).any()
