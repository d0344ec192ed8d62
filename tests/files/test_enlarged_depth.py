"""A network's depth that was enlarged to the size of its photograph comes back to the size at which it was made."""

import numpy as np
import pytest
from PIL import Image

import pointshade_gl as ps
from pointshade_gl.files.depth.depth_kinds import reduced, times_enlarged

H, W = 480, 640
HOW = {"bilinear": Image.Resampling.BILINEAR, "cubic": Image.Resampling.BICUBIC, "area": Image.Resampling.BOX}


def discs(seed=1):
    """Depth (H, W) and colours (H, W, 3) of 40 tilted discs before a slanted wall; the colours are means of 4x4."""
    rng = np.random.default_rng(seed)
    v, u = (np.mgrid[: 4 * H, : 4 * W] + 0.5) / 4 - 0.5
    inverse = 0.1 + 0.1 * u / W + 0.05 * v / H
    color = np.full((4 * H, 4 * W, 3), 150.0)
    for _ in range(40):
        (x, y), radius, near = rng.uniform((0, 0), (W, H)), rng.uniform(20, 60), rng.uniform(0.3, 1)
        part = tuple(slice(max(0, int(4 * (at - radius))), int(4 * (at + radius)) + 8) for at in (y, x))  # around it
        across, down = u[part] - x, v[part] - y
        inside = across**2 + down**2 < radius**2
        plane = near + rng.uniform(-0.001, 0.001) * across
        inside &= plane > inverse[part]
        inverse[part] = np.where(inside, plane, inverse[part])
        color[part][inside] = rng.uniform(40, 230, 3)
    soft = color.reshape(H, 4, W, 4, 3).mean((1, 3)).round().astype(np.uint8)
    return 1 / inverse[2::4, 2::4].astype(np.float32), soft


def resized(depth, size, how):
    return 1 / np.asarray(Image.fromarray(1 / depth).resize(size, HOW[how]))


@pytest.fixture(scope="module")
def scene():
    return discs()


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_sharp_depth_has_its_own_size(seed):
    assert times_enlarged(discs(seed)[0]) == 1


@pytest.mark.parametrize("how", HOW)
@pytest.mark.parametrize("width", [320, 434, 518])
def test_depth_as_a_network_makes_it_has_its_own_size(scene, width, how):
    assert times_enlarged(resized(scene[0], (width, width * H // W), how)) == 1


@pytest.mark.parametrize("enlarged", ["bilinear", "cubic"])
@pytest.mark.parametrize("how", HOW)
@pytest.mark.parametrize(("times", "least", "most"), [(2, 2, 2), (3, 2, 4), (6, 4, 8)])
def test_how_many_times_it_was_enlarged(scene, how, enlarged, times, least, most):
    small = resized(scene[0], (320, 240), how)
    assert least <= times_enlarged(resized(small, (320 * times, 240 * times), enlarged)) <= most


def test_256_levels_tell_it_too(scene):
    large = 1 / resized(resized(scene[0], (320, 240), "area"), (W, H), "bilinear")
    assert times_enlarged(1 / np.maximum(np.round(large / large.max() * 255), 1)) == 2


def test_it_does_not_become_smaller_than_what_networks_make(scene):
    soft = resized(resized(scene[0], (160, 120), "area"), (1280, 960), "bilinear")
    assert times_enlarged(soft) == 5
    assert times_enlarged(soft[:384, :384]) == 2
    assert times_enlarged(soft[:383, :500]) == 1


@pytest.mark.parametrize(
    "depth",
    [
        np.full((H, W), 2.0),
        np.zeros((H, W)),
        np.ones((1, 1)),
        np.ones((3, 500)),
        1 / (0.2 + np.mgrid[:H, :W][1] / W),
        1 / (1 + 0.3 * np.sin(np.mgrid[:H, :W][1] / 30)),
        np.random.default_rng(0).uniform(1, 9, (H, W)),
    ],
    ids=["flat", "nothing", "a pixel", "three rows", "a slope", "waves", "noise"],
)
def test_without_edges_nothing_was_enlarged(depth):
    assert times_enlarged(depth) == 1


def test_a_plane_stays_itself_and_what_is_missing_stays_missing():
    v, u = np.mgrid[:9, :12]
    depth = (1 / (0.5 + 0.01 * u + 0.02 * v)).astype(np.float32)
    depth[:3, :3] = 0
    small = reduced(depth, 3)
    v, u = np.mgrid[1:9:3, 1:12:3]
    expected = 1 / (0.5 + 0.01 * u + 0.02 * v)
    expected[0, 0] = 0
    np.testing.assert_allclose(small, expected, rtol=1e-6)


def laid(depth):
    """16 bits, as networks' inverse depth is saved."""
    return np.round(65535 * (1 / depth - 0.1) / (1 / depth).max()).clip(0, 65535).astype(np.uint16)


def enlarged(depth):
    return resized(resized(depth, (320, 240), "area"), (W, H), "bilinear")


def test_a_frame_has_the_size_at_which_its_depth_was_made_and_a_note_says_so(scene, tmp_path):
    depth, color = scene
    Image.fromarray(laid(enlarged(depth))).save(tmp_path / "depth.png")
    notes = []
    options = {"color": color, "depth_kind": "inverse", "fov": 45}
    frame = ps.load_frame(depth=tmp_path / "depth.png", notes=notes.append, **options)
    assert (frame.depth.shape, frame.color.shape) == ((240, 320), (480, 640, 3))
    assert (frame.camera.width, frame.camera.fx) == (320, pytest.approx(frame.camera.fy))
    assert frame.picture_camera == ps.Camera.from_fov(45, W, H)
    (said,) = [one for one in notes if "edges that are 2 pixels wide" in one]
    assert "depth.png: depth of 640x480" in said and "taken at 320x240" in said
    sharp = ps.load_frame(depth=laid(depth), notes=notes.append, **options)
    assert sharp.depth.shape == (H, W)


def test_metres_that_are_known_everywhere_are_a_networks_too(scene):
    depth, color = scene
    frame = ps.load_frame(depth=enlarged(depth), color=color, fov=45, notes=[].append)
    assert frame.depth.shape == (240, 320)


def test_without_colours_or_with_smaller_ones_and_of_sensors_it_is_left_alone(scene):
    depth, color = scene
    soft, unheard = enlarged(depth), [].append
    values, holes = laid(soft), soft.copy()
    holes[:5, :5] = 0
    for depth, options in (
        (values, {"depth_kind": "inverse"}),
        (values, {"depth_kind": "inverse", "color": color[::2, ::2]}),
        (values, {"depth_kind": "inverse", "color": color, "depth_scale": 1e4}),
        (values, {"depth_kind": "z", "color": color, "depth_scale": 1e4}),
        (holes, {"color": color}),
    ):
        assert ps.load_frame(depth=depth, fov=45, notes=unheard, **options).depth.shape == (H, W)


@pytest.mark.parametrize("kind", ["inverse", "z"])
def test_all_frames_of_a_sequence_have_the_size_of_the_first(scene, tmp_path, kind):
    depth, color = scene
    soft, holes = enlarged(depth), enlarged(depth)
    holes[:5, :5] = 0
    for k, one in enumerate((soft, depth) if kind == "inverse" else (soft, holes)):
        if kind == "inverse":
            Image.fromarray(laid(one)).save(tmp_path / f"depth_{k}.png")
        else:
            np.save(tmp_path / f"depth_{k}.npy", one)
        Image.fromarray(color).save(tmp_path / f"color_{k}.png")
    source = ps.open_source(tmp_path, depth_kind=kind, notes=[].append)
    assert [frame.depth.shape for frame in source] == [(240, 320), (240, 320)]


def psnr(image, truth):
    return -10 * np.log10(np.mean((image[..., :3] / 255 - truth[..., :3] / 255) ** 2))


@pytest.mark.gl
def test_its_picture_is_nearer_to_that_of_sharp_depth(scene):
    """By 3 dB and more; so much by rims that no longer are dark, and by shadows without streaks."""
    depth, color = scene
    camera = ps.Camera.from_fov(45, W, H)
    light = ps.Light(position=(1.2, -0.9, 0.3), shadow=True)
    soft = enlarged(depth)
    truth = ps.render(ps.Frame(color, depth, camera), light)
    before = ps.render(ps.Frame(color, soft, camera), light)
    after = ps.render(ps.Frame(color, reduced(soft, 2), camera.resized(320, 240)), light)
    assert after.shape == truth.shape
    assert psnr(after, truth) > psnr(before, truth) + 3
