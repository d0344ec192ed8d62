"""Where the ground lies under frames: the lowest points of things, seen or not, and floors, by closed formulas."""

import numpy as np
import pytest

import pointshade_gl as ps
from pointshade_gl.estimation.ground import ground_under, lowest_point, shown_floor, up_and_floor

CAMERA = ps.Camera(400, 400, 199.5, 149.5, 400, 300)
PIXEL = 2.4 / 400  # metres, where things stand
BALLS = ((-0.4, 0.02, 0.0), 0.25), ((0.1, -0.1, -0.1), 0.2), ((0.45, -0.15, 0.1), 0.15)
BOX = (-0.3, -0.2, -0.2), (0.3, 0.2, 0.2)


class Stage:
    """Things 2.4 m before a camera that looks down by some degrees: their axes are right, up and away."""

    def __init__(self, pitch):
        a = np.radians(pitch)
        self.axes = np.array([[1, 0, 0], [0, -np.cos(a), -np.sin(a)], [0, -np.sin(a), np.cos(a)]])
        self.up, self.eye = self.axes[1], -self.axes @ (0, 0, 2.4)
        v, u = np.indices((CAMERA.height, CAMERA.width))
        self.rays = np.stack([(u - CAMERA.cx) / 400, (v - CAMERA.cy) / 400, np.ones(u.shape)], -1) @ self.axes.T

    def ball(self, middle, radius):
        """(h, w) z of a ball; inf where it is not."""
        towards = self.eye - middle
        a, b = (self.rays**2).sum(-1), self.rays @ towards
        root = b * b - a * (towards @ towards - radius**2)
        return np.where(root > 0, (-b - np.sqrt(np.maximum(root, 0))) / a, np.inf)

    def box(self, low, high, turn=0.0):
        """(h, w) z of a box that is turned by some degrees."""
        c, s = np.cos(np.radians(turn)), np.sin(np.radians(turn))
        turned = np.array([[c, 0, -s], [0, 1, 0], [s, 0, c]])
        ends = [(np.array(end) - turned @ self.eye) / (self.rays @ turned.T + 1e-12) for end in (low, high)]
        near, far = np.minimum(*ends).max(-1), np.maximum(*ends).min(-1)
        return np.where(near < far, near, np.inf)

    def floor(self, level):
        z = (level - self.eye[1]) / np.minimum(self.rays[..., 1], -1e-9)
        return np.where(z < 6, z, np.inf)

    def frame(self, *things, noise=0.0, strays=0):
        rng, depth = np.random.default_rng(1), np.minimum.reduce(things)
        depth = np.where(np.isfinite(depth), depth + noise * rng.normal(size=depth.shape), 0)
        v, u = rng.integers(0, CAMERA.height, strays), rng.integers(0, CAMERA.width, strays)
        depth[v, u] = rng.uniform(3, 6, strays)
        return ps.Frame(None, depth.astype(np.float32), CAMERA)

    def sunk(self, frame):
        """How high the camera's place below things is above their lowest point."""
        return lowest_point(frame, self.up) - (self.axes @ (0, 0, 2.4))[1]


@pytest.mark.parametrize("pitch", [10, 25, 40])
class TestLowestPoint:
    @pytest.mark.parametrize("strays", [0, 5])
    def test_the_underside_of_balls_is_where_their_circle_has_it(self, pitch, strays):
        """The lowest that the camera sees lies 8 to 65 mm above."""
        stage = Stage(pitch)
        frame = stage.frame(*(stage.ball(*ball) for ball in BALLS), strays=strays)
        assert stage.sunk(frame) == pytest.approx(-0.3, abs=0.001)

    def test_noise_of_a_third_of_a_pixel_moves_it_little(self, pitch):
        stage = Stage(pitch)
        frame = stage.frame(*(stage.ball(*ball) for ball in BALLS[1:]), noise=0.002)
        assert stage.sunk(frame) == pytest.approx(-0.3, abs=2 * PIXEL)

    @pytest.mark.parametrize("turn", [0, 25])
    def test_boxes_end_between_two_pixels(self, pitch, turn):
        stage = Stage(pitch)
        for shift in np.arange(5) * PIXEL / 5:
            frame = stage.frame(stage.box(np.add(BOX[0], (0, shift, 0)), BOX[1], turn))
            assert stage.sunk(frame) == pytest.approx(-0.2 + shift, abs=0.75 * PIXEL)

    def test_thin_feet_count(self, pitch):
        """Three pixels wide, each less than a thousandth of all points high."""
        stage = Stage(pitch)
        feet = [stage.box((x, -0.4, z), (x + 0.018, 0.1, z + 0.018)) for x in (-0.3, 0.3) for z in (-0.25, 0.25)]
        frame = stage.frame(*feet, stage.box((-0.35, 0.1, -0.3), (0.35, 0.14, 0.3)))
        assert stage.sunk(frame) == pytest.approx(-0.4, abs=PIXEL)

    def test_a_picture_that_is_turned_says_the_same(self, pitch):
        stage = Stage(pitch)
        frame = stage.frame(*(stage.ball(*ball) for ball in BALLS), stage.box((0.6, -0.1, -0.1), (0.8, 0, 0.1)))
        upright, up = lowest_point(frame, stage.up), stage.up
        x, y, z = up
        on_its_head = ps.Camera(400, 400, 199.5, 149.5, 400, 300)
        on_its_side = ps.Camera(400, 400, 149.5, 199.5, 300, 400)
        for depth, camera, down in (
            (frame.depth[::-1, ::-1], on_its_head, (-x, -y, z)),
            (frame.depth.T[::-1], on_its_side, (y, -x, z)),
            (frame.depth.T, on_its_side, (y, x, z)),
            (frame.depth[::-1], ps.Camera(400, -400, 199.5, 149.5, 400, 300), up),
        ):
            turned = ps.Frame(None, np.ascontiguousarray(depth), camera)
            assert lowest_point(turned, np.array(down)) == pytest.approx(upright, abs=1e-6)


def test_nothing_and_a_few_points_have_a_lowest_point():
    depth = np.zeros((300, 400), np.float32)
    assert lowest_point(ps.Frame(None, depth, CAMERA), np.array([0, -1.0, 0])) == 0
    depth[200, 200] = 2
    assert lowest_point(ps.Frame(None, depth, CAMERA), np.array([0, -1.0, 0])) == pytest.approx(-50.5 / 400 * 2)


@pytest.mark.parametrize("pitch", [10, 25, 40])
class TestFloor:
    def shown(self, pitch, *things, lean=50.0, **options):
        stage = Stage(pitch)
        frame = stage.frame(*(thing(stage) for thing in things), **options)
        return shown_floor(frame, np.array([0, -1.0, 0]), lean)

    @pytest.mark.parametrize("noise", [0, 0.005])
    def test_it_is_the_plane_below_everything(self, pitch, noise):
        floor = self.shown(pitch, lambda s: s.floor(-0.2), lambda s: s.box(*BOX), noise=noise, strays=20)
        stage = Stage(pitch)
        assert np.degrees(np.arccos(floor[:3] @ stage.up)) < 0.3
        assert floor[3] == pytest.approx(stage.eye[1] + 0.2, abs=0.002 + 3 * noise)

    def test_of_two_it_is_the_lower_one(self, pitch):
        table = (-0.5, 0.1, -0.3), (0.3, 0.14, 0.1)
        floor = self.shown(pitch, lambda s: s.floor(-0.4), lambda s: s.box(*table))
        assert floor[3] == pytest.approx(Stage(pitch).eye[1] + 0.4, abs=0.005)

    def test_boards_balls_and_what_leans_too_far_are_none(self, pitch):
        board = (-0.6, -0.03, -0.6), (0.6, 0.0, 0.6)
        assert self.shown(pitch, lambda s: s.box(*board)) is None
        assert self.shown(pitch, lambda s: s.ball(*BALLS[0])) is None
        assert (self.shown(pitch, lambda s: s.floor(-0.2), lean=12.0) is None) == (pitch > 12)

    def test_the_ground_of_a_frame_goes_on_from_it(self, pitch):
        """In world axes, and at the scale of its node."""
        stage, pose = Stage(pitch), ps.orbit_pose(None, (0.3, 0.2, 1), 50, -30)
        made = stage.frame(stage.floor(-0.2), stage.box(*BOX))
        frame = ps.Frame(None, made.depth, CAMERA, pose)
        up, _ = up_and_floor(frame)
        np.testing.assert_allclose(up, pose[:3, :3] @ stage.up, atol=0.005)
        transform = np.diag([2.0, 2, 2, 1])
        transform[:3, 3] = 0.1, 0.2, 0.3
        for matrix, scale in ((np.eye(4), 1), (transform, 2)):
            plane = ground_under(ps.Scene((ps.Node(ps.PointObject(frame), transform=matrix),)), tuple(up))
            eye = matrix @ pose[:, 3]
            assert plane[:3] @ eye[:3] + plane[3] == pytest.approx(scale * (stage.eye[1] + 0.2), abs=0.01)


def test_a_shown_floor_is_continued_without_bands_and_slits(renderer):
    """A floor with missing pixels, seen from the side: what lies beside it and between is no shadow of its own."""
    stage, rng = Stage(25), np.random.default_rng(2)
    depth = stage.frame(stage.floor(-0.2), noise=0.004).depth.copy()
    depth[rng.random(depth.shape) < 0.05] = 0
    frame = ps.Frame(None, depth, CAMERA)
    turned = {"yaw": 20, "pitch": 10, "normals": "triangles-8"}
    seen = renderer.render(frame, **turned)[..., 3] > 0
    alpha = renderer.render(frame, ground=True, **turned)[..., 3][~seen]
    assert (~seen).mean() > 0.05 and (alpha > 25).mean() < 0.02


def test_a_thing_on_a_shown_floor_shades_what_continues_it(renderer):
    stage, sun = Stage(25), ps.Light(direction=(1, 0.5, 0.1), shadow=True)
    depth = stage.frame(stage.floor(-0.2), stage.box((0.2, -0.2, -0.2), (0.4, 0.4, 0.2))).depth.copy()
    depth[:, 300:] = 0
    image = renderer.render(ps.Frame(None, depth, CAMERA), sun, ground=True)
    assert (image[:, 305:, 3] > 200).mean() > 0.1
