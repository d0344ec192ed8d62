"""Groups of options: declared once, shown as single options, given to the command as one value."""

import inspect
from dataclasses import dataclass, fields
from typing import Annotated

import pytest
import typer
from typer.testing import CliRunner

import pointshade_gl as ps
from pointshade_gl.cli import main as cli
from pointshade_gl.cli.option_groups import AppearanceGroup
from pointshade_gl.cli.options import FrameOptions, ViewOptions, spread
from pointshade_gl.scene.option_fields import (
    CAMERA,
    CLOUD,
    FILM,
    LIGHT,
    NETWORK,
    PAGE,
    PICTURE,
    READING,
    SETS,
    SHADING,
    SURFACE,
    VIEW,
    WINDOW,
)
from pointshade_gl.scene.viewpoint import View

READ = {READING, CAMERA, NETWORK, CLOUD}


@dataclass(frozen=True)
class Place:
    where: Annotated[str, typer.Argument(help="Somewhere.")] = "here"
    far: Annotated[float, typer.Option("--far", "-f", help="How far.")] = 1.5


@dataclass(frozen=True)
class Colors:
    color: Annotated[list[str] | None, typer.Option(help="Repeatable.")] = None


def command(needed: Annotated[int, typer.Option(help="A number.")], place: Place, colors: Colors, loud: bool = False):
    print(needed, place, colors, loud)


def run(*arguments):
    app = typer.Typer()
    app.command()(spread(command))
    return CliRunner().invoke(app, list(arguments))


def test_fields_become_options_in_the_place_of_their_group():
    parameters = inspect.signature(spread(command)).parameters
    assert list(parameters) == ["needed", "where", "far", "color", "loud", "help_all"]
    assert [parameter.default for parameter in parameters.values()] == [
        inspect.Parameter.empty,
        "here",
        1.5,
        None,
        False,
        False,
    ]


def test_the_command_gets_its_groups_with_what_was_typed_and_the_defaults_of_the_rest():
    done = run("there", "--needed", "3", "--color", "red", "--color", "blue", "--loud")
    assert done.stdout == f"3 {Place('there', 1.5)} {Colors(['red', 'blue'])} True\n"
    assert run("--needed", "3", "-f", "2").stdout == f"3 {Place('here', 2.0)} {Colors()} False\n"


def test_an_option_that_is_needed_stays_so():
    assert run().exit_code == 2


def test_two_groups_cannot_declare_the_same_option():
    def twice(one: Place, other: Place):
        print(one, other)

    with pytest.raises(ValueError, match="duplicate parameter name"):
        spread(twice)


def test_the_defaults_of_the_command_line_are_those_of_the_library_except_that_pictures_are_completed():
    assert AppearanceGroup().look() == ps.Appearance(missing="complete")
    view = ViewOptions().view(ps.Appearance())
    assert [getattr(view, field.name) or None for field in fields(View)] == [
        getattr(View(), field.name) or None for field in fields(View)
    ]
    known = inspect.signature(ps.load_frame).parameters
    assert all(value is None or known[name].default == value for name, value in FrameOptions().load_options.items())


@pytest.mark.parametrize(
    ("name", "panels"),
    [
        ("render", {*READ, SURFACE, SETS, LIGHT, SHADING, VIEW, PICTURE, FILM, PAGE}),
        ("normals", {*READ, SURFACE, VIEW, PICTURE}),
        ("depth", {*READ, SURFACE, VIEW, PICTURE}),
        ("view", {*READ, SURFACE, SETS, LIGHT, SHADING, VIEW, PICTURE, WINDOW}),
        ("info", READ),
        ("bench", set()),
    ],
)
def test_every_option_has_a_help_and_its_panel(name, panels):
    options = typer.main.get_command(cli.command_line()).commands[name].params
    assert all(option.help for option in options)
    found = dict.fromkeys(getattr(option, "rich_help_panel", None) for option in options)
    assert {panel for panel in found if panel} == panels
