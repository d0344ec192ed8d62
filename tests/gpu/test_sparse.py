"""Sparse depth, such as LiDAR in a picture: when it counts as sparse, and its normals."""

import numpy as np
import pytest

import pointshade_gl as ps
from pointshade_gl.bench.tracing import as_frame, plane, trace
from pointshade_gl.scene.frame import is_sparse
from pointshade_gl.scene.noise import describe

from ..reference.inverse_depth import pixel_grid
from ..reference.normals_sparse import estimate_sparse
from ..support import frames
from .test_surface import angle, assert_agree


def scan_lines(shape, pitch=5.3, share=0.5):
    """Lines that are bent as those of a rotating sensor, `pitch` pixels apart, with a share of their pixels."""
    v, u = np.mgrid[: shape[0], : shape[1]]
    line = (v + 4e-4 * (u - shape[1] / 2) ** 2) / pitch
    return (line % 1 < 1 / pitch) & (np.random.default_rng(3).random(shape) < share)


def at_random(shape, share):
    return np.random.default_rng(5).random(shape) < share


def kept(frame, mask, noise=0.0):
    """The frame with the depths of a mask only, each off by a share of itself."""
    depth = frame.depth * (1 + noise * np.random.default_rng(2).normal(size=frame.depth.shape))
    return ps.Frame(frame.color, np.where(mask, depth, 0), frame.camera)


def ground():
    """A road 1.7 units below the camera, seen to 40 units, with its true normals."""
    truth = trace([plane((0, -1, 0), (0, 1.7, 0), frames.checks)], frames.CAMERA)
    depth = np.where(truth.depth < 40, truth.depth, 0)
    return ps.Frame(None, depth, frames.CAMERA), truth.normals


SHAPE = (120, 160)
PATTERNS = {
    "scan lines": scan_lines(SHAPE),
    "every fourth row": np.indices(SHAPE)[0] % 4 == 1,
    "every third pixel": (np.indices(SHAPE) % 3 == 1).all(0),
    "a fifth at random": at_random(SHAPE, 0.2),
}


@pytest.mark.parametrize("pattern", PATTERNS)
def test_pixels_that_stand_apart_are_sparse(pattern):
    assert is_sparse(np.where(PATTERNS[pattern], frames.sphere_before_wall().depth, 0))


def dense_depths():
    full = frames.sphere_before_wall().depth
    small = np.zeros_like(full)
    small[50:70, 60:90] = full[50:70, 60:90]
    yield "full", full
    for missing in (0.05, 0.2, 0.5):
        yield f"{missing} missing", np.where(at_random(SHAPE, missing), 0, full)
    yield "small object", small
    yield "two small objects", small + np.roll(small, 60, axis=1)
    yield "repeated pixels", full[::3, ::3].repeat(3, 0).repeat(3, 1)
    yield "chequered", np.where(np.indices(SHAPE).sum(0) % 2, full, 0)
    yield "a few pixels", np.where(at_random(SHAPE, 0.002), full, 0)
    yield "empty", np.zeros_like(full)


@pytest.mark.parametrize(("name", "depth"), list(dense_depths()))
def test_holes_and_small_objects_are_not_sparse(name, depth):
    assert not is_sparse(depth)


@pytest.mark.parametrize("make", [frames.tilted_plane, frames.sphere_before_wall, frames.step])
@pytest.mark.parametrize("pattern", ["scan lines", "a fifth at random"])
def test_sparse_agrees_with_the_mirror(renderer, make, pattern):
    frame = kept(make(), PATTERNS[pattern], noise=0.001)
    mirror = estimate_sparse(frame.depth, pixel_grid(frame.depth), frame.camera.intrinsics)
    normals = np.where(mirror.any(-1, keepdims=True), mirror[..., :3], np.nan)
    assert_agree(renderer.estimate_normals(frame, "sparse"), normals)
    depth = renderer.render_depth(frame, normals="sparse", point_size=0.5)
    both = (depth > 0) & (mirror[..., 3] > 0)
    assert both.sum() > 0.9 * (mirror[..., 3] > 0).sum()
    assert (np.abs(depth - mirror[..., 3])[both] > 1e-4).mean() < 0.001


@pytest.mark.parametrize("pattern", PATTERNS)
def test_auto_finds_the_ground_under_noise(renderer, pattern):
    road, normals = ground()
    frame = kept(road, PATTERNS[pattern], noise=0.002)
    found = renderer.estimate_normals(frame)
    assert renderer.choice.method == "sparse"
    assert np.nanmedian(angle(found, normals)) < 2
    assert np.nanmedian(angle(renderer.estimate_normals(frame, "star"), normals)) > 20


def test_noise_widens_where_it_looks_and_the_unit_does_not_matter(renderer):
    """At five times the noise the tilt stays below five times the error; in millimetres it is the same."""
    road, normals = ground()
    calm, noisy = (kept(road, PATTERNS["a fifth at random"], noise) for noise in (0.002, 0.01))
    errors = [np.nanmedian(angle(renderer.estimate_normals(frame), normals)) for frame in (calm, noisy)]
    assert errors[1] < 3.5 * errors[0]
    scaled = ps.Frame(None, calm.depth * 1000, calm.camera)
    assert np.nanmax(angle(renderer.estimate_normals(calm), renderer.estimate_normals(scaled))) < 0.1


def test_surfaces_keep_their_normals_beside_an_edge(renderer):
    """Two tilted walls: few pixels beside the step between them take the other's side into account."""
    walls = [plane((0.4, 0, -1), (0, 0, 1.2), frames.checks), plane((-0.4, 0.1, -1), (0, 0, 2.0), frames.checks)]
    near, far = (trace([wall], frames.CAMERA) for wall in walls)
    left = np.arange(160) < 80
    frame = as_frame(near, frames.CAMERA)
    frame = ps.Frame(frame.color, np.where(left, near.depth, far.depth), frames.CAMERA)
    truth = np.where(left[:, None], near.normals, far.normals)
    frame = kept(frame, PATTERNS["scan lines"], noise=2e-4)
    off = angle(renderer.estimate_normals(frame), truth)[frame.depth > 0]
    assert np.median(off) < 1.5 and (off > 10).mean() < 0.05


def test_a_single_line_faces_the_camera(renderer):
    """How it is tilted across its line is not known."""
    depth = np.zeros(SHAPE, np.float32)
    depth[60] = 2
    found = renderer.estimate_normals(ps.Frame(None, depth, frames.CAMERA), "sparse")[60]
    ray = np.stack([(np.arange(160) - 79.5) / 131, np.full(160, 0.5 / 131), np.ones(160)], -1)
    assert angle(found, -ray).max() < 0.1


def test_explain_says_why(renderer):
    renderer.estimate_normals(kept(frames.tilted_plane(), PATTERNS["every fourth row"]))
    assert describe(renderer.choice).startswith("sparse: 75 % of the depth is missing")
    renderer.estimate_normals(frames.tilted_plane(), "sparse")
    assert describe(renderer.choice) == "sparse: as requested"
