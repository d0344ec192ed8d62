"""The help: short at first, complete with --help-all, its examples are commands that work."""

import re
import shlex
import shutil
from pathlib import Path

import numpy as np
import pytest
from typer.main import get_command

import pointshade_gl as ps
from pointshade_gl.cli.help import EXAMPLES, FIRST
from pointshade_gl.cli.main import COMMANDS, command_line
from pointshade_gl.files.access.known_names import asset
from pointshade_gl.scene.option_fields import PANELS

from ..support import frames

LINES = [line for name in EXAMPLES for _, line in EXAMPLES[name]]
NEEDS_MORE = "view", "bench", "batch", "render left right", "pointshade align"  # a window, time, processes, real views


@pytest.fixture
def commands():
    """The commands, by name."""
    return get_command(command_line()).commands


@pytest.fixture(autouse=True)
def narrow(monkeypatch):
    """A terminal of 80 columns."""
    monkeypatch.setenv("COLUMNS", "80")


def shown_options(command):
    return [one for one in command.params if one.param_type_name == "option" and not one.hidden]


def names_in(text):
    """The options that are explained, in the order of the page."""
    return re.findall(r"^  (?:-\w, )?(--[\w-]+)", text, re.MULTILINE)


@pytest.mark.parametrize("name", COMMANDS)
def test_the_help_fits_a_screen_and_shows_what_everybody_needs(typed, commands, name):
    _, text, errors = typed(f"{name} --help")
    lines = text.splitlines()
    assert not errors and len(lines) < 60 and max(map(len, lines)) <= 80
    assert typed(f"{name} -h")[1] == text
    wanted = FIRST.get(name, "").split() or [one.opts[0] for one in shown_options(commands[name])]
    for option in wanted:
        assert re.search(rf"^  (-\w, )?(--[\w-]+, )?{option}\b", text, re.MULTILINE), option
    assert all(line in text for _, line in EXAMPLES[name]) and 3 <= len(EXAMPLES[name]) <= 5
    if name in FIRST:
        left = len(shown_options(commands[name])) + 1 - len(wanted)  # and --help
        assert f"`pointshade {name} --help-all` explains {left} more options: " in " ".join(text.split())


@pytest.mark.parametrize("name", COMMANDS)
def test_all_of_the_help_explains_every_option_once_in_a_group_of_few(typed, commands, name):
    _, text, _ = typed(f"{name} --help-all")
    assert max(map(len, text.splitlines())) <= 80
    listed = names_in(text)
    options = [next(name for name in one.opts if name.startswith("--")) for one in shown_options(commands[name])]
    assert sorted(listed) == sorted([*options, "--help"])
    groups = re.split(rf"^({'|'.join(PANELS)}):\n", text.partition("\nExamples:")[0], flags=re.MULTILINE)
    assert [name for one in groups[2::2] for name in names_in(one)] == listed
    assert all(len(names_in(one)) <= 12 for one in groups[2::2])
    assert [one for one in PANELS if one in groups[1::2]] == groups[1::2]


def test_a_terminal_gets_colours_unless_it_wants_none(typed, monkeypatch):
    for variable in ("FORCE_COLOR", "NO_COLOR"):
        monkeypatch.delenv(variable, raising=False)
    plain = typed("render --help")[1]
    assert "\x1b" not in plain
    monkeypatch.setenv("FORCE_COLOR", "1")
    coloured = typed("render --help")[1]
    assert "\x1b[36m" in coloured and re.sub(r"\x1b\[[\d;]*m", "", coloured) == plain
    monkeypatch.setenv("NO_COLOR", "1")
    assert "\x1b[36m" not in typed("render --help")[1]


@pytest.mark.parametrize("width", [10, 80, 300])
def test_it_reads_well_at_any_width(typed, monkeypatch, width):
    monkeypatch.setenv("COLUMNS", str(width))
    text = typed("bench --help-all")[1].partition("\nExamples:")[0]
    assert max(map(len, text.splitlines())) <= min(max(width, 40), 100)


@pytest.mark.parametrize("line", LINES)
def test_an_example_is_a_command_of_80_columns(commands, line):
    program, *words = shlex.split(line)
    assert program == "pointshade" and len(line) <= 76
    commands[words[0]].make_context(words[0], words[1:])


@pytest.mark.usefixtures("renderer")
@pytest.mark.parametrize(
    "line",
    [
        pytest.param(line, marks=pytest.mark.system) if "--ground" in line or "--turntable" in line else line
        for line in LINES
        if not any(word in line for word in NEEDS_MORE)
    ],
)
def test_an_example_runs(typed, tmp_path, line):
    shutil.copytree(asset("vase"), "my_frame")
    scene = frames.sphere()
    for kind, folder in (("color", "my_sequence"), ("depth", "my_sequence"), ("color", "my_lights")):
        Path(folder, kind).mkdir(parents=True)
    Path("my_lights/depth").mkdir()
    for folder in ("my_sequence", "my_lights"):
        for k in range(3):
            ps.save_image(f"{folder}/color/{k}.png", scene.color // (1 + k))
            np.save(f"{folder}/depth/{k}.npy", scene.depth)
        c = frames.CAMERA
        Path(folder, "intrinsics.json").write_text(
            f'{{"fx": {c.fx}, "fy": {c.fy}, "cx": {c.cx}, "cy": {c.cy}, "width": {c.width}, "height": {c.height}}}'
        )
    ps.save_image("photo.jpg", scene.color)
    ps.save_depth("photo_depth.png", scene.depth)
    ball = np.random.default_rng(0).normal(size=(500, 3))
    ps.save_points("scan.ply", ps.PointCloud(ball / np.linalg.norm(ball, axis=1, keepdims=True)))
    if ".exr" in line:
        pytest.importorskip("OpenEXR")
    few = " --frames 2" if "--turntable" in line else ""
    code, _, errors = typed(line.removeprefix("pointshade ") + few)
    assert code == 0, errors
