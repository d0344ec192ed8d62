"""The built-in vase on the command line: a picture that turns away from its front shows all of its sides."""

import numpy as np
import pytest
from PIL import Image

import pointshade_gl as ps
from pointshade_gl.cli.inputs import is_front, is_turned, with_all_sides
from pointshade_gl.cli.options import FrameOptions, MoreOptions, PlaceOptions
from pointshade_gl.renderer.requests import RenderRequest, turnable

SMALL = "--samples 1 --picture-size 160x120"


@pytest.fixture
def drawn(typed, tmp_path):
    """drawn(words): the picture that `pointshade render` makes, and how many points it is drawn from."""

    def run(words):
        code, output, errors = typed(f"render {words} {SMALL} -o a.png")
        assert code == 0, errors
        with Image.open(tmp_path / "a.png") as image:
            return np.asarray(image), int(output.split(" from ")[1].split()[0])

    return run


@pytest.mark.system
def test_its_back_is_drawn_once_it_turns(drawn):
    turned, count = drawn("--yaw 120")
    whole, same = drawn("vase/whole --yaw 120")
    front, fewer = drawn("vase/front --yaw 120")
    np.testing.assert_array_equal(turned, whole)
    assert count == same > 5 * fewer
    assert (whole[..., 3] > 0).sum() > 1.2 * (front[..., 3] > 0).sum()


@pytest.mark.system
def test_its_depth_is_that_of_its_picture(drawn, typed, tmp_path):
    image, _ = drawn("--yaw 120")
    assert typed("depth vase --yaw 120 --picture-size 160x120 -o z.npy")[0] == 0
    np.testing.assert_array_equal(np.load(tmp_path / "z.npy") > 0, image[..., 3] > 0)


def test_a_small_turn_shows_the_front_alone(drawn):
    np.testing.assert_array_equal(drawn("--yaw 4")[0], drawn("vase/front --yaw 4")[0])


@pytest.mark.system
def test_by_its_name_all_of_it_is_drawn_in_python():
    frames = list(ps.open_source("vase/whole"))
    look = {"camera": frames[0].camera.fitted(160, 120), "yaw": 180, "shading": "none"}
    np.testing.assert_array_equal(ps.render("vase/whole", **look), ps.render(frames, **look))


def test_in_python_its_name_is_its_front_until_the_view_turns():
    front = RenderRequest.of("vase", yaw=4.9)
    assert isinstance(front.source, ps.Frame) and isinstance(RenderRequest.of("vase/front", yaw=90).source, ps.Frame)
    turned = ps.orbit_pose(None, (0, 0, 1), 30)
    for options in ({"yaw": 20}, {"pitch": -20}, {"pose": turned}):
        assert len(RenderRequest.of("vase", **options).frames) == 11
    assert [turnable(one, {}) for one in ("vase", "vase/front", "demo")] == ["vase/whole", "vase/front", "demo"]
    for look in ({"splat": "mesh"}, {"normals": np.zeros((480, 640, 3), np.float32) - (0, 0, 1)}):  # of one frame alone
        assert isinstance(RenderRequest.of("vase", yaw=20, **look).source, ps.Frame)


def test_pages_have_all_of_it_as_they_are_turned(typed, monkeypatch):
    written = []
    for name in ("page", "picture"):
        at = f"pointshade_gl.cli.commands.render_command._write_{name}"
        monkeypatch.setattr(at, lambda asked, _: written.append(asked.others.views))
    for words in ("-o a.html", "vase -o a.html", "vase/front -o a.html", "vase -o a.png", "-o a.html --splat mesh"):
        assert typed(f"render {words}")[0] == 0
    assert written == ["all", "all", None, None, None]


@pytest.mark.parametrize(
    ("place", "turns"),
    [
        ({}, False), ({"yaw": 4.9}, False), ({"yaw": -5.1}, True), ({"pitch": 6.0}, True), ({"dolly": 0.5}, False),
        ({"pose": "0,0,-1,0,0,0,1"}, False), ({"pose": "0,0,0,0,0.1,0,0.995"}, True),
    ],
)  # fmt: skip
def test_how_far_it_must_turn(place, turns):
    assert is_turned(PlaceOptions(**place)) is turns


@pytest.mark.parametrize(
    ("frame", "others"),
    [
        ({"input": "vase/front"}, {}), ({"input": "demo"}, {}), ({"input": "vase", "frame": "0"}, {}),
        ({"depth": "a.png"}, {}), ({"input": "vase"}, {"more": ["b"]}), ({"depth_scale": 2.0}, {}),
    ],
)  # fmt: skip
def test_what_else_is_named_stays_as_it_is(frame, others):
    given = FrameOptions(**frame), MoreOptions(**others)
    assert not is_front(*given) and with_all_sides(*given, turns=True) == given
