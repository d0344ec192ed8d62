"""`pointshade bench`: scenes are what they claim, stresses do what they say, files are complete."""

import json
import re
import sys

import numpy as np
import pytest
from PIL import Image
from typer.testing import CliRunner

from pointshade_gl.bench import command, measure, speed
from pointshade_gl.bench.charts import pareto_front, place_labels, who_holds
from pointshade_gl.bench.command import bench_speed, research
from pointshade_gl.bench.measure import CONDITIONS, STRESSES, Measurement, Plan, angle, breaking_point, generator
from pointshade_gl.bench.scenes import MIDDLE, SCENES, make_scene, standard_camera
from pointshade_gl.cli.main import command_line
from pointshade_gl.gpu.points import tiles as tiling
from pointshade_gl.scene.camera import Camera
from pointshade_gl.scene.noise import METHODS

SMALL = standard_camera(96, 72)
FINE = Camera(8 * SMALL.fx, 8 * SMALL.fy, SMALL.cx, SMALL.cy, SMALL.width, SMALL.height)  # an eighth of the view
TINY = Plan((48, 36), ("sphere", "overlap"), ("sphere",), 5, 1)


def flat_depth():
    return np.full((60, 80), 2.0)


def spoiled(name, strength, depth=None):
    return STRESSES[name].spoil(flat_depth() if depth is None else depth, strength, generator(0, name))


def differences(scene):
    """Normals (h-2, w-2, 3) from the depth's own central differences."""
    points = scene.camera.rays() * scene.depth[..., None].astype(float)
    normals = np.cross(points[1:-1, 2:] - points[1:-1, :-2], points[2:, 1:-1] - points[:-2, 1:-1])
    normals /= np.maximum(np.linalg.norm(normals, axis=-1, keepdims=True), 1e-30)
    return normals * np.where((normals * points[1:-1, 1:-1]).sum(-1, keepdims=True) > 0, -1, 1)


@pytest.mark.parametrize("name", [name for name in SCENES if name != "vase"])  # the vase takes seconds
def test_a_scenes_normals_are_those_of_its_depth(name):
    scene = make_scene(name, SMALL, FINE)
    inside = np.zeros(scene.depth.shape, bool)
    inside[3:-3, 3:-3] = True
    known = scene.depth > 0
    for axis in (0, 1):  # not beside a pixel that sees nothing
        known &= np.roll(scene.depth > 0, 1, axis) & np.roll(scene.depth > 0, -1, axis)
    judged = (inside & known & ~scene.edge)[1:-1, 1:-1]
    error = angle(differences(scene), scene.normals[1:-1, 1:-1])[judged]
    assert judged.sum() > 1000
    assert np.median(error) < 0.1
    assert np.percentile(error, 90) < 2  # creases and the shortest waves


@pytest.mark.parametrize("name", ["sphere", "torus", "stairs", "overlap"])
def test_a_scenes_normals_are_unit_and_face_the_camera_from_any_pose(name):
    pose = np.array([(0.8, 0, 0.6, -0.9), (0, 1, 0, 0.1), (-0.6, 0, 0.8, 0.3), (0, 0, 0, 1)])
    scene = make_scene(name, SMALL, pose=pose)
    known = scene.depth > 0
    assert np.linalg.norm(scene.normals[known], axis=-1) == pytest.approx(1, abs=1e-5)
    assert ((scene.normals * SMALL.rays()).sum(-1)[known] < 1e-6).all()


def test_edges_are_jumps_in_depth_and_not_slopes_creases_or_the_end_of_a_surface():
    assert not make_scene("grazing-85", SMALL).edge.any()
    assert not make_scene("waves", SMALL).edge.any()
    assert make_scene("sphere", SMALL).edge.any()
    scene = make_scene("rods", SMALL)
    thin = scene.depth < 1.75
    assert 0.005 < thin.mean() < 0.3
    assert scene.edge[thin].all()


def test_noise_has_the_strength_that_it_says():
    assert (spoiled("noise", 3.0) - 2).std() == pytest.approx(0.003, rel=0.05)
    assert (spoiled("sensor-noise", 2.0) - 2).std() == pytest.approx(2 * (0.0012 + 0.0019 * 1.6**2), rel=0.05)
    smooth = spoiled("smooth-noise", 3.0) - 2
    assert smooth.std() == pytest.approx(0.003, rel=0.01)
    assert np.corrcoef(smooth[:, :-1].ravel(), smooth[:, 1:].ravel())[0, 1] > 0.7


def test_rounded_depth_lies_on_its_steps():
    ramp = np.linspace(0.5, 4, 4800).reshape(60, 80)
    for strength in (0.2, 1.0, 10.0):
        counts = spoiled("steps", strength, ramp) * 1000 / strength
        assert counts == pytest.approx(np.round(counts), abs=1e-6)
    halves = 525 * 0.075 / spoiled("disparity-steps", 0.5, ramp) * 2
    assert halves == pytest.approx(np.round(halves), abs=1e-6)


@pytest.mark.parametrize("name", ["hole-pixels", "hole-blobs"])
@pytest.mark.parametrize("share", [1.0, 20.0, 40.0])
def test_as_many_pixels_go_missing_as_asked(name, share):
    assert 100 * (spoiled(name, share) == 0).mean() == pytest.approx(share, abs=3)


def test_a_scaled_scene_lies_where_it_says():
    middle = np.full((2, 2), MIDDLE)
    assert spoiled("distance-m", 100.0, middle) == pytest.approx(100)
    assert spoiled("distance-mm", 100.0, middle) == pytest.approx(100_000)


def test_a_long_lens_from_afar_keeps_the_size_of_the_object():
    camera, pose = STRESSES["telephoto"].look(SMALL, 64)
    near, far = make_scene("sphere", SMALL), make_scene("sphere", SMALL, camera, pose)
    middle = far.depth[36, 48]
    assert middle == pytest.approx(MIDDLE * 64, rel=0.02)
    round_ones = (near.depth < 1.6).sum(), (far.depth < MIDDLE * 64).sum()
    assert round_ones[0] == pytest.approx(round_ones[1], rel=0.3)


@pytest.mark.parametrize("stress", STRESSES.values(), ids=list(STRESSES))
def test_strengths_rise(stress):
    assert np.all(np.diff(stress.strengths) > 0)


def test_what_is_random_depends_on_the_seed_alone():
    spoil, depth = CONDITIONS["bad-day"].spoil, flat_depth()
    first = spoil(depth, 1, generator(7, "bad-day", "sphere"))
    assert np.array_equal(first, spoil(depth, 1, generator(7, "bad-day", "sphere")))
    assert not np.array_equal(first, spoil(depth, 1, generator(8, "bad-day", "sphere")))


def test_the_angle_is_exact_where_it_is_small():
    turn = np.radians(0.01)
    n = np.array([[0, 0, -1], [0, 0, -1], [0, 0, 1]], np.float32)
    truth = np.array([[0, np.sin(turn), -np.cos(turn)], [0, -1, 0], [0, 0, -1]], np.float32)
    assert angle(n, truth) == pytest.approx([0.01, 90, 180], rel=1e-4)


def test_an_estimator_breaks_where_its_error_first_passes_ten_degrees():
    assert breaking_point([1, 10, 100], [1, 5, 9.9]) is None
    assert breaking_point([1, 10, 100], [1, 10 / np.sqrt(10), 10 * np.sqrt(10)]) == pytest.approx(10**1.5)
    assert breaking_point([1, 10], [11, 12]) == 1


def test_the_front_holds_what_nothing_beats():
    assert pareto_front([3, 1, 2, 4], [1, 5, 6, 0.5]) == [1, 0, 3]


def test_the_headline_names_those_that_break_least():
    stability = {
        "noise": {"breaks": {"a": None, "b": 2.0, "c": 1.0}},
        "steps": {"breaks": {"a": 5.0, "b": None, "c": 3.0}},
    }
    assert who_holds(stability, ["a", "b", "c"]) == "broken least, by 1 of 2: a, b"
    assert who_holds({"noise": stability["noise"]}, ["a", "b"]) == "never broken: a"


def test_labels_stay_inside_and_off_each_other():
    points = np.random.default_rng(3).normal((100, 100), 12, (16, 2))
    sizes = [(30, 9)] * 16
    middles = place_labels(points, sizes, (0, 0, 200, 200), 4)
    gap = np.abs(middles[:, None] - middles[None]) + np.eye(16)[..., None] * 99
    assert ((gap[..., 0] >= 30 - 1e-6) | (gap[..., 1] >= 9 - 1e-6)).all()
    assert (middles > 0).all() and (middles < 200).all()


def test_a_missing_normal_counts_as_the_view_facing_one():
    class Blind:
        def estimate_normals(self, frame, method):
            return np.full((*frame.depth.shape, 3), np.nan, np.float32)

    measurement = Measurement(Blind(), TINY, ["star"], 0, lambda: None)  # type: ignore[arg-type]
    scene = make_scene("plane", standard_camera(48, 36))
    every = measurement.errors(scene, measurement.frame(scene, CONDITIONS["clean"].spoil, 0, "clean"))
    rays = scene.camera.rays()[8:-8, 8:-8]
    slant = np.degrees(np.arccos(1 / np.linalg.norm(rays, axis=-1))).mean()
    assert every["star"] == {"all": pytest.approx(slant, rel=1e-3), "edge": None}


def run(*arguments):
    return CliRunner().invoke(command_line(), ["bench", *map(str, arguments)])


@pytest.fixture
def tiny(monkeypatch):
    monkeypatch.setattr(command, "QUICK", TINY)


@pytest.mark.usefixtures("renderer", "tiny")
class TestCommand:
    @pytest.mark.system
    def test_it_writes_charts_and_results_for_every_method(self, tmp_path):
        done = run("--quick", "--seed", 3, "-o", tmp_path / "out")
        assert done.exit_code == 0, done.output
        assert sorted(path.name for path in (tmp_path / "out").iterdir()) == [
            "chart.png",
            "results.json",
            "stability.png",
        ]
        results = json.loads((tmp_path / "out" / "results.json").read_text())
        assert results["methods"] == list(METHODS) and results["seed"] == 3
        assert results["gl"]["renderer"] and results["size"] == [48, 36]
        for method in METHODS:
            assert set(results["errors"][method]) == set(CONDITIONS)
            assert all(0 <= cell["all"] < 180 for cell in results["errors"][method].values())
            assert all(cell["wall_ms"] > 0 for cell in results["times"][method].values())
            assert all(len(row["errors"][method]) == len(row["strengths"]) for row in results["stability"].values())
        for name in ("chart.png", "stability.png"):
            with Image.open(tmp_path / "out" / name) as image:
                assert image.width == 1800 and np.asarray(image.convert("L")).std() > 5
        assert re.search(r"out: chart.png, stability.png, results.json: \d+ methods on .+\n$", done.stdout)

    @pytest.mark.system
    def test_only_measures_what_is_named_and_images_adds_pictures(self, tmp_path, monkeypatch):
        research("images", "lit_pictures")
        monkeypatch.setattr("lit_forms.SAMPLES", (1, 2))
        monkeypatch.setattr("lit_forms.YAWS", (30,))
        named = ("--only", "star", "--only", "auto", "--only", "kinect")
        done = run("--quick", *named, "--images", "-o", tmp_path)
        assert done.exit_code == 0, done.output
        results = json.loads((tmp_path / "results.json").read_text())
        assert results["methods"] == ["auto", "star"] and results["conditions"] == ["kinect"]
        assert not results["stability"] and not (tmp_path / "stability.png").exists()
        assert len(results["pictures"]["rows"]["clean"]) == 2 * 3 * 2
        assert len(results["forms"]["rows"]) == 3 * 3 * 2 and len(results["forms"]["lit"]) == 3
        names = {path.name for path in tmp_path.iterdir()}
        assert names == {"chart.png", "images.png", "forms.png", "results.json"}
        with Image.open(tmp_path / "forms.png") as image:
            assert image.width == 1800 and np.asarray(image.convert("L")).std() > 5
        assert "forms at the source's size" in done.stdout and "lit in the vertex shader" in done.stdout

    def test_errors_are_the_same_every_time_and_whatever_else_is_measured(self, renderer):
        def errors(methods, conditions):
            return Measurement(renderer, TINY, methods, 1, lambda: None).conditions(conditions)

        both = errors(["auto", "star"], ["clean", "bad-day"])
        assert errors(["star"], ["bad-day"])["star"]["bad-day"] == both["star"]["bad-day"]

    def test_an_interruption_leaves_no_file(self, tmp_path, monkeypatch):
        def interrupt(*_):
            raise KeyboardInterrupt

        monkeypatch.setattr(measure.Measurement, "stability", interrupt)
        assert run("--quick", "--only", "star", "-o", tmp_path).exit_code != 0
        assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("line", "option", "script"),
    [
        (["--views"], "views", "several_views"),
        (["--images", "--quick"], "images", "lit_pictures"),
        (["--speed", "--against", "HEAD~1"], "against", "speed_against"),
    ],
)
def test_research_needs_a_clone(tmp_path, monkeypatch, line, option, script):
    assert (command.RESEARCH / f"{script}.py").is_file()
    monkeypatch.setattr(command, "RESEARCH", tmp_path)
    error = run(*line, "-o", tmp_path / "out").exception
    place = f"(tests/benchmarks/{script}.py)"
    assert isinstance(error, ValueError) and not (tmp_path / "out").exists()
    assert str(error).endswith(f"{option} is research: run it in a clone of the repository {place}")


def test_an_unknown_name_lists_the_known_ones(tmp_path):
    error = run("--only", "stars", "-o", tmp_path / "out").exception
    assert isinstance(error, ValueError) and "'stars'" in str(error)
    for name in (*METHODS, *CONDITIONS, *STRESSES):
        assert name in str(error)
    assert not (tmp_path / "out").exists()


def test_without_matplotlib_one_sentence_says_what_to_install(tmp_path, monkeypatch):
    for name in ("matplotlib", "matplotlib.figure"):
        monkeypatch.setitem(sys.modules, name, None)
    error = run("--quick", "-o", tmp_path / "out").exception
    assert isinstance(error, ValueError) and "pip install '.[bench]' in the clone" in str(error)
    assert not (tmp_path / "out").exists()


def test_a_file_in_the_folders_place_is_told(tmp_path):
    (tmp_path / "out").write_text("mine")
    error = run("--quick", "-o", tmp_path / "out").exception
    assert isinstance(error, ValueError) and "it is a file" in str(error)


class TestSpeed:
    def test_a_stage_is_held_to_the_bytes_that_it_moves(self):
        needed = speed.stage_bytes(points=1000, pixels=100)
        assert needed["surface"] == 1000 * (4 + 16)
        assert needed["splats"] == 1000 * 16 + 100 * (4 + 4 + 4)
        assert needed["light alone"] == 100 * (16 + 8 + 4)

    def test_hills_have_a_depth_everywhere_and_look_the_same_at_any_size(self):
        small, large = speed.hilly(32, 24), speed.hilly(320, 240)
        assert small.points_known == 32 * 24
        assert np.abs(large.depth[5::10, 5::10] - small.depth).max() < 0.05

    def test_each_way_to_measure_a_bandwidth_copies_all(self, renderer, monkeypatch):
        monkeypatch.setattr(speed, "COPY", 4 * speed.COPIED_BY_GROUP)
        with renderer.context.in_use():
            gl, content = renderer.context.gl, bytes(range(256)) * (speed.COPY // 256)
            target, source = gl.buffer(reserve=speed.COPY), gl.buffer(content)
            ways = 0
            for copy, times in speed.copies(target, source, is_software=False):
                target.clear()
                copy(times)
                assert target.read() == content
                ways += 1
            target.release()
            source.release()
        assert ways == (2 if gl.version_code >= 430 else 1)

    def test_every_size_and_rasterizer_is_timed(self, renderer):
        calls = []
        rows = speed.measure_points(0, 2, [(40, 30), (80, 60)], lambda: calls.append(1))
        names = ["points", "compute"] if renderer.context.gl.version_code >= 430 else ["points"]
        assert [(row["points"], row["rasterizer"]) for row in rows] == [(n, r) for n in (1200, 4800) for r in names]
        assert all(row[key] > 0 for row in rows for key in ("live_ms", "view_ms", "light_ms", "splats_ms", "memory_mb"))
        assert len(calls) == 2

    def test_what_a_small_picture_costs_is_counted_and_timed(self, renderer):
        rows = {row["change"]: row for row in speed.measure_overhead(renderer, 1)}
        assert list(rows) == ["same", "light", "view", "new"] and all(row["us"] > 0 for row in rows.values())
        assert 0 < rows["same"]["calls"] < rows["light"]["calls"] < rows["view"]["calls"] < rows["new"]["calls"]

    def test_a_frame_in_tiles_is_timed_and_held_tile_by_tile(self, renderer, monkeypatch):
        monkeypatch.setattr(tiling, "LARGEST_WHOLE", 1200)
        rows = speed.measure_points(0, 2, [(40, 30), (80, 60)], lambda: None)
        assert {row["points"]: row["splats_ms"] is None for row in rows} == {1200: False, 4800: True}
        assert all(row["view_ms"] > 0 for row in rows)
        assert speed.held_bytes(1 << 27, 0, "compute") == speed.held_bytes(1 << 24, 0, "compute")

    def test_a_rasterizer_without_patience_is_left_out_of_larger_sizes(self, renderer, monkeypatch):
        monkeypatch.setattr(speed, "PATIENCE", 0.0)
        rows = speed.measure_points(0, 2, [(40, 30), (80, 60)], lambda: None)
        assert {row["points"] for row in rows} == {1200}

    @pytest.mark.system
    def test_the_command_writes_and_says_on_what(self, renderer, tmp_path, monkeypatch, capsys):
        monkeypatch.setattr(speed, "SIZES", ((40, 30), (80, 60)))
        monkeypatch.setattr(research("speed", "merging"), "TOLERANCES", (0.0, 1e-5))
        against = research("against", "speed_against")
        monkeypatch.setattr(against, "measure_jobs", lambda *_: {"first picture": {"ms": 1.0, "cpu_ms": 2.0}})
        said = bench_speed(tmp_path / "out", quick=True, device=0)
        assert renderer.context.renderer in said
        results = json.loads((tmp_path / "out" / "speed.json").read_text())
        assert [stage["name"] for stage in results["stages"]] == list(speed.stage_bytes(1, 1))
        assert all(stage["ms"] > 0 and stage["limit_ms"] > 0 for stage in results["stages"])
        assert against.read_jobs(tmp_path / "out" / "speed.json") == {"first picture": {"ms": 1, "cpu_ms": 2}}
        assert results["cold_start_s"] > 0 and len(results["points"]) in (2, 4)
        with Image.open(tmp_path / "out" / "speed.png") as image:
            assert image.width > 1000
        shown = capsys.readouterr().out
        assert ("a software renderer" in shown) == renderer.context.is_software
        assert ("merging" in shown) == renderer.context.is_software
        assert "cold start" in shown and "32x24 points" in shown
