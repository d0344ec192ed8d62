"""Shader files: includes, and complaints that name file and line."""

import re
import signal
from types import SimpleNamespace

import moderngl
import pytest

import pointshade_gl as ps
from pointshade_gl.gpu.context.context import signals_later
from pointshade_gl.gpu.core.programs import (
    build_compute,
    build_program,
    set_uniforms,
    shader_folder,
    splice,
    translate_log,
)
from pointshade_gl.notes.errors import ShaderError


def test_includes_are_recursive_and_taken_once(tmp_path):
    (tmp_path / "a.glsl").write_text("float a;\n")
    (tmp_path / "b.glsl").write_text('#include "a.glsl"\nfloat b;\n')
    (tmp_path / "main.frag").write_text('#version 330 core\n#include "a.glsl"\n#include "b.glsl"\nfloat m;\n')
    text, origin = splice("main.frag", tmp_path)
    assert text == "#version 330 core\nfloat a;\nfloat b;\nfloat m;\n"
    lines = [(file, number) for file, numbers in origin for number in numbers]
    assert lines == [("main.frag", 1), ("a.glsl", 1), ("b.glsl", 2), ("main.frag", 4)]


def test_files_of_another_folder_are_read_again(tmp_path):
    for text in ("float a;\n", "float b;\n"):
        (tmp_path / "main.frag").write_text(text)
        assert splice("main.frag", tmp_path)[0] == text


def test_all_shaders_have_the_origin_of_each_line():
    folder = shader_folder()
    files = {path.relative_to(folder).as_posix(): path.read_text().splitlines() for path in folder.rglob("*.*")}
    for name in files:
        if name.endswith((".vert", ".frag", ".comp")):
            text, origin = splice(name)
            places = [(file, number) for file, numbers in origin for number in numbers]
            assert [files[file][number - 1] for file, number in places] == text.splitlines()
            assert not re.search(r"^\s*#include", text, re.MULTILINE)


def test_an_include_in_a_comment_is_a_comment(tmp_path):
    (tmp_path / "main.frag").write_text('// #include "nowhere.glsl"\n')
    assert "nowhere" in splice("main.frag", tmp_path)[0]


def test_a_missing_include_names_the_line_that_wants_it(tmp_path):
    (tmp_path / "main.frag").write_text('#version 330 core\n\n#include "phog.glsl"\n')
    with pytest.raises(ShaderError, match=r'main.frag:3: cannot include "phog.glsl": no such file'):
        splice("main.frag", tmp_path)


ORIGIN = [("x.frag", [1]), ("common/a.glsl", range(1, 3))]


@pytest.mark.parametrize(
    "log", ["0:3(5): error: no function 'f'", "0(3) : error C1008: no function 'f'", "ERROR: 0:3: no function 'f'"]
)
def test_complaints_of_three_drivers_name_the_file(log):
    assert translate_log(log, ORIGIN).startswith("common/a.glsl:2: error: ")
    assert translate_log(log, ORIGIN).endswith("no function 'f'")


def test_a_real_complaint_names_the_included_file(renderer, tmp_path):
    (tmp_path / "fullscreen.vert").write_text((shader_folder() / "fullscreen.vert").read_text())
    (tmp_path / "bad.glsl").write_text("float halve(float x) {\n    return x / two;\n}\n")
    (tmp_path / "main.frag").write_text(
        '#version 330 core\n#include "bad.glsl"\nout vec4 c;\nvoid main() { c = vec4(halve(1.0)); }\n'
    )
    with renderer.context.gl, pytest.raises(ShaderError, match=r"bad.glsl:2: error: .*two"):
        build_program(renderer.context.gl, "fullscreen.vert", "main.frag", tmp_path)


def test_a_misspelt_uniform_is_an_error(renderer):
    with renderer.context.gl:
        program = build_program(renderer.context.gl, "fullscreen.vert", "surface/normals_triangles.frag")
        with pytest.raises(KeyError):
            set_uniforms(program, intrinsic=(1, 1, 1, 1))
        program.release()


SIGNALS = [
    getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGUSR1", "SIGALRM", "SIGBREAK") if hasattr(signal, name)
]


class Stopped(Exception):
    """What a handler raises."""


@pytest.fixture(params=SIGNALS, ids=lambda number: number.name)
def stopping(request):
    """A signal whose handler raises Stopped."""

    def stop(*_):
        raise Stopped

    before = signal.signal(request.param, stop)
    yield request.param
    assert signal.getsignal(request.param) is stop
    signal.signal(request.param, before)


@pytest.mark.parametrize("kind", ["program", "compute_shader"])
def test_a_signal_waits_until_a_program_is_built(stopping, kind):
    """moderngl ends the process where it is interrupted."""
    built = []

    def build(*_, **shaders):
        signal.raise_signal(stopping)
        built.append(shaders)

    context = SimpleNamespace(**{kind: build}, info={"GL_RENDERER": ""}, version_code=450)
    with pytest.raises(Stopped):
        if kind == "program":
            build_program(context, "fullscreen.vert", "output/present.frag")
        build_compute(context, "meshes/grid.comp")
    assert len(built) == 1


def test_a_signal_waits_until_a_context_is_made_and_passes_as_itself(renderer, monkeypatch, stopping):
    made = []

    def create(**_):
        signal.raise_signal(stopping)
        made.append(1)

    monkeypatch.setattr(moderngl, "create_context", create)
    with pytest.raises(Stopped):
        ps.Renderer()
    assert made == [1]


@pytest.mark.parametrize("error", [Stopped(), TimeoutError("too late"), moderngl.Error("no driver")], ids=repr)
def test_what_another_thread_raises_here_is_not_taken_for_a_missing_driver(renderer, monkeypatch, error):
    def create(**_):
        raise error

    monkeypatch.setattr(moderngl, "create_context", create)
    is_drivers = isinstance(error, moderngl.Error)
    with pytest.raises(ps.ContextError if is_drivers else type(error), match="no driver" if is_drivers else None):
        ps.Renderer()


def test_of_two_signals_the_second_keeps_its_handler_if_the_first_raises():
    def stop(*_):
        raise Stopped

    first, second = SIGNALS[:2]
    seen, before = [], [signal.signal(first, stop), signal.signal(second, lambda *_: seen.append(1))]
    try:
        with pytest.raises(Stopped), signals_later():
            signal.raise_signal(first)
        signal.raise_signal(second)
        assert seen == [1]
    finally:
        signal.signal(first, before[0]), signal.signal(second, before[1])
