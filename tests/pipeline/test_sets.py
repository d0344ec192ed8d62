"""Several frames of one thing, drawn as one object: against stored pictures and the truth."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

import pointshade_gl as ps
from pointshade_gl.bench.tracing import as_frame, patch, sphere, sphere_and_wall, trace, waves
from pointshade_gl.estimation.multi_view import importances, primary_shares
from pointshade_gl.gpu.points.set_merge import target_estimator
from pointshade_gl.scene.appearance import NORMALS_AT, SHADINGS

from ..benchmarks.traced_light import co_visible, near_edge
from ..support import frames
from ..support.compare import compare_images
from ..support.drivers import need_compute
from ..support.view_sets import noisy, pose_at, replaced, seen_from, three_views, write_views

BETWEEN = pose_at(6, -2)
SUN = ps.Light(direction=(0.6, 0.5, 1), shadow=True)


@pytest.fixture(scope="module", params=["compute", "points"])
def rasterizer(request, renderer):
    if request.param == "compute":
        need_compute(renderer)
    with ps.Renderer(rasterizer=request.param) as made:
        yield request.param, made


def scored(image, pose, views):
    """PSNR where all views see the surface and no edge is near; the truth is traced."""
    seen = trace(sphere_and_wall(), frames.CAMERA, pose)
    truth, judged = as_frame(seen, frames.CAMERA).color, ~near_edge(seen)
    for view in views:
        judged &= co_visible(seen, trace(sphere_and_wall(), view.camera, view.pose), view.camera, view.pose)
    error = image[judged][:, :3].astype(float) - truth[judged]
    assert judged.mean() > 0.3
    return 10 * np.log10(255**2 / max((error**2).mean(), 1e-9))


@pytest.mark.parametrize("name", ["unlit", "lit", "sun", "target"])
def test_three_views_are_drawn_as_they_were(rasterizer, golden, name):
    _, renderer = rasterizer
    options = {"shading": "none" if name == "unlit" else "phong", "normals": "star"}
    if name == "target":
        options = {"normals_at": "target"}
    light = ps.Light(position=(-1, -1, 0)) if name in ("unlit", "lit") else SUN
    golden(f"views_{name}", renderer.render(three_views(), light, camera=frames.CAMERA, pose=BETWEEN, **options))


def test_a_list_of_one_frame_is_the_frame_bit_for_bit(rasterizer):
    _, renderer = rasterizer
    frame = three_views()[0]
    for options in ({}, {"shading": "none"}, {"light": SUN}, {"pose": BETWEEN, "point_size": 2.0}):
        assert (renderer.render([frame], **options) == renderer.render(frame, **options)).all()


def test_merged_views_are_nearer_to_the_truth_than_their_point_objects_in_a_scene(rasterizer):
    """Noise is averaged, flying pixels are left out."""
    _, renderer = rasterizer
    views = [noisy(view, seed) for seed, view in enumerate(three_views())]
    merged = renderer.render(views, camera=frames.CAMERA, pose=BETWEEN, shading="none")
    nodes = tuple(ps.Node(ps.PointObject(view, shading="none")) for view in views)
    piled = renderer.render(ps.Scene(nodes, camera=frames.CAMERA, pose=BETWEEN))
    assert scored(merged, BETWEEN, views) >= max(scored(piled, BETWEEN, views) + 1, 33)
    assert (merged[..., 3] > 0).mean() >= (piled[..., 3] > 0).mean()  # distrusted points still close holes


def things_all_around():
    """A ball with six thin leaves around it, in the air."""
    leaves = [
        patch((0.22 * x, 0.22 * y, 1.5), (0.13 * x, 0.13 * y, 0.06), (-0.05 * y, 0.05 * x, 0.02), waves)
        for x, y in (np.array((np.cos(a), np.sin(a))) for a in np.arange(6) * np.pi / 3 + 0.2)
    ]
    return [sphere((0, 0, 1.5), 0.1, waves), *leaves]


def seen_around(yaw, pitch):
    pose = ps.orbit_pose(None, (0, 0, 1.5), yaw, pitch)
    return as_frame(trace(things_all_around(), frames.CAMERA, pose), frames.CAMERA, pose)


class TestViewsFromAllAround:
    """They say about each other where surfaces end."""

    VIEWS = [seen_around(yaw, 10) for yaw in range(0, 360, 60)] + [seen_around(30, 50)]

    @pytest.mark.parametrize("turn", [(30, 5), (85, 20), (-45, -5)])
    def test_outlines_of_exact_ones_do_not_grow_with_each(self, rasterizer, turn):
        _, renderer = rasterizer
        truth = seen_around(*turn)
        drawn = renderer.render(self.VIEWS, camera=frames.CAMERA, pose=truth.pose, shading="none")[..., 3] > 0
        true = truth.depth > 0
        assert (drawn & ~true).sum() < 0.045 * true.sum()  # 0.11 to 0.14 without
        assert (true & ~drawn).sum() < 0.01 * true.sum()

    def test_what_one_view_alone_has_seen_is_not_hidden_by_others(self, rasterizer):
        _, renderer = rasterizer
        truth = seen_around(120, 30)
        image = renderer.render(self.VIEWS, camera=frames.CAMERA, pose=truth.pose, shading="none")
        both = (image[..., 3] > 0) & (truth.depth > 0)
        error = image[both][:, :3].astype(float) - truth.color[both]
        assert 10 * np.log10(255**2 / (error**2).mean()) > 42  # 39.2 where its edges fly and near views come first

    def test_backs_are_not_compared_with_fronts(self, renderer):
        renderer.render(self.VIEWS, camera=frames.CAMERA, shading="none")
        told = "\n".join(renderer.explain())
        assert "gains: none" in told and "within 0.4 %" in told


def test_what_stands_out_by_a_pixel_casts_its_shadow_where_views_have_no_noise(rasterizer):
    _, renderer = rasterizer
    floor = patch((0, 0.1, 1.5), (0.3, 0, 0), (0, 0, 0.3), waves)
    plates = [floor, patch((0, 0.088, 1.5), (0.12, 0, 0), (0, 0, 0.12), waves)]  # 12 mm above it, a pixel of the views
    poses = [ps.orbit_pose(None, (0, 0.1, 1.5), yaw, 45) for yaw in range(0, 360, 60)]
    hits = [trace(plates, frames.CAMERA, pose) for pose in poses]
    views = [as_frame(one, frames.CAMERA, pose) for one, pose in zip(hits, poses, strict=True)]
    options, sun = {"camera": frames.CAMERA, "pose": poses[0]}, ps.Light(direction=(1, 0.25, 0))
    lit, dark = (renderer.render(views, replace(sun, shadow=on), **options)[..., 1] for on in (False, True))
    x, _, z = np.moveaxis(hits[0].points, -1, 0)
    beside = (hits[0].depth > 0) & (abs(z - 1.5) < 0.09)
    assert (dark < 0.8 * lit)[beside & (x > 0.13) & (x < 0.155)].mean() > 0.9  # the shadow ends at 0.168
    assert (dark < lit)[beside & ((x > 0.19) | (x < -0.14)) & (abs(x) < 0.27)].mean() < 0.01


class TestNormalsAtTheTarget:
    """They come from the merged depth; those at the source are mixed."""

    LIGHT = ps.Light(position=(-1, -1, 0))

    def both(self, renderer, views, **options):
        options = {"light": self.LIGHT, "camera": frames.CAMERA, "pose": BETWEEN} | options
        return [renderer.render(views, normals_at=place, **options).astype(int) for place in NORMALS_AT]

    def test_of_noisy_views_light_nearly_as_those_at_the_source(self, rasterizer):
        _, renderer = rasterizer
        views = [noisy(view, seed) for seed, view in enumerate(three_views())]
        source, target = self.both(renderer, views)
        assert (source[..., 3] == target[..., 3]).all() and (source != target).any()
        assert np.abs(source - target).mean() < 1 and (np.abs(source - target).max(-1) > 16).mean() < 0.02

    @pytest.mark.parametrize("options", [{"shading": "none"}, {"shading": "flat"}, {"shading": "gouraud"}])
    def test_make_no_difference_where_they_are_not_lit(self, renderer, options):
        source, target = self.both(renderer, three_views(), **options)
        assert (source == target).all()

    def test_make_no_difference_to_a_single_frame(self, renderer):
        for frame in (three_views()[0], [three_views()[0]]):
            first = renderer.render(frame, normals_at="target", pose=BETWEEN)
            renderer.render(frame)
            assert (renderer.render(frame, pose=BETWEEN) == first).all()

    def test_are_found_by_the_method_and_step_of_the_frames_and_measure_their_noise(self):
        options = {"normals": "triangles-8", "max_depth_step": 0.05, "noise": "kinect"}
        assert target_estimator(ps.Appearance(normals_at="target", **options)) == (
            "triangles-8",
            (0.05, 0.0),
            None,
            "keep",
        )
        assert target_estimator(ps.Appearance(normals_at="source", **options)) is None

    def test_a_new_light_only_lights(self, renderer):
        views = three_views()
        options = {"camera": frames.CAMERA, "pose": BETWEEN, "normals_at": "target"}
        renderer.render(views, **options)
        before = renderer.steps.counts.copy()
        renderer.render(views, self.LIGHT, **options)
        assert renderer.steps.counts - before == {"light": 1}

    def test_in_scenes_objects_choose_and_scale(self, renderer):
        """Beside others, and twice as large: the depth is that of the object's own metres."""
        transform = np.diag((2.0, 2.0, 2.0, 1.0))
        node = ps.Node(ps.PointObject(three_views(), normals_at="target"), transform=transform)
        moved = BETWEEN.copy()
        moved[:3, 3] *= 2
        light = replace(self.LIGHT, position=tuple(2 * np.array(self.LIGHT.position)))
        image = renderer.render(ps.Scene((node,), camera=frames.CAMERA), light, pose=moved)
        _, target = self.both(renderer, three_views())
        assert not compare_images(image, target)

    def test_an_unknown_place_lists_the_known_ones(self, renderer, typed):
        with pytest.raises(ValueError, match=r"unknown normals_at 'frame'.*known are source, target"):
            renderer.render(three_views(), normals_at="frame")
        code, _, err = typed("render vase -o a.png --normals-at frame")
        assert code == 2 and "--normals-at" in err


@pytest.mark.parametrize("shading", SHADINGS)
def test_every_shading_shows_nearly_what_the_best_single_view_shows(renderer, shading):
    views, light = three_views(), ps.Light(position=(-1, -1, 0))
    options = {"camera": frames.CAMERA, "pose": views[1].pose, "shading": shading, "light": light}
    merged, single = (renderer.render(one, **options).astype(int) for one in (views, views[1]))
    assert np.median(np.abs(merged - single)) <= 1 and (np.abs(merged - single).max(-1) > 12).mean() < 0.05


def test_what_floats_before_the_others_surfaces_is_not_seen(renderer):
    views = three_views()
    spoilt = views[1].depth.copy()
    spoilt[40:60, 20:35] = 0.9
    alone = renderer.render(views, camera=frames.CAMERA, pose=BETWEEN, shading="none")
    floating = [views[0], replaced(views[1], depth=spoilt), views[2]]
    image = renderer.render(floating, camera=frames.CAMERA, pose=BETWEEN, shading="none")
    assert (np.abs(image.astype(int) - alone).max(-1) > 16).mean() < 0.005


def test_a_thin_post_that_all_views_see_stays(renderer):
    views = []
    for view in three_views():
        z = view.depth.copy()
        # a post 4 mm thick in the world plane z = 0.9, upright through x = -0.25
        v, u = np.mgrid[0 : z.shape[0], 0 : z.shape[1]]
        camera = view.camera
        rays = np.stack([(u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy, np.ones(u.shape)], -1)
        world = rays @ view.pose[:3, :3].T
        t = (0.9 - view.pose[2, 3]) / world[..., 2]
        hit = np.abs(view.pose[0, 3] + t * world[..., 0] + 0.25) < 0.015
        color = view.color.copy()
        color[hit] = (255, 0, 0)
        views.append(replaced(view, depth=np.where(hit, t, z), color=color))
    image = renderer.render(views, camera=frames.CAMERA, pose=BETWEEN, shading="none")
    red = (image[..., 0] > 200) & (image[..., 1] < 40)
    assert (red.sum(1) >= 2).mean() > 0.9


def test_exposures_are_matched_and_equal_ones_left_alone(renderer):
    views = three_views()
    darker = np.round(views[2].color * 0.8).astype(np.uint8)
    options = {"camera": frames.CAMERA, "pose": BETWEEN, "shading": "none"}
    plain = renderer.render(views, **options).astype(float)
    mixed = renderer.render([*views[:2], replaced(views[2], color=darker)], **options).astype(float)
    both = (plain[..., 3] > 0) & (mixed[..., 3] > 0)
    ratio = (mixed / np.maximum(plain, 1))[both][:, :3]
    assert np.median(ratio) < 0.97  # towards the mean of the three
    assert np.percentile(ratio, 95) - np.percentile(ratio, 5) < 0.06  # evenly: no seam


def shifted(view, seed):
    """With a pose that is wrong by 1 cm."""
    pose, off = view.pose.copy(), np.random.default_rng(seed).normal(0, 1, 3)
    pose[:3, 3] += 0.01 * off / np.linalg.norm(off)
    return replaced(view, pose=pose)


def contradicting_views():
    return [shifted(seen_from(pose_at(yaw)), k) for k, yaw in enumerate((-16, -10, -4, 3, 9, 15))]


def test_views_that_come_and_go_are_drawn_as_they_were(rasterizer, golden):
    _, renderer = rasterizer
    views, pose = contradicting_views(), pose_at(0.2)
    shares = primary_shares(importances(views, pose))
    assert ((shares > 0.1) & (shares < 0.9)).any()
    actual = renderer.render(views, camera=frames.CAMERA, pose=pose, shading="none", normals="star")
    golden("views_coming", actual)


def test_nothing_pops_along_a_path_though_the_views_contradict_each_other(renderer):
    """From step to step about as much changes, also while other views become primary."""
    views, path = contradicting_views(), [pose_at(yaw) for yaw in np.arange(-1.5, 1.5, 0.05)]
    best = {tuple(np.argsort(importances(views, pose))[-3:]) for pose in path}
    images = [renderer.render(views, camera=frames.CAMERA, pose=p, shading="none").astype(int) for p in path]
    changes = [np.abs(a - b)[..., :3] for a, b in pairwise(images)]
    much = [(change.max(-1) > 30).mean() for change in changes]
    means = [change.mean() for change in changes]
    assert len(best) > 1
    assert max(means) < 1.25 * np.median(means) and max(much) < 4 * np.median(much)


@pytest.mark.system
def test_from_the_place_of_one_of_several_exact_frames_its_surface_is_seen(renderer):
    """Others, who guess where their thin leaves end, do not stand before it."""
    views = list(ps.open_source("vase/whole"))
    for own in views[::5]:
        depth = renderer.render_depth(views, camera=own.camera, pose=own.pose)
        both = (own.depth > 0) & (depth > 0)
        before = depth[both] < 0.998 * own.depth[both]
        assert both.sum() == (own.depth > 0).sum() and before.sum() < 100  # of 614 when all counted alike


class TestOnlyWhatChangedRunsAgain:
    def ran(self, renderer, views, **options):
        before = renderer.steps.counts.copy()
        renderer.render(views, camera=frames.CAMERA, **options)
        return {name: count for name, count in (renderer.steps.counts - before).items() if count}

    def test_a_new_light_lights_and_a_new_view_draws_and_merges(self, renderer):
        views = three_views()
        count = self.ran(renderer, views)
        assert (count["upload"], count["surface"], count["agreement"], count["trust"]) == (3, 3, 6, 3)
        assert self.ran(renderer, list(views), light=ps.Light(position=(1, 0, 0))) == {"light": 1}
        assert self.ran(renderer, views, pose=BETWEEN) == {"light": 1, "splats": 3, "surfaces": 1}

    def test_a_new_frame_is_uploaded_and_compared_alone(self, renderer):
        views = three_views()
        self.ran(renderer, views)
        count = self.ran(renderer, [*views[:2], replaced(views[2])])
        assert (count["upload"], count["surface"], count["agreement"]) == (1, 1, 4)


def test_in_a_scene_they_are_one_object_that_a_node_moves_and_scales(renderer):
    views, light = three_views(), ps.Light(position=(-1, -1, 0))
    alone = renderer.render(views, light, camera=frames.CAMERA, pose=BETWEEN)
    transform = ps.orbit_pose(None, (0.3, 0.1, 2), 25, 10)
    transform[:3, :3] *= 2
    scene = ps.Scene((ps.Node(ps.PointObject(views), transform=transform),), camera=frames.CAMERA)
    moved = transform @ BETWEEN
    moved[:3, :3] /= 2
    lamp = transform @ (*light.position, 1)
    image = renderer.render(scene, replace(light, position=tuple(lamp[:3])), pose=moved)
    assert not compare_images(image, alone)
    assert len(scene.instances) == 1 and scene.points_known == sum(view.points_known for view in views)


def test_an_object_with_another_look_keeps_all_of_its_frames():
    views = three_views()
    changed = replace(ps.PointObject(views), look=ps.Appearance(shading="flat"))
    assert changed.frames == tuple(views) and changed.frame is views[0] and changed.look.shading == "flat"


def test_meshes_stand_before_and_behind_them_and_take_their_shadows(renderer):
    board = ps.Mesh(
        [(-0.6, 0.2, 0.8), (-0.2, 0.2, 0.8), (-0.2, 0.5, 0.8)], [(0, 1, 2)], color=(1, 0, 0), shading="none"
    )
    nodes = ps.Node(ps.PointObject(three_views(), shading="none")), ps.Node(board)
    image = renderer.render(ps.Scene(nodes, camera=frames.CAMERA))
    assert 0.005 < ((image[..., 0] == 255) & (image[..., 1] == 0)).mean() < 0.2
    depth = renderer.render_depth(three_views(), camera=frames.CAMERA, pose=BETWEEN)
    truth = trace(sphere_and_wall(), frames.CAMERA, BETWEEN)
    close = (np.abs(depth - truth.depth) < 0.005 * truth.depth)[~near_edge(truth) & (depth > 0)]
    assert close.mean() > 0.99


class TestInput:
    def test_the_same_frame_twice_is_the_frame(self, renderer):
        frame = three_views()[0]
        options = {"camera": frames.CAMERA, "pose": BETWEEN, "shading": "none"}
        once, twice = (renderer.render(views, **options).astype(int) for views in (frame, [frame, frame]))
        assert (np.abs(once - twice).max(-1) > 20).mean() < 0.03

    def test_an_empty_view_adds_nothing(self, renderer):
        views = three_views()
        empty = replaced(views[1], depth=np.zeros_like(views[1].depth))
        options = {"camera": frames.CAMERA, "pose": BETWEEN}
        assert (renderer.render([*views, empty], **options)[..., 3] == renderer.render(views, **options)[..., 3]).all()
        assert not renderer.render([empty, empty], **options).any()

    def test_views_that_do_not_overlap_are_both_seen(self, renderer):
        here = three_views()[1]
        there = replaced(here, pose=ps.orbit_pose(None, (0, 0, 0), 180))
        for pose in (here.pose, there.pose):
            image = renderer.render([here, there], camera=frames.CAMERA, pose=pose, shading="none")
            alone = renderer.render(here, camera=frames.CAMERA, shading="none")
            assert (image[..., 3] == alone[..., 3]).all()
            assert (np.abs(image.astype(int) - alone).max(-1) > 20).mean() < 0.02

    def test_views_of_2x2_pixels_are_drawn(self, renderer):
        camera = ps.Camera(2, 2, 0.5, 0.5, 2, 2)
        tiny = [ps.Frame(None, np.full((2, 2), 1.0), camera, pose_at(yaw)) for yaw in (0, 5)]
        assert renderer.render(tiny)[..., 3].all()

    @pytest.mark.parametrize(
        ("wrong", "message"),
        [
            ([], "1 to 200 frames, got 0"),
            ([frames.single_pixel()] * 201, "1 to 200 frames, got 201"),
            ([frames.single_pixel(), "vase"], "frame 1 must be a Frame, got 'vase'"),
            (7, "frame must be a Frame"),
        ],
    )
    def test_anything_else_is_one_clear_sentence(self, renderer, wrong, message):
        with pytest.raises((TypeError, ValueError), match=message):
            renderer.render(wrong)
        with pytest.raises((TypeError, ValueError), match=message):
            ps.PointObject(wrong)

    def test_arrays_belong_to_one_frame(self, renderer):
        views = three_views()
        for options in ({"normals": np.ones((120, 160, 3))}, {"point_size": np.ones((120, 160))}):
            with pytest.raises(ValueError, match="arrays belong to one frame"):
                renderer.render(views, **options)


class TestCommandLine:
    @pytest.fixture
    def folder(self, tmp_path):
        """A sequence of seven views with poses, of which the fourth has none."""
        return write_views(tmp_path / "walk", [seen_from(pose_at(yaw)) for yaw in range(-9, 10, 3)], lost=(3,))

    def test_evenly_chosen_views_are_one_object(self, typed, folder, tmp_path):
        code, _, err = typed(f"render '{folder}' -o out.png --views 3 --shading none --depth-scale 1000")
        assert code == 0, err
        assert "left out" in err
        from PIL import Image

        chosen = [seen_from(pose_at(yaw)) for yaw in (-9, -3, 9)]
        with Image.open(tmp_path / "out.png") as image:
            written = np.asarray(image)
        truth = ps.render(chosen, shading="none")
        assert (np.abs(written.astype(int) - truth).max(-1) > 24).mean() < 0.02
        assert typed(f"render '{folder}' -o all.png --views all --yaw 5 --depth-scale 1000")[0] == 0

    @pytest.mark.parametrize(
        ("line", "sentence"),
        [
            ("vase -o a.png --views 3", "single frame"),
            ("demo -o a.png --views 3", "is a scene"),
            ("'{folder}' -o a.png --views 1", "or frames such as 0,5,9, got '1'"),
            ("'{folder}' -o %d.ply --views 3 --depth-scale 1000", "are one cloud: write one file, such as out.ply"),
        ],
    )
    def test_what_cannot_be_merged_is_said_in_one_sentence(self, typed, folder, line, sentence):
        code, _, err = typed(f"render {line.format(folder=folder)}")
        assert code == 2 and sentence in err

    def test_a_sequence_without_poses_is_not_merged(self, typed, folder):
        for path in (folder / "pose").iterdir():
            path.unlink()
        (folder / "pose").rmdir()
        code, _, err = typed(f"render '{folder}' -o a.png --views all --depth-scale 1000")
        assert code == 2 and "has poses for 0 frames: --views needs two at least" in err


def test_a_callers_blending_stays(renderer):
    """Frames are added up by blending; a caller's own factors and equations are as they were."""
    import moderngl

    from pointshade_gl.gpu.core.programs import EQUATIONS, FACTORS, AdditiveBlend

    context = moderngl.create_context(standalone=True, backend="egl") if renderer.context.owned else None
    assert context is not None
    context.blend_func, context.blend_equation = (moderngl.SRC_ALPHA, moderngl.ONE), moderngl.MIN
    asked = AdditiveBlend(context)._asked
    before = [asked(name, k) for name in (*FACTORS, *EQUATIONS) for k in (0, 1)]
    with ps.Renderer(context) as borrowed:
        borrowed.render(three_views(), pose=BETWEEN)
    assert [asked(name, k) for name in (*FACTORS, *EQUATIONS) for k in (0, 1)] == before
    context.release()
