"""Depth that is rounded to steps: smooth walls are lit without rings, and small structure on them stays."""

import numpy as np
import pytest

import pointshade_gl as ps
from pointshade_gl.estimation.noise_model import flat_grid
from pointshade_gl.scene.noise import Noise

from ..reference.surface_pass import flat_surfaces

CAMERA = ps.Camera(525, 525, 159.5, 119.5, 320, 240)
STEP = 0.001
u, v = (k.astype(np.float64) for k in np.meshgrid(np.arange(320), np.arange(240)))


def wall(steps_u, steps_v, distance=1.8):
    """Exact depth (h, w) and unit normal of a plane whose depth changes by so many steps a pixel in the middle."""
    w = 1 / distance - STEP / distance**2 * (steps_u * (u - CAMERA.cx) + steps_v * (v - CAMERA.cy))
    n = np.array([525 * (w[0, 1] - w[0, 0]), 525 * (w[1, 0] - w[0, 0]), 1 / distance])
    return 1 / w, -n / np.linalg.norm(n)


def rounded(depth):
    return ps.Frame(np.full((240, 320, 3), 200, np.uint8), (np.round(depth / STEP) * STEP).astype(np.float32), CAMERA)


def error(normals, truth):
    """Degrees; arcsin, because arccos sees no small angles in float32."""
    return np.degrees(np.arcsin(np.linalg.norm(np.cross(normals.astype(np.float64), truth), axis=-1)))


def rms(values):
    return np.sqrt(np.mean(np.square(values)))


# Before there were planes as wide as many steps, these were 0.16 to 1.01 degrees.
@pytest.mark.parametrize("steps", [(1.0, 0.05), (0.95, 0.1), (0.05, 0.03), (0.5, 0.02), (2.0, 1.0), (0.37, -0.21)])
def test_a_rounded_wall_has_one_normal(renderer, steps):
    depth, normal = wall(*steps)
    assert rms(error(renderer.estimate_normals(rounded(depth)), normal)) < 0.1


@pytest.mark.parametrize("light", [(-0.6, -0.6, 0.0), (1.5, -1.0, 1.0)])
def test_a_lit_wall_shows_no_rings(renderer, light):
    depth, normal = wall(0.98, 0.03)
    options = {"light": ps.Light(position=light), "material": ps.Material(0.1, 0.9, 0.0)}
    exact = np.broadcast_to(normal, (240, 320, 3)).astype(np.float32)
    picture = renderer.render(rounded(depth), **options)[..., :3].astype(float)
    truth = renderer.render(rounded(depth), normals=exact, **options)[..., :3].astype(float)
    assert rms(picture - truth) < 0.5


def test_points_of_a_rounded_wall_lie_on_it(renderer):
    depth, _ = wall(0.98, 0.03)
    surface = renderer.render_depth(rounded(depth))
    assert rms(surface / depth - 1) * 1.8 < 0.2 * STEP  # rounding alone: 0.29 steps


@pytest.mark.parametrize("height", [2, 3, 6])
@pytest.mark.parametrize("size", [3, 5, 9])
def test_a_small_thing_on_a_wall_stays(renderer, size, height):
    """A square plate some steps before the wall: its points and those around it move as little as they ever did."""
    depth, _ = wall(0.9, 0.1)
    plate = (abs(u - 160) <= size // 2) & (abs(v - 120) <= size // 2)
    exact = np.where(plate, depth - height * STEP, depth)
    drawn = renderer.render_depth(rounded(exact))
    assert abs(drawn - exact)[plate].max() < 1.6 * STEP
    assert abs(drawn - exact)[~plate].max() < 1.6 * STEP


@pytest.mark.parametrize(
    ("along", "periods"),
    [(u, range(2, 28, 2)), (v, range(3, 28, 2)), (u + v, range(2, 28, 3)), (2 * u - v, range(3, 28, 3))],
    ids=["u", "v", "diagonal", "steep"],
)
def test_ripples_are_no_wall(along, periods):
    """Waves of 4 mm, of any length up to three cells: their crests must not be joined."""
    noise = Noise(0.0, 0.0, STEP, "z", 0.0, 0.0, 1.0, None, (0.0, 0.0))
    for period in periods:
        depth = wall(0.3, 0.2)[0] + 0.004 * np.sin(2 * np.pi * (along + 0.3) / period)
        flat = flat_surfaces(rounded(depth).depth, noise, np.array(CAMERA.intrinsics, np.float32))
        assert not flat.any(), period


@pytest.mark.parametrize("bend", [3, 10, 30])
def test_a_crease_stays_where_it_is(renderer, bend):
    """Two walls that meet at an angle: away from the crease each has its normal."""
    left, normal = wall(0.9, 0.1)
    slope = np.tan(np.radians(bend)) * 525 / 1.8 * STEP
    w = 1 / left + np.where(u > 160, slope / STEP * (u - 160) / 525**2, 0)
    n = np.array([525 * (w[0, 201] - w[0, 200]), 525 * (w[1, 200] - w[0, 200]), 0])
    n[2] = w[0, 200] - (200 - CAMERA.cx) * (w[0, 201] - w[0, 200]) + CAMERA.cy * (w[1, 200] - w[0, 200])
    right = -n / np.linalg.norm(n)
    normals = renderer.estimate_normals(rounded(1 / w))
    assert rms(error(normals, normal)[:, :154]) < 0.25
    assert rms(error(normals, right)[:, 167:]) < 0.25


@pytest.mark.parametrize("size", [(1, 1), (2, 9), (9, 10), (64, 47), (320, 240), (640, 480), (641, 479)])
def test_cells_are_centred_and_cover_the_picture(size):
    cells, first = flat_grid(*size)
    for n, count, start in zip(size, cells, first, strict=True):
        last = start + 9 * (count - 1)
        assert start < 0
        assert last > n - 1
        assert start + last == n - 1
