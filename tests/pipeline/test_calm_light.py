"""Light on noisy depth: calm where photograph and depth are smooth, and no shadow of the surface's own noise."""

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

import pointshade_gl as ps
from pointshade_gl.scene.noise import describe

CAMERA = ps.Camera(262.5, 262.5, 159.5, 119.5, 320, 240)
LIGHT = ps.Light(position=(-0.8, -0.6, 0.3))
MATT = ps.Material(0.1, 0.9, 0)
V, U = np.mgrid[:240, :320]
LEFT = U < 160
WRONG = (U >= 160) & (U < 300) & (V >= 40) & (V < 200)


def corner() -> np.ndarray:
    """Two walls that meet in the middle, metres."""
    slope = np.where(LEFT, 0.5, -0.5) * (U - 159.5) / 262.5
    return 1.5 / (1 - slope)


def noises(depth: np.ndarray) -> dict[str, np.ndarray]:
    """Noise of each pixel, and noise that neighbours share, as of stereo."""
    random = np.random.default_rng(2)
    wide = gaussian_filter(random.normal(size=depth.shape), 3)
    return {
        "own": depth + random.normal(0, 0.004, depth.shape),
        "shared": 1 / (np.round((1 / depth + 0.003 * wide / wide.std()) * 1260) / 1260),
    }


@pytest.fixture(scope="module")
def photograph() -> np.ndarray:
    """The walls have two colours; a camera has noise of its own."""
    grey = np.where(LEFT, 90, 150) + np.random.default_rng(1).normal(0, 1, LEFT.shape)
    return np.repeat(np.round(grey).astype(np.uint8)[..., None], 3, 2)


@pytest.fixture(params=["own", "shared"])
def noise(request) -> str:
    return request.param


@pytest.fixture
def noisy(noise, photograph) -> ps.Frame:
    return ps.Frame(photograph, noises(corner())[noise].astype(np.float32), CAMERA)


def off(picture: np.ndarray, truth: np.ndarray) -> np.ndarray:
    """The error away from the picture's borders, 8 bits."""
    return np.abs(picture[..., :3].astype(float) - truth[..., :3])[8:-8, 8:-8].mean(-1)


def test_light_is_calm_and_the_corner_stays(renderer, noise, noisy, photograph):
    truth = renderer.render(ps.Frame(photograph, corner().astype(np.float32), CAMERA), LIGHT, MATT)
    plain, calm = (off(renderer.render(noisy, LIGHT, MATT, normals=name), truth) for name in ("adaptive", "auto"))
    assert np.square(calm).mean() < {"own": 0.4, "shared": 0.75}[noise] * np.square(plain).mean()
    near = np.abs(U - 159.5)[8:-8, 8:-8] < 6
    assert calm[near].mean() < 1.05 * plain[near].mean()


def test_normals_that_are_asked_for_stay_as_measured(renderer, noisy):
    """Calm normals are for light: `estimate_normals` is that of "adaptive", and a sentence says so."""
    renderer.render(noisy, LIGHT)
    assert "for light, normals are averaged" in describe(renderer.choice)
    assert (renderer.estimate_normals(noisy) == renderer.estimate_normals(noisy, "adaptive")).all()


def test_clean_frames_and_other_methods_are_not_calmed(noisy, photograph):
    clean = ps.Frame(photograph, corner().astype(np.float32), CAMERA)
    with ps.Renderer() as made:
        for frame, options in ((clean, {}), (noisy, {"normals": "adaptive"}), (noisy, {"shading": "none"})):
            made.render(frame, LIGHT, **options)
            assert made.steps.counts["calm"] == 0
        made.render(noisy, LIGHT)
        made.render(noisy, ps.Light(position=(0.5, 0, 0)))
        assert made.steps.counts["calm"] == 1  # another light costs nothing more


def test_a_surface_is_not_shadowed_by_its_own_noise(renderer, noise, photograph):
    wall = noises(np.full(LEFT.shape, 1.5))[noise]
    frame, low = ps.Frame(photograph, wall.astype(np.float32), CAMERA), (-1.2, 0, 1.45)
    lit, shadowed = (renderer.render(frame, ps.Light(position=low, shadow=on), MATT)[..., 0] for on in (False, True))
    assert not (shadowed.astype(int) < lit - 3.0)[8:-8, 8:-8].any()


@pytest.fixture(scope="module")
def blank() -> ps.Frame:
    """An even wall; where WRONG is, stereo has seen planes of 20x20 pixels that are not there."""
    flat, slopes = np.full(LEFT.shape, 1.5), np.random.default_rng(4).normal(0, 0.8, (2, 12, 16))
    u, v = slopes.repeat(20, 1).repeat(20, 2)
    planes = (u * (U % 20 - 9.5) + v * (V % 20 - 9.5)) * 1.5 / CAMERA.fx
    grey = np.round(150 + np.random.default_rng(1).normal(0, 1, (240, 320, 1))).astype(np.uint8).repeat(3, -1)
    return ps.Frame(grey, (noises(flat)["shared"] + planes * WRONG).astype(np.float32), CAMERA)


def test_wrong_depth_is_lit_like_what_surrounds_it_and_its_share_is_named(renderer, blank):
    wall = renderer.render(ps.Frame(blank.color, np.full(LEFT.shape, 1.5, np.float32), CAMERA), LIGHT, MATT)
    pictures = [renderer.render(blank, LIGHT, MATT, normals=name) for name in ("adaptive", "auto")]
    plain, calm = (np.abs(one[..., 0].astype(float) - wall[..., 0])[WRONG].mean() for one in pictures)
    assert calm < 0.1 * plain
    share = renderer.choice.wrong
    assert 0.5 < share / WRONG.mean() < 1.1
    assert f"depth seems wrong over {100 * share:.0f} % of the picture" in describe(renderer.choice)


def test_wrong_depth_shows_no_highlights(renderer, blank):
    black = ps.Frame((blank.color // 30).astype(np.uint8), blank.depth, CAMERA)
    matt, shiny = (renderer.render(black, LIGHT, ps.Material(0.1, 0.9, s), exposure=0, fill=0) for s in (0, 0.3))
    highlights = (shiny.astype(int) - matt)[..., 0]
    assert highlights[80:160, 210:260].max() <= 3 and highlights[~WRONG].max() > 100


def body() -> np.ndarray:
    """A wall, and before it a ball with a nose, metres."""
    far = np.hypot(U - 160, V - 120)
    ball = 1.5 - 0.25 * np.sqrt(np.maximum(1 - (far / 90) ** 2, 0))
    return np.where(far < 90, ball, 2.0) - 0.12 * np.exp(-0.5 * (far / 28) ** 2)


def test_a_nose_and_the_rim_of_a_body_stay(renderer):
    """Wide cells around a nose do not outvote it, nor those of a wall the rim before it: no photograph shows either."""
    mottled = gaussian_filter(np.random.default_rng(1).normal(size=(*LEFT.shape, 3)), (4, 4, 0))
    color = np.clip(150 + 12 * mottled / mottled.std(), 0, 255).astype(np.uint8)
    truth = renderer.render(ps.Frame(color, body().astype(np.float32), CAMERA), LIGHT, MATT)
    noisy = ps.Frame(color, noises(body())["shared"].astype(np.float32), CAMERA)
    plain, calm = (off(renderer.render(noisy, LIGHT, MATT, normals=name), truth) for name in ("adaptive", "auto"))
    nose = (np.hypot(U - 160, V - 120) < 40)[8:-8, 8:-8]
    assert calm[nose].mean() < plain[nose].mean() and calm.mean() < plain.mean()


def test_calm_normals_open_no_gaps_between_splats_that_are_turned(renderer):
    ramp = 1.2 + 0.6 * np.clip((U - 120) / 40, 0, 1)  # what a sensor's own filter makes of an edge
    depth = (ramp + noises(corner())["shared"] - corner()).astype(np.float32)
    grey = np.round(150 + np.random.default_rng(1).normal(0, 1, (240, 320, 1))).astype(np.uint8).repeat(3, -1)
    frame = ps.Frame(grey, depth, CAMERA)
    pose = ps.orbit_pose(frame.pose, tuple(frame.pivot), yaw=20)
    plain, calm = (renderer.render(frame, pose=pose, normals=name)[..., 3] for name in ("adaptive", "auto"))
    assert renderer.choice.calm
    assert (plain > 0).mean() > 0.5 and ((plain > 0) & (calm == 0)).sum() == 0


def test_right_depth_is_not_doubted(renderer, noisy):
    renderer.render(noisy, LIGHT, MATT)
    assert renderer.choice.calm and renderer.choice.wrong < 0.001


def test_info_names_wrong_depth(typed, blank, photograph, tmp_path):
    frames = {"wrong": blank, "right": ps.Frame(photograph, noises(corner())["shared"].astype(np.float32), CAMERA)}
    for name, frame in frames.items():
        (tmp_path / name).mkdir()
        ps.save_image(tmp_path / name / "color.png", frame.color)
        np.save(tmp_path / name / "depth.npy", frame.depth)
        code, out, _ = typed(f"info {tmp_path / name} --intrinsics 262.5,262.5,159.5,119.5")
        assert code == 0 and ("depth seems wrong over" in out) == (name == "wrong")
