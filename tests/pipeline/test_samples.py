"""Pictures of several samples: where these lie, what they add up to and cost, how near the truth they come."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest

import pointshade_gl as ps
from pointshade_gl.bench.tracing import as_frame, decode, encode, sphere_and_wall, trace
from pointshade_gl.scene import shadow_cameras
from pointshade_gl.scene.camera import Eye
from pointshade_gl.scene.sample_pattern import ball_point, light_part, moved_light, pixel_offset
from pointshade_gl.scene.settings import OutputSettings

from ..benchmarks.traced_light import co_visible, shade
from ..reference import rasterizers
from ..reference import sample_mean as developed
from ..reference.render import render as mirror_render
from ..support import frames
from ..support.compare import compare_images
from ..support.drivers import merging, need_compute
from ..support.view_sets import pose_at, three_views
from .test_pictures import vase

LIGHT = ps.Light(position=(-0.8, -0.9, 0.2))
ASIDE = ps.orbit_pose(None, (0, 0, 1.5), 15, 5)
BOARD = ps.Mesh([(-0.4, 0.3, 1), (0.4, 0.3, 1), (0.4, 0.3, 2), (-0.4, 0.3, 2)], [(0, 1, 2), (0, 2, 3)])


@pytest.fixture(scope="module", params=["compute", "points"])
def rasterizer(request, renderer):
    if request.param == "compute":
        need_compute(renderer)
    with ps.Renderer(rasterizer=request.param) as made:
        made.name = request.param
        yield made


def offsets(count):
    return np.array([pixel_offset(k) for k in range(count)])


class TestPlaces:
    def test_the_first_sample_is_the_middle_and_all_lie_within_the_pixel(self):
        assert pixel_offset(0) == (0, 0)
        assert np.abs(offsets(4096)).max() <= 0.5

    @pytest.mark.parametrize(("count", "most"), [(16, 0.04), (64, 0.01), (256, 0.003)])
    def test_the_samples_leave_the_picture_where_it_is(self, count, most):
        assert np.abs(offsets(count).mean(0)).max() <= most

    def test_the_first_samples_of_a_longer_run_cover_edges_evenly(self):
        """The share of an edge's pixel that they find, over many edges: its error falls faster than that of chance."""
        rng = np.random.default_rng(0)
        turn, shift = rng.uniform(0, 2 * np.pi, 500), rng.uniform(-0.5, 0.5, 500)
        edges = np.stack([np.cos(turn), np.sin(turn)], -1)
        whole = (np.stack(np.meshgrid(*[np.arange(100)] * 2), -1).reshape(-1, 2) + 0.5) / 100 - 0.5
        truth = (whole @ edges.T < shift).mean(0)
        for count, share in ((4, 0.95), (16, 0.65), (64, 0.4)):
            error = np.sqrt((((offsets(count) @ edges.T < shift).mean(0) - truth) ** 2).mean())
            assert error < share * np.sqrt((truth * (1 - truth)).mean() / count)

    def test_a_light_is_a_disc_from_every_side(self):
        """Of an even disc the mean square of a coordinate is a quarter."""
        points = np.array([ball_point(k) for k in range(1024)])
        assert not points[0].any() and np.linalg.norm(points, axis=1).max() <= 1
        for axis in np.random.default_rng(1).normal(size=(20, 3)):
            along = points @ (axis / np.linalg.norm(axis))
            assert abs(along.mean()) < 0.01 and (along**2).mean() == pytest.approx(0.25, abs=0.01)

    def test_lights_and_pixels_have_nothing_to_do_with_each_other(self):
        points = np.array([ball_point(k) for k in range(64)])
        assert np.abs(np.corrcoef(offsets(64).T, points.T)[:2, 2:]).max() < 0.2

    def test_lights_move_as_far_as_they_are_large(self):
        ball, sun, plain = ps.Light(position=(1, 2, 3), radius=0.5), ps.Light(direction=(0, 0, 2), angle=20), LIGHT
        centre = np.zeros(3)
        for light in (ball, sun, plain):
            assert moved_light(light, 0, centre) == light
        away = [np.subtract(moved_light(ball, k, centre).position, (1, 2, 3)) for k in range(256)]
        assert 0.49 < np.linalg.norm(away, axis=1).max() <= 0.5
        turned = np.array([moved_light(sun, k, centre).direction for k in range(256)])
        angles = np.degrees(np.arccos(turned[:, 2] / np.linalg.norm(turned, axis=1)))
        assert 9.8 < angles.max() <= 10 and np.abs(turned[:, :2].mean(0)).max() < 0.01
        assert moved_light(plain, 5, centre) == plain

    @pytest.mark.parametrize("count", [17, 65])
    def test_an_area_light_is_a_level_rectangle_across_its_direction(self, count):
        for direction in ((0.3, 0.5, -0.2), (0, 1, 0), (0, 0, 2), (-1, 0, 0), (1e-9, -1, 0)):
            light, along = ps.Light((1, 2, 3), direction, size=(0.8, 0.3)), np.array(direction)
            off = np.array([moved_light(light, k, np.zeros(3)).position for k in range(count)]) - (1, 2, 3)
            assert not off[0].any() and np.abs(off @ along).max() < 1e-9 and np.abs(off.mean(0)).max() < 1e-12
            width = np.array([1.0, 0, 0]) if abs(direction[1]) == 1 else np.cross((0, 1.0, 0), along)
            width /= np.linalg.norm(width)
            x, y = off @ width, off @ np.cross(along, width) / np.linalg.norm(along)
            assert 0.36 < np.abs(x).max() <= 0.4 and 0.13 < np.abs(y).max() <= 0.15
            rest = 1 - np.mean([light_part(k) ** 2 for k in range(count)])  # the parts are as wide as what is missing
            assert (x**2).mean() == pytest.approx(rest * 0.8**2 / 12, rel=3 / count)
            assert (y**2).mean() == pytest.approx(rest * 0.3**2 / 12, rel=3 / count)


def test_developed_is_that_of_the_mirror(gpu):
    sums = np.random.default_rng(2).uniform(0, 16, (500, 4)).astype(np.float32)
    sums[:, :3] *= sums[:, 3:] / 16
    sums[:50] = 0
    ground = np.random.default_rng(4).uniform(0, 1, 500).astype(np.float32) * (16 - sums[:, 3])
    for behind in ((0, 0, 0, 0), (0.2, 0.5, 0.9, 1)):
        behind = np.array(behind, np.float32)
        answer = gpu("sample_mean.glsl", "developed(s, g, 16.0, b)", s=sums, g=ground[:, None], b=behind[None])
        np.testing.assert_allclose(answer, developed.developed(sums, ground, 16, behind), atol=1e-5)


def test_a_ground_is_smoothed_as_by_the_mirror(gpu):
    rng = np.random.default_rng(6)
    sums, grounds = rng.uniform(0, 16, (2, 9, 12, 4)).astype(np.float32)
    sums[2:5, 3:9, 3] = 16  # all of these samples show a surface
    pixel = np.stack(np.meshgrid(np.arange(12), np.arange(9)), -1).reshape(-1, 2)
    answer = gpu(
        "sample_mean.glsl", "smooth_ground(grounds_map, sums_map, ivec2(p), 16.0), 0, 0, 0",
        p=pixel.astype(np.float32), grounds_map=grounds, sums_map=sums,
    )  # fmt: skip
    expected = developed.smooth_ground(grounds, sums, pixel, 16)
    np.testing.assert_allclose(answer[:, 0], expected, rtol=1e-5)
    assert (expected[sums[..., 3].reshape(-1) == 16] == grounds[2:5, 3:9, 0].reshape(-1)).all()


def test_a_pixel_shows_the_ground_where_its_samples_show_no_surface(gpu):
    """Of 16 samples 4 are covered, 6 see a ground whose shadow takes .6, and 6 see what is above its horizon."""
    sums, ground = np.array([[2, 1, 0, 4]], np.float32), np.array([[6 * 0.6]], np.float32)
    alpha = 4 / 16 + (1 - 4 / 16) * (6 * 0.6 / 12)
    clear = gpu("sample_mean.glsl", "developed(s, g, 16.0, vec4(0))", s=sums, g=ground)[0]
    np.testing.assert_allclose(decode(clear[:3] * 255), np.array([2, 1, 0]) / 16 / alpha, atol=1e-3)
    assert clear[3] == pytest.approx(alpha)
    white = gpu("sample_mean.glsl", "developed(s, g, 16.0, vec4(1))", s=sums, g=ground)[0]
    np.testing.assert_allclose(decode(white[:3] * 255), np.array([2, 1, 0]) / 16 + 1 - alpha, atol=1e-3)


def test_an_inner_outline_shows_no_crack_and_an_outer_one_ends_softly(renderer):
    """A ball hides a wall, and before nothing it ends softly."""
    frame = frames.sphere_before_wall()
    alpha = renderer.render(frame, samples=16)[8:-8, 8:-8, 3]
    assert (alpha == 255).all()
    alone = renderer.render(frames.sphere(), samples=16)[..., 3]
    assert ((alone > 0) & (alone < 255)).sum() > 50


PICTURES = {
    "phong": {},
    "unlit": {"shading": "none", "background": (0.2, 0.5, 0.9)},
    "flat": {"shading": "flat", "background": "white"},
    "gouraud": {"shading": "gouraud"},
    "eye-dome": {"shading": "edl", "background": "white"},
    "soft": {"light": ps.Light(position=(-0.8, -0.9, 0.2), radius=0.2, shadow=True)},
}


@pytest.mark.parametrize(
    ("rasterizer", "name"),
    [
        *(("compute", name) for name in ("phong", "flat", "eye-dome", "soft")),
        *(("points", name) for name in ("phong", "unlit", "gouraud", "soft")),
    ],
    indirect=["rasterizer"],
)
def test_samples_are_averaged_as_the_mirror_averages_them(rasterizer, golden, monkeypatch, name):
    monkeypatch.setattr(shadow_cameras, "SHADOW_SIDE", 256)  # of the soft light: the mirror draws a view a sample
    options = {"light": LIGHT, "shading": "phong"} | PICTURES[name]
    frame, light, shading = frames.sphere_before_wall(), options["light"], options["shading"]
    if light.is_soft:
        frame = ps.Frame(frame.color[::2, ::2], frame.depth[::2, ::2], frame.camera.resized(80, 60))
    count = 2 if light.is_soft else 4
    actual = rasterizer.render(frame, pose=ASIDE, normals="triangles-8", max_depth_step="5%", samples=count, **options)
    normals = np.nan_to_num(rasterizer.estimate_normals(frame, "triangles-8", max_depth_step="5%"))
    eye = Eye.at_distance(frame.camera, ASIDE, frame.scale)
    finish = OutputSettings(count, options.get("background"))
    look = ps.Appearance(shading=shading)
    drawn = rasterizer.name, merging(rasterizer)
    mirrors = [mirror_render(frame, normals, [light], look, eye, *drawn, finish=finish)]
    if name == "unlit":  # nothing is mixed: which of two neighbours is seen hangs on the depth buffer's last step alone
        for rounded in (np.floor, np.positive):  # drivers keep more bits on the way there than float32, and cut them
            monkeypatch.setattr(rasterizers, "window_depths", partial(window_depths, rounded))
            mirrors.append(mirror_render(frame, normals, [light], look, eye, *drawn, finish=finish))
    golden(f"samples {name}", actual, nearest_of(mirrors, actual), stored=False)


def window_depths(rounded, pairs, near):
    """`rasterizers.window_depths` of a driver that rounds window depths otherwise."""
    window = (np.float32(1) - np.float32(2 * near) * pairs.splat.inverse_depth).astype(float) * 0.5 + 0.5
    window = np.where(pairs.is_rim, 1 - near * pairs.inverse_depth.astype(float), window)
    return rounded(window * rasterizers.DEPTH_STEPS) / rasterizers.DEPTH_STEPS


def nearest_of(pictures, actual):
    """The picture whose pixels are, of those of several pictures, the most like the actual ones."""
    stack = np.stack(pictures)
    best = np.abs(stack.astype(int) - actual).sum(-1).argmin(0)
    return np.take_along_axis(stack, best[None, ..., None], 0)[0]


def scene_of(*lights):
    content = ps.Node(ps.PointObject(frames.sphere())), ps.Node(BOARD), ps.Node(ps.PointObject(frames.step()))
    return ps.Scene((*content, *map(ps.Node, lights)), camera=frames.CAMERA, pose=ASIDE)


def views_as_scene():
    views = ps.PointObject(three_views(), normals="star")
    return ps.Scene((ps.Node(views), ps.Node(ps.Light(position=(-1, -1, 0)))), frames.CAMERA, pose_at(6, -2))


@pytest.mark.parametrize("kind", ["objects", "merged views"])
def test_a_scene_is_the_mean_of_its_jittered_pictures_in_linear_light(rasterizer, kind):
    """Each drawn by a camera of its own; they have 8 bits, so the mean of theirs is a little off."""
    c, sun = frames.CAMERA, ps.Light(direction=(0.4, 0.6, 1), shadow=True)
    scene = scene_of(sun) if kind == "objects" else views_as_scene()
    total = np.zeros((c.height, c.width, 4))
    for dx, dy in offsets(5):
        image = rasterizer.render(scene, camera=replace(c, cx=c.cx - dx, cy=c.cy - dy)).astype(float)
        total[..., :3] += decode(image[..., :3]) * (image[..., 3:] > 0)
        total[..., 3] += image[..., 3] / 255
    expected = encode(total[..., :3] / np.maximum(total[..., 3:], 1)) * (total[..., 3:] > 0)
    expected = np.concatenate([expected, total[..., 3:] * 51], -1)
    assert not compare_images(rasterizer.render(scene, samples=5), np.round(expected).astype(np.uint8))


@pytest.mark.parametrize("shading", ["none", "phong"])
def test_one_sample_is_the_picture_bit_for_bit(rasterizer, shading):
    frame = vase()
    soft = ps.Light(position=(-0.8, -0.9, 0.2), radius=0.3, shadow=True)
    plain = rasterizer.render(frame, soft, shading=shading)
    assert (rasterizer.render(frame, soft, shading=shading, samples=1) == plain).all()
    over = rasterizer.render(frame, soft, shading=shading, background="#102030")
    assert np.abs(over[..., :3].astype(int) - np.where(plain[..., 3:] > 0, plain[..., :3], (16, 32, 48))).max() <= 1
    assert (over[..., 3] == 255).all()


def test_alpha_is_the_coverage_and_colours_are_not_multiplied_by_it(renderer):
    """A white board that ends within pixels: half of its last column is covered."""
    depth = np.full((120, 160), 1.0, np.float32)
    depth[:, 80:] = 0
    frame = ps.Frame(np.full((120, 160, 3), 255, np.uint8), depth, frames.CAMERA)
    camera = replace(frames.CAMERA, cx=frames.CAMERA.cx + 0.5)
    image = renderer.render(frame, camera=camera, shading="none", samples=64)
    edge = image[20:100, 80]
    assert np.abs(edge[:, 3].astype(int) - 128).max() < 40 and (edge[:, :3] == 255).all()
    over = renderer.render(frame, camera=camera, shading="none", samples=64, background="black")
    np.testing.assert_allclose(decode(over[20:100, 80, 0].astype(float)), edge[:, 3] / 255, atol=0.01)


def counted(renderer, *arguments, **options):
    before = renderer.steps.counts.copy()
    image = renderer.render(*arguments, **options)
    return {name: n for name, n in (renderer.steps.counts - before).items() if n}, image


class TestCost:
    @pytest.fixture
    def fresh(self, renderer):
        with ps.Renderer() as made:
            yield made

    def test_samples_draw_and_do_nothing_twice(self, fresh):
        ran, _ = counted(fresh, frames.sphere(), samples=16)
        assert ran == {"upload": 1, "surface": 1, "splats": 16, "resolve": 16}

    def test_depth_is_brought_to_the_size_of_the_colours_once(self, fresh):
        frame = frames.sphere()
        large = ps.Frame(frame.color.repeat(2, 0).repeat(2, 1), frame.depth, frame.camera)
        ran, _ = counted(fresh, large, samples=4)
        assert ran == {"upload": 1, "surface": 1, "upsample": 1, "splats": 4, "resolve": 4}

    def test_only_soft_lights_draw_their_shadows_again(self, fresh):
        hard, soft = ps.Light(direction=(0, 0.5, 1), shadow=True), ps.Light((-1, -1, 0), shadow=True, radius=0.1)
        ran, _ = counted(fresh, frames.sphere(), [hard, soft], samples=4)
        assert ran["splats"] == 4 + 1 + 4 and ran["upload"] == ran["surface"] == 1
        ran, _ = counted(fresh, frames.sphere(), [hard, hard], samples=4)
        assert ran["splats"] == 4 + 2 and ran["shadows"] == 1

    def test_a_picture_that_shows_the_same_goes_on_where_the_last_one_ended(self, fresh):
        frame = frames.sphere()
        fresh.render(frame, samples=4)
        ran, image = counted(fresh, frame, samples=16)
        assert ran == {"splats": 12, "resolve": 12}
        assert counted(fresh, frame, samples=16)[0] == {}
        for changes in ({"light": LIGHT}, {"pose": ASIDE}, {"shading": "flat"}, {"samples": 4}):
            assert counted(fresh, frame, **{"samples": 16} | changes)[0]["resolve"] == changes.get("samples", 16)
        fresh.render(frame, pose=ASIDE)
        assert (fresh.render(frame, samples=16) == image).all()


class TestTruth:
    """A sphere before a wall, against a truth of 36 rays a pixel."""

    CAMERA = ps.Camera(262, 262, 159.5, 119.5, 320, 240)
    LIGHT = ps.Light(position=(-1.0, -1.0, -0.5))

    def gains(self, renderer, yaw, camera):
        """How many dB 64 samples gain over one: near edges, elsewhere, everywhere; turned, where the frame saw it."""
        source, pose = trace(sphere_and_wall(), self.CAMERA), ps.orbit_pose(None, (0, 0, 1.8), yaw)
        seen, light = trace(sphere_and_wall(), camera, pose), 0
        for dx, dy in np.stack(np.meshgrid(*[np.arange(6)] * 2), -1).reshape(-1, 2) / 6 - 5 / 12:
            hits = trace(sphere_and_wall(), replace(camera, cx=camera.cx - dx, cy=camera.cy - dy), pose)
            light = light + shade(hits, self.LIGHT, ps.Material(), pose[:3, 3]) / 36
        numbers = np.pad(seen.surface, 2, "edge")
        windows = np.lib.stride_tricks.sliding_window_view(numbers, (5, 5)).reshape(*seen.surface.shape, 25)
        near, known = windows.max(-1) != windows.min(-1), np.ones(seen.depth.shape, bool)
        if yaw:
            known = co_visible(seen, source, self.CAMERA, pose=np.eye(4))
        frame, truth, found = as_frame(source, self.CAMERA), encode(light), []
        for samples in (1, 64):
            image = renderer.render(frame, self.LIGHT, camera=camera, pose=pose, samples=samples)
            error = (np.asarray(image[..., :3], float) - truth) ** 2
            found.append([-10 * np.log10(error[mask].mean()) for mask in (near & known, ~near & known, known)])
        return np.subtract(found[1], found[0])

    def test_turned_by_15_degrees(self, renderer):
        """Of the picture's middle, with the sphere's outlines."""
        middle = replace(self.CAMERA, cx=self.CAMERA.cx - 40, cy=self.CAMERA.cy - 30, width=240, height=180)
        near, elsewhere, _ = self.gains(renderer, 15, middle)
        assert near >= 6 and elsewhere >= 0

    @pytest.mark.parametrize(("yaw", "least"), [(0, 15), (15, 8)])
    def test_at_a_quarter_of_the_resolution(self, renderer, yaw, least):
        _, elsewhere, everywhere = self.gains(renderer, yaw, self.CAMERA.resized(80, 60))
        assert everywhere >= least and elsewhere >= 0


LOOKS = {
    "phong": {},
    "flat": {"shading": "flat"},
    "gouraud": {"shading": "gouraud"},
    "flat triangles": {"shading": "flat", "splat": "mesh"},
    "gouraud triangles": {"shading": "gouraud", "splat": "mesh"},
    "turned": {"yaw": 12},
}


@pytest.mark.parametrize("look", LOOKS)
def test_light_is_cut_off_once_after_the_mean(renderer, monkeypatch, look):
    """A board before a white wall, its soft shadow, and a highlight: sixteen times as bright a lamp shows sixteen times
    the light, cut off at 1, and not the mean of samples that were cut off."""
    monkeypatch.setattr(shadow_cameras, "SHADOW_SIDE", 256)
    v, u = np.indices((120, 160))
    board = (abs(u - 75) < 22) & (abs(v - 55) < 25)
    frame = ps.Frame(np.where(board, 200, 255)[..., None].repeat(3, -1).astype(np.uint8), np.where(board, 1.4, 2.0),
                     frames.CAMERA)  # fmt: skip
    options = {"material": ps.Material(0, 1, 0.4, 20), "samples": 12} | LOOKS[look]
    dim, bright = (
        renderer.render(frame, ps.Light((-0.7, -0.6, 0.3), radius=0.25, intensity=k, shadow=True), **options)
        for k in (0.225, 3.6)
    )
    seen = (dim[..., 3] == 255) & (bright[..., 3] == 255) & (dim[..., :3] < 255).all(-1)
    truth = encode(np.minimum(decode(dim[..., :3].astype(float)) * 16, 1))
    error = (truth - bright[..., :3])[seen] / 255
    assert seen.mean() > 0.7 and ((bright[..., 0] == 255) & seen).mean() > 0.5
    assert -10 * np.log10((error**2).mean()) >= 40


@pytest.mark.parametrize("samples", [0, -1, 1.5, 5000])
def test_an_impossible_number_of_samples_is_named(renderer, samples):
    with pytest.raises(ValueError, match="samples must be"):
        renderer.render(frames.sphere(), samples=samples)
