"""What the window shows in place of light, and the values under the mouse."""

import numpy as np
import pytest

import pointshade_gl as ps
from pointshade_gl.files.depth.depth_files import ramp
from pointshade_gl.files.pictures.picture_files import normals_to_rgb
from pointshade_gl.scene.orbit import State
from pointshade_gl.scene.values import BLUE
from pointshade_gl.viewer.overlay import NOTHING, values_of

from ..support import frames
from ..support.viewing import move, press, quiet, shown
from .test_history import SCENE

LOW = 60  # rows of the lower edge, in which values and colours are told


def seen(viewer):
    """The picture without text."""
    return shown(quiet(viewer))[:-LOW].astype(int)


def told(viewer):
    """The values that are shown."""
    pointer = viewer._overlay.pointer
    found = viewer.renderer.read_surface(*pointer, viewer.camera, viewer.picture.pose)
    return " ".join(values_of(viewer.picture, *pointer, found))


class TestModes:
    def test_v_goes_through_all_of_them_and_shift_v_back(self, open_viewer):
        viewer = open_viewer()
        pictures, shows = [seen(viewer)], []
        for name in ("V", "V", "V", "V", "V"):
            press(viewer, name)
            shows.append((viewer.state.lit, viewer.state.finish.show))
            pictures.append(seen(viewer))
        assert shows == [(True, "normals"), (True, "depth"), (True, "certainty"), (False, "light"), (True, "light")]
        assert (pictures[0] == pictures[5]).all()
        assert all((a != b).any() for k, a in enumerate(pictures[:5]) for b in pictures[:k])
        for expected in reversed(pictures[:5]):
            press(viewer, "SHIFT+V")
            assert (seen(viewer) == expected).all()

    def test_normals_have_the_colours_of_a_normal_map(self, open_viewer):
        viewer = open_viewer(window_size=(frames.CAMERA.width, frames.CAMERA.height))
        press(viewer, "V")
        expected = normals_to_rgb(ps.estimate_normals(viewer.frame))[:-LOW]
        known = expected[..., 3] > 0
        assert np.abs(seen(viewer) - expected[..., :3])[known].max() <= 1

    def test_depth_is_blue_where_it_is_near_and_red_where_it_is_far(self, open_viewer):
        viewer = open_viewer(frames.sphere_before_wall(), window_size=(frames.CAMERA.width, frames.CAMERA.height))
        press(viewer, "V", "V")
        picture, depth, scale = seen(viewer), viewer.frame.depth, viewer.renderer.color_scale
        assert (scale.low, scale.high) == pytest.approx(np.quantile(depth[depth > 0], (0.02, 0.98)), rel=0.01)
        share = np.clip((1 / scale.low - 1 / depth) / (1 / scale.low - 1 / scale.high), 0, 1)
        expected = ramp("turbo")[np.rint(255 * (BLUE + (1 - BLUE) * share)).astype(int)][:-LOW]
        assert np.abs(picture - expected).max() < 35 and np.abs(picture - expected).mean() < 6  # a polynomial

    def test_the_light_follows_the_mouse_without_another_picture(self, open_viewer):
        viewer = open_viewer()
        press(viewer, "V", "V", "D")
        quiet(viewer).step(wait=False)
        drawn, light = viewer.drawn, viewer.state.light_at
        move(viewer, (50, 50), (200, 200))
        viewer.step(wait=False)
        assert viewer.drawn == drawn and viewer.state.light_at != light

    def test_undo_and_reset_bring_light_back(self, open_viewer):
        viewer = open_viewer()
        press(viewer, "V", "V", "CTRL+Z")
        assert viewer.state.finish.show == "normals"
        press(viewer, "R")
        assert viewer.state.is_lit

    @pytest.mark.parametrize("name", ["B", "4"])
    def test_what_chooses_light_shows_it(self, open_viewer, name):
        viewer = open_viewer()
        before = seen(viewer)
        press(viewer, "V", name)
        assert viewer.state.is_lit and (seen(viewer) == before).all()

    @pytest.mark.parametrize("shading", ["none", "flat", "gouraud"])
    def test_the_shading_of_the_light_does_not_change_them(self, open_viewer, shading):
        viewer, plain = open_viewer(state=State(look=ps.Appearance(shading=shading))), open_viewer()
        for one in (viewer, plain):
            press(one, "V")
        assert (seen(viewer) == seen(plain)).all()

    def test_scenes_show_them_too_and_keep_their_own_light(self, open_viewer):
        viewer = open_viewer(SCENE)
        before = seen(viewer)
        for _ in range(3):
            press(viewer, "V")
            assert (seen(viewer) != before).any(-1).mean() > 0.1
        press(viewer, "V", "V")
        assert (seen(viewer) == before).all()


class TestValues:
    def test_they_are_those_of_the_surface_under_the_mouse(self, open_viewer):
        viewer = open_viewer(frames.sphere_before_wall())
        press(viewer, "V")
        move(viewer, (10, 10), (20, 30))
        viewer.step(wait=False)
        frame, camera = viewer.frame, viewer.camera
        u, v = (
            int(n) for n in np.rint(frame.camera.project(camera.unproject(np.float64(1.0), np.array([20.0, 30.0]))))
        )
        depth = float(frame.depth[v, u])
        x, y, _ = frame.camera.unproject(np.float64(depth), np.array([u, v], float))
        assert f"depth {depth:.3f} m" in told(viewer) and f"pixel {u}, {v}" in told(viewer)
        words = told(viewer).split()
        pixel = depth / frame.camera.fx
        assert float(words[1]) == pytest.approx(x, abs=pixel) and float(words[3]) == pytest.approx(y, abs=pixel)
        normal = [float(words[words.index("normal") + k]) for k in (1, 2, 3)]
        assert normal == pytest.approx(ps.estimate_normals(frame)[v, u], abs=0.02)

    def test_after_a_turn_they_are_still_those_of_the_world(self, open_viewer):
        viewer = open_viewer(frames.tilted_plane())
        press(viewer, "V", "KP6")
        move(viewer, (150, 110), (160, 120))
        viewer.step(wait=False)
        words = told(viewer).split()
        point = np.array([float(words[k]) for k in (1, 3, 5)])
        frame = viewer.frame
        u, v = (int(n) for n in np.rint(frame.camera.project(point)))
        assert point == pytest.approx(
            frame.camera.unproject(np.float64(frame.depth[v, u]), np.array([u, v], float)), abs=0.02
        )
        normal = [float(words[words.index("normal") + k]) for k in (1, 2, 3)]
        assert normal == pytest.approx(ps.estimate_normals(frame)[v, u], abs=0.02)

    def test_beside_all_surfaces_it_says_so(self, open_viewer):
        viewer = open_viewer()
        press(viewer, "V")
        move(viewer, (30, 30), (2, 2))
        viewer.step(wait=False)
        assert told(viewer) == NOTHING

    def test_d_tells_them_over_light_and_takes_them_away_elsewhere(self, open_viewer):
        viewer = open_viewer()
        move(viewer, (100, 100), (160, 120))
        assert viewer._overlay.pointer is None
        press(viewer, "D")
        assert viewer._overlay.pointer == (160, 120) and "depth" in told(viewer)
        press(viewer, "D", "V")
        assert viewer._overlay.pointer == (160, 120)
        press(viewer, "D")
        assert viewer._overlay.pointer is None

    def test_reading_them_draws_no_surface_again(self, open_viewer):
        viewer = open_viewer()
        press(viewer, "D")
        move(viewer, (100, 100), (150, 120))
        viewer.step(wait=False)
        before = viewer.renderer.steps.counts.copy()
        move(viewer, (150, 120), (160, 130))
        viewer.step(wait=False)
        assert viewer.renderer.steps.counts - before == {"light": 1}

    def test_they_stand_above_the_timeline(self, open_viewer):
        viewer = open_viewer([frames.sphere(), frames.sphere()], fps=1)
        press(viewer, "SPACE")
        before = shown(quiet(viewer))[-20:]
        press(viewer, "V")
        move(viewer, (100, 100), (160, 120))
        after = shown(quiet(viewer))
        assert (after[-20:] != before).mean() < 0.3 and (after[-45:-30, :100].astype(int).max() > 200)

    def test_undo_leaves_them_as_they_are(self, open_viewer):
        viewer = open_viewer()
        press(viewer, "3", "D", "CTRL+Z")
        assert viewer.state.reads and viewer.state.look.shading == "phong"
