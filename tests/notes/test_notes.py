"""Notes on the command line: at most five, none with --quiet. In Python each is logged, or given to `notes`."""

import ast
import io
import logging
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import pointshade_gl as ps
from pointshade_gl.cli import inputs as cli_inputs
from pointshade_gl.cli.commands import render_command  # noqa: F401 - so that it takes none of what is patched
from pointshade_gl.notes.notes import few_notes, print_note, print_warning, silence

from ..support import frames
from ..support.command import run
from ..support.places import ROOT

CHILD = os.environ | {"PYTHONPATH": str(ROOT)}
LOGGER = logging.getLogger("pointshade_gl")
PACKAGE = Path(ps.__file__).parent


def notes(capsys):
    return [line.removeprefix("note: ") for line in capsys.readouterr().err.splitlines()]


@pytest.mark.parametrize("count", [0, 5, 6, 8])
def test_the_sixth_and_later_notes_of_a_command_are_counted(capsys, count):
    with few_notes():
        for k in range(count):
            print_note(str(k))
    *told, last = notes(capsys) or [""]
    if count > 5:
        assert told == list("01234")
        many = {6: "1 more note", 8: "3 more notes"}[count]
        assert last == f"{many}: see all with pointshade info INPUT, none with --quiet"
    else:
        assert [*told, last] == (list("01234")[:count] or [""])


def test_the_same_note_is_printed_and_counted_once(capsys):
    with few_notes():
        for text in "aabbccddaabbee":
            print_note(text)
    assert notes(capsys) == list("abcde")


def test_python_prints_all_also_after_a_command(capsys):
    with few_notes():
        silence()
        print_note("not this")
    for k in range(9):
        print_note(str(k))
    assert notes(capsys) == list("012345678")


def test_an_error_comes_after_the_count(typed, monkeypatch):
    def load(*_, **__):
        for k in range(7):
            print_note(str(k))
        raise OSError("no more")

    monkeypatch.setattr(cli_inputs, "load", load)
    code, _, errors = typed("render -o out.png")
    assert code == 2 and errors.splitlines()[5:] == [
        "note: 2 more notes: see all with pointshade info INPUT, none with --quiet",
        "pointshade: no more",
    ]
    assert typed("render -o out.png --quiet")[2] == "pointshade: no more\n"


@pytest.mark.usefixtures("renderer")
@pytest.mark.parametrize("line", ["render -o out.png", "normals -o out.png", "info"])
def test_quiet_leaves_the_result_alone(typed, line):
    code, output, errors = typed(f"{line} --quiet")
    assert (code, errors) == (0, "") and output


@pytest.fixture(params=["pointshade_gl", ""])
def application(request):
    """What a handler of an application gets, on the package's logger or on the root."""
    records, logger = [], logging.getLogger(request.param)
    handler = logging.Handler()
    handler.emit = records.append
    logger.addHandler(handler)
    yield records
    logger.removeHandler(handler)


def test_an_application_that_handles_logs_gets_notes_in_place_of_stderr(application, capsys):
    print_note("100 % is a guess")
    print_warning("skipped one")
    assert [(r.name, r.levelname, r.getMessage()) for r in application] == [
        ("pointshade_gl", "INFO", "100 % is a guess"),
        ("pointshade_gl", "WARNING", "skipped one"),
    ]
    assert capsys.readouterr().err == ""


def test_the_level_of_the_logger_silences_notes(capsys):
    LOGGER.setLevel(logging.WARNING)
    try:
        print_note("not this")
        print_warning("but this")
    finally:
        LOGGER.setLevel(logging.INFO)
    assert capsys.readouterr().err == "warning: but this\n"


def test_a_level_that_the_application_chose_before_stays():
    code = "import logging as l; l.getLogger('pointshade_gl').setLevel(30); import pointshade_gl.notes.notes as n"
    done = subprocess.run([sys.executable, "-c", f"{code}; n.print_note('no')"], capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, "")


def test_notes_go_to_the_stderr_of_the_moment(monkeypatch):
    stream = io.StringIO()
    monkeypatch.setattr(sys, "stderr", stream)
    print_note("here")
    stream.close()
    print_note("nowhere, and nothing fails")
    monkeypatch.setattr(sys, "stderr", other := io.StringIO())
    print_note("there")
    assert other.getvalue() == "note: there\n"


@pytest.mark.usefixtures("renderer")
def test_without_stderr_and_stdout_the_library_works(monkeypatch, tmp_path, unposed):
    monkeypatch.setattr(sys, "stderr", None)
    monkeypatch.setattr(sys, "stdout", None)
    image = ps.render(unposed)
    ps.save_page(tmp_path / "a.html", frames.sphere())
    ps.save_depth(tmp_path / "a.png", np.array([[1.0, 70.0]], np.float32))
    assert image.any() and (tmp_path / "a.html").exists()


@pytest.mark.usefixtures("renderer")
def test_without_stderr_a_command_says_nothing_elsewhere(monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("contextlib.redirect_stderr.__enter__", lambda _: setattr(sys, "stderr", None))
    monkeypatch.setattr("contextlib.redirect_stderr.__exit__", lambda *_: setattr(sys, "stderr", sys.__stderr__))
    code, output, _ = run("render", "nothing", "-o", "a.png")
    assert (code, output) == (2, "")
    code, output, _ = run("render", "vase", "-o", "a.png", "--samples", "1")
    assert code == 0 and output.startswith("a.png: ")
    assert run("render", "vase", "-o", "a.gif", "--turntable", "light", "--frames", "2", "--samples", "1")[0] == 0


@pytest.fixture
def unposed():
    """Two frames with the same pose, on which there is a note each time."""
    return [frames.sphere(), frames.sphere_before_wall()]


HOOKED = {  # calls that print a note unless they get `notes`: a renderer, unposed frames, a folder without units
    "render": lambda renderer, frames, _, **more: renderer.render(frames, **more),
    "draw": lambda renderer, frames, _, **more: renderer.draw(frames, **more),
    "render_depth": lambda renderer, frames, _, **more: renderer.render_depth(frames, **more),
    "render_normals": lambda renderer, frames, _, **more: renderer.render_normals(frames, **more),
    "render_passes": lambda renderer, frames, _, **more: renderer.render_passes(frames, **more),
    "render_points": lambda renderer, _, path, **more: renderer.render_points(path, **more),
    "estimate_normals": lambda renderer, _, path, **more: renderer.estimate_normals(path, **more),
    "render a path": lambda renderer, _, path, **more: renderer.render(path, **more),
    "save_page": lambda _, __, path, **more: ps.save_page(path / "a.html", path, **more),
    "show": lambda _, __, path, **more: ps.show(path, **more),
    "map": lambda _, __, path, **more: list(ps.batch.map([str(path)], workers=1, **more)),
}


@pytest.mark.usefixtures("renderer")
@pytest.mark.parametrize("name", HOOKED)
def test_what_may_print_a_note_takes_notes(tmp_path, unposed, monkeypatch, capsys, name):
    np.save(tmp_path / "depth.npy", 1000 * frames.sphere().depth)
    (tmp_path / "intrinsics.txt").write_text("131 131 79.5 59.5")

    def call(**more):
        with ps.Renderer() as renderer:
            HOOKED[name](renderer, unposed, tmp_path, **more)
        return notes(capsys)

    given = []
    assert call(notes=given.append) == [] and given
    assert call() == given
    with pytest.raises(TypeError, match="notes must be a function, got 3"):
        call(notes=3)


SPEAKS = {  # files of the library that say something otherwise, and why
    "notes/notes.py": "writes what is logged to stderr where no application listens",
    "notes/errors.py": "POINTSHADE_DEBUG=1 shows a traceback",
    "renderer/renderer.py": "a ResourceWarning, as Python has for files that nobody closed",
    "viewer/background.py": "the window prints the path of a picture that it saved",
}


def says(node):
    """Whether a call in the source prints, warns, or writes to a stream of the process."""
    called = ast.unparse(node.func) if isinstance(node, ast.Call) else ""
    return called in ("print", "warnings.warn") or called.startswith(("sys.std", "logging.", "traceback.print"))


def test_all_that_the_library_says_goes_through_its_logger():
    library = [path for path in PACKAGE.rglob("*.py") if path.relative_to(PACKAGE).parts[0] not in ("cli", "bench")]
    speaking = {path for path in library if any(map(says, ast.walk(ast.parse(path.read_text(encoding="utf-8")))))}
    assert {path.relative_to(PACKAGE).as_posix() for path in speaking} == {*SPEAKS}


@pytest.mark.system
@pytest.mark.usefixtures("renderer")
@pytest.mark.parametrize(
    ("line", "code", "written"),
    [
        ("render vase --samples 1 -o out.png", 0, "out.png"),
        ("render vase -o out.ply", 0, "out.ply"),
        ("render vase --samples 1 --turntable light --frames 2 -o out.mp4", 0, "out.mp4"),
        ("render nothing -o out.png", 2, ""),
        ("render vase --nothing", 2, ""),
        ("batch vase --workers 2 -o out", 0, "out/vase.png"),
        ("info vase --json", 0, ""),
    ],
)
@pytest.mark.parametrize("closed", ["2>&-", ">&- 2>&-"])
def test_a_process_without_stderr_does_its_work(tmp_path, line, code, written, closed):
    """As a service may start it. Nothing that belongs to stderr comes to stdout."""
    command = f"{sys.executable} -m pointshade_gl {line} {closed}"
    done = subprocess.run(command, shell=True, cwd=tmp_path, stdout=subprocess.PIPE, text=True, env=CHILD, timeout=120)
    assert done.returncode == code
    assert "note:" not in done.stdout and "pointshade:" not in done.stdout
    assert bool(done.stdout) == (code == 0 and closed == "2>&-")
    assert not written or (tmp_path / written).stat().st_size
