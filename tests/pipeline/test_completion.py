"""Missing points are completed: each hole by the surface that goes on there. What is known stays as it is."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.ndimage import distance_transform_edt, gaussian_filter

import pointshade_gl as ps
from pointshade_gl.bench.tracing import as_frame, patch, plane, sphere, trace, waves

from ..gpu.test_completion import surfaces
from ..gpu.test_sparse import PATTERNS, at_random, ground, kept, scan_lines
from ..gpu.test_surface import angle
from ..support import frames, given_values
from ..support.drivers import need_compute
from ..support.pattern_shadow import shadow
from ..support.view_sets import replaced

F = np.float32
FILL = {"point_size": "fill"}


@pytest.fixture(scope="module", params=["points", "compute"])
def rasterizer(request, renderer):
    if request.param == "compute":
        need_compute(renderer)
    with ps.Renderer(rasterizer=request.param) as made:
        yield made


@pytest.fixture
def own_renderer(renderer):
    with ps.Renderer() as made:
        yield made


def without(frame, missing):
    return replaced(frame, depth=np.where(missing, F(0), frame.depth))


def error_of(depth, truth):
    """By which share of itself a depth is off, infinite where it is missing."""
    return np.where(depth > 0, np.abs(depth / np.where(truth > 0, truth, 1) - 1), np.inf)


def disc(frame, middle, radius, squeezed=1.0, turned=0.0):
    v, u = np.indices(frame.depth.shape) - np.array(middle)[::-1, None, None]
    c, s = np.cos(np.radians(turned)), np.sin(np.radians(turned))
    return np.hypot(c * u + s * v, squeezed * (c * v - s * u)) < radius


def check_known_points(renderer, data):
    """Whatever the depth, the colours, and where it is missing. What is completed has a normal and a depth."""
    frame = data.draw(given_values.frames(camera=given_values.plain_cameras))
    measured, completed = surfaces(renderer, frame)
    known, found = measured[..., 3] != 0, completed[..., 3] != 0
    np.testing.assert_array_equal(completed[known, :3], measured[known, :3])
    np.testing.assert_array_equal(np.abs(completed[known, 3]), np.abs(measured[known, 3]))
    new = completed[found & ~known]
    assert np.isfinite(new).all()
    np.testing.assert_allclose(np.linalg.norm(new[:, :3], axis=1), 1, rtol=1e-5)


class TestKnownPoints:
    @pytest.mark.parametrize(
        "make", [frames.tilted_plane, frames.sphere_before_wall, frames.sphere, frames.step, frames.noisy]
    )
    @pytest.mark.parametrize("yaw", [0, 20])
    def test_a_frame_without_holes_looks_as_it_did(self, rasterizer, make, yaw):
        """To the bit; round the sphere alone is nothing, and its outline stays."""
        np.testing.assert_array_equal(rasterizer.render(make(), yaw=yaw, **FILL), rasterizer.render(make(), yaw=yaw))

    @settings(max_examples=12)
    @given(st.data())
    def test_known_points_keep_their_surface(self, renderer, data):
        check_known_points(renderer, data)

    @pytest.mark.system
    @given(st.data())
    def test_all_known_points_keep_their_surface(self, renderer, data):
        check_known_points(renderer, data)

    def test_the_same_frame_is_completed_the_same_twice(self, renderer):
        frame = without(frames.sphere_before_wall(), at_random((120, 160), 0.3) | disc(frames.step(), (90, 60), 20))
        pictures = []
        for _ in range(2):
            with ps.Renderer() as made:
                pictures.append(made.render(frame, yaw=10, **FILL))
        np.testing.assert_array_equal(*pictures)

    def test_a_second_picture_completes_nothing_anew(self, own_renderer):
        frame = kept(frames.tilted_plane(), PATTERNS["scan lines"])
        for yaw in (0, 10):
            own_renderer.render(frame, ps.Light(position=(yaw, -1, 0)), yaw=yaw, **FILL)
        assert own_renderer.steps.counts["completion"] == 1


class TestPlanes:
    @pytest.mark.parametrize("pattern", PATTERNS)
    def test_a_sparse_plane_comes_back_whole(self, rasterizer, pattern):
        """Where it was and as bright."""
        dense = frames.tilted_plane()
        sparse = kept(dense, PATTERNS[pattern])
        assert (rasterizer.render(sparse)[..., 3] > 0).mean() < 0.5
        picture = rasterizer.render(sparse, **FILL)
        assert (picture[..., 3] > 0).mean() > 0.99
        off = np.abs(picture.astype(int) - rasterizer.render(dense))[picture[..., 3] > 0]
        assert np.median(off) <= 1 and (off > 8).mean() < 0.01
        depth = rasterizer.render_depth(sparse, **FILL)
        assert np.median(error_of(depth, dense.depth)) < 1e-4

    def test_a_road_is_seen_from_aside(self, renderer):
        """Points move onto their plane, so that few cracks open between them; a mesh has none."""
        road, _ = ground()
        sparse = kept(road, scan_lines((120, 160)), noise=0.002)
        options = {"yaw": 15, "shading": "none"}
        whole = renderer.render(road, **options)[..., 3] > 0
        splats, mesh = (
            renderer.render(sparse, splat=one, **FILL, **options)[..., 3] > 0 for one in ("footprint", "mesh")
        )
        assert (renderer.render(sparse, **options)[..., 3] > 0)[whole].mean() < 0.3
        assert splats[whole].mean() > 0.8 and mesh[whole].mean() > 0.8

    @pytest.mark.parametrize("squeezed", [1.0, 2.0])
    @pytest.mark.parametrize("turned", [0, 30])
    def test_holes_of_every_size_close(self, rasterizer, squeezed, turned):
        """With the plane they were cut from, round and oval ones, without dots."""
        frame = frames.tilted_plane()
        for radius in (1, 1.5, 2.5, 4, 8, 14, 25, 45):
            missing = disc(frame, (80.4, 60.3), radius, squeezed, turned)
            depth = rasterizer.render_depth(without(frame, missing), **FILL)
            assert error_of(depth, frame.depth)[missing].max() < 1e-3, radius

    @pytest.mark.parametrize("splat", ["footprint", "round", "mesh"])
    def test_no_hole_is_left_in_a_turned_picture(self, renderer, splat):
        frame = frames.tilted_plane()
        missing = at_random(frame.depth.shape, 0.05) | disc(frame, (80, 60), 20)
        whole, picture = (renderer.render(one, yaw=15, splat=splat, **FILL) for one in (frame, without(frame, missing)))
        assert (picture[whole[..., 3] > 0][:, 3] > 0).mean() > 0.998
        assert (np.abs(picture.astype(int) - whole).max(-1) > 8).mean() < 0.01

    def test_a_hole_at_the_border_closes_if_its_colours_are_those_of_the_plane(self, renderer):
        frame = frames.tilted_plane()
        missing = np.zeros_like(frame.depth, bool)
        missing[:30, :40] = missing[50:80, 140:] = missing[110:] = True
        depth = renderer.render_depth(without(frame, missing), **FILL)
        assert np.median(error_of(depth, frame.depth)[missing]) < 1e-3
        assert (error_of(depth, frame.depth)[missing] > 0.02).mean() < 0.02


def before_wall(near=lambda u, v: u < 68 + 0.2 * v):
    """A red board, where it is near, before a blue wall; both are tilted. And the depth of each."""
    v, u = np.indices((120, 160))
    is_near, random = near(u, v), np.random.default_rng(5)
    ends = ((-0.3, 0.1, -1), (0, 0, 1.2)), ((0.2, 0.1, -1), (0, 0, 2.0))
    depths = [trace([plane(*one, waves)], frames.CAMERA).depth for one in ends]
    color = np.where(is_near[..., None], (190, 70, 60), (60, 90, 180)) + random.integers(-12, 13, (120, 160, 1))
    return ps.Frame(color.astype(np.uint8), np.where(is_near, *depths), frames.CAMERA), depths


class TestSteps:
    def test_in_a_hole_across_a_step_both_sides_follow_the_colours(self, rasterizer):
        frame, _ = before_wall()
        missing = disc(frame, (80, 60), 18)
        depth = rasterizer.render_depth(without(frame, missing), **FILL)
        assert (error_of(depth, frame.depth)[missing] > 0.01).mean() < 0.01
        pose = ps.orbit_pose(None, frame.pivot, yaw=15)  # the other's own is elsewhere: half of it is near
        picture, whole = (rasterizer.render(one, pose=pose, **FILL) for one in (without(frame, missing), frame))
        assert ((picture[..., 3] > 0) != (whole[..., 3] > 0)).mean() < 0.005  # no bridge between the walls

    def test_nothing_lies_between_two_surfaces(self, renderer):
        """Also where the colours do not tell which one it is."""
        frame, depths = before_wall()
        missing = disc(frame, (80, 60), 18)
        depth = renderer.render_depth(without(replaced(frame, color=None), missing), **FILL)
        assert np.min([error_of(depth, one) for one in depths], 0)[missing].max() < 0.01

    @pytest.mark.parametrize("mirrored", [False, True])
    @pytest.mark.parametrize("colored", [False, True])
    def test_the_shadow_of_a_pattern_goes_to_what_is_farther(self, rasterizer, colored, mirrored):
        """The near surface keeps its outline, to a pixel or two without colours, which alone could tell."""
        camera = frames.CAMERA.resized(320, 240)
        things = [sphere((0.1, 0.05, 1.2), 0.25, waves), plane((0.15, -0.1, -1), (0, 0, 2.4), waves)]
        hits = trace(things, camera)
        side = np.s_[:, ::-1] if mirrored else np.s_[:]
        lost = shadow(hits.depth[side], camera.fx * 0.07)[side]
        assert lost.sum() > 800 and (hits.surface[lost] == 1).mean() > 0.95  # of the ball the outermost pixels
        color = as_frame(hits, camera).color if colored else None
        frame = ps.Frame(color, np.where(lost, 0, hits.depth), camera)
        depth = rasterizer.render_depth(frame, **FILL)
        wall = lost & (hits.surface == 1)
        wrong = wall & (error_of(depth, hits.depth) > 0.02)
        assert wrong.sum() <= (0.04 if colored else 0.15) * wall.sum()
        assert not (wrong & (distance_transform_edt(hits.surface == 1) > 2.5)).any()
        ball = (hits.surface == 0) & ~lost
        assert error_of(depth, hits.depth)[ball].max() < 1e-4

    def test_thin_things_go_on_across_a_hole(self, renderer):
        frame, _ = before_wall(lambda u, v: (u > 70) & (u < 90))
        v, u = np.indices(frame.depth.shape)
        missing = (v > 45) & (v < 75) & (u > 40) & (u < 120)
        depth = renderer.render_depth(without(frame, missing), **FILL)
        assert (error_of(depth, frame.depth)[missing] > 0.01).mean() < 0.02


class TestNothing:
    """What is left empty."""

    @pytest.mark.parametrize("colored", [False, True])
    def test_objects_that_were_cut_out_get_no_halo(self, rasterizer, colored):
        """Holes in them close."""
        frame = frames.sphere()
        frame = frame if colored else replaced(frame, color=None)
        inside = distance_transform_edt(frame.depth > 0) > 8
        missing = inside & (at_random(frame.depth.shape, 0.1) | disc(frame, (80, 62), 9))
        depth = rasterizer.render_depth(without(frame, missing), **FILL)
        np.testing.assert_array_equal(depth > 0, frame.depth > 0)
        assert (error_of(depth, frame.depth)[missing] > 0.02).mean() < 0.01

    @pytest.mark.parametrize("color", [None, (120, 130, 140)])
    def test_the_corner_of_an_object_that_was_cut_out_stays_empty(self, renderer, color):
        """An L, with holes, before something of its own colour."""
        frame = frames.tilted_plane()
        v, u = np.indices(frame.depth.shape)
        inside = (u > 40) & (u < 110) & (v > 20) & (v < 95) & ~((u > 70) & (v < 60))
        deep = distance_transform_edt(inside) > 8
        missing = ~inside | (deep & at_random(inside.shape, 0.15))
        color = None if color is None else np.full((*inside.shape, 3), color, np.uint8)
        depth = renderer.render_depth(without(replaced(frame, color=color), missing), **FILL)
        np.testing.assert_array_equal(depth > 0, inside)

    def test_two_objects_are_not_joined(self, renderer):
        balls = [sphere((x, 0, 1.5), 0.22, lambda p: np.full(p.shape, 0.5)) for x in (-0.3, 0.3)]
        frame = as_frame(trace(balls, frames.CAMERA), frames.CAMERA)
        np.testing.assert_array_equal(renderer.render(frame, **FILL), renderer.render(frame))

    def test_a_sky_stays_empty(self, rasterizer):
        """Open to the picture's border, and unlike all colours below; also in the valleys between hills."""
        frame = frames.tilted_plane()
        v, u = np.indices(frame.depth.shape)
        sky = v < 40 + 6 * np.sin(u / 9)
        color = np.where(sky[..., None], (235, 245, 255), frame.color).astype(np.uint8)
        depth = rasterizer.render_depth(without(replaced(frame, color=color), sky), **FILL)
        assert (depth[sky] > 0).mean() < 0.03 and (depth[v < 30] == 0).all() and (depth[~sky] > 0).all()

    def test_pixels_that_the_colours_cut_out_are_not_completed(self, renderer):
        frame = frames.tilted_plane()
        color = np.full((*frame.depth.shape, 4), 255, np.uint8)
        color[50:54, 50:54, 3] = 0
        missing = at_random(frame.depth.shape, 0.2)
        missing[40:60, 40:60] = True
        picture = renderer.render(without(ps.Frame(color, frame.depth, frame.camera), missing), **FILL)
        np.testing.assert_array_equal(picture[..., 3] > 0, color[..., 3] > 0)

    def test_without_points_there_is_nothing(self, rasterizer):
        assert not rasterizer.render(frames.all_missing(), **FILL).any()

    def test_one_point_stays_one(self, rasterizer):
        frame = frames.single_pixel()
        np.testing.assert_array_equal(rasterizer.render(frame, **FILL), rasterizer.render(frame))


class TestSizes:
    @pytest.mark.parametrize("share", [2.0, 1.5, 0.5])
    def test_colours_of_another_size(self, rasterizer, share):
        """More of them: they tell a finer outline. Fewer: they are read between their pixels."""
        truth, _ = before_wall()
        missing = disc(truth, (80, 60), 18)
        width, height = round(160 * share), round(120 * share)
        u, v = np.arange(width) * 160 // width, np.arange(height) * 120 // height
        frame = without(replaced(truth, color=truth.color[v][:, u]), missing)
        depth = rasterizer.render_depth(frame, camera=frames.CAMERA, **FILL)
        assert (error_of(depth, truth.depth)[missing] > 0.01).mean() < 0.06
        large = frames.CAMERA.resized(width, height)
        pose = ps.orbit_pose(None, truth.pivot, yaw=8)  # the frame's own is elsewhere: half of its points are near
        picture = rasterizer.render(frame, camera=large, pose=pose, **FILL)
        whole = rasterizer.render(replaced(frame, depth=truth.depth), camera=large, pose=pose)
        assert ((picture[..., 3] > 0) != (whole[..., 3] > 0)).mean() < 0.02

    def test_a_single_row(self, rasterizer):
        """Nothing crosses the picture in one line: that is no surface between its borders."""
        frame = frames.tilted_plane()
        row = np.indices(frame.depth.shape)[0] == 60
        picture = rasterizer.render(without(frame, ~row), **FILL)
        np.testing.assert_array_equal(picture[..., 3] > 0, row)

    @pytest.mark.parametrize("shape", [(1, 1), (1, 2), (3, 5), (2, 9), (9, 2), (5, 4)])
    def test_pictures_smaller_than_a_cell_or_two(self, rasterizer, shape):
        h, w = shape
        camera = ps.Camera(20, 20, (w - 1) / 2, (h - 1) / 2, w, h)
        color, depth = np.full((h, w, 3), 130, np.uint8), np.full(shape, 2, F)
        depth[0, 0] = 0
        assert rasterizer.render_depth(ps.Frame(color, depth, camera), **FILL).shape == shape
        depth = np.full(shape, 2, F)
        depth[h // 2, w // 2] = 0
        found = rasterizer.render_depth(ps.Frame(color, depth, camera), **FILL)
        if min(shape) > 2:
            np.testing.assert_allclose(found, 2, rtol=1e-3)


def test_other_words_for_the_size_are_refused(renderer, typed):
    with pytest.raises(ValueError, match="size must be a number of source pixels, or 'fill', got 'full'"):
        renderer.render(frames.sphere(), point_size="full")
    code, _, said = typed("render vase -o a.png --point-size full")
    assert code == 2 and "--point-size must be a number of source pixels, or 'fill', got 'full'" in said
    assert typed("render vase -o a.png --point-size fill")[0] == 0


class TestQuality:
    """Against traced truth, and against the depth that is nearest in the picture, and the farther side of each row."""

    CAMERA = frames.CAMERA.resized(320, 240)
    SEEDS = (1, 2, 4)

    @classmethod
    def traced(cls, seed):
        """A room with balls and a board; what a sensor with a baseline of 6 cm and patches of dark leave of it."""
        rng = np.random.default_rng(seed)

        def paint():
            base, turn = rng.uniform(0.25, 0.7, 3), rng.uniform(0, 6, 3)
            return lambda p: np.clip(base + 0.08 * np.sin(9 * p + turn) + 0.05 * np.sin(23 * p[..., ::-1]), 0, 1)

        things = [plane((0.2, 0.1, -1), (0, 0, 2.6), paint()), plane((0, -1, 0.05), (0, 0.55, 2), paint())]
        low, high = (-0.6, -0.2, 1.2), (0.6, 0.3, 1.9)
        things += [sphere(rng.uniform(low, high), rng.uniform(0.1, 0.25), paint()) for _ in range(3)]
        things.append(patch(rng.uniform(low, high), (0.2, 0, 0.1), (0, 0.15, 0.05), paint()))
        hits = trace(things, cls.CAMERA)
        field = gaussian_filter(rng.normal(size=hits.depth.shape), 4)
        missing = shadow(hits.depth, cls.CAMERA.fx * 0.06) | (field > np.quantile(field, 0.96))
        missing |= rng.random(missing.shape) < 0.01
        return hits, missing

    @staticmethod
    def anchors(depth):
        place = distance_transform_edt(depth == 0, return_distances=False, return_indices=True)
        near, hole, u = depth[tuple(place)], depth == 0, np.arange(depth.shape[1])
        left = np.maximum.accumulate(np.where(hole, 0, u), 1)
        right = np.minimum.accumulate(np.where(hole, u[-1], u)[:, ::-1], 1)[:, ::-1]
        both = np.maximum(np.take_along_axis(depth, left, 1), np.take_along_axis(depth, right, 1))
        return near, np.where(hole, np.where(both > 0, both, near), depth)

    @classmethod
    def scores(cls, renderer, seed):
        """Left, off (%), normals (degrees); dB above the better anchor from the frame's own camera and turned."""
        hits, missing = cls.traced(seed)
        whole = as_frame(hits, cls.CAMERA)
        frame = without(whole, missing)
        depth = renderer.render_depth(frame, **FILL)
        row = [100 * (depth == 0)[missing].mean(), 100 * (error_of(depth, hits.depth)[missing] > 0.02).mean()]
        found = renderer.estimate_normals(replaced(whole, depth=np.where(missing, depth, whole.depth)), "star")
        row.append(np.nanmean(angle(found, hits.normals)[missing]))
        light, material = ps.Light(position=(-1.0, -1.2, 0.0)), ps.Material(ambient=0.1, diffuse=0.9, specular=0.0)
        for yaw in (0, 12):
            pose = ps.orbit_pose(None, (0, 0, 1.7), yaw)

            def draw(one, pose=pose, **options):
                picture = renderer.render(one, light, material, pose=pose, **options)
                return np.where(picture[..., 3:] > 0, picture[..., :3], 0).astype(float), picture[..., 3] > 0

            best, seen = draw(whole)
            asked = missing if yaw == 0 else seen & ~draw(frame)[1]
            others = [draw(replaced(frame, depth=one))[0] for one in cls.anchors(frame.depth)]
            decibels = [
                10 * np.log10(255**2 / ((one - best)[asked] ** 2).mean()) for one in (draw(frame, **FILL)[0], *others)
            ]
            row.append(decibels[0] - max(decibels[1:]))
        return row

    def test_completed_surfaces_are_the_true_ones(self, renderer):
        rows = np.array([self.scores(renderer, seed) for seed in self.SEEDS])
        left, off, normals, own, turned = rows.mean(0)
        assert left <= 0.5 and off <= 3 and normals <= 3 and own >= 4 and turned >= 3, rows
