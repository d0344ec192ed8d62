"""Noise: measured, or given by the caller; the right estimator is chosen, and stays stable where others break."""

from dataclasses import replace

import numpy as np
import pytest

import pointshade_gl as ps
from pointshade_gl.bench.tracing import plane, sphere, sphere_and_wall, trace
from pointshade_gl.scene.noise import describe, parse_noise

from ..gpu.test_surface import angle, assert_agree
from ..reference.surface_pass import measure_noise, surface_by_noise
from ..support import frames

CAMERA = ps.Camera(262.5, 262.5, 159.5, 119.5, 320, 240)
INTRINSICS = np.array(CAMERA.intrinsics, np.float32)


@pytest.fixture(scope="module")
def scene():
    """Depth and true normals of spheres before a wall, 320x240."""
    surfaces = [*sphere_and_wall(), sphere((-0.5, 0.3, 1.2), 0.2, frames.checks)]
    hits = trace(surfaces, CAMERA)
    return hits.depth, hits.normals


def gaussian(depth, sigma, seed=1):
    return np.where(depth > 0, depth + np.random.default_rng(seed).normal(0, 1, depth.shape) * sigma, 0)


def kinect(depth, seed=1):
    return gaussian(depth, 0.0012 + 0.0019 * (depth - 0.4) ** 2, seed)


def rounded(depth, step):
    return np.round(depth / step) * step


def disparity(depth, step=1 / 8, span=262.5 * 0.075):
    return span / (np.round(span / depth / step) * step)


def holes(depth, share, seed=1):
    return np.where(np.random.default_rng(seed).random(depth.shape) < share, 0, depth)


def enlarged(depth, times=1.5):
    """The nearest of fewer pixels, as a picture that was moved to a finer camera's: lines are repeated."""
    v, u = (np.round(np.floor(np.arange(n) / times + 0.5) * times).astype(int) for n in depth.shape)
    return depth[np.ix_(np.minimum(v, len(v) - 1), np.minimum(u, len(u) - 1))]


STRESSES = {
    "clean": lambda z: z,
    "1 mm noise": lambda z: gaussian(z, 0.001),
    "kinect noise": kinect,
    "1 mm steps": lambda z: rounded(z, 0.001),
    "1/5 mm steps": lambda z: rounded(z, 0.0002),
    "disparity steps": disparity,
    "40 % holes": lambda z: holes(z, 0.4),
    "enlarged": lambda z: enlarged(rounded(gaussian(z, 0.001), 0.001)),
    "kinect noise, 1 mm steps, holes": lambda z: holes(rounded(kinect(z), 0.001), 0.05),
}


def frame_of(depth, scale=1.0):
    return ps.Frame(None, np.asarray(depth * scale, np.float32), CAMERA)


def mean_error(normals, truth, depth):
    """Degrees over known pixels, 8 pixels inside the picture's border."""
    inside = np.zeros(depth.shape, bool)
    inside[8:-8, 8:-8] = True
    return angle(normals, truth)[inside & (depth > 0)].mean()


@pytest.mark.parametrize("told", [None, 0.002, "kinect"])
@pytest.mark.parametrize("stress", STRESSES)
def test_auto_agrees_with_the_mirror(renderer, scene, stress, told):
    rows, columns = slice(60, 180), slice(80, 240)  # the mirror takes its time
    depth = STRESSES[stress](scene[0])[rows, columns]
    camera = replace(CAMERA, cx=CAMERA.cx - columns.start, cy=CAMERA.cy - rows.start, width=160, height=120)
    frame = ps.Frame(None, np.asarray(depth, np.float32), camera)
    normals = renderer.estimate_normals(frame, "auto", noise=told)
    mirror = surface_by_noise(frame.depth, np.array(camera.intrinsics, np.float32), parse_noise(told, frame.depth))[
        ..., :3
    ]
    assert_agree(normals, np.where(mirror.any(-1, keepdims=True), mirror, np.nan))


@pytest.mark.parametrize("stress", ["1 mm noise", "kinect noise", "disparity steps", "kinect noise, 1 mm steps, holes"])
def test_points_lie_on_the_surfaces_that_were_fitted(renderer, scene, stress):
    """They are drawn where the mirror says, closer to the truth than averaged depth, and no edge is rounded."""
    frame, truth = frame_of(STRESSES[stress](scene[0])), scene[0]
    drawn = renderer.render_depth(frame)
    mirror = surface_by_noise(frame.depth, INTRINSICS)[..., 3]
    known = (frame.depth > 0) & (drawn > 0)
    assert (np.abs(drawn - mirror) < 1e-4 * mirror)[known].mean() > 0.999
    assert np.median(np.abs(drawn - truth)[known]) < 0.22 * np.median(np.abs(frame.depth - truth)[known])
    assert (np.abs(drawn - truth) > 0.05)[known].mean() <= (np.abs(frame.depth - truth) > 0.05)[known].mean()


def test_noise_that_neighbours_share_opens_few_holes_in_a_turned_view(renderer):
    near = ps.Camera(525, 525, 159.5, 119.5, 320, 240)
    wall = plane((0.3, -0.1, -1), (0, 0, 2.4), frames.checks)
    depth = trace([wall, sphere((0.1, 0.1, 1.8), 0.25, frames.checks)], near).depth
    noise = np.random.default_rng(1).normal(0, 1, depth.shape)
    for axis in (0, 1):
        noise = (np.roll(noise, 1, axis) + 2 * noise + np.roll(noise, -1, axis)) / np.sqrt(6)
    matched = 40 / (np.round((40 / depth + 0.16 * noise) * 8) / 8)  # disparity in steps of 1/8 pixel
    both = (ps.Frame(None, z.astype(np.float32), near) for z in (matched, depth))
    pose = ps.orbit_pose(None, (0, 0, 2.2), 15)
    seen, there = (renderer.render(frame, pose=pose)[..., 3] > 0 for frame in both)
    assert (there & ~seen).mean() < 0.045  # .063 with averaged depth


@pytest.mark.parametrize(
    ("stress", "method"),
    [("clean", "star"), ("40 % holes", "star"), ("1 mm noise", "adaptive"), ("1/5 mm steps", "adaptive")],
)
def test_only_noise_asks_for_the_adaptive_estimator(renderer, scene, stress, method):
    renderer.estimate_normals(frame_of(STRESSES[stress](scene[0])), "auto")
    assert renderer.choice.method == method


# A bound in degrees that auto keeps, and a classical method that exceeds it.
@pytest.mark.parametrize(
    ("stress", "bound", "classical", "step"),
    [
        ("clean", 0.2, "triangles-8", None),
        ("1 mm noise", 2.0, "triangles-8", "5%"),
        ("kinect noise", 3.5, "plane-fit-7", None),
        ("1 mm steps", 1.0, "one-sided", None),
        ("1/5 mm steps", 0.4, "one-sided", None),
        ("disparity steps", 6.0, "one-sided", None),
        ("40 % holes", 0.8, "triangles-8", None),
        ("kinect noise, 1 mm steps, holes", 3.5, "triangles-8", "5%"),
    ],
)
def test_auto_holds_a_bound_that_a_classical_method_breaks(renderer, scene, stress, bound, classical, step):
    depth, truth = STRESSES[stress](scene[0]), scene[1]
    frame = frame_of(depth)
    assert mean_error(renderer.estimate_normals(frame), truth, depth) < bound
    broken = renderer.estimate_normals(frame, classical, max_depth_step=step)
    assert mean_error(broken, truth, depth) > bound


@pytest.mark.parametrize("scale", [1e-2, 1e3])
@pytest.mark.parametrize("stress", ["clean", "1 mm steps", "kinect noise", "disparity steps"])
def test_the_unit_of_depth_does_not_matter(renderer, scene, stress, scale):
    depth = STRESSES[stress](scene[0]).astype(np.float32)
    metres = renderer.estimate_normals(frame_of(depth))
    scaled = renderer.estimate_normals(frame_of(depth, scale))
    assert angle(metres, scaled)[depth > 0].mean() < 0.05
    assert (angle(metres, scaled)[depth > 0] > 1).mean() < 0.01  # the scaled input is itself rounded to float32


@pytest.mark.parametrize("method", ["auto", "star", "star-borrow", "triangles-8", "plane-fit-5", "one-sided"])
@pytest.mark.parametrize("stress", ["clean", "1 mm steps", "kinect noise"])
def test_a_mirrored_picture_has_mirrored_normals(renderer, scene, stress, method):
    depth = STRESSES[stress](scene[0])
    plain = renderer.estimate_normals(frame_of(depth), method)
    flipped = renderer.estimate_normals(frame_of(depth[:, ::-1]), method)[:, ::-1] * (-1, 1, 1)
    assert (angle(plain, flipped)[depth > 0] > 0.1).mean() < 0.002


@pytest.mark.parametrize("method", ["auto", "star", "star-borrow", "triangles-8", "plane-fit-5", "one-sided"])
@pytest.mark.parametrize("stress", ["clean", "1 mm steps", "kinect noise"])
def test_a_turned_picture_has_turned_normals(renderer, scene, stress, method):
    depth = STRESSES[stress](scene[0])
    plain = renderer.estimate_normals(frame_of(depth), method)
    upright = ps.Camera(262.5, 262.5, 119.5, 159.5, 240, 320)
    turned = ps.Frame(None, np.rot90(depth).astype(np.float32), upright)
    normals = np.rot90(renderer.estimate_normals(turned, method), -1)
    back = np.stack([-normals[..., 1], normals[..., 0], normals[..., 2]], -1)
    assert (angle(plain, back)[depth > 0] > 0.1).mean() < 0.002


ODD_DEPTHS = {
    "one value": np.ones((60, 80)),
    "checkerboard": np.where(np.indices((60, 80)).sum(0) % 2, 1.0, 0),
    "random": np.random.default_rng(0).uniform(1e-3, 1e5, (60, 80)),
    "tiny": np.full((60, 80), 1e-6),
    "huge": np.full((60, 80), 1e18),
    "one row": np.vstack([np.ones((1, 80)), np.zeros((59, 80))]),
    "steps": np.repeat(np.linspace(1, 2, 20), 240).reshape(60, 80),
}


@pytest.mark.parametrize("method", ["auto", "adaptive", "star", "star-borrow", "plane-fit-7", "central", "triangles-8"])
@pytest.mark.parametrize("name", ODD_DEPTHS)
def test_odd_depths_get_unit_normals_towards_the_camera(renderer, name, method):
    depth = ODD_DEPTHS[name].astype(np.float32)
    normals = renderer.estimate_normals(ps.Frame(None, depth, ps.Camera(70, 70, 39.5, 29.5, 80, 60)), method)
    known = depth > 0
    assert np.abs(np.linalg.norm(normals[known], axis=-1) - 1).max() < 1e-4
    v, u = np.nonzero(known)
    ray = np.stack([(u - 39.5) / 70, (v - 29.5) / 70, np.ones(len(u))], -1)
    assert ((normals[known] * ray).sum(-1) < 1e-3).all()


@pytest.mark.parametrize("size", [(1, 1), (1, 7), (7, 1), (2, 2), (33, 47), (49, 97)])
@pytest.mark.parametrize("method", ["auto", "adaptive", "star-borrow"])
def test_pictures_of_any_size(renderer, size, method):
    camera = ps.Camera(50, 50, size[1] / 2, size[0] / 2, size[1], size[0])
    depth = 1 + np.random.default_rng(1).normal(0, 0.01, size)
    normals = renderer.estimate_normals(ps.Frame(None, depth, camera), method)
    assert np.isfinite(normals).all()


def test_flicker_under_thirty_noisy_frames_is_bounded(renderer, scene):
    """The same still scene, 30 times with Kinect noise: how far the normals of a pixel spread about their mean."""
    spread = {}
    for method in ("auto", "triangles-8"):
        total = []
        for seed in range(30):
            normals = renderer.estimate_normals(frame_of(kinect(scene[0], seed)), method, max_depth_step="5%")
            total.append(normals[8:-8, 8:-8])
        mean = np.mean(total, 0)
        mean /= np.linalg.norm(mean, axis=-1, keepdims=True)
        spread[method] = float(np.mean([angle(n, mean).mean() for n in total]))
    print(f"flicker in degrees: {spread}")
    assert spread["auto"] < 1.0 and spread["auto"] < spread["triangles-8"] / 8


@pytest.mark.parametrize("sigma", [0.0005, 0.002, 0.005])
def test_gaussian_noise_is_measured(scene, sigma):
    noise = measure_noise(gaussian(scene[0], sigma).astype(np.float32), 262.5)
    assert noise.sigma == pytest.approx(sigma, rel=0.15)


def test_rounding_steps_are_found(scene):
    assert measure_noise(rounded(scene[0], 0.001).astype(np.float32), 262.5).step == pytest.approx(0.001, rel=0.01)
    noise = measure_noise(disparity(scene[0]).astype(np.float32), 262.5)
    assert noise.domain == "1/z" and noise.step == pytest.approx(1 / 8 / (262.5 * 0.075), rel=0.05)


def test_repeated_lines_are_seen_and_leave_no_speckle(renderer):
    """A grazing floor, enlarged: neighbouring lines are equal or differ by a slope: no noise level explains that."""
    hits = trace([plane((0.1, -0.9, 0), (0, 0.25, 0), frames.checks)], CAMERA)
    depth = enlarged(rounded(np.where((hits.depth > 0) & (hits.depth < 3), hits.depth, 0), 0.001))
    normals = renderer.estimate_normals(frame_of(depth))
    assert renderer.choice.noise.misplaced == pytest.approx(1.5 / np.sqrt(12), rel=0.1)
    error = angle(normals, hits.normals)
    known = depth > 0
    known[:, :8] = known[:, -8:] = known[-8:] = False
    assert error[known].mean() < 0.8 and (error[known] > 15).mean() < 0.005
    assert measure_noise(rounded(hits.depth, 0.001).astype(np.float32), 262.5).misplaced == 0


def test_the_choice_is_said_in_words(renderer, scene):
    renderer.estimate_normals(frame_of(scene[0]))
    assert describe(renderer.choice).startswith("star: the depth is clean")
    renderer.estimate_normals(frame_of(rounded(scene[0], 0.001)))
    assert "rounded to steps of 1 mm" in describe(renderer.choice)
    renderer.estimate_normals(frame_of(scene[0]), noise=0.001)
    assert "noise was given" in describe(renderer.choice)
    renderer.estimate_normals(frame_of(scene[0]), "central")
    assert describe(renderer.choice) == "central: as requested"


@pytest.mark.parametrize(
    ("noise", "complaint"),
    [
        (0, "noise must be metres above 0, got 0"),
        (-0.001, "got -0.001"),
        (np.nan, "got nan"),
        (np.inf, "got inf"),
        (np.ones((3, 4)), r"the depth's shape \(240, 320\), got \(3, 4\)"),
        (np.zeros((240, 320)), "above 0 wherever depth is known"),
        ("sonar", "unknown sensor 'sonar' for noise: known are kinect"),
    ],
)
def test_impossible_noise_is_named(renderer, scene, noise, complaint):
    with pytest.raises(ValueError, match=complaint):
        renderer.estimate_normals(frame_of(scene[0]), noise=noise)


def test_given_noise_per_pixel_is_used(renderer, scene):
    """Half of the frame is noisy and the caller says so: the other half stays as sharp as clean depth."""
    depth, truth = scene
    sigma = np.where(np.arange(320) < 160, 0.002, 1e-7)[None].repeat(240, 0)
    noisy = gaussian(depth, sigma)
    normals = renderer.estimate_normals(frame_of(noisy), noise=sigma)
    error = angle(normals, truth)
    assert error[8:-8, 170:-8].mean() < 0.3
    assert error[8:-8, 8:150].mean() < 3


def test_a_slanted_plane_stays_a_plane_under_noise(renderer):
    hits = trace([plane((0.9, 0.2, -0.4), (0, 0, 1.5), frames.checks)], CAMERA)
    depth = gaussian(np.where(hits.depth < 6, hits.depth, 0), 0.001)
    normals = renderer.estimate_normals(frame_of(depth))
    assert mean_error(normals, hits.normals, depth) < 1.0
