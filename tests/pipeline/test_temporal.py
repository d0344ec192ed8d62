"""Streams that are filtered over time: what stands still flickers less, what moves is as it was."""

import json
from functools import cache

import moderngl
import numpy as np
import pytest
from PIL import Image

import pointshade_gl as ps
from pointshade_gl.bench.tracing import Hits, encode, plane, sphere, trace, waves
from pointshade_gl.scene.orbit import State

from ..benchmarks.traced_light import shade
from ..renderer.test_lifetime import alive
from ..renderer.test_renderer import living_objects
from ..support import frames
from ..support.view_sets import pose_at
from ..support.viewing import press

CAMERA, LIGHT = frames.CAMERA, ps.Light(position=(-0.5, -0.7, 0.2))
WALL = plane((0.15, -0.1, -1), (0, 0, 2.4), waves)


def kinect(z, rng):
    return z + rng.normal(0, 1, z.shape) * (0.0012 + 0.0019 * (z - 0.4) ** 2)


def shared(z, rng):
    """Disparity of matched windows, in steps of 1/16 pixel: neighbours share its noise."""
    noise = rng.normal(0, 0.25, z.shape)
    for axis in (0, 1):
        noise = np.mean([np.roll(noise, k, axis) for k in range(-2, 3)], 0)
    return 40 / (np.round((40 / z + noise) * 16) / 16)


NOISES = {
    "gauss": lambda z, rng: z + rng.normal(0, 0.002, z.shape),
    "kinect": kinect,
    "shared": shared,
    "millimetres": lambda z, rng: np.round(z + rng.normal(0, 0.0005, z.shape), 3),
}


def some(*names):
    """All noises; but for these only in the run of the system."""
    return [name if name in names else pytest.param(name, marks=pytest.mark.system) for name in NOISES]


def seen(hits, noise, seed, pose=None):
    """The frame of a camera with this noise."""
    depth = np.where(hits.depth > 0, NOISES[noise](hits.depth, np.random.default_rng(seed)), 0)
    return ps.Frame(np.round(encode(hits.albedo)).astype(np.uint8), depth.astype(np.float32), CAMERA, pose)


def scene_at(centre=(0.05, 0.02, 1.5), radius=0.4, pose=None):
    return still(centre, radius) if pose is None else trace([sphere(centre, radius, waves), WALL], CAMERA, pose)


@cache
def still(centre, radius):
    """From where all cameras are that do not move."""
    return trace([sphere(centre, radius, waves), WALL], CAMERA)


def drawn(stream, temporal):
    """Normals, pictures and depths of a stream, (n, h, w, ...). Pictures in light that is not calm: it hides noise."""
    with ps.Renderer() as renderer:
        made = []
        for frame in stream:
            picture = renderer.render(frame, LIGHT, normals="adaptive", temporal=temporal)[..., :3].astype(float)
            normals = renderer.estimate_normals(frame, "adaptive", temporal=temporal)
            made.append(
                (np.nan_to_num(normals), picture, renderer.render_depth(frame, normals="adaptive", temporal=temporal))
            )
        assert renderer.steps.counts["surface"] == len(stream)
    return [np.array(x) for x in zip(*made, strict=True)]


def errors(made, hits: Hits, k):
    """Of depth, degrees of normals, steps of the picture: (h, w) each, for one picture of a stream."""
    normals, picture, depth = (x[k] for x in made)
    angle = np.degrees(np.arccos(np.clip((normals * hits.normals).sum(-1), -1, 1)))
    truth = encode(shade(hits, LIGHT, ps.Material(), (0, 0, 0)))
    return np.abs(depth - hits.depth), angle, np.abs(picture - truth).mean(-1)


class TestQuality:
    @pytest.mark.parametrize("noise", some("gauss", "shared"))
    def test_what_stands_still_flickers_half_as_much(self, noise):
        """The first frames included, while the mean settles; of the picture's median it is 8 bits that count there."""
        stream = [seen(scene_at(), noise, k) for k in range(30)]
        before, after = drawn(stream, False), drawn(stream, True)
        for kind, skipped in ((0, 0), (1, 5)):
            flicker, left = (np.sqrt(made[kind].var(0).sum(-1)) for made in (before, after))
            assert left.mean() <= 0.5 * flicker.mean()
            flicker, left = (np.sqrt(made[kind][skipped:].var(0).sum(-1)) for made in (before, after))
            assert np.median(left) <= 0.5 * np.median(flicker)
        plain, calm = (errors(made, scene_at(), -1) for made in (before, after))
        for kind, bound in ((0, 0.9), (1, 0.9), (2, 0.95)):  # half of the picture's error is that of 8 bits
            assert calm[kind].mean() < bound * plain[kind].mean()

    @pytest.mark.parametrize("noise", some("kinect", "millimetres"))
    def test_what_moves_is_not_smeared(self, noise):
        """5 pixels a frame; also in a band of 3 pixels on both sides of its outline."""
        step = 5 * 1.5 / CAMERA.fx
        hits = [scene_at((-0.4 + step * k, 0.0, 1.5), 0.28) for k in range(9)]
        stream = [seen(one, noise, k) for k, one in enumerate(hits)]
        before, after = drawn(stream, False), drawn(stream, True)
        total = {}
        for k in range(3, 9):
            ball = hits[k].surface == 0
            near, inner = ball.copy(), ball.copy()
            for _ in range(3):
                near, inner = grown(near), ~grown(~inner)
            for name, part in (("ball", ball), ("edges", near & ~inner)):
                for kind, (plain, calm) in enumerate(
                    zip(*(errors(m, hits[k], k) for m in (before, after)), strict=True)
                ):
                    total.setdefault((name, kind), []).append((plain[part].mean(), calm[part].mean()))
        ratios = {key: np.mean(value, 0)[1] / np.mean(value, 0)[0] for key, value in total.items()}
        assert max(ratios.values()) <= 1.1, ratios

    @pytest.mark.parametrize("noise", ["kinect", "millimetres"])
    def test_a_camera_that_turns_flickers_a_third_less(self, noise):
        """The error of the normals against the truth, and its change from one picture to the next."""
        poses = [ps.orbit_pose(None, (0, 0, 1.7), 1.5 * k - 8) for k in range(10)]
        hits = [scene_at(pose=pose) for pose in poses]
        stream = [seen(one, noise, k, pose) for k, (one, pose) in enumerate(zip(hits, poses, strict=True))]
        flicker = {}
        for temporal in (False, True):
            off = []  # how far the normals are off, world axes
            for made, one, pose in zip(drawn(stream, temporal)[0], hits, poses, strict=True):
                off.append(made @ pose[:3, :3].T - one.normals)
            flicker[temporal] = np.mean([change(off, hits, poses, k) for k in range(4, 10)])
        assert flicker[True] <= 0.67 * flicker[False], flicker


def grown(mask):
    padded = np.pad(mask, 1)
    return mask | padded[2:, 1:-1] | padded[:-2, 1:-1] | padded[1:-1, 2:] | padded[1:-1, :-2]


def change(off, hits, poses, k):
    """Mean change of an error from picture k - 1 to k, where both see the same."""
    there = (hits[k].points - poses[k - 1][:3, 3]) @ poses[k - 1][:3, :3]
    u, v = (np.rint(there[..., i] / there[..., 2] * f + c).astype(int) for i, f, c in ((0, 131, 79.5), (1, 131, 59.5)))
    inside = (u >= 0) & (v >= 0) & (u < 160) & (v < 120)
    u, v = np.where(inside, u, 0), np.where(inside, v, 0)
    same = inside & (np.abs(hits[k - 1].depth[v, u] - there[..., 2]) < 0.01 * there[..., 2])
    return np.linalg.norm(off[k] - off[k - 1][v, u], axis=-1)[same].mean()


def noisy(seed, **options):
    return seen(scene_at(**options), "gauss", seed, options.get("pose"))


def same(renderer, frame, **options):
    """Whether a frame is drawn as without the filter."""
    calm = renderer.estimate_normals(frame, temporal=True, **options)
    with ps.Renderer() as fresh:
        plain = fresh.estimate_normals(frame, **options)
    return np.array_equal(calm, plain, equal_nan=True)


@pytest.fixture
def own():
    with ps.Renderer() as made:
        yield made


class TestStreams:
    def test_the_first_frame_is_as_without_and_the_second_is_not(self, own):
        assert same(own, noisy(0)) and not same(own, noisy(1))

    def test_a_picture_drawn_again_is_not_filtered_again(self, own):
        own.render(noisy(0), temporal=True)
        frame = noisy(1)
        first = own.render(frame, LIGHT, temporal=True)
        own.render(frame, ps.Light(position=(1, 0, 0)), temporal=True)
        own.render(frame, LIGHT, yaw=20, temporal=True)
        assert (own.render(frame, LIGHT, temporal=True) == first).all()
        assert own.steps.counts["temporal"] == own.steps.counts["temporal normals"] == 2

    def test_without_the_option_no_step_runs_and_nothing_is_kept(self, own):
        frame = noisy(0)
        plain = own.render(frame)
        assert own.steps.counts["temporal"] == 0
        assert (own.render(noisy(0)) == plain).all()

    def test_another_size_or_camera_begins_anew(self, own):
        own.estimate_normals(noisy(0), temporal=True)
        frame = noisy(1)
        camera = ps.Camera(130, 131, 79.5, 59.5, 160, 120)
        assert same(own, ps.Frame(frame.color, frame.depth, camera))
        assert same(own, ps.Frame(frame.color, frame.depth, CAMERA))
        small = ps.Frame(None, frame.depth[:100], ps.Camera(131, 131, 79.5, 59.5, 160, 100))
        assert same(own, small) and same(own, noisy(2))

    def test_a_frame_that_is_estimated_otherwise_begins_anew(self, own):
        own.estimate_normals(noisy(0), temporal=True)
        frame = noisy(1)
        assert not same(own, frame) and same(own, frame, noise=0.002) and not same(own, noisy(2), noise=0.002)

    def test_clean_depth_and_other_methods_do_not_change(self, own):
        clean = [ps.Frame(None, scene_at((0.05 * k, 0, 1.5)).depth, CAMERA) for k in range(3)]
        assert all(same(own, frame) for frame in clean)
        own.estimate_normals(noisy(0), temporal=True)
        assert same(own, noisy(1), method="star") and same(own, clean[0]) and same(own, noisy(2))

    def test_what_others_have_left_at_the_same_place_fails_the_comparison(self, own):
        own.estimate_normals(noisy(0), temporal=True)
        other = seen(trace([plane((0, 0.2, -1), (0, 0, 0.8), waves)], CAMERA), "gauss", 1)
        assert same(own, other)

    def test_missing_depth_stays_missing_and_comes_back_fresh(self, own):
        options = {"temporal": True, "noise": 0.002}  # what is measured is decided for the stream
        hole = np.zeros((120, 160), bool)
        hole[40:70, 50:90] = True
        for k in range(3):
            frame = noisy(k)
            found = own.render_depth(ps.Frame(frame.color, np.where(hole, 0, frame.depth), CAMERA), **options)
            assert not found[hole].any()
        found = own.render_depth(noisy(3), **options)
        with ps.Renderer() as fresh:
            change = np.abs(found - fresh.render_depth(noisy(3), noise=0.002))
        far_in = np.zeros_like(hole)  # points are drawn on surfaces that are fitted to their neighbours
        far_in[52:58, 62:78] = True
        assert change[far_in].max() < 1e-5 < change[~hole].mean()

    def test_each_object_of_a_scene_has_its_own_stream_also_while_it_is_out_of_view(self, own):
        def scene(order, seed, x=0.5):
            wall = trace([plane((0, 0, -1), (0, 0, 1.2), waves)], CAMERA)
            both = noisy(seed), seen(wall, "gauss", 50 + seed)
            places = np.eye(4), np.eye(4)
            places[1][0, 3] = x
            nodes = [
                ps.Node(ps.PointObject(one, temporal=True), transform=at) for one, at in zip(both, places, strict=True)
            ]
            return ps.Scene(tuple(nodes[k] for k in order), CAMERA)

        def filtered(*arguments):
            before = own.steps.counts["temporal"]
            own.render(scene(*arguments))
            return own.steps.counts["temporal"] - before

        histories = own._pipeline.gpu_scene.frames.streams._histories
        assert filtered((0, 1), 0) == 2 and len(histories) == 2
        first, second = histories.values()
        assert first is not second
        before = alive(own)["Texture"]
        assert filtered((0, 1), 1, 50) == 1 and list(histories.values()) == [first, second]
        assert filtered((0,), 2) == 1 and list(histories.values()) == [first]
        assert alive(own)["Texture"] < before

    def test_of_a_set_only_the_source_with_a_new_frame_is_filtered(self, own):
        poses = [pose_at(-10), pose_at(10)]
        views = [noisy(k, pose=pose) for k, pose in enumerate(poses)]
        own.render(views, temporal=True)
        assert own.steps.counts["temporal"] == 2
        own.render([views[0], noisy(2, pose=poses[1])], temporal=True)
        assert own.steps.counts["temporal"] == 3

    def test_nothing_is_left_on_the_gpu(self):
        context = moderngl.create_context(standalone=True, backend="egl")
        before = living_objects(context)
        with ps.Renderer(context) as made:
            for k in range(3):
                made.render(noisy(k, pose=pose_at(0.2 * k)), temporal=True)
            assert made.steps.counts["temporal normals"] == 3
        assert context.error == "GL_NO_ERROR" and living_objects(context) == before
        context.release()


def test_a_stream_in_a_window_is_filtered_once_a_frame(open_viewer):
    viewer = open_viewer(iter([noisy(k) for k in range(3)]), state=State(look=ps.Appearance(temporal=True)))
    while (
        viewer.document.playback.players[0]._thread.is_alive() or not viewer.document.playback.players[0]._queue.empty()
    ):
        viewer.step(wait=False)
    counts = viewer.screen.renderer.steps.counts
    assert 2 <= counts["temporal"] == counts["surface"] <= 3
    press(viewer, "RIGHT")
    viewer.step(wait=False)
    assert counts["temporal"] == counts["surface"]


def test_a_wrong_value_is_named(renderer):
    with pytest.raises(TypeError, match="temporal must be True or False, got 'yes'"):
        renderer.render(frames.sphere(), temporal="yes")


def test_a_scene_file_keeps_it_and_names_a_wrong_one(tmp_path):
    scene = ps.Scene((ps.Node(ps.PointObject(noisy(0), temporal=True), "points"),), CAMERA)
    ps.save_scene(tmp_path / "a.gltf", scene)
    said = json.loads((tmp_path / "a.gltf").read_text())
    assert ps.load_scene(tmp_path / "a.gltf", notes=lambda _: None).nodes[0].content.look.temporal
    (extras,) = [n["extras"]["pointshade"] for n in said["nodes"] if "frame" in str(n.get("extras"))]
    extras["temporal"] = "yes"
    (tmp_path / "a.gltf").write_text(json.dumps(said))
    with pytest.raises(ValueError, match="temporal must be true or false, got 'yes'"):
        ps.load_scene(tmp_path / "a.gltf", notes=lambda _: None)


@pytest.fixture
def sequence(tmp_path):
    """Eight noisy frames of a still scene, in millimetres."""
    place = tmp_path / "still"
    (place / "depth").mkdir(parents=True)
    (place / "color").mkdir()
    for k in range(8):
        frame = seen(scene_at(), "kinect", k)
        Image.fromarray(np.round(frame.depth * 1000).astype(np.uint16)).save(place / "depth" / f"{k}.png")
        Image.fromarray(frame.color).save(place / "color" / f"{k}.png")
    camera = {name: getattr(CAMERA, name) for name in ("width", "height", "fx", "fy", "cx", "cy")}
    (place / "intrinsics.json").write_text(json.dumps(camera | {"depth_scale": 1000}))
    return place


def test_numbered_files_are_filtered(typed, sequence, tmp_path):
    flicker = {}
    for name, option in (("plain", ""), ("calm", "--temporal")):
        (tmp_path / name).mkdir()
        code, _, told = typed(f"render '{sequence}' -o '{tmp_path}/{name}/%d.png' {option}")
        assert code == 0, told
        pictures = [np.asarray(Image.open(tmp_path / name / f"{k}.png"), float) for k in range(8)]
        flicker[name] = np.std(pictures[3:], 0).mean()
    assert flicker["calm"] < 0.5 * flicker["plain"]


def test_films_and_normals_take_the_option(typed, sequence):
    assert typed(f"render '{sequence}' -o out.mp4 --temporal --frames 3")[0] == 0
    assert typed(f"normals '{sequence}' -o n%d.npy --temporal")[0] == 0
    assert typed(f"depth '{sequence}' -o d%d.npy --temporal")[0] == 0


@pytest.mark.parametrize(
    "line",
    [
        "render vase -o a.png --temporal",
        "render vase -o a.mp4 --turntable light --temporal",
        "render vase -o a.ply --temporal",
        "normals vase -o a.npy --temporal",
        "depth vase -o a.npy --temporal",
        "view vase --temporal",
    ],
)
def test_a_single_frame_is_refused(typed, line):
    code, _, told = typed(line)
    assert code == 2 and "--temporal filters the frames of a sequence over time, and here is a single one" in told
