"""Shader files: includes, and complaints that name file and line."""

import signal
from types import SimpleNamespace

import pytest

from pointshade_gl.gpu.core.programs import (
    build_compute,
    build_program,
    set_uniforms,
    shader_folder,
    splice,
    translate_log,
)
from pointshade_gl.messages.errors import ShaderError


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
    for path in shader_folder().rglob("*.*"):
        if path.suffix in (".vert", ".frag", ".comp"):
            text, origin = splice(path.relative_to(shader_folder()).as_posix())
            places = [(file, number) for file, numbers in origin for number in numbers]
            files = {file: (shader_folder() / file).read_text().splitlines() for file, _ in places}
            assert [files[file][number - 1] for file, number in places] == text.splitlines()
            assert not any(line.lstrip().startswith("#include") for line in text.splitlines())


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


@pytest.mark.parametrize("kind", ["program", "compute_shader"])
def test_ctrl_c_waits_until_a_program_is_built(monkeypatch, kind):
    """moderngl ends the process where it is interrupted."""
    built = []

    def build(*_, **shaders):
        signal.raise_signal(signal.SIGINT)
        built.append(shaders)

    context = SimpleNamespace(**{kind: build}, info={"GL_RENDERER": ""}, version_code=450)
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        with pytest.raises(KeyboardInterrupt):
            if kind == "program":
                build_program(context, "fullscreen.vert", "output/present.frag")
            build_compute(context, "meshes/grid.comp")
        assert len(built) == 1 and signal.getsignal(signal.SIGINT) is signal.default_int_handler
    finally:
        signal.signal(signal.SIGINT, before)
