"""Fine structure is not taken for noise, and what was decided about noise stays, and can be told."""

import numpy as np
import pytest
from numpy.lib.stride_tricks import sliding_window_view

import pointshade_gl as ps
from pointshade_gl.bench.tracing import plane, sphere, trace
from pointshade_gl.estimation.noise_model import PATIENCE, Decisions, lattice_step, misplaced_pixels
from pointshade_gl.scene.noise import Noise, NoiseWords, describe, noise_words

from ..reference import noise_structure

CAMERA = ps.Camera(525, 525, 239.5, 191.5, 480, 384)


def bumps(seed=2, count=4000):
    """Depth and true normals of spheres of a few pixels that lie all over a wall."""
    rng = np.random.default_rng(seed)
    v, u = np.mgrid[:384, :480]
    ray = np.stack([(u - 239.5) / 525, (v - 191.5) / 525, np.ones(u.shape)], -1)
    z, n = np.full(u.shape, 1.55), np.zeros((*u.shape, 3))
    n[:] = 0, 0, -1
    for _ in range(count):
        centre = np.array([rng.uniform(-0.75, 0.75), rng.uniform(-0.6, 0.6), rng.uniform(1.5, 1.55)])
        radius = rng.uniform(0.01, 0.025)
        low, high = ((centre[:2] / centre[2] + k * radius) * 525 + (239.5, 191.5) for k in (-1, 1))
        window = tuple(slice(max(int(a) - 1, 0), int(b) + 3) for a, b in zip(low[::-1], high[::-1], strict=True))
        d = ray[window]
        a, b, c = (d * d).sum(-1), d @ centre, centre @ centre - radius**2
        hit = (b - np.sqrt(np.maximum(b * b - a * c, 0))) / a
        nearer = (b * b > a * c) & (hit < z[window])
        z[window][nearer] = hit[nearer]
        n[window][nearer] = ((hit[..., None] * d - centre) / radius)[nearer]
    return z, n


@pytest.fixture(scope="module")
def busy():
    return bumps()


def wall():
    """Depth and true normals of a smooth, tilted wall."""
    v, u = np.mgrid[:384, :480]
    normal = np.array([0.2, -0.3, -1]) / np.linalg.norm([0.2, -0.3, -1])
    depth = 1.5 / (((u - 239.5) / 525) * -0.2 + ((v - 191.5) / 525) * 0.3 + 1)
    return depth, np.broadcast_to(normal, (384, 480, 3))


def noisy(depth, sigma=0.001, seed=1):
    return depth + np.random.default_rng(seed).normal(0, sigma, depth.shape)


def mean_error(renderer, depth, normals, where=np.s_[:, :], **options):
    frame = ps.Frame(None, depth.astype(np.float32), CAMERA)
    found = renderer.estimate_normals(frame, **options)
    return np.degrees(np.arccos(np.clip((found * normals).sum(-1), -1, 1)))[where].mean()


@pytest.mark.parametrize(
    "spoil", [lambda z: z, lambda z: np.round(z * 5000) / 5000, noisy], ids=["clean", "16bit", "1mm"]
)
def test_structure_is_not_averaged_away(renderer, busy, spoil):
    depth, normals = spoil(busy[0]), busy[1]
    star = mean_error(renderer, depth, normals, method="star")
    assert mean_error(renderer, depth, normals) < 1.05 * star


def test_clean_structure_gets_the_edge_exact_estimator(renderer, busy):
    mean_error(renderer, *busy)
    assert renderer.choice.method == "star"


def test_each_half_of_a_frame_gets_what_it_needs(renderer, busy):
    """Clean structure on the left, a smooth noisy wall on the right."""
    (depth, normals), (smooth, flat) = busy, wall()
    left = np.arange(480)[None] < 240
    mixed, truth = np.where(left, depth, noisy(smooth)), np.where(left[..., None], normals, flat)
    star = mean_error(renderer, mixed, truth, np.s_[:, :200], method="star")
    assert mean_error(renderer, mixed, truth, np.s_[:, :200]) < 1.1 * star
    assert mean_error(renderer, mixed, truth, np.s_[:, 280:]) < 1.5  # star: 9


def test_structure_patch_agrees_with_its_mirror(gpu, busy):
    depth = busy[0].astype(np.float32)
    depth[50:60, 100:130] = 0
    rng = np.random.default_rng(4)
    first = rng.integers(-3, (483, 387), (400, 2))
    first = np.concatenate([first, [[105, 52], [0, 0], [477, 381]]])
    at = first.astype(np.float32)
    found = gpu("noise_structure.glsl", "structure_patch(depth_map, ivec2(first))", first=at, depth_map=depth)
    mirror = noise_structure.structure_patch(depth, (first[:, 0], first[:, 1]))
    assert (found < 0).any() and ((found < 0) == (mirror < 0)).all()
    np.testing.assert_allclose(found, mirror, atol=2e-6)


def test_ring_residual_of_white_noise_is_the_same_for_every_reach():
    depth = noisy(np.ones((64, 64))).astype(np.float32)
    v, u = np.mgrid[4:60, 4:60]
    near, far = (np.median(noise_structure.ring_residual(depth, (u, v), reach)) for reach in (1, 2))
    assert far == pytest.approx(near, rel=0.05)


def test_a_lattice_needs_blocks_that_agree():
    seen = np.ones((4, 5), bool)
    step = np.full((4, 5), 0.001)
    assert lattice_step(step, seen) == 0.001
    step[1:] *= np.arange(2, 17).reshape(3, 5)  # as far from a sensor of disparity: few depths of a fine lattice
    assert lattice_step(step, seen) == pytest.approx(0.001)
    assert lattice_step(np.random.default_rng(0).uniform(0.001, 0.01, (4, 5)), seen) == 0


def test_repeated_lines_need_votes_from_nearly_all_blocks():
    assert misplaced_pixels(np.full(20, 0.33)) > 0
    assert misplaced_pixels(np.where(np.arange(20) < 11, 0.33, 0.0)) == 0
    assert misplaced_pixels(np.full(20, 0.08)) == 0


def disparity(depth, seed):
    """Disparity with noise that neighbours share, rounded to 1/8 pixel and then to millimetres."""
    noise = np.random.default_rng(seed).normal(0, 0.05, depth.shape)
    for axis in (0, 1):
        noise = (np.roll(noise, 1, axis) + 2 * noise + np.roll(noise, -1, axis)) / 6**0.5
    return np.round(525 * 0.075 / (np.round((525 * 0.075 / depth + noise) * 8) / 8), 3)


def interpolated(depth, reach, offset=0.0):
    """Depth between pixels, up to `reach` pixels away, as it is moved to the pixels of a color camera."""
    v, u = np.mgrid[: depth.shape[0], : depth.shape[1]]
    at_v = np.clip(v + reach * np.sin(v / 90 + offset), 0, depth.shape[0] - 1.001)
    at_u = np.clip(u + reach * np.sin(u / 150 + offset), 0, depth.shape[1] - 1.001)
    v, u, t, s = at_v.astype(int), at_u.astype(int), at_v % 1, at_u % 1
    top, bottom = ((1 - s) * depth[v + k, u] + s * depth[v + k, u + 1] for k in (0, 1))
    return (1 - t) * top + t * bottom


def room(distance, seed):
    """Depth and true normals of spheres before two walls that meet at a distance, metres."""
    rng = np.random.default_rng(seed)
    turn = rng.uniform(0.2, 0.5)
    surfaces = [plane((s, rng.uniform(-0.3, 0.3), -1), (0, 0, distance), lambda p: p) for s in (turn, turn - 0.7)]
    for _ in range(3):
        centre = np.array([*rng.uniform(-0.3, 0.3, 2), 1]) * distance * rng.uniform(0.5, 0.9)
        surfaces.append(sphere(centre, 0.1 * distance, lambda p: p))
    hits = trace(surfaces, CAMERA)
    return hits.depth, hits.normals


@pytest.mark.parametrize(("distance", "seed"), [(1.6, 0), (2, 1), (3, 2), (5, 3), (8, 4)])
def test_steps_of_disparity_are_found_after_interpolation(renderer, distance, seed):
    """Interpolated depth has parts of a step, too; taken for whole millimetres, normals were 9 to 22 times worse."""
    depth, normals = room(distance, seed)
    depth = disparity(depth, seed)
    inside = np.s_[16:-16, 16:-16]
    before = mean_error(renderer, depth, normals, inside)
    after = mean_error(renderer, np.round(interpolated(depth, 1 + seed / 2, seed), 3), normals, inside)
    noise, step = renderer.choice.noise, 1 / 8 / (525 * 0.075)
    assert noise.domain == "1/z" and 0.5 * step < noise.step < 1.05 * step
    assert after < 2 * before


def filtered(depth, seed, sigma, side):
    """Median of noisy depth over side x side pixels, as in cameras that measure time of flight."""
    windows = sliding_window_view(np.pad(noisy(depth, sigma, seed), side // 2, "edge"), (side, side))
    return np.median(windows.reshape(*depth.shape, -1), -1)


def reliefs(seed, count=80):
    """A wall that the camera faces, with rectangles up to 5 mm before and behind it."""
    rng = np.random.default_rng(seed)
    depth = np.full((384, 480), 2.0)
    for _ in range(count):
        v, u, height, width = rng.integers((0, 0, 10, 10), (364, 460, 90, 90))
        depth[v : v + height, u : u + width] += rng.uniform(-0.005, 0.005)
    return depth


@pytest.mark.parametrize(
    "depth",
    [
        lambda seed: room(1, seed)[0],
        lambda seed: room(2, seed)[0],
        lambda seed: noisy(room(2, seed)[0], 0.0004, seed),
        lambda seed: noisy(room(2, seed)[0], 0.002, seed),
        lambda seed: filtered(room(1, seed)[0], seed, 0.01, 3),
        lambda seed: filtered(room(1, seed)[0], seed, 0.004, 5),
        lambda seed: filtered(room(3, seed)[0], seed, 0.01, 5),
        reliefs,
    ],
    ids=["near", "far", "faint noise", "noise", "median of 3x3", "median of 5x5", "far median", "reliefs"],
)
def test_whole_millimetres_are_not_taken_for_steps_of_disparity(renderer, depth):
    for seed in range(2):
        renderer.estimate_normals(ps.Frame(None, np.round(depth(seed), 3).astype(np.float32), CAMERA))
        noise = renderer.choice.noise
        assert noise.domain == "z" and noise.step == pytest.approx(0.001, rel=0.01)


@pytest.mark.parametrize(("width", "height"), [(320, 240), (480, 360)])
def test_whole_centimetres_are_not_taken_for_steps_of_disparity(renderer, width, height):
    """Few blocks of a floor, a wall and balls have jumps; at edges those are of several steps."""
    planes = [plane((0, 0, -1), (0, 0, 2.5001), lambda p: p), plane((0, -1, 0), (0, 0.6001, 0), lambda p: p)]
    balls = [sphere((0.1, -0.05, 1.5), 0.35, lambda p: p), sphere((-0.5, 0.35, 1.7), 0.25, lambda p: p)]
    camera = ps.Camera.from_fov(45, width, height)
    depth = np.round(trace(planes + balls, camera).depth, 2).astype(np.float32)
    renderer.estimate_normals(ps.Frame(None, depth, camera))
    noise = renderer.choice.noise
    assert noise.domain == "z" and noise.step == pytest.approx(0.01, rel=0.01)


def test_a_still_noisy_stream_gets_one_answer(renderer):
    depth, normals = wall()
    errors, said = [], set()
    for seed in range(6):
        errors.append(mean_error(renderer, disparity(depth, seed), normals))
        noise = renderer.choice.noise
        said.add((renderer.choice.method, noise.domain, noise.misplaced > 0))
    assert said == {("adaptive", "1/z", False)}
    assert max(errors) < 1.2 * min(errors)


def found(share=0.5, domain="z", misplaced=0.0):
    return Noise(0.001, 0.001, 0.001, domain, 0, misplaced, share, None, (0, -1))


class TestDecisions:
    def test_one_odd_frame_changes_nothing(self):
        decisions, usual = Decisions(), found()
        assert decisions.settle("a", usual) is usual
        assert decisions.settle("a", found(misplaced=0.3)) is usual
        assert decisions.settle("a", another := found()) is another

    def test_evidence_over_several_frames_does(self):
        decisions, odd = Decisions(), [found(domain="1/z") for _ in range(PATIENCE)]
        decisions.settle("a", found())
        assert [decisions.settle("a", noise) is noise for noise in odd] == [False] * (PATIENCE - 1) + [True]

    def test_a_clear_change_counts_at_once(self):
        decisions, clean = Decisions(), found(0.0)
        decisions.settle("a", clean)
        assert decisions.settle("a", found(0.02)) is clean
        assert decisions.settle("a", noise := found(0.5)) is noise

    def test_streams_do_not_know_of_each_other(self):
        decisions, other = Decisions(), found(domain="1/z")
        decisions.settle("a", found())
        assert decisions.settle("b", other) is other


def test_frames_made_by_hand_are_judged_alone(renderer):
    """What was drawn before changes no picture, unless frames say that they are of one stream."""
    depth = wall()[0]
    alone, other = noisy(depth, 3e-5), disparity(depth, 0)

    def normals(z, source=None):
        frame = ps.Frame(None, z.astype(np.float32), CAMERA, source=source)
        return renderer.estimate_normals(frame), renderer.choice.noise.domain

    before = normals(alone)
    normals(other)
    after = normals(alone)
    assert np.array_equal(before[0], after[0])
    assert normals(other, "stream")[1] == "1/z"
    assert normals(noisy(other, 0.003), "stream")[1] == "1/z"  # kept: one frame is no evidence


def test_frames_of_one_stream_that_are_drawn_together_are_judged_alone(renderer):
    """Which others are in a set, and in which order, changes the normals of none."""
    depth = wall()[0]
    first, *others = (
        ps.Frame(None, z.astype(np.float32), CAMERA, ps.orbit_pose(None, (0, 0, 2), yaw), source="set")
        for yaw, z in enumerate([disparity(depth, 0), noisy(depth, 3e-5), noisy(depth, 3e-5)])
    )
    renderer.render([first, *others])
    together = renderer.choice.noise
    renderer.render(others)
    assert renderer.choice.noise.domain == together.domain == ""


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("clean", NoiseWords()),
        ("1.5mm", NoiseWords(0.0015)),
        ("0.2%,shared=2", NoiseWords(0.002, True, 2.0)),
        ("2mm,shared=1.5,steps=1mm,repeated=0.4", NoiseWords(0.002, False, 1.5, 0.001, "z", 0.4)),
        ("0.4mm,shared=6,steps=1mm,bumps=0.003/m", NoiseWords(0.0004, False, 6, 0.001, "z", 0.0, 0.003)),
        ("0.3%,steps=0.0029/m", NoiseWords(0.003, True, 0.0, 0.0029, "1/z")),
    ],
)
def test_noise_in_words_is_read_as_it_is_written(text, words):
    assert noise_words(text) == pytest.approx(words) if text == "clean" else str(noise_words(text)) == text
    assert str(words) == text


@pytest.mark.parametrize(
    "text", ["", "sonar", "shared=2", "1.5mm,shared=2mm", "1mm,1mm", "0mm", "1mm;shared=2", "1.2.3mm"]
)
def test_other_texts_are_no_noise(text):
    assert noise_words(text) is None
    with pytest.raises(ValueError, match=r"unknown sensor .* or pass metres, or 'clean', or 1\.5mm"):
        ps.Appearance(noise=text)


@pytest.mark.parametrize("spoil", [lambda z: z, noisy, lambda z: disparity(z, 0)], ids=["clean", "noisy", "disparity"])
def test_what_was_printed_can_be_given_back(renderer, spoil):
    depth, normals = wall()
    depth = spoil(depth)
    measured = mean_error(renderer, depth, normals)
    said, method = describe(renderer.choice), renderer.choice.method
    text = said.split("(noise='")[1].removesuffix("')")
    told = mean_error(renderer, depth, normals, noise=text)
    assert renderer.choice.method == method and "noise was given" in describe(renderer.choice)
    assert told < 1.3 * measured + 0.1
