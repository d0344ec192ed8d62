"""`--light` and `--environment` on the command line: everything that they have in Python, in words."""

import inspect

import numpy as np
import pytest
from PIL import Image

import pointshade_gl as ps
from pointshade_gl.cli import option_groups as cli_light
from pointshade_gl.cli.command_lines import words_of
from pointshade_gl.cli.option_groups import light_from
from pointshade_gl.cli.options import EnvironmentOptions

from ..support.radiance_files import mantissas, radiance_file

AT = (-0.5, -0.7, 0.2)


@pytest.mark.parametrize(
    ("text", "light"),
    [
        ("-.5,-.7,.2", ps.Light(AT)),
        ("position=-.5,-.7,.2 intensity=2 shadow", ps.Light(AT, intensity=2, shadow=True)),
        ("-.5,-.7,.2 intensity=2 shadow", ps.Light(AT, intensity=2, shadow=True)),
        ("direction=0,1,1", ps.Light(direction=(0, 1, 1))),
        ("  direction = 0, 1, 1   shadow = no ", ps.Light(direction=(0, 1, 1))),
        (
            "position=-.5,-.7,.2 direction=.5,.7,1 cone=20,32 attenuation=1,0,1e1",
            ps.Light(AT, (0.5, 0.7, 1), cone=(20, 32), attenuation=(1, 0, 10)),
        ),
        ("watts=100 position=0,-1,1", ps.Light((0, -1, 1), watts=100)),
        ("0,-1,1 candela=20 falloff=none", ps.Light((0, -1, 1), candela=20, falloff="none")),
        ("position=0,-1,1 falloff=inverse-square", ps.Light((0, -1, 1), attenuation=(0, 0, 1))),
        ("direction=0,1,1 lux=3", ps.Light(direction=(0, 1, 1), lux=3)),
        (
            "0,-1,1 direction=0,1,0 size=.5,.25 watts=9",
            ps.Light((0, -1, 1), (0, 1, 0), size=(0.5, 0.25), watts=9),
        ),
        ("color=1,.8,.6", ps.Light(color=(1, 0.8, 0.6))),
        ("color=#fff", ps.Light()),
        ("color=Black shadow=YES", ps.Light(color=(0, 0, 0), shadow=True)),
    ],
)
def test_words_are_the_fields_of_a_light(text, light):
    assert light_from(text) == light


def test_a_named_colour_is_srgb_and_becomes_linear():
    """The values are those of IEC 61966-2-1 for 255, 128 and 10 of 255."""
    assert light_from("color=#ff800a").color == pytest.approx((1, 0.21586, 0.0030353), rel=1e-4)
    assert light_from("color=rgb(255,128,10)").color == light_from("color=#ff800a").color


def test_what_is_not_said_is_the_callers():
    assert light_from("0,0,0", shadow=True).shadow
    assert not light_from("0,0,0 shadow=off", shadow=True).shadow


def test_what_a_light_takes_becomes_a_word(monkeypatch):
    def tuned(position: "tuple", roundness: "float" = 0.0, glows: "bool" = False):
        return position, roundness, glows

    monkeypatch.setattr(cli_light, "Light", tuned)
    monkeypatch.setattr(cli_light, "FIELDS", inspect.signature(tuned).parameters)
    assert light_from("0,0,0 roundness=.3 glows") == ((0, 0, 0), 0.3, True)


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("0,0,0 colr=red", "'colr' is unknown (did you mean color?): it takes X,Y,Z in metres, or words"),
        ("red", "'red' is unknown"),
        ("0,0,0 1,1,1", "position is there twice, numbers need commas and no spaces between them"),
        ("0 0 0", "position is there twice, numbers need commas and no spaces between them"),
        ("intensity=2 intensity=3", "intensity is there twice"),
        ("", "it is empty"),
        ("0,0", "light position must be three finite numbers"),
        ("0,0,nan", "light position must be three finite numbers"),
        ("position=here", "position must be numbers with commas between them, got 'here'"),
        ("color", "color must be numbers with commas between them, got ''"),
        ("color=tomatoe", "color 'tomatoe' is unknown (did you mean tomato?): known are three numbers, #rrggbb and"),
        ("color=#ff000080", "color '#ff000080' is unknown: known are three numbers, #rrggbb and the names of CSS"),
        ("intensity=-1", "light intensity must be a number from 0"),
        ("intensity=1,2", "light intensity must be a number from 0"),
        ("cone=40,20", "light cone must be two half angles"),
        ("0,0,0 watts=much", "watts must be a number, got 'much'"),
        ("0,0,0 watts=2 intensity=2", "light takes one of intensity, watts, candela, lux, got intensity and watts"),
        ("lux=2 0,0,0", "light lux is of a directional light: a light with a position has watts or candela"),
        ("0,0,0 falloff=square", "unknown light falloff 'square': known are none, inverse-square"),
        ("0,0,0 size=1", "light size must be a width and a height above 0, got 1"),
        ("shadow=maybe", "shadow must be yes or no, got 'maybe'"),
    ],
)
def test_a_wrong_light_is_one_sentence_with_the_text_and_the_known_words(typed, text, sentence):
    code, _, errors = typed(f'render --light "{text}" -o out.png')
    (line,) = errors.splitlines()
    assert code == 2 and line.startswith(f"pointshade: --light {text!r}: {sentence}"), line
    assert any(words in line for words in ("known are", "must be", "there twice", "takes one of", "is of"))
    if "it takes" in line:
        assert line.endswith(
            "known are position, direction, color, intensity, attenuation, cone, shadow, radius, angle, size, "
            "watts, candela, lux, falloff"
        )


@pytest.mark.parametrize("line", ["--light position=0,0,0 shadow", "--light position=0,0,0 color=red vase"])
def test_words_without_quotes_are_told_to_need_them(typed, line):
    code, _, errors = typed(f"render {line} -o out.png")
    assert code == 2 and len(errors.splitlines()) == 1
    assert 'put the words of a light in quotes, as in --light "position=' in errors


def picture(name):
    with Image.open(name) as image:
        return np.asarray(image)


WORDS = "position=-.5,-.7,.2 color=#ffcc99 intensity=2 attenuation=1,.5,0"


@pytest.mark.parametrize("shadow", ["", " shadow"])
def test_the_picture_of_a_frame_is_that_of_the_same_light_in_python(renderer, typed, shadow):
    assert typed(f'render vase --light "{WORDS}{shadow}" --samples 1 -o out.png')[0] == 0
    color = light_from("color=#ffcc99").color
    light = ps.Light(AT, color=color, intensity=2, attenuation=(1, 0.5, 0), shadow=bool(shadow))
    np.testing.assert_array_equal(picture("out.png"), renderer.render(ps.load_frame("vase"), light))


@pytest.mark.parametrize(
    ("words", "tells"),
    [
        ("vase --light '0,-.5,0 shadow' -o out.png", True),
        ("vase -o out.glb", True),
        ("vase -o out.png", False),
        ("vase/front --light '0,-.5,0 shadow' -o out.png", False),
    ],
)
def test_where_the_front_of_the_vase_stands_for_all_of_it_a_note_says_so(typed, words, tells):
    code, _, errors = typed(f"render {words} --overwrite")
    assert code == 0 and ("note: this is the front of the vase alone: vase/whole has all sides" in errors) is tells


def test_a_shadow_on_a_single_frame_darkens_it(renderer, typed):
    for name, shadow in (("plain", "no"), ("dark", "yes")):
        assert typed(f'render vase --light "-.5,-.7,.2 shadow={shadow}" --samples 1 -o {name}.png')[0] == 0
    plain, dark = (picture(f"{name}.png")[..., :3].astype(int) for name in ("plain", "dark"))
    assert (dark <= plain + 1).all() and (dark < plain - 20).any(-1).mean() > 0.01


@pytest.mark.system
def test_in_a_scene_a_light_casts_shadows_unless_it_says_no(renderer, typed):
    scene = ps.load_scene("demo")
    for text, shadow in (("0,1,.5", True), ("0,1,.5 shadow=no", False)):
        assert typed(f'render demo --light "{text}" --samples 1 -o out.png')[0] == 0
        expected = renderer.render(scene, ps.Light((0, 1, 0.5), shadow=shadow))
        np.testing.assert_array_equal(picture("out.png"), expected)


@pytest.mark.parametrize(
    ("line", "shadows"),
    [("vase", False), ("vase --light 0,0,0", False), ("vase --light '0,0,0 shadow'", True), ("demo", True)],
)
def test_the_window_starts_with_the_shadows_that_were_asked_for(display, typed, monkeypatch, line, shadows):
    from pointshade_gl.viewer import Viewer

    seen = []

    def run(viewer):
        seen.append((viewer.state.shadows, viewer.held.shadow))
        viewer.release()

    monkeypatch.setattr(Viewer, "run", run)
    assert typed(f"view {line} --window-size 64x48")[0] == 0
    assert seen == [(shadows, True)]  # the key S has something to switch on


def finish_of(typed, monkeypatch, words):
    """The OutputSettings that a command line asks for, instead of a picture."""
    seen = []

    def draw(self, request, **options):
        seen.append(request)
        return np.zeros((2, 2, 4), np.uint8)

    monkeypatch.setattr(ps.Renderer, "render", draw)
    code, _, errors = typed(f"render vase {words} -o a.png")
    assert code == 0, errors
    return seen[0]


def test_light_from_all_around_is_typed(typed, monkeypatch, tmp_path):
    request = finish_of(typed, monkeypatch, "--environment sky --environment-rotation -30 --environment-intensity 2")
    assert request.finish.environment is ps.Environment.of("sky") and request.lights is None
    assert (request.finish.environment_rotation, request.finish.environment_intensity) == (-30, 2)
    (tmp_path / "a.hdr").write_bytes(radiance_file(mantissas(np.full((4, 8, 3), 0.5))))
    request = finish_of(typed, monkeypatch, "--environment a.hdr --light 0,-1,0 --ground")
    assert (request.finish.environment.picture == 0.5).all() and len(request.lights) == 1


@pytest.mark.parametrize(
    ("words", "value"),
    [("", None), ("--ao auto", None), ("--ao yes", True), ("--ambient-occlusion no", False), ("--ao .25", 0.25)],
)
def test_ambient_occlusion_has_a_short_name(typed, monkeypatch, words, value):
    found = finish_of(typed, monkeypatch, words).finish.ambient_occlusion
    assert found == value and type(found) is type(value)


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        ("--ao maybe", "--ambient-occlusion takes auto, yes, no or metres, got 'maybe'"),
        ("--ao -1", "--ambient-occlusion must be a number from 0 to 1e+18, got -1.0"),
        ("--environment skyy", "--environment must be sky or studio, or a file such as studio.hdr: 'skyy' does not "
         "exist (did you mean sky?)"),
        ("--environment a.hdr", "a.hdr is not a picture"),
        ("--environment sky --environment-intensity -1", "--environment-intensity must be a number from 0"),
        ("--environmen sky", "did you mean --environment"),
    ],
)  # fmt: skip
def test_what_is_no_light_from_all_around_is_told_in_one_line(typed, tmp_path, words, sentence):
    (tmp_path / "a.hdr").write_text("hello")
    code, _, errors = typed(f"render vase {words} -o a.png")
    assert code == 2 and sentence in errors and len(errors.splitlines()) == 1


def test_the_words_of_a_finish_make_it_again():
    for finish in (
        ps.OutputSettings(environment="sky", environment_rotation=30, ambient_occlusion=True),
        ps.OutputSettings(environment="studio", environment_intensity=0.5, ambient_occlusion=1.0),
        ps.OutputSettings(ambient_occlusion=False),
        ps.OutputSettings(),
    ):
        options = EnvironmentOptions.of(finish)
        assert ps.OutputSettings(**options.chosen()) == finish
        assert (finish == ps.OutputSettings()) == (words_of(options) == [])
    unsaid = ps.OutputSettings(environment=np.ones((2, 4, 3)), environment_rotation=np.eye(3))
    assert words_of(EnvironmentOptions.of(unsaid)) == []
