"""Each option is spelt once: as a field with its documentation, its command-line option and its type."""

import ast
import inspect
import re
from dataclasses import fields
from pathlib import Path

import pytest

import pointshade_gl as ps
from pointshade_gl.cli.option_groups import AppearanceGroup as TypedLook
from pointshade_gl.cli.options import PictureOptions, ViewOptions
from pointshade_gl.files.frames.frame_parts import LoadOptions
from pointshade_gl.notes import notes
from pointshade_gl.renderer.requests import DepthOptions, PassOptions, PointsOptions, RenderOptions, RenderRequest
from pointshade_gl.scene.appearance import AppearanceOptions
from pointshade_gl.scene.option_fields import option_of
from pointshade_gl.scene.settings import OutputOptions
from pointshade_gl.scene.viewpoint import MoveOptions

from ..support import frames

PACKAGE = Path(ps.__file__).parent
MOST = 6  # files of the package in which an option may stand
FIELDS = {one.name: one for group in (ps.Appearance, ps.Material, ps.View, ps.OutputSettings) for one in fields(group)}
WORDS = {  # of the field: they also name arrays, steps, stages, files and fields of meshes and clouds, a command
    "material", "normals", "shading", "splat", "noise", "temporal", "ambient", "shininess", "lights", "pose", "yaw",
    "pitch", "look", "finish", "point_size", "samples", "background", "ground", "diffuse", "specular", "exposure",
    "missing", "environment", "align", "show", "fill",
}  # fmt: skip
PASSED_BY = {"opt", "option", "Appearance", "Material", "View", "OutputSettings", "RenderRequest"}
HELD_BY = {
    "Appearance",
    "Material",
    "View",
    "OutputSettings",
    "AppearanceOptions",
    "OutputOptions",
    "MoveOptions",
    "SurfaceOptions",
}
SOURCES = {
    path: path.read_text(encoding="utf-8") for path in PACKAGE.rglob("*.py") if "reference" not in path.parts
}  # fmt: skip


def spelt(tree):
    """The names that a file declares as options, passes by name to what holds them, or writes in a message."""
    for node in ast.walk(tree):
        if isinstance(node, ast.ClassDef) and node.name in HELD_BY:
            yield from (one.target.id for one in node.body if isinstance(one, ast.AnnAssign))
        elif isinstance(node, ast.Call) and getattr(node.func, "id", "") in PASSED_BY:
            yield from (one.arg for one in node.keywords)
            yield from (one.value for one in node.args if isinstance(one, ast.Constant))


SPELT = {path: set(spelt(ast.parse(text))) for path, text in SOURCES.items()}


@pytest.mark.parametrize("name", FIELDS)
def test_an_option_stands_in_few_files(name):
    found = [path for path, names in SPELT.items() if name in names]
    if name not in WORDS:
        found = [path for path, text in SOURCES.items() if re.search(rf"\b{name}\b(?!-)", text)]  # not --unlight-all
    assert 1 <= len(found) <= MOST, sorted(str(path.relative_to(PACKAGE)) for path in found)


@pytest.mark.parametrize(
    ("listed", "group", "besides"),
    [
        (AppearanceOptions, ps.Appearance, {"material"}),
        (OutputOptions, ps.OutputSettings, set()),
        (MoveOptions, ps.View, {"lights", "pose", "picture_size", "look", "finish"}),
    ],
)
def test_the_types_for_editors_are_those_of_the_fields(listed, group, besides):
    known = {one.name: one.type for one in fields(group) if one.name not in besides}
    assert known == {name: kind.__forward_arg__ for name, kind in listed.__annotations__.items()}


def test_the_types_of_what_is_read_are_those_of_load_frame():
    taken = inspect.signature(ps.load_frame).parameters
    known = {name: one.annotation for name, one in taken.items() if one.kind is one.KEYWORD_ONLY}
    listed = {name: kind.__forward_arg__.removesuffix(" | None") for name, kind in LoadOptions.__annotations__.items()}
    assert listed == {name: kind.removesuffix(" | None") for name, kind in known.items()}


@pytest.mark.parametrize(
    ("function", "options"),
    [
        (ps.render, RenderOptions), (ps.Renderer.draw, RenderOptions), (ps.render_depth, DepthOptions),
        (ps.render_normals, DepthOptions), (ps.render_passes, PassOptions), (ps.render_points, PointsOptions),
        (ps.render_mesh, PointsOptions),
        (ps.save_page, RenderOptions), (ps.show, RenderOptions),
    ],
)  # fmt: skip
def test_help_lists_every_option_with_its_default_and_its_documentation(function, options):
    parameters, doc = inspect.signature(function).parameters, " ".join(inspect.getdoc(function).split())
    assert set(options.__annotations__) <= set(parameters)
    for name in set(parameters) & set(FIELDS):
        assert parameters[name].default == FIELDS[name].default or name == "material"
        assert f"{name} : " in doc and (name in ("shading", "pose") or option_of(FIELDS[name]).doc[1:] in doc)
    assert not any(one.kind is one.VAR_KEYWORD for one in parameters.values())


@pytest.mark.parametrize(
    ("call", "says"),
    [
        (lambda: ps.render("vase", shadng="flat"), r"render\(\) got .* 'shadng' \(did you mean shading\?\)"),
        (lambda: ps.render_depth("vase", sample=2), r"render_depth\(\) got an unexpected keyword argument 'sample'"),
        (lambda: ps.save_page("a.html", "vase", fliyng="snap"), r"'fliyng' \(did you mean flying\?\)"),
        (lambda: RenderRequest.of("vase", unligt=True), r"of\(\) got .* 'unligt' \(did you mean unlight\?\)"),
        (lambda: ps.render(RenderRequest.of("vase"), yaw=3), "a request has all its options: leave out yaw"),
        (lambda: ps.Appearance(flyng="snap"), "flyng"),
        (lambda: ps.open_source("vase", depht_scale=3), r"open_source\(\) got .* \(did you mean depth_scale\?\)"),
    ],
)
def test_a_wrong_name_is_named(call, says):
    with pytest.raises(TypeError, match=says):
        call()


def test_a_request_keeps_what_was_passed():
    one, other = frames.sphere(), frames.sphere()
    lights = [ps.Light(position=(0, -1, 0))]
    request = RenderRequest.of([one, other], light=lights, flying="snap", yaw=5, samples=2)
    assert [frame is kept for frame, kept in zip((one, other), request.source, strict=True)] == [True, True]
    assert request.lights[0] is lights[0] and request.look == ps.Appearance(flying="snap")
    assert request.turns == (5, 0, 0) and request.finish == ps.OutputSettings(2)
    assert RenderRequest.of(request) is request and RenderRequest.of(one).source is one


def test_a_request_is_drawn_as_its_options_are(renderer):
    frame, options = frames.sphere(), {"shading": "flat", "yaw": 10, "background": "white", "point_size": 2}
    request = RenderRequest.of(frame, **options)
    assert (renderer.render(request) == renderer.render(frame, **options)).all()
    assert (renderer.render_depth(request) == renderer.render_depth(frame, point_size=2, yaw=10)).all()
    assert (
        renderer.render_points(request).colors == renderer.render_points(frame, shading="flat", yaw=10).colors
    ).all()
    view = ps.View(look=request.look, finish=request.finish, yaw=10)
    assert (renderer.render(RenderRequest.seen(frame, view)) == renderer.render(request)).all()


def test_older_names_work_with_one_note(monkeypatch):
    monkeypatch.setattr(notes, "_renamed", set())
    scene = ps.Scene((ps.Node(ps.PointObject(frames.sphere())),))
    with notes.taken() as found:
        for _ in range(2):
            assert ps.Look is ps.Appearance and ps.Finish is ps.OutputSettings and scene.things == scene.instances
    names = (("Look", "Appearance"), ("Finish", "OutputSettings"), ("Scene.things", "Scene.instances"))
    assert found == [f"{old} is called {new} now: the older name goes with the next version" for old, new in names]


def test_the_names_of_0_1_are_gone(renderer, typed):
    with pytest.raises(TypeError, match="argument 'size': a picture has the size of its camera"):
        renderer.render(frames.sphere(), size=3)
    code, _, errors = typed("render vase --size 40x30 -o a.png")
    assert code == 2 and "--size (did you mean --picture-size?)" in errors


def test_the_command_line_has_every_option():
    typed = {one.name for group in (TypedLook, ViewOptions, PictureOptions) for one in fields(group)}
    assert set(FIELDS) - {"material", "look", "finish", "lights"} | {"light", "zoom"} == typed
