"""What docs/stability.md and docs/gpu-tensors.md say is so, as far as it can be tried without a GPU."""

import ast
import inspect
import multiprocessing
import pickle
import re
import subprocess
import sys
from concurrent.futures import ProcessPoolExecutor

import moderngl
import numpy as np
import pytest

import pointshade_gl as ps
from pointshade_gl.cli import main
from pointshade_gl.cli.commands import batch_command as batch
from pointshade_gl.cli.commands import batch_command as batch_run

from .support import frames
from .support.places import ROOT
from .test_user_types import members

STABILITY, TENSORS = ((ROOT / f"docs/{name}.md").read_text(encoding="utf-8") for name in ("stability", "gpu-tensors"))
LOGGING, ENDING = re.findall(r"```python\n(.*?)```", STABILITY, re.DOTALL)
(INTEROP,) = re.findall(r"```python\n(.*?)```", TENSORS, re.DOTALL)
CLASSES = [getattr(ps, name) for name in ps.__all__ if inspect.isclass(getattr(ps, name))]


@pytest.mark.parametrize("name", ps.__all__)
def test_each_public_name_says_what_it_is(name):
    public = getattr(ps, name)
    assert inspect.getdoc(public) and public.__module__.startswith("pointshade_gl")


def test_each_public_name_is_pickled_by_its_name():
    for name in ps.__all__:
        value = getattr(ps, name)
        assert pickle.loads(pickle.dumps(value)) is value, name


@pytest.mark.usefixtures("renderer")
def test_processes_are_given_public_functions():
    with ProcessPoolExecutor(1, multiprocessing.get_context("spawn")) as pool:
        picture = pool.submit(ps.render, frames.sphere()).result(timeout=60)
    assert np.array_equal(picture, ps.render(frames.sphere()))


def test_the_modules_that_are_public_are_those_of_the_page():
    listed = re.search(r"the modules (.*?):", STABILITY, re.DOTALL)[1]
    assert {f"ps.{name}" for name in ps._MODULES} - {"ps.files"} == set(re.findall(r"ps\.\w+", listed))


def test_the_exit_codes_are_those_of_the_page():
    codes = [int(code) for code in re.findall(r"^\| (\d+) \|", STABILITY, re.MULTILINE)]
    assert codes == [0, 1, 2, batch_run.FAILED, main.SOFTWARE, batch.INTERRUPTED, main.CLOSED]


def test_the_oldest_versions_are_those_that_are_installed():
    project = (ROOT / "pyproject.toml").read_text(encoding="utf-8")
    python, numpy = re.search(r"Python ([\d.]+) and NumPy ([\d.]+) or newer", STABILITY).groups()
    assert f'requires-python = ">={python}"' in project and f'"numpy>={numpy}"' in project


def test_types_and_the_change_log_are_there():
    assert (ROOT / "pointshade_gl/py.typed").is_file() and (ROOT / "CHANGELOG.md").is_file()


def test_what_takes_progress_is_on_the_page():
    functions = {name: getattr(ps, name) for name in ps.__all__ if inspect.isfunction(getattr(ps, name))}
    for kind in CLASSES:
        functions |= {
            name: getattr(kind, name) for name, _ in members(kind) if inspect.isfunction(getattr(kind, name, 0))
        }
    taking = {name for name, one in functions.items() if "progress" in inspect.signature(one).parameters}
    listed = re.search(r"## Progress.*?take\n", STABILITY, re.DOTALL)[0]
    assert taking - {"submit", "render_async"} | {"batch.map"} == set(re.findall(r"`(\w+(?:\.\w+)?)`", listed))


@pytest.mark.usefixtures("renderer")
def test_the_example_of_ending_work_draws():
    given = {}
    exec(ENDING.replace("samples=64", "samples=2"), given)
    assert given["picture"].any()
    exec(ENDING.replace("threading.Event()", "threading.Event(); stop.set()"), given)
    assert given["picture"] is None


def heard(lines, tmp_path):
    """What a process says on stderr that runs these lines and then has a note and a warning."""
    code = "\n".join(["import pointshade_gl.notes.notes as n", *lines, "n.print_note('a')", "n.print_warning('b')"])
    done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=True)
    return done.stderr


def test_the_lines_about_the_logger_do_what_they_say(tmp_path):
    begin, _, no_notes, nothing, file = LOGGING.strip().splitlines()
    assert heard([], tmp_path) == "note: a\nwarning: b\n"
    assert heard([begin, no_notes], tmp_path) == "warning: b\n"
    assert heard([begin, nothing], tmp_path) == ""
    assert heard([begin, file], tmp_path) == ""
    assert (tmp_path / "my.log").read_text() == "INFO:pointshade_gl:a\nWARNING:pointshade_gl:b\n"


@pytest.mark.usefixtures("renderer")
def test_the_texture_of_draw_is_what_the_page_says_and_is_copied_to_a_buffer_on_the_gpu():
    frame = frames.sphere()
    context = moderngl.create_context(standalone=True, require=330, backend="egl", device_index=0)
    with context, ps.Renderer(context) as renderer:
        expected = renderer.render(frame)
        texture = renderer.draw(frame)
        assert isinstance(texture.glo, int) and texture.glo > 0
        assert (texture.components, texture.dtype, texture.samples) == (4, "f1", 0)
        assert (texture.width, texture.height) == (frame.camera.width, frame.camera.height)
        buffer = context.buffer(reserve=4 * texture.width * texture.height)
        texture.read_into(buffer)
        copied = np.frombuffer(buffer.read(), np.uint8).reshape(expected.shape)
        assert np.array_equal(copied, expected)  # top row first
        assert renderer.draw(frame, yaw=5) is texture  # until a picture of another size
    context.release()


def test_the_code_for_tensors_calls_what_is_there():
    """As far as can be told without a GPU: see tests/clients/test_torch.py for the run of it."""
    calls = {ast.unparse(node.func) for node in ast.walk(ast.parse(INTEROP)) if isinstance(node, ast.Call)}
    assert {"renderer.draw", "texture.read_into", "context.buffer", "ps.Renderer"} <= calls
    assert "egl_device" in (ROOT / "pointshade_gl/gpu/context/context.py").read_text(encoding="utf-8")
