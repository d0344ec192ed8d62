"""The command line as a user types it: it writes files and prints one line; every error is one sentence."""

import os
import re
import signal
import subprocess
import sys
import time
from importlib.metadata import entry_points
from pathlib import Path

import numpy as np
import pytest
from PIL import Image, ImageSequence

import pointshade_gl as ps

from ..support.children import started
from ..support.command import run, run_process

CAMERA_JSON = '{"width": 8, "height": 6, "fx": 10, "fy": 10, "cx": 3.5, "cy": 2.5, "depth_scale": 1000}'


@pytest.fixture
def folder(tmp_path):
    """A small frame: depth in millimetres, colours, intrinsics."""
    place = tmp_path / "frame"
    place.mkdir()
    depth = np.full((6, 8), 1500, np.uint16)
    Image.fromarray(depth).save(place / "depth.png")
    Image.fromarray(np.full((6, 8, 3), 120, np.uint8)).save(place / "color.png")
    (place / "intrinsics.json").write_text(CAMERA_JSON)
    return place


@pytest.fixture
def sequence(tmp_path):
    """Five frames in folders depth/ and color/, of greys 100, 110..."""
    place = tmp_path / "sequence"
    for name in ("depth", "color"):
        (place / name).mkdir(parents=True)
    for k in range(5):
        Image.fromarray(np.full((6, 8), 1500 + k, np.uint16)).save(place / "depth" / f"{k}.png")
        Image.fromarray(np.full((6, 8, 3), 100 + 10 * k, np.uint8)).save(place / "color" / f"{k}.png")
    (place / "intrinsics.json").write_text(CAMERA_JSON)
    return place


@pytest.mark.usefixtures("renderer")
class TestWithGl:
    def test_without_input_the_vase_is_rendered_and_one_line_says_so(self, tmp_path):
        done = run_process("render", "-o", tmp_path / "out.png")
        assert done.returncode == 0, done.stderr
        assert re.fullmatch(r".+out\.png: 640x480 pixels from 93207 points, .+, \d+ ms\n", done.stdout)
        with Image.open(tmp_path / "out.png") as image:
            assert image.size == (640, 480) and image.mode == "RGBA"
            assert 0.2 < (np.asarray(image)[..., 3] > 0).mean() < 0.5

    def test_a_software_renderer_is_announced_once(self, renderer, tmp_path):
        if not renderer.context.is_software:
            pytest.skip("a real GPU needs no announcement")
        assert run("render", "-o", tmp_path / "out.png").stderr.count("software renderer") == 1

    @pytest.mark.skipif(sys.platform != "linux", reason="elsewhere names of files are texts")
    @pytest.mark.parametrize("encoding", ["utf-8", "ascii", "cp1252"])
    def test_names_that_are_no_text_are_printed_with_escapes(self, folder, monkeypatch, tmp_path, encoding):
        monkeypatch.chdir(tmp_path)
        monkeypatch.setenv("PYTHONIOENCODING", encoding)
        name = os.fsdecode(b"\xff\x1b[31m \xe2\x82\xac")  # no UTF-8, a terminal's red, a euro sign
        folder.rename(name)
        known = "\u20ac" if encoding != "ascii" else "\\u20ac"
        written = rf"\udcff\x1b[31m {known}"
        command = [sys.executable, "-m", "pointshade_gl"]
        done = subprocess.run([*command, "render", name, "-o", f"{name}.html"], capture_output=True)
        assert done.returncode == 0, done.stderr
        assert done.stdout.decode(encoding).startswith(f"{written}.html: a page of ")
        assert "<title>\\udcff\\x1b[31m \u20ac</title>" in Path(f"{name}.html").read_text(encoding="utf-8")
        done = subprocess.run([*command, "render", f"{name}.nothing", "-o", "a.png"], capture_output=True)
        assert done.returncode == 2 and f"there is no file {written}.nothing" in done.stderr.decode(encoding)

    def test_options_reach_the_picture(self, folder, tmp_path):
        plain = run("render", folder, "-o", tmp_path / "a.png", "--shading", "none")
        assert plain.returncode == 0, plain.stderr
        options = ["--shading", "flat", "--light", "-1,-1,0", "--light", "1,0,0", "--ambient", "0.2", "--specular", "0"]
        view = ["--yaw", "10", "--pitch", "-5", "--dolly", "0.2", "--picture-size", "40x30", "--splat", "round"]
        done = run("render", folder, "-o", tmp_path / "b.png", *options, *view, "--normals", "triangles-4")
        assert done.returncode == 0, done.stderr
        with Image.open(tmp_path / "a.png") as a, Image.open(tmp_path / "b.png") as b:
            assert np.asarray(a)[..., :3].min() == 120
            assert b.size == (40, 30) and np.asarray(b)[..., 3].any()

    def test_a_pose_file_moves_the_camera(self, folder, tmp_path):
        np.savetxt(tmp_path / "pose.txt", ps.orbit_pose(None, (0, 0, 1.5), yaw=180))
        done = run("render", folder, "-o", tmp_path / "back.png", "--pose", tmp_path / "pose.txt")
        assert done.returncode == 0, done.stderr

    def test_a_disparity_picture_with_its_baseline(self, folder, tmp_path):
        options = ["--depth-kind", "disparity", "--depth-scale", "1000", "--baseline", "0.3"]
        done = run("render", folder, "-o", tmp_path / "out.png", "--shading", "none", *options)
        assert done.returncode == 0, done.stderr
        with Image.open(tmp_path / "out.png") as image:
            assert np.asarray(image)[..., 3].all()

    def test_normals_as_numbers_and_as_colours(self, folder, tmp_path):
        assert run("normals", folder, "-o", tmp_path / "n.npy").returncode == 0
        assert np.load(tmp_path / "n.npy") == pytest.approx(np.broadcast_to((0, 0, -1), (6, 8, 3)), abs=1e-5)
        assert run("normals", folder, "-o", tmp_path / "n.png").returncode == 0
        with Image.open(tmp_path / "n.png") as image:
            assert np.asarray(image)[3, 4].tolist() == [128, 128, 255, 255]

    def test_the_light_goes_round_in_a_film(self, folder, tmp_path):
        done = run("render", folder, "--turntable", "light", "--frames", "5", "--fps", "10", "-o", tmp_path / "out.gif")
        assert done.returncode == 0, done.stderr
        assert re.fullmatch(r".+out\.gif: 5 pictures of 8x6 pixels, .+, \d+ ms\n", done.stdout)
        with Image.open(tmp_path / "out.gif") as film:
            durations = [image.info["duration"] for image in ImageSequence.Iterator(film)]
            assert sum(durations) == 500 and len(durations) > 2  # pictures of a wall lit from behind are one
            assert film.info["loop"] == 0

    def test_the_camera_goes_round_in_numbered_pictures(self, folder, tmp_path):
        done = run("render", folder, "--turntable", "360", "--frames", "4", "-o", tmp_path / "%d.png")
        assert done.returncode == 0, done.stderr
        pictures = [np.asarray(Image.open(tmp_path / f"{k}.png").copy()) for k in range(4)]
        assert (pictures[0][..., 3] > 0).all() and not np.array_equal(pictures[0], pictures[1])

    def test_a_sequence_becomes_a_film_and_pictures(self, sequence, tmp_path):
        done = run("render", sequence, "-o", tmp_path / "out.mp4", "--shading", "none")
        assert done.returncode == 0, done.stderr
        assert "out.mp4: 5 pictures of 8x6 pixels" in done.stdout and (tmp_path / "out.mp4").stat().st_size > 500
        done = run("render", sequence, "-o", tmp_path / "%03d.png", "--shading", "none", "--frames", "3")
        assert done.returncode == 0 and "%03d.png: 3 pictures of 8x6 pixels" in done.stdout
        greys = [Image.open(tmp_path / f"{k:03d}.png").getpixel((4, 3))[0] for k in range(3)]
        assert greys == [100, 110, 120] and len(list(tmp_path.glob("*.png"))) == 3

    def test_a_sequence_into_one_picture_gives_its_first_frame(self, sequence, tmp_path):
        done = run("render", sequence, "-o", tmp_path / "out.png", "--shading", "none")
        assert done.returncode == 0 and "is a sequence of 5 frames: 0.png is taken" in done.stderr
        with Image.open(tmp_path / "out.png") as image:
            assert image.getpixel((4, 3)) == (100, 100, 100, 255)

    def test_an_unreadable_frame_in_the_middle_is_one_warning_and_the_rest_goes_on(self, sequence, tmp_path):
        (sequence / "depth" / "2.png").write_bytes(b"no picture at all")
        done = run("render", sequence, "-o", tmp_path / "%d.png")
        assert done.returncode == 0 and ": 4 pictures of 8x6" in done.stdout
        (warning,) = [line for line in done.stderr.splitlines() if not line.startswith("note: ")]
        assert re.fullmatch(r"warning: skipped frame 2: .+2\.png is not a picture, .+", warning)
        assert sorted(path.name for path in tmp_path.glob("*.png")) == ["0.png", "1.png", "3.png", "4.png"]

    def test_info_names_the_renderer_and_its_limits(self, renderer):
        done = run("info")
        assert done.returncode == 0
        assert renderer.context.renderer in done.stdout and "largest point" in done.stdout
        limits = renderer.context.limits()
        assert re.findall(r"(?:rasterizer|programs) +(\w+)", done.stdout) == [limits["rasterizer"], limits["programs"]]

    def test_a_device_that_does_not_exist_is_exit_code_1(self, tmp_path):
        done = run("render", "-o", tmp_path / "out.png", "--device", "99")
        assert done.returncode == 1 and "device 99" in done.stderr and not list(tmp_path.iterdir())


def pointer(folder):
    (folder / "depth.npy").write_text("version https://git-lfs.github.com/spec/v1\noid sha256:00\nsize 1\n")


def depth8(folder):
    Image.fromarray(np.full((6, 8), 150, np.uint8)).save(folder / "depth.png")


def rainbow(folder):
    colors = np.random.default_rng(0).integers(0, 255, (6, 8, 3), np.uint8)
    Image.fromarray(colors).save(folder / "depth.png")


def no_picture(folder):
    (folder / "depth.png").write_bytes(b"no picture at all, only words that look like nothing")


def wrong_size(folder):
    (folder / "intrinsics.json").write_text(CAMERA_JSON.replace('"width": 8', '"width": 800'))


def no_focal_length(folder):
    (folder / "intrinsics.json").write_text(CAMERA_JSON.replace('"fx": 10', '"fx": 0'))


def all_missing(folder):
    Image.fromarray(np.zeros((6, 8), np.uint16)).save(folder / "depth.png")


def no_depth(folder):
    (folder / "depth.png").unlink()


@pytest.mark.parametrize(
    ("spoil", "complaint"),
    [
        (no_depth, "has no depth picture"),
        (no_picture, "is not a picture"),
        (pointer, "git-LFS pointer"),
        (depth8, "8 bits"),
        (rainbow, "is a colour picture, not depth, nor depth colour-mapped by Spectral_r"),
        (wrong_size, "intrinsics are for 800x6"),
        (no_focal_length, "fx must be above 0"),
        (all_missing, "depth must be known somewhere"),
    ],
)
def test_a_spoilt_frame_is_one_sentence_and_exit_code_2(folder, tmp_path, spoil, complaint):
    spoil(folder)
    check_refused(run("render", folder, "-o", tmp_path / "out.png"), tmp_path, complaint)


@pytest.mark.parametrize(
    ("options", "complaint"),
    [
        (["--intrinsics", "0,10,3,2"], "fx must be above 0"),
        (["--depth", "nowhere.png"], "nowhere.png does not exist"),
        (["--depth-kind", "sonar"], "unknown --depth-kind 'sonar': known are z, ray"),
        (["--depth-scale", "0"], "--depth-scale must be"),
        (["--fov", "200"], "--fov must lie between 0 and 180"),
        (["--yaw", "nan"], "--yaw and --pitch must be finite"),
        (["--dolly", "1"], "--dolly below 1"),
        (["--light", "1,2"], "--light '1,2': light position must be three finite numbers"),
        (["--picture-size", "big"], "--picture-size takes WIDTHxHEIGHT"),
        (["--picture-size", "0x5"], "whole pixels above 0"),
        (["--shininess", "-3"], "pointshade: --shininess must be a number"),
        (["--max-depth-step", "wide"], "--max-depth-step must be metres"),
        (["--turntable", "light"], "many pictures need a film (.mp4, .gif) or a number in the name"),
    ],
)
def test_a_wrong_option_is_one_sentence_and_exit_code_2(folder, tmp_path, options, complaint):
    check_refused(run("render", folder, "-o", tmp_path / "out.png", *options), tmp_path, complaint)


@pytest.mark.parametrize(
    ("option", "complaint"), [("--shading=toon", "known are none"), ("--normals=magic", "known are auto")]
)
@pytest.mark.usefixtures("renderer")
def test_an_unknown_name_is_answered_with_the_known_ones(folder, tmp_path, option, complaint):
    check_refused(run("render", folder, "-o", tmp_path / "out.png", option), tmp_path, complaint)


def test_a_pose_with_nan_is_one_sentence(folder, tmp_path):
    np.savetxt(tmp_path / "pose.txt", np.full((4, 4), np.nan))
    done = run("render", folder, "-o", tmp_path / "out.png", "--pose", tmp_path / "pose.txt")
    check_refused(done, tmp_path, "must be finite")


@pytest.mark.parametrize(
    ("name", "complaint"), [("no/out.png", "create it first"), ("out.xyz", "suffix must be one of")]
)
def test_a_place_that_cannot_be_written_is_said_before_any_work(folder, tmp_path, name, complaint):
    check_refused(run("render", folder, "-o", tmp_path / name), tmp_path, complaint)


@pytest.mark.parametrize(
    ("name", "options", "complaint"),
    [
        ("out.gif", [], "a single frame cannot become a film: pass --turntable light or camera"),
        ("out%d.png", [], "a single frame cannot become a film"),
        ("out.gif", ["--turntable", "table"], "unknown --turntable 'table': known are light, camera, swing, 360"),
        ("out.gif", ["--turntable", "light", "--frames", "3", "--fps", "0"], "--fps must be pictures per second"),
        (
            "out.gif",
            ["--turntable", "light", "--temporal"],
            "--temporal filters the frames of a sequence over time, and",
        ),
        ("no/out.mp4", ["--turntable", "light"], "create it first"),
        ("out.avi", ["--turntable", "light"], "many pictures need a film (.mp4, .gif)"),
    ],
)
@pytest.mark.usefixtures("renderer")
def test_a_film_that_cannot_be_is_one_sentence(folder, tmp_path, name, options, complaint):
    check_refused(run("render", folder, "-o", tmp_path / name, *options), tmp_path, complaint)


def test_no_gl_at_all_is_exit_code_1_and_says_what_to_install(folder, tmp_path):
    """The loader of EGL drivers finds no driver."""
    nowhere = {"__EGL_VENDOR_LIBRARY_FILENAMES": os.devnull}
    done = run_process("render", folder, "-o", tmp_path / "out.png", environment=nowhere)
    check_refused(done, tmp_path, "no OpenGL 3.3 context", code=1)
    assert sys.platform != "linux" or "apt-get install -y libegl1 libgl1-mesa-dri" in done.stderr


def check_refused(done, tmp_path, complaint, code=2):
    assert done.returncode == code, done.stderr
    lines = [line for line in done.stderr.splitlines() if not line.startswith("note: ")]
    assert len(lines) == 1 and complaint in lines[0], done.stderr
    assert not done.stdout and not list(tmp_path.rglob("*out*")) and not list(tmp_path.rglob("*.part"))


def test_version():
    assert run_process("--version").stdout == f"pointshade_gl {ps.__version__}\n"


@pytest.mark.usefixtures("renderer")
def test_a_light_for_a_scene_casts_shadows_as_the_scenes_own_do(tmp_path):
    source = ps.load_scene("demo")
    light = ps.Light(position=(0, 1, 0.5), shadow=True)
    done = run("render", "demo", "--light", "0,1,0.5", "--samples", 1, "-o", tmp_path / "out.png")
    assert done.returncode == 0, done.stderr
    with Image.open(tmp_path / "out.png") as image:
        assert (np.asarray(image) == ps.render(source, light)).all()


@pytest.mark.parametrize(
    ("options", "named"),
    [
        (["--shading", "flat", "--specular", "0.9"], "leave out --specular"),
        (["--max-depth-step", "3%", "--noise", "kinect"], "leave out --max-depth-step, --noise"),
    ],
)
def test_options_for_the_look_of_objects_are_refused_for_a_scene(tmp_path, options, named):
    check_refused(run("render", "demo", "-o", tmp_path / "out.png", *options), tmp_path, named)


@pytest.mark.usefixtures("renderer")
def test_an_empty_picture_is_written_and_said(folder, tmp_path):
    done = run("render", folder, "--dolly", "0.5", "--pose", tmp_path / "away.txt", "-o", tmp_path / "out.png")
    assert done.returncode == 2
    np.savetxt(tmp_path / "away.txt", np.diag([1, -1, -1, 1]))
    done = run("render", folder, "--pose", tmp_path / "away.txt", "-o", tmp_path / "out.png")
    assert done.returncode == 0 and "note: nothing is in view" in done.stderr
    assert (tmp_path / "out.png").exists()


@pytest.mark.system
@pytest.mark.usefixtures("renderer")
@pytest.mark.skipif(sys.platform == "win32", reason="there a process that is ended has no last word")
@pytest.mark.parametrize(("name", "suffix"), [("SIGTERM", "gif"), ("SIGHUP", "gif"), ("SIGHUP", "mp4")])
def test_a_film_that_is_ended_from_outside_leaves_nothing_half_written(tmp_path, name, suffix):
    """By a request to end, or because the terminal is closed; the shell then sends a second signal."""
    command = [sys.executable, "-m", "pointshade_gl", "render", "--turntable", "light", "--frames", "100000"]
    with started([*command, "-o", tmp_path / f"out.{suffix}"], stdout=None) as process:
        assert process.stderr is not None and process.stderr.readline()  # the note about the driver: it is drawing
        deadline = time.monotonic() + 30
        while suffix == "mp4" and not list(tmp_path.iterdir()) and time.monotonic() < deadline:
            time.sleep(0.01)  # until the hidden file is there
        process.send_signal(getattr(signal, name))
        process.send_signal(getattr(signal, name))
        assert process.wait(timeout=60) != 0
    assert not list(tmp_path.iterdir())


@pytest.mark.skipif(not hasattr(signal, "SIGHUP"), reason="Windows has no hang-up")
def test_under_nohup_a_closed_terminal_ends_nothing():
    code = """if True:
        import signal, sys
        from pointshade_gl.cli.main import main
        signal.signal(signal.SIGHUP, signal.SIG_IGN)
        sys.argv[1:] = ["--version"]
        try:
            main()
        finally:
            print(signal.getsignal(signal.SIGHUP) == signal.SIG_IGN)"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60)
    assert done.stdout == f"pointshade_gl {ps.__version__}\nTrue\n", done.stderr


def test_the_command_is_installed_under_its_name():
    (command,) = entry_points(group="console_scripts", name="pointshade")
    assert command.value == "pointshade_gl.__main__:main"


@pytest.mark.parametrize(
    "module", ["typer", "numpy", "pointshade_gl.cli.output", "pointshade_gl.cli.commands.info_command"]
)
def test_ctrl_c_while_something_is_imported_ends_without_a_traceback(module):
    code = f"""
import sys
class Interrupted:
    def find_spec(self, name, *_):
        if name == {module!r}:
            raise KeyboardInterrupt
sys.meta_path.insert(0, Interrupted())
sys.argv = ["pointshade", "info"]
from pointshade_gl.__main__ import main
main()"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60)
    assert done.returncode == 130 and not done.stderr.strip(), done.stderr


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no broken pipes")
@pytest.mark.parametrize("line", ["--version", "--help", "render --help-all", "info --device 77"])
def test_a_reader_that_has_gone_ends_the_command_as_shells_know_it(line, folder):
    reader, writer = os.pipe()
    os.close(reader)
    try:
        done = subprocess.run(
            [sys.executable, "-m", "pointshade_gl", *line.split()], stdout=writer, stderr=subprocess.PIPE, timeout=60
        )
    finally:
        os.close(writer)
    expected = 1 if "device" in line else 141  # what goes wrong before anything is printed, is said
    assert done.returncode == expected and b"Traceback" not in done.stderr and b"ignored" not in done.stderr


@pytest.mark.gl
def test_a_picture_needs_nothing_of_pydantic(tmp_path):
    """typer imports it from version 0.29 on, which takes .2 s: docs/stability.md."""
    code = f"""
import sys
sys.argv = ["pointshade", "render", "-o", {str(tmp_path / "out.png")!r}, "--samples", "1", "--picture-size", "32x24"]
from pointshade_gl.__main__ import main
try:
    main()
except SystemExit as end:
    sys.exit(end.code or [name for name in sys.modules if name.startswith("pydantic")] or 0)"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60)
    assert done.returncode == 0, done.stderr


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="files of Linux")
@pytest.mark.parametrize(("line", "code"), [("render nowhere", 2), ("render --bogus", 2), ("--version", 2)])
def test_an_output_that_is_full_changes_no_exit_code_and_prints_no_traceback(line, code, tmp_path):
    with Path("/dev/full").open("w") as full:
        stdout, stderr = (full, subprocess.PIPE) if line == "--version" else (subprocess.PIPE, full)
        done = subprocess.run(
            [sys.executable, "-m", "pointshade_gl", *line.split()], stdout=stdout, stderr=stderr, timeout=60
        )
    assert done.returncode == code
    assert not done.stderr or (b"No space left" in done.stderr and b"Traceback" not in done.stderr)


@pytest.mark.skipif(not hasattr(signal, "SIGHUP"), reason="Windows has no SIGHUP")
def test_two_signals_at_once_end_a_command_without_a_traceback():
    """As systemd sends them with SendSIGHUP=yes: the second has come before the first is answered."""
    code = """
import os, signal
from pointshade_gl.cli import main
def command(*_, **__):
    signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGTERM, signal.SIGHUP])
    os.kill(os.getpid(), signal.SIGTERM)
    os.kill(os.getpid(), signal.SIGHUP)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, [signal.SIGTERM, signal.SIGHUP])
main.command_line = lambda _: command
from pointshade_gl.__main__ import main
main()"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60)
    assert done.returncode == 130 and "race condition" not in done.stderr and "Traceback" not in done.stderr
