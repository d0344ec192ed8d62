"""Normals: the GPU compared with its mirror, and with the true normals of surfaces."""

from functools import partial
from itertools import product

import numpy as np
import pytest

import pointshade_gl as ps
from pointshade_gl.bench.tracing import as_frame, plane, trace
from pointshade_gl.scene.noise import METHODS, PLANE_FITS, TRIANGLES, parse_max_depth_step

from ..reference.inverse_depth import pixel_grid
from ..reference.normals_borrow import borrow
from ..reference.normals_differences import estimate_central, estimate_one_sided
from ..reference.normals_plane_fit import estimate_plane_fit
from ..reference.normals_star import estimate_star
from ..reference.normals_triangles import RING, TRIANGLE_ORDER, normal_from_triangles
from ..support import frames

STEPS = [None, 0.05, "2%"]


def mirror_normals(frame, method, step=None):
    """(h, w, 3), NaN where missing, by the functions of tests.reference."""
    intrinsics = np.array(frame.camera.intrinsics, np.float32)
    depth, pixel = frame.depth, pixel_grid(frame.depth)
    if method in TRIANGLES:
        max_step = parse_max_depth_step(step)
        normals = normal_from_triangles(depth, pixel, intrinsics, TRIANGLES[method], max_step)
    elif method in PLANE_FITS:
        normals = estimate_plane_fit(depth, pixel, intrinsics, PLANE_FITS[method])
    elif method == "star-borrow":
        star = estimate_star(depth, pixel, intrinsics, 0.0)
        normals = borrow(depth, star, pixel, intrinsics)[..., :3]
    else:
        mirror = {
            "star": partial(estimate_star, sigma=0.0),
            "central": estimate_central,
            "one-sided": estimate_one_sided,
        }
        normals = mirror[method](depth, pixel, intrinsics)[..., :3]
    return np.where(normals.any(-1, keepdims=True), normals, np.nan)


def turned_by_rounding(frame, method, step):
    """(h, w) by how much 2.5 ulp of all depths around a pixel, each to its worse side, turn its normal in the mirror.

    GLSL lets a quotient be off by 2.5 ulp, and GPUs, which multiply by reciprocals, use that. Triangles subtract depths
    that were divided, so it turns the short ones, most where there are few; all other methods subtract first.
    """
    v, u = pixel_grid(frame.depth)[::-1]
    before, turned = mirror_normals(frame, method, step), np.zeros(frame.depth.shape)
    for k in range(9):
        is_moved = (u % 3 == k % 3) & (v % 3 == k // 3) & (frame.depth > 0)  # one pixel of each 3x3
        moved = np.where(is_moved, np.nextafter(frame.depth, np.float32(np.inf)), frame.depth)
        after = mirror_normals(ps.Frame(None, moved, frame.camera), method, step)
        turned += np.nan_to_num(np.abs(after - before).max(-1))
    return 2.5 * turned


def assert_agree(normals, mirror, rounding=lambda: 0):
    """DESIGN section 6: equal validity, 1e-5 away from decisions; at most 0.1 % of the pixels decide otherwise.

    rounding  gives the bound (h, w) where it is wider than 1e-5; half of all normals are within that anyway
    """
    assert (np.isnan(normals) == np.isnan(mirror)).all()
    error = np.nan_to_num(np.abs(normals - mirror).max(-1))
    if (error > 1e-5).mean() <= 0.001:
        return
    off = error > np.maximum(rounding(), 1e-5)
    assert off.mean() <= 0.001, f"{100 * off.mean():.3f} % of the normals differ"
    assert np.median(error) <= 1e-5, "most normals differ"


FRAMES = [frames.tilted_plane, frames.sphere_before_wall, frames.step, frames.holes, frames.single_pixel]


@pytest.mark.parametrize("step", STEPS)
@pytest.mark.parametrize("method", TRIANGLES)
@pytest.mark.parametrize("make", FRAMES)
def test_triangles_agree_with_the_mirror(renderer, make, method, step):
    frame = make()
    normals, mirror = renderer.estimate_normals(frame, method, max_depth_step=step), mirror_normals(frame, method, step)
    assert_agree(normals, mirror, lambda: turned_by_rounding(frame, method, step))


def divided(depth, rng, ulps):
    """Depths as quotients that are off by as many ulps, at most, are worth."""
    return (depth * (1 + rng.uniform(-ulps, ulps, depth.shape) * 2.0**-24)).astype(np.float32)


@pytest.mark.parametrize("method", TRIANGLES)
def test_normals_agree_on_every_gpu_that_divides_as_glsl_asks_and_on_no_other(method):
    frame, rng = frames.sphere_before_wall(), np.random.default_rng(3)
    mirror, bound = mirror_normals(frame, method), turned_by_rounding(frame, method, None)
    for ulps, agrees in ((2.5, True), (40, False)):
        normals = mirror_normals(ps.Frame(None, divided(frame.depth, rng, ulps), frame.camera), method)
        error = np.abs(normals - mirror).max(-1)
        assert ((error > np.maximum(bound, 1e-5)).mean() <= 0.001) == agrees
    assert (error > 1e-5).mean() > 0.1


INVERSE_DEPTH = ["star", "star-borrow", "central", "one-sided", "plane-fit-3", "plane-fit-7"]
# Borrowing compares residuals. With noise their last bits decide, so it is for clean depth.
ON_NOISE = [(frames.noisy, method) for method in INVERSE_DEPTH if method != "star-borrow"]


@pytest.mark.parametrize(("make", "method"), [*product(FRAMES, INVERSE_DEPTH), *ON_NOISE])
def test_estimators_in_inverse_depth_agree_with_the_mirror(renderer, make, method):
    frame = make()
    assert_agree(renderer.estimate_normals(frame, method), mirror_normals(frame, method))


def angle(a, b):
    return np.degrees(np.arctan2(np.linalg.norm(np.cross(a, b), axis=-1), (a * b).sum(-1)))


@pytest.mark.parametrize("method", TRIANGLES)
def test_a_plane_is_answered_exactly(renderer, method):
    truth = trace([plane((0.5, 0.2, -1), (0, 0, 1.5), frames.checks)], frames.CAMERA)
    normals = renderer.estimate_normals(as_frame(truth, frames.CAMERA), method)
    assert angle(normals, truth.normals).max() < 0.05


def test_negative_fy_gives_the_same_surface(renderer):
    camera = ps.Camera(131, -131, 79.5, 59.5, 160, 120)
    truth = trace([plane((0.5, 0.2, -1), (0, 0, 1.5), frames.checks)], camera)
    normals = renderer.estimate_normals(as_frame(truth, camera), "triangles-8")
    assert angle(normals, truth.normals).max() < 0.05


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("make", [frames.holes, frames.single_pixel, frames.step])
def test_every_known_pixel_has_a_unit_normal_towards_the_camera(renderer, make, method):
    frame = make()
    normals = renderer.estimate_normals(frame, method, max_depth_step="1%")
    known = frame.depth > 0
    assert np.isnan(normals[~known]).all()
    assert np.abs(np.linalg.norm(normals[known], axis=-1) - 1).max() < 1e-5
    v, u = np.nonzero(known)
    ray = np.stack([(u - 79.5) / 131, (v - 59.5) / 131, np.ones(len(u))], -1)
    assert ((normals[known] * ray).sum(-1) <= 1e-5).all()


def test_a_rejected_neighbour_drops_both_its_triangles(renderer):
    """At the step in depth, only the answer with a gate is the wall's own normal."""
    frame = frames.step()
    gated = renderer.estimate_normals(frame, "triangles-8", max_depth_step=0.05)
    open_ = renderer.estimate_normals(frame, "triangles-8")
    assert np.abs(gated[:, 79:81] - (0, 0, -1)).max() < 1e-5
    assert np.abs(open_[2:-2, 79:81] - (0, 0, -1)).max() > 0.1


def test_the_first_four_triangles_touch_all_eight_neighbours():
    touched = {k for i in TRIANGLE_ORDER[:4] for k in (i, (i + 1) % 8)}
    assert touched == set(range(8)) and len(RING) == 8


def test_opposite_triangles_come_first():
    assert TRIANGLE_ORDER[1] - TRIANGLE_ORDER[0] == 4
