"""Messages name options as their reader writes them: in Python, or on the command line."""

import contextlib
import json
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from PIL import Image

import pointshade_gl as ps
from pointshade_gl.bench.command import select
from pointshade_gl.files.depth.depth_coding import decode
from pointshade_gl.files.depth.depth_kinds import DepthHints, to_metres
from pointshade_gl.files.writing.film import Film
from pointshade_gl.notes.words import as_command_line, as_python, option, shown
from pointshade_gl.renderer.series import jobs_of
from pointshade_gl.scene.viewpoint import View
from pointshade_gl.viewer.playback import Player

from ..support.gltf_files import write_gltf

CAMERA = ps.Camera(10, 10, 3.5, 2.5, 8, 6)
FRAME = ps.Frame(None, np.full((6, 8), 1.5, np.float32), CAMERA)
U8, U16 = np.ones((6, 8), np.uint8), np.ones((6, 8), np.uint16)


class TestOption:
    @pytest.mark.parametrize(
        ("arguments", "python", "command_line"),
        [
            (("depth_kind",), "depth_kind", "--depth-kind"),
            (("depth_kind", "inverse"), "depth_kind='inverse'", "--depth-kind inverse"),
            (("depth_scale", 1), "depth_scale=1", "--depth-scale 1"),
            (("depth", "FILE"), "depth=FILE", "--depth FILE"),
            (("turntable", "light", "camera"), "turntable='light' or 'camera'", "--turntable light or camera"),
            (("allow_outside", True), "allow_outside=True", "--allow-outside"),
        ],
    )
    def test_both_forms(self, arguments, python, command_line):
        assert option(*arguments) == python
        with as_command_line():
            assert option(*arguments) == command_line

    def test_a_part_of_something_in_python_stands_alone_on_the_command_line(self):
        assert option("shininess", of="material") == "material shininess"
        with as_command_line():
            assert option("shininess", of="material") == "--shininess"

    def test_options_that_no_file_holds_keep_the_form_of_the_command_line(self):
        with as_command_line(), as_python():
            assert option("max_pixels", 9) == "max_pixels=9"
            assert option("max_pixels", 9, beside_file=True) == "--max-pixels 9"
        with as_python():
            assert option("max_pixels", 9, beside_file=True) == "max_pixels=9"

    def test_long_and_deep_values_are_cut(self):
        deep = []
        for _ in range(100_000):
            deep = [deep]
        for value in ("x" * 10_000, list(range(10_000)), deep, dict.fromkeys(range(99), "y" * 500), 10**3000):
            assert len(shown(value)) <= 200
        assert shown(["a", {"b": 1.5}]) == "['a', {'b': 1.5}]"

    def test_all_threads_speak_alike_and_an_error_ends_it(self):
        with contextlib.suppress(KeyError), as_command_line(), ThreadPoolExecutor(1) as pool:
            assert pool.submit(option, "fov").result() == "--fov"
            with as_python():
                assert option("fov") == "fov"
            assert option("fov") == "--fov"
            raise KeyError
        assert option("fov") == "fov"


@pytest.mark.parametrize(
    ("call", "sentence"),
    [
        (lambda: ps.load_frame(), "a frame needs depth: pass a folder with depth.*, or depth=FILE"),
        (lambda: ps.load_frame(__file__), "pass depth in one of them as depth=FILE"),
        (lambda: ps.load_frame(depth=U16, fov=50, intrinsics="1,1,1,1"), "pass intrinsics or fov, not both"),
        (lambda: ps.load_frame(depth=U16, fov=50, depth_kind="sonar"), "unknown depth_kind 'sonar'"),
        (lambda: ps.load_frame(depth=U16, fov=50, depth_scale=0), "depth_scale must be a finite number above 0"),
        (lambda: ps.load_frame(depth=U8, fov=50), "pass another file, or depth_kind='inverse' or 'z'"),
        (lambda: ps.load_frame(depth=FRAME.depth, fov=50, depth_kind="disparity"), "pass baseline in metres"),
        (lambda: ps.load_frame(depth=FRAME.depth, intrinsics="1,2,3"), "intrinsics must hold fx, fy, cx, cy"),
        (lambda: ps.load_frame(depth=FRAME.depth, intrinsics="0,9,3,2"), "intrinsics: camera fx must be above 0"),
        (lambda: to_metres(U16, CAMERA, "disparity", 1, -1, print), "baseline must be a finite number above 0"),
        (lambda: ps.Camera.from_fov(200, 8, 6), "fov must lie between 0 and 180"),
        (lambda: ps.orbit_pose(None, (0, 0, 1), dolly=1), "yaw and pitch must be finite and dolly below 1"),
        (lambda: ps.Appearance(normals="magic"), "unknown normals method 'magic'"),
        (lambda: ps.Appearance(max_depth_step="wide"), "max_depth_step must be metres"),
        (lambda: ps.Appearance(noise="sonar"), "unknown sensor 'sonar' for noise: known are kinect; or pass metres"),
        (lambda: ps.PointObject(FRAME, noise=-1), "noise must be metres above 0"),
        (lambda: ps.Appearance(shading="toon"), "unknown shading 'toon'"),
        (lambda: ps.Appearance(splat="star"), "unknown splat 'star'"),
        (lambda: ps.Material(specular=-1), "material specular must be a number from 0"),
        (lambda: ps.Material(shininess=0), "material shininess must be a number from 0.001"),
        (lambda: jobs_of(FRAME, View(), None, None, print), "pass turntable='light' or 'camera', or write a single"),
        (lambda: jobs_of(FRAME, View(), "table", None, print), "unknown turntable 'table'"),
        (lambda: Film("out.gif", fps=0), "fps must be pictures per second"),
        (lambda: Player([], fps=0), "fps must be frames per second"),
        (lambda: select(["magic"]), "unknown name 'magic' for only"),
    ],
)
def test_errors_in_python(call, sentence, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)  # where a film could be written
    with pytest.raises((ValueError, OSError)) as error:
        call()
    assert sentence in str(error.value)


def test_notes_in_python():
    notes = []
    decode(U16, "depth", DepthHints(), notes.append)
    decode(U16, "depth", DepthHints("disparity"), notes.append)
    decode(1000 * FRAME.depth, "depth", DepthHints(filed_scale=1000), notes.append)
    assert notes[0].startswith("depth is of integers, without depth_scale: taken as millimetres")
    assert notes[1].startswith("disparity is of integers, without depth_scale: taken as pixels")
    assert notes[2].endswith("pass depth_scale=1 if it is in metres")


@pytest.fixture
def pointshade(typed, tmp_path):
    """pointshade("arguments") in a folder with pictures: exit code, stdout, stderr."""
    for name, array in (("depth8", U8), ("depth16", U16), ("color", np.full((6, 8, 3), 99, np.uint8))):
        Image.fromarray(array).save(tmp_path / f"{name}.png")
    np.save(tmp_path / "metres.npy", FRAME.depth)
    frame = tmp_path / "frame"
    frame.mkdir()
    np.save(frame / "depth.npy", FRAME.depth)
    numbers = {"fx": 10, "fy": 10, "cx": 3.5, "cy": 2.5, "width": 8, "height": 6}
    (frame / "intrinsics.json").write_text(json.dumps(numbers | {"depth_scale": 1000}))
    return typed


RENDER = "render --depth metres.npy --fov 50 -o out.png"


@pytest.mark.parametrize(
    ("line", "sentence"),
    [
        ("render --color color.png -o out.png", "a frame needs depth: pass a folder with depth.*, or --depth FILE"),
        ("render empty -o out.png", "or pass --depth FILE"),
        ("render listed/depth.txt -o out.png", "pass depth in one of them as --depth FILE"),
        (f"{RENDER} --intrinsics 9,9,3,2", "pass --intrinsics or --fov, not both"),
        (f"{RENDER} --depth-kind sonar", "unknown --depth-kind 'sonar'"),
        (f"{RENDER} --depth-scale 0", "--depth-scale must be a finite number above 0"),
        (
            "render --depth depth8.png --fov 50 -o out.png",
            "pass another file, or --depth-kind inverse or z",
        ),
        (f"{RENDER} --depth-kind disparity", "pass --baseline in metres"),
        (f"{RENDER} --depth-kind disparity --baseline -1", "--baseline must be a finite number above 0"),
        ("render --depth depth16.png --intrinsics 1,2,3 -o out.png", "--intrinsics must hold fx, fy, cx, cy"),
        ("render --depth depth16.png --intrinsics 0,9,3,2 -o out.png", "--intrinsics: camera fx must be above 0"),
        ("render --depth metres.npy --fov 200 -o out.png", "--fov must lie between 0 and 180"),
        (f"{RENDER} --dolly 1", "--yaw and --pitch must be finite and --dolly below 1"),
        (f"{RENDER} --normals magic", "unknown --normals method 'magic'"),
        ("normals -o out.npy --normals magic", "unknown --normals method 'magic'"),
        (f"{RENDER} --max-depth-step wide", "--max-depth-step must be metres"),
        (f"{RENDER} --noise sonar", "unknown sensor 'sonar' for --noise: known are kinect; or pass metres"),
        (f"{RENDER} --noise -1", "--noise must be metres above 0"),
        (f"{RENDER} --shading toon", "unknown --shading 'toon'"),
        (f"{RENDER} --splat star", "unknown --splat 'star'"),
        (f"{RENDER} --specular -1", ": --specular must be a number from 0"),
        (f"{RENDER} --shininess 0", ": --shininess must be a number from 0.001"),
        (f"{RENDER} --light nan,0,0", "--light 'nan,0,0': 'nan,0,0' is unknown: it takes X,Y,Z in metres, or words"),
        (
            f"{RENDER} --picture-size 4x4.5",
            "--picture-size takes WIDTHxHEIGHT in whole pixels above 0, such as 640x480, or depth, color, half, "
            "got '4x4.5'",
        ),
        ("render frame -o out.gif", "pass --turntable light or camera, or write a single picture"),
        ("render frame -o out.gif --turntable table", "unknown --turntable 'table'"),
        ("render frame -o out.gif --turntable light --frames 2 --fps 0", "--fps must be pictures per second"),
        ("view many --fps 0", "--fps must be frames per second"),
        ("bench --only magic", "unknown name 'magic' for --only"),
        ("render demo -o out.png --fov 50 --depth metres.npy", "leave out --depth, --fov"),
        ("render demo -o out.png --max-depth-step 3% --ambient 1", "leave out --max-depth-step, --ambient"),
        ("render frame -o out.png --max-pixels 40", "the limit is 40: pass --max-pixels 48 to allow it"),
        ("render frame -o out.png --max-pixels 0", "--max-pixels must be a finite number above 0, got 0"),
        ("render listed -o out.png", "'../depth16.png' leaves the folder listed: pass --allow-outside to allow it"),
    ],
)
@pytest.mark.usefixtures("renderer")
def test_errors_on_the_command_line(pointshade, tmp_path, line, sentence):
    (tmp_path / "empty").mkdir()
    for kind, suffix in (("depth", "npy"), ("color", "png")):
        (tmp_path / "many" / kind).mkdir(parents=True)
        for k in range(2):
            source = tmp_path / {"npy": "metres.npy", "png": "color.png"}[suffix]
            (tmp_path / "many" / kind / f"{k}.{suffix}").write_bytes(source.read_bytes())
    (tmp_path / "listed").mkdir()
    (tmp_path / "listed" / "depth.txt").write_text("1.0 ../depth16.png")
    (tmp_path / "many" / "intrinsics.json").write_bytes((tmp_path / "frame" / "intrinsics.json").read_bytes())
    code, _, errors = pointshade(line)
    *notes, error = errors.splitlines()
    assert code == 2 and error.startswith("pointshade: ") and sentence in error
    assert all(note.startswith("note: ") for note in notes)


@pytest.mark.parametrize(
    ("line", "sentence"),
    [
        ("render --depth depth16.png --fov 50", "depth is of integers, without --depth-scale: taken as millimetres"),
        ("render frame", "taken as 1 a metre; pass --depth-scale if that is wrong"),
        (
            "render --depth depth16.png --fov 50 --depth-kind disparity --baseline 1",
            "disparity is of integers, without --depth-scale: taken as pixels",
        ),
    ],
)
@pytest.mark.usefixtures("renderer")
def test_notes_on_the_command_line(pointshade, line, sentence):
    code, _, errors = pointshade(f"{line} -o out.png")
    assert code == 0 and sum(sentence in text for text in errors.splitlines()) == 1, errors


@pytest.mark.parametrize("said", [{"depth": "{}/depth16.png", "fov": 50}, {"frame": "{}/frame"}])
@pytest.mark.usefixtures("renderer")
def test_the_command_line_can_allow_a_scene_to_name_files_outside(pointshade, tmp_path, said):
    (tmp_path / "scene").mkdir()
    values = {key: value.format("..") if isinstance(value, str) else value for key, value in said.items()}
    extras = {"extras": {"pointshade": values}}
    write_gltf(tmp_path / "scene", {"asset": {"version": "2.0"}, "scenes": [{"nodes": [0]}], "nodes": [extras]})
    assert pointshade("render scene/scene.gltf -o out.png")[0] == 2
    assert pointshade("render scene/scene.gltf -o out.png --allow-outside --max-pixels 100")[0] == 0


@pytest.mark.usefixtures("renderer")
def test_explain_names_the_noise_that_was_given(pointshade):
    code, output, _ = pointshade("normals frame --noise kinect --explain -o n.npy")
    assert code == 0 and output.startswith("adaptive: --noise was given")


@pytest.mark.parametrize(
    ("values", "sentence"),
    [
        ({"depth_kind": "sonar"}, "unknown depth_kind 'sonar' in frame/intrinsics.json: known are z, ray"),
        ({"depth_scale": -3}, "intrinsics.json: depth_scale must be a finite number above 0, got -3.0"),
        (
            {"depth_kind": "disparity", "baseline": 0},
            "intrinsics.json: baseline must be a finite number above 0, got 0.0",
        ),
        ({"fx": 0}, "intrinsics.json: camera fx must be above 0 pixels, got 0"),
    ],
)
def test_what_a_file_says_is_named_as_the_file_has_it(pointshade, tmp_path, values, sentence):
    path = tmp_path / "frame" / "intrinsics.json"
    path.write_text(json.dumps(json.loads(path.read_text()) | values))
    code, _, errors = pointshade("render frame -o out.png")
    assert code == 2 and sentence in errors.splitlines()[-1] and "--" not in errors.splitlines()[-1]


@pytest.mark.parametrize(
    ("values", "sentence"),
    [
        ({"frame": "frame", "shading": "toon"}, "unknown shading 'toon'"),
        ({"depth": "depth8.png", "fov": 50}, "pass another file, or depth_kind='inverse' or 'z'"),
        ({"frame": "frame", "material": {"specular": -1}}, "material specular must be"),
        ({"frame": "../frame"}, "'../frame' leaves the scene's folder: pass --allow-outside to allow it"),
    ],
)
def test_extras_of_a_scene_have_the_names_of_python_and_its_user_those_of_the_command_line(
    pointshade, tmp_path, values, sentence
):
    extras = {"extras": {"pointshade": values}}
    write_gltf(tmp_path, {"asset": {"version": "2.0"}, "scenes": [{"nodes": [0]}], "nodes": [extras]})
    code, _, errors = pointshade("render scene.gltf -o out.png")
    assert code == 2 and sentence in errors
