"""Frames too large for the GPU are drawn in tiles: the picture is that of the whole frame, and no tile shows."""

import gc
import weakref

import numpy as np
import pytest

import pointshade_gl as ps
from pointshade_gl.bench.tracing import as_frame, sphere_and_wall, trace
from pointshade_gl.gpu.points import tiles as tiling
from pointshade_gl.scene.noise import Noise

from ..support.compare import compare_images

CAMERA = ps.Camera(270, 270, 159.5, 119.5, 320, 240)
CLEAN = as_frame(trace(sphere_and_wall(), CAMERA), CAMERA)
SPREAD = np.random.default_rng(3).normal(0, 0.004, CLEAN.depth.shape)
NOISY = ps.Frame(CLEAN.color, np.where(CLEAN.depth > 0, CLEAN.depth + SPREAD, 0), CAMERA)
LAMP, SUN = ps.Light(position=(-1, -1, -0.5)), ps.Light(direction=(1, 1, 3), shadow=True)


@pytest.fixture(params=["auto", "points"])
def own(request):
    with ps.Renderer(rasterizer=request.param) as renderer:
        yield renderer


@pytest.fixture
def cut(monkeypatch):
    """From now on every frame is cut: into four tiles, textures being so small."""

    def use(renderer, largest_side=208):
        monkeypatch.setattr(tiling, "LARGEST_WHOLE", 100)
        monkeypatch.setattr(renderer._pipeline.gpu_scene.tiles, "largest_side", largest_side)
        renderer._pipeline.gpu_scene.drawn = {}  # so that its objects are prepared anew

    return use


@pytest.mark.parametrize(
    ("width", "height", "side"), [(320, 240, 200), (3840, 2160, 16384), (12288, 8192, 16384), (20001, 333, 16384)]
)
def test_tiles_cover_every_pixel_and_see_what_lies_around(width, height, side, monkeypatch):
    monkeypatch.setattr(tiling, "TILE_POINTS", 1 << 20)
    tiles = tiling.tiles_of(width, height, side)
    drawn = np.zeros((height, width), np.uint8)
    sizes = {tile.box[2:] for tile in tiles}
    assert len(sizes) == 1 and len(tiles) > 1
    for (left, top, wide, high), (u, v, inner_wide, inner_high) in tiles:
        drawn[top + v : top + v + inner_high, left + u : left + u + inner_wide] += 1
        assert left >= 0 and top >= 0 and left + wide <= width and top + high <= height and max(wide, high) <= side
        around = u, v, wide - u - inner_wide, high - v - inner_high
        at_edge = left == 0, top == 0, left + wide == width, top + high == height
        assert all(edge or room >= tiling.REACH - tiling.SEAM for room, edge in zip(around, at_edge, strict=True))
        assert sizes.pop() == (wide, high)
        sizes.add((wide, high))
    assert drawn.min() == 1


def test_a_frame_that_fits_is_one_tile():
    assert tiling.tiles_of(640, 480, 16384) == [((0, 0, 640, 480), (0, 0, 640, 480))]


@pytest.mark.gl
class TestPictures:
    @pytest.mark.parametrize(("light", "yaw"), [(LAMP, 0), (SUN, 15), (LAMP, 40), (SUN, 0)])
    def test_the_picture_is_that_of_the_whole_frame(self, own, cut, yaw, light):
        whole = own.render(CLEAN, light, yaw=yaw)
        uploads = own.steps.counts["upload"]
        cut(own)
        assert compare_images(own.render(CLEAN, light, yaw=yaw), whole) == ""
        assert own.steps.counts["upload"] >= uploads + 4

    @pytest.mark.parametrize("options", [{"shading": "none"}, {"shading": "flat"}, {"shading": "gouraud"}])
    def test_every_shading_is_the_same(self, own, cut, options):
        whole = own.render(CLEAN, LAMP, yaw=15, **options)
        cut(own, largest_side=240)  # columns; with GL points colours that are not mixed differ along the borders
        assert compare_images(own.render(CLEAN, LAMP, yaw=15, **options), whole) == ""

    def test_options_that_are_arrays_are_cut_as_the_frame_is(self, own, cut):
        normals = np.nan_to_num(own.estimate_normals(CLEAN, "plane-fit-7"))
        sizes = np.where(np.arange(320) < 160, 1.0, 0.0) * np.ones((240, 1))  # the right half is hidden
        whole = own.render(CLEAN, LAMP, yaw=15, normals=normals, point_size=sizes)
        cut(own)
        assert compare_images(own.render(CLEAN, LAMP, yaw=15, normals=normals, point_size=sizes), whole) == ""

    def test_larger_splats_leave_no_gap_between_tiles(self, own, cut):
        """Which of two overlapping splats is nearer is decided splat by splat in a tile, pixel by pixel between two."""
        whole = own.render(CLEAN, LAMP, yaw=15, point_size=2)
        cut(own)
        tiled = own.render(CLEAN, LAMP, yaw=15, point_size=2)
        assert (whole[..., 3] != tiled[..., 3]).mean() < 1e-4
        assert (np.abs(whole.astype(int) - tiled).max(-1) > 2).mean() < 5e-3

    def test_a_scene_shows_it_among_other_things(self, own, cut):
        corners = np.array([[-0.5, -0.5, 1.2], [0.5, -0.5, 1.2], [0, 0.5, 1.2]])
        nodes = ps.Node(ps.PointObject(CLEAN)), ps.Node(ps.Mesh(corners, np.array([[0, 1, 2]])))
        scene = ps.Scene(nodes, camera=CAMERA)
        whole = own.render(scene, SUN)
        cut(own)
        assert compare_images(own.render(scene, SUN), whole) == ""

    def test_it_is_drawn_where_it_has_moved(self, own, cut):
        thing = ps.PointObject(CLEAN)
        scenes = [
            ps.Scene((ps.Node(thing, transform=place),), camera=CAMERA)
            for place in (np.eye(4), ps.orbit_pose(None, CLEAN.pivot, 10))
        ]
        whole = own.render(scenes[1], LAMP)
        cut(own)
        own.render(scenes[0], LAMP)
        assert compare_images(own.render(scenes[1], LAMP), whole) == ""

    def test_points_and_depth_are_those_of_the_whole_frame(self, own, cut):
        cloud, depth = own.render_points(CLEAN, LAMP), own.render_depth(CLEAN, yaw=10)
        cut(own)
        tiled = own.render_points(CLEAN, LAMP)
        assert np.allclose(tiled.positions, cloud.positions, atol=1e-6)
        assert np.abs(tiled.colors.astype(int) - cloud.colors).max() <= 1
        assert (np.abs(own.render_depth(CLEAN, yaw=10) - depth) > 1e-4).mean() < 1e-3


@pytest.mark.gl
@pytest.mark.parametrize("method", ["star", "star-borrow", "plane-fit-13", "triangles-8"])
def test_normals_are_those_of_the_whole_frame(own, cut, method):
    whole = own.estimate_normals(CLEAN, method)
    cut(own)
    assert np.allclose(own.estimate_normals(CLEAN, method), whole, atol=1e-6, equal_nan=True)


@pytest.mark.gl
def test_auto_decides_once_for_all_tiles(own, cut):
    whole, choice = own.estimate_normals(NOISY), own.choice
    cut(own)
    tiled = own.estimate_normals(NOISY)
    assert own.choice.method == choice.method == "adaptive"
    assert np.isclose(own.choice.noise.sigma, choice.noise.sigma, rtol=0.3)
    cosine = (tiled * whole).sum(-1)[np.isfinite(whole[..., 0])]
    assert np.degrees(np.arccos(np.clip(np.median(cosine), -1, 1))) < 1
    own.estimate_normals(CLEAN)
    assert own.choice.method == "star"


def test_a_frame_in_tiles_is_explained(own, cut):
    cut(own)
    own.render(NOISY)
    (sentence,) = own.explain()
    assert sentence.startswith("adaptive: noise of ")


def test_the_noise_of_a_tile_is_that_measured_nearby():
    shape = (1000, 2000)
    rows, columns = (len(tiling._starts(size)) for size in shape)
    grid = np.ones((5 * rows, 5 * columns, 3), np.float32)
    grid[:, : 5 * columns // 2] = 3  # the left half is noisier
    grid[4::5] = grid[:, 4::5] = 99  # between the pieces nothing was measured
    noise = Noise(1, 1, 0, "", 0, 0, 1, grid, (0, 0))
    left, right = (tiling.noise_in((u, 100, 400, 300), noise, shape).grid for u in (0, 1600))
    assert left.shape == right.shape and np.all(left == 3) and np.all(right == 1)


@pytest.mark.gl
def test_another_light_uploads_nothing_and_another_view_every_tile(renderer, cut):
    with ps.Renderer() as own:
        cut(own)
        own.render(CLEAN, LAMP, yaw=10)
        first = own.steps.counts["upload"]
        own.render(CLEAN, ps.Light(position=(1, -1, 0)), yaw=10)
        assert own.steps.counts["upload"] == first
        own.render(CLEAN, LAMP, yaw=11)
        assert own.steps.counts["upload"] == 2 * first
        own.render(CLEAN, LAMP, yaw=11, shading="flat")
        own.render(CLEAN, ps.Light(position=(1, -1, 0)), yaw=11, shading="flat")
        assert own.steps.counts["upload"] > 2 * first


@pytest.mark.gl
def test_one_set_of_textures_serves_all_tiles_and_is_freed_with_them(renderer, cut):
    with ps.Renderer() as own:
        cut(own)
        frame = ps.Frame(CLEAN.color, CLEAN.depth, CAMERA)
        own.render(frame, LAMP)
        store, gone = own._pipeline.gpu_scene.tiles, weakref.ref(frame)
        assert store._textures.size == (208, 208)
        own.render(ps.Frame(None, np.ones((9, 9)), ps.Camera(9, 9, 4, 4, 9, 9)))
        assert store._textures is None
        del frame
        assert gone() is None


@pytest.mark.gl
def test_colours_of_another_size_are_not_cut_and_must_fit(renderer, cut):
    with ps.Renderer() as own:
        small = ps.Frame(CLEAN.color[::2, ::2], CLEAN.depth, CAMERA)
        whole = own.render(small, LAMP, yaw=10)
        cut(own, largest_side=400)
        assert compare_images(own.render(small, LAMP, yaw=10), whole) == ""
        assert own.steps.counts["upload"] == 1
    limit = renderer.context.gl.info["GL_MAX_TEXTURE_SIZE"]
    wide = ps.Camera(100, 100, 0, 0, limit + 1, 2)
    with pytest.raises(ValueError, match="too large for colours of another size on this GPU"):
        renderer.render(ps.Frame(CLEAN.color, np.ones((2, limit + 1)), wide), camera=CAMERA)


@pytest.mark.gl
def test_a_frame_wider_than_textures_is_drawn(renderer):
    limit = renderer.context.gl.info["GL_MAX_TEXTURE_SIZE"]
    camera = ps.Camera(limit, limit, limit / 2, 1.5, limit + 400, 4)
    image = renderer.render(ps.Frame(None, np.full((4, limit + 400), 2.0), camera), camera=camera.resized(820, 20))
    assert (image[8:12, 5:-5, 3] == 255).all()


@pytest.mark.gl
@pytest.mark.parametrize("content", ["frame", "set", "scene"])
def test_a_frame_is_freed_as_soon_as_nobody_holds_it(renderer, content):
    gc.disable()  # without the help of the garbage collector: large frames would pile up until it comes
    try:
        frame = ps.Frame(CLEAN.color, CLEAN.depth, CAMERA)
        other = ps.Frame(CLEAN.color, CLEAN.depth, CAMERA)
        drawn = {"frame": frame, "set": [frame, other], "scene": ps.Scene((ps.Node(ps.PointObject(frame)),), CAMERA)}
        renderer.render(drawn[content], SUN)
        gone = weakref.ref(frame)
        del frame, other, drawn
        renderer.render(ps.Frame(None, np.ones((9, 9)), ps.Camera(9, 9, 4, 4, 9, 9)))
        assert gone() is None
    finally:
        gc.enable()
