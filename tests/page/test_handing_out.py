"""What a page hands out: its picture as a file, the command that makes it; and the box for the light."""

import shlex

import numpy as np
import pytest
from PIL import Image

import pointshade_gl as ps
from pointshade_gl.page import draw_page

from ..support import frames, view_sets
from ..support.browser import altered
from ..support.page_functions import run_script
from .test_pictures import SHADOW_SIDE
from .test_pictures import small_shadows as small_shadows

LIGHT = "position=-.5,-.6,.3 color=1,.8,.6 shadow radius=.1"
COPIED = """async () => {
  let text = "";
  navigator.clipboard.writeText = async (given) => { text = given; };
  copy.click();
  await new Promise((resolve) => setTimeout(resolve));
  return text;
}"""
BALL = "--depth-scale 1000"  # of the folders that `written` makes: one frame, and three of a walk
LEAST = 38  # dB: the line draws by another rasteriser
TURNED = {"yaw": 20, "pitch": -10, "distance": 0.8, "lightAt": [0.4, 0.3]}
VIEWS = {
    "as at the start": {},
    "turned": TURNED,
    "moved": TURNED | {"pan": [0.05, 0.02]},
    "flat": {"shading": "flat", "lightIntensity": 0.5},
    "unlit": {"lit": False, "yaw": 5},
    "no shadows": {"shadows": False, "lightColor": [0.2, 0.5, 1]},
}


MOVED = "(yaw) => { pointshade.state = { ...pointshade.state, yaw }; }"


def saved(opened):
    """The picture that the page saves, its file's name."""
    with opened.page.expect_download() as found:
        opened.page.locator("#save").click()
    with Image.open(found.value.path()) as image:
        return np.asarray(image.convert("RGBA")), found.value.suggested_filename


def compare(page, still):
    """PSNR over black, everywhere."""
    one, other = (picture[..., :3] * (picture[..., 3:] / 255) for picture in (page.astype(float), still.astype(float)))
    return 10 * np.log10(255**2 / max(np.square(one - other).mean(), 1e-9))


@pytest.fixture
def written(typed, tmp_path):
    """Write a page with the command line, of what is built in or of small folders; returns its path."""
    walk = [view_sets.seen_from(view_sets.pose_at(yaw)) for yaw in view_sets.YAWS]
    view_sets.write_views(tmp_path / "walk", walk)
    view_sets.write_views(tmp_path / "ball", walk[1:2])

    def write(words):
        code, _, err = typed(f"render {words} -o page.html")
        assert code == 0, err
        return tmp_path / "page.html"

    return write


@pytest.mark.system
@pytest.mark.browser
@pytest.mark.gl
class TestCommand:
    @pytest.mark.parametrize(
        ("words", "views"),
        [
            (
                f"ball {BALL} --light '{LIGHT}' --shininess 60 --background #336699 --title 'My \"ball\"'",
                ["turned", "unlit"],
            ),
            (f"ball {BALL} --light 'position=-.5,-.6,.3 color=1,.8,.6 shadow' --shininess 60", VIEWS),
            (f"walk {BALL} --views all --light 'position=-.5,-.6,.3 shadow'", ["as at the start"]),
            ("vase", ["as at the start"]),
            ("demo", ["turned", "no shadows"]),
            (f"ball {BALL} --yaw 12 --environment sky", ["as at the start", "turned"]),
        ],
        ids=["soft light", "frame", "set", "built-in set", "scene", "environment"],
    )
    @pytest.mark.usefixtures("small_shadows")
    def test_it_makes_the_picture_that_is_shown(self, browser, written, typed, tmp_path, words, views):
        page = altered(written(words).read_text(encoding="utf-8"), SHADOW_SIDE=SHADOW_SIDE)
        with browser.opened(page, viewport={"width": 180, "height": 150}) as opened:
            opened.wait_until_drawn()
            for name in views:
                set_state = "(changes) => { pointshade.state = { ...START, ...pointshade.data.start, ...changes }; }"
                opened.page.evaluate(set_state, VIEWS[name])
                line = shlex.split(opened.page.evaluate(COPIED))
                picture, file = saved(opened)
                assert line[:2] == ["pointshade", "render"] and line[-2:] == ["-o", file]
                code, _, err = typed(shlex.join([*line[1:-1], "still.png"]))
                assert code == 0, err
                with Image.open(tmp_path / "still.png") as image:
                    still = np.asarray(image.convert("RGBA"))
                assert picture.shape == still.shape
                assert compare(picture, still) > LEAST, (name, line)

    def test_turns_are_said_as_turns(self, browser, written):
        with browser.opened(written(f"ball {BALL}")) as opened:
            opened.wait_until_drawn()
            assert "--pose" not in opened.page.evaluate(COPIED)
            opened.page.keyboard.press("ArrowLeft")
            assert "--yaw 5 --picture-size" in opened.page.evaluate(COPIED)
            opened.page.keyboard.press("Control+ArrowLeft")
            assert "--pose" in opened.page.evaluate(COPIED)

    def test_where_no_line_makes_the_picture_there_is_no_button(self, browser, renderer, written):
        with browser.opened(draw_page(renderer, frames.sphere())) as opened:
            opened.wait_until_drawn()
            assert not opened.page.locator("#copy").is_visible()
            opened.page.keyboard.press("c")
            opened.page.keyboard.press("h")
            assert not opened.page.locator("tr.copy").is_visible()
        with browser.opened(written(f"ball {BALL} --picture-size 100x300")) as opened:  # a camera of another shape
            opened.wait_until_drawn()
            assert not opened.page.locator("#copy").is_visible()

    def test_a_frame_of_another_page_that_may_not_write_to_the_clipboard_copies_the_old_way(self, browser, written):
        with browser.opened(written(f"ball {BALL}")) as opened:
            opened.wait_until_drawn()
            refused = "navigator.clipboard.writeText = async () => { throw new Error('no'); }"
            heard = "document.addEventListener('copy', () => (window.heard = getSelection().toString()))"
            opened.page.evaluate(f"() => {{ {refused}; {heard}; }}")
            opened.page.locator("#copy").click()
            opened.wait_for("window.heard?.startsWith('pointshade render ball ')")
            assert "copied" in opened.page.locator("#message").inner_text()
            assert opened.page.evaluate("document.activeElement.id") == "copy"


@pytest.fixture(scope="module")
def opened(browser, renderer):
    light = ps.Light((-0.5, -0.6, 0.3))
    with browser.opened(draw_page(renderer, frames.sphere_before_wall(), light=light, title="a/b: <ball>")) as page:
        page.wait_until_drawn()
        page.page.evaluate("window.first = pointshade.state")
        yield page


@pytest.mark.system
@pytest.mark.browser
@pytest.mark.gl
def test_a_slow_picture_is_saved_in_turns_that_answer_and_as_it_is_when_asked_again_or_left(browser, renderer):
    page = altered(draw_page(renderer, view_sets.three_views()), SLOW=0)
    with browser.shown(page) as opened:
        opened.page.evaluate("pointshade.data.samples = 1e6")  # so it does not end by itself
        message = opened.page.locator("#message")
        opened.page.evaluate("pointshade.drawing.took = 1")  # a first picture that is drawn twice is not measured
        assert opened.page.evaluate("pointshade.drawing.isSlow")
        for k, key in enumerate(("ArrowLeft", "p")):
            opened.page.evaluate(MOVED, 4 + k)
            opened.wait_for("pointshade.drawing.isCoarse")
            opened.page.keyboard.press("p")
            assert message.inner_text().startswith("saving: 0 % refined")
            opened.wait_for("pointshade.drawing.isShown")
            before = opened.state
            opened.page.mouse.move(60 + 9 * k, 70)
            assert opened.state == before
            with opened.page.expect_download() as found:
                opened.page.keyboard.press(key)
            assert found.value.suggested_filename.endswith(".png")
            assert (opened.state["yaw"] == before["yaw"]) == (key == "p")


@pytest.mark.system
@pytest.mark.browser
@pytest.mark.gl
class TestPicture:
    def test_it_is_what_rests_on_the_page_without_the_marker(self, opened):
        picture, name = saved(opened)
        assert name == "a-b- -ball-.png"
        assert opened.page.evaluate("pointshade.drawing.isFine")
        shown = opened.page.evaluate("[...pointshade.drawing.read()]")
        np.testing.assert_allclose(picture, np.reshape(shown, picture.shape), atol=1)


@pytest.mark.system
@pytest.mark.browser
@pytest.mark.gl
class TestLampBox:
    @pytest.fixture(autouse=True)
    def closed(self, opened):
        yield
        opened.page.evaluate("toggleLamp(false); pointshade.state = first")

    def test_color_and_strength_change_the_light(self, opened):
        opened.page.locator("#lamp").click()
        opened.page.locator("#color").fill("#ff8000")
        assert opened.state["lightColor"] == pytest.approx([1, 0.2158605, 0], abs=1e-6)
        opened.page.locator("#strength").fill("1")
        assert opened.state["lightIntensity"] == pytest.approx(10)
        assert opened.page.locator("#strong").inner_text() == "10"
        opened.page.keyboard.press("ArrowLeft")
        assert 9 < opened.state["lightIntensity"] < 10
        assert (opened.state["yaw"], opened.state["lit"]) == (0, True)  # the arrow was the slider's
        opened.page.locator("#reset").click()
        assert (opened.state["lightColor"], opened.state["lightIntensity"]) == ([1, 1, 1], 1)
        assert opened.page.locator("#color").input_value() == "#ffffff"

    def test_keys_open_and_close_it_and_give_the_focus_back(self, opened):
        page = opened.page
        page.locator("#lamp").focus()
        page.keyboard.press("i")
        assert page.locator("#lamp-box").is_visible()
        assert page.locator("#lamp").get_attribute("aria-expanded") == "true"
        assert page.evaluate("document.activeElement.id") == "strength"
        page.keyboard.press("Escape")
        assert not page.locator("#lamp-box").is_visible()
        assert page.evaluate("document.activeElement.id") == "lamp"

    def test_a_press_on_the_picture_closes_it_and_does_nothing_else(self, opened):
        opened.page.keyboard.press("i")
        opened.page.mouse.move(200, 200)
        before = opened.state
        opened.page.mouse.click(200, 200)
        assert not opened.page.locator("#lamp-box").is_visible()
        assert opened.state == before


def test_names_of_files_can_be_written_everywhere():
    script = "return value.map(fileName);"
    names = run_script(script, ["A vase", "../a/b", "con: <1>?", "...", "", "x" * 300, "Größe"], "command.js")
    assert names[:5] == ["A vase.png", "a-b.png", "con- -1-.png", "pointshade.png", "pointshade.png"]
    assert len(names[5]) == 104 and names[6] == "Größe.png"
