"""What a page is to whoever opens it: complete in itself, readable, reachable, and a picture where it cannot draw."""

import io

import numpy as np
import pytest
from PIL import Image

from pointshade_gl.page import draw_page

from ..support import frames

pytestmark = [pytest.mark.system, pytest.mark.browser, pytest.mark.gl]
TITLE = 'a <b>sphere</b> & "more"'
CONTRAST = """([front, back]) => {
  const canvas = new OffscreenCanvas(1, 1).getContext("2d", { willReadFrequently: true });
  const linear = (c) => (c <= 0.04045 ? c / 12.92 : ((c + 0.055) / 1.055) ** 2.4);
  const luminance = (name) => {
    canvas.fillStyle = getComputedStyle(document.documentElement).getPropertyValue(name);
    canvas.fillRect(0, 0, 1, 1);
    const [red, green, blue] = [...canvas.getImageData(0, 0, 1, 1).data].map((c) => linear(c / 255));
    return 0.2126 * red + 0.7152 * green + 0.0722 * blue;
  };
  const [low, high] = [luminance(front), luminance(back)].sort((a, b) => a - b);
  return (high + 0.05) / (low + 0.05);
}"""


@pytest.fixture(scope="module")
def html(renderer):
    return draw_page(renderer, frames.sphere(), title=TITLE)


@pytest.fixture(scope="module")
def opened(browser, html):
    with browser.opened(html) as page:
        page.wait_until_drawn()
        yield page
        assert page.complaints == []


def picture_of(page, part="main"):
    """What is seen, (h, w, 3) uint8."""
    with Image.open(io.BytesIO(page.locator(part).screenshot())) as image:
        return np.asarray(image.convert("RGB")).astype(int)


def shows_the_sphere(picture):
    """The middle differs from the corner, and has shades."""
    height, width, _ = picture.shape
    middle = picture[height // 3 : 2 * height // 3, 2 * width // 5 : 3 * width // 5]
    return np.abs(middle - picture[3, 3]).max() > 60 and middle.std() > 10


class TestOfItself:
    def test_it_asks_for_nothing_and_may_not(self, opened):
        assert opened.outside == []
        failed = "fetch('https://example.com/x.png').then(() => 'fetched', () => 'refused')"
        assert opened.page.evaluate(failed) == "refused"
        assert opened.outside == []
        opened.complaints.clear()  # of the refusal

    def test_it_draws_only_when_something_has_changed(self, opened):
        counted = """async () => {
          while (!pointshade.drawing.isFine) await new Promise(requestAnimationFrame);
          let count = 0, refined = 0;
          const drawing = pointshade.drawing, draw = drawing.draw.bind(drawing);
          drawing.draw = (...given) => { ++count; return draw(...given); };
          drawing.refine = () => ++refined;
          const frames = async (n) => { for (let k = 0; k < n; ++k) await new Promise(requestAnimationFrame); };
          await frames(5);
          const idle = count + refined;
          for (let k = 0; k < 10; ++k) pointshade.state = { ...pointshade.state, yaw: k };
          await frames(3);
          delete drawing.draw;
          delete drawing.refine;
          pointshade.state = { ...pointshade.state, yaw: 0 };
          return [idle, count];
        }"""
        assert opened.page.evaluate(counted) == [0, 1]

    def test_its_canvas_has_the_pixels_of_the_screen_also_after_a_change_of_size(self, browser, html):
        with browser.opened(html, viewport={"width": 320, "height": 240}, device_scale_factor=2) as page:
            page.wait_until_drawn()
            size = "[picture.width, picture.height, picture.clientWidth * 2, picture.clientHeight * 2]"
            for width, height in ((320, 240), (260, 320)):
                page.page.set_viewport_size({"width": width, "height": height})
                page.wait_for(f"picture.width === {2 * width}")
                found = page.page.evaluate(size)
                assert found[:2] == pytest.approx(found[2:], abs=1)
                assert shows_the_sphere(picture_of(page.page))

    def test_a_background_fills_the_window(self, browser, renderer):
        text = draw_page(renderer, frames.sphere(), title="", background="#336699")
        with browser.opened(text, viewport={"width": 320, "height": 240}) as page:
            page.wait_until_drawn()
            picture = picture_of(page.page)
            np.testing.assert_allclose(picture[[3, 3, -3], [3, -3, 3]], [[0x33, 0x66, 0x99]] * 3, atol=1)


class TestForEveryone:
    def test_it_says_what_it_is(self, opened):
        page = opened.page
        assert page.title() == TITLE == page.locator("h1").inner_text()
        assert page.locator("html").get_attribute("lang") == "en"
        assert TITLE in page.locator("#still").get_attribute("alt")
        canvas = page.get_by_role("application")
        assert TITLE in canvas.get_attribute("aria-label") and "Arrow keys" in canvas.get_attribute("aria-label")
        for name in ("Follow", "Unlit", "Reset view and light", "Help"):
            assert page.get_by_role("button", name=name, exact=True).is_visible(), name
        assert page.get_by_role("combobox", name="Shading").is_visible()

    def test_the_keyboard_reaches_everything_and_shows_where_it_is(self, opened):
        page, reached = opened.page, []
        page.evaluate("document.body.prepend(Object.assign(document.createElement('a'), {id: 'top', tabIndex: 0}))")
        page.evaluate("top => (top.focus(), top.remove())", page.query_selector("#top"))  # Tab goes on from there
        ring = "getComputedStyle(document.activeElement)"
        for _ in range(10):
            page.keyboard.press("Tab")
            reached.append(page.evaluate("document.activeElement.id"))
            is_seen = f"{ring}.outlineStyle !== 'none' || {ring}.boxShadow !== 'none'"
            assert page.evaluate(is_seen), reached
        assert reached == ["picture", "follow", "unlit", "shadows", "shading", "lamp", "reset", "save", "full", "ask"]

    def test_help_opens_and_closes_by_keys_and_gives_the_focus_back(self, opened):
        page = opened.page
        page.locator("#ask").focus()
        page.keyboard.press("Enter")
        assert page.get_by_role("dialog").is_visible()
        before = opened.state
        page.keyboard.press("ArrowLeft")
        assert opened.state == before  # nothing moves behind it
        page.keyboard.press("Escape")
        assert not page.get_by_role("dialog").is_visible()
        assert page.evaluate("document.activeElement.id") == "ask"
        for shown in (True, False):
            page.keyboard.press("h")
            assert page.locator("#help").is_visible() == shown

    @pytest.mark.parametrize("scheme", ["dark", "light"])
    def test_words_can_be_read_on_dark_and_light_pages(self, opened, scheme):
        opened.page.emulate_media(color_scheme=scheme)
        grounds = [opened.page.evaluate(CONTRAST, [front, "--paper"]) for front in ("--ink", "--quiet")]
        assert min(grounds) > 4.5 and opened.page.evaluate(CONTRAST, ["--ink", "--touch"]) > 4.5
        assert opened.page.evaluate(CONTRAST, ["--ring", "--paper"]) > 3
        is_dark = picture_of(opened.page)[3, 3].mean() < 128
        assert is_dark == (scheme == "dark")

    def test_nothing_moves_by_itself_where_people_ask_for_that(self, opened):
        for motion, seconds in (("no-preference", "0.4s"), ("reduce", "0s")):
            opened.page.emulate_media(reduced_motion=motion)
            found = opened.page.evaluate("getComputedStyle(document.querySelector('#message')).transitionDuration")
            assert found == seconds
        opened.wait_for("pointshade.drawing.isFine")
        before = picture_of(opened.page)
        opened.page.wait_for_timeout(200)
        np.testing.assert_array_equal(picture_of(opened.page), before)

    def test_the_bar_of_a_phone_is_one_row(self, browser, html):
        phone = {"viewport": {"width": 390, "height": 844}, "device_scale_factor": 2, "has_touch": True}
        with browser.opened(html, is_mobile=True, **phone) as page:
            buttons = page.page.locator("#tools > :visible")
            assert len({buttons.nth(k).bounding_box()["y"] for k in range(buttons.count())}) == 1 < buttons.count()

    def test_it_fits_a_phone_and_fingers_meet_its_buttons(self, browser, html):
        phone = {"viewport": {"width": 320, "height": 640}, "device_scale_factor": 2, "has_touch": True}
        with browser.opened(html, is_mobile=True, **phone) as page:
            page.wait_until_drawn()
            assert page.page.evaluate("document.documentElement.scrollWidth") == 320
            for control in page.page.locator("#tools > :visible").all():
                box = control.bounding_box()
                assert min(box["width"], box["height"]) >= 44
                assert box["x"] >= 0 and box["x"] + box["width"] <= 320 and box["y"] + box["height"] <= 640
            assert "finger" in page.page.locator("#message").inner_text()
            page.page.locator("#ask").tap()
            assert page.page.locator(".touch").is_visible() and not page.page.locator(".keys").is_visible()


class TestWhereItCannotDraw:
    def test_without_javascript_it_is_a_picture(self, browser, html):
        with browser.opened(html, java_script_enabled=False) as page:
            assert shows_the_sphere(picture_of(page.page))
            assert "JavaScript" in page.page.locator("footer").inner_text()
            assert not page.page.locator("#tools").is_visible()

    def test_without_webgl_it_is_a_picture_and_says_why(self, browser, html):
        blind = "HTMLCanvasElement.prototype.getContext = () => null"
        with browser.opened(html, before=blind) as page:
            page.page.wait_for_selector("#note:not([hidden])")
            assert "WebGL 2" in page.page.locator("#note").inner_text()
            assert shows_the_sphere(picture_of(page.page))
            assert not page.page.locator("#tools").is_visible()

    def test_a_lost_context_leaves_the_picture_and_comes_back(self, opened):
        page = opened.page
        page.mouse.move(300, 470)
        page.evaluate("pointshade.state = { ...pointshade.state, yaw: 20 }")
        page.wait_for_timeout(100)
        opened.wait_for("pointshade.drawing.isFine")
        before = picture_of(page)
        page.evaluate("window.loss = picture.getContext('webgl2').getExtension('WEBGL_lose_context')")
        page.evaluate("loss.loseContext()")
        page.wait_for_selector("body:not(.live)")
        assert shows_the_sphere(picture_of(page))
        page.keyboard.press("ArrowLeft")  # harmless
        page.keyboard.press("ArrowRight")
        page.evaluate("loss.restoreContext()")
        opened.wait_until_drawn()
        opened.wait_for("pointshade.drawing.isFine")
        np.testing.assert_array_equal(picture_of(page), before)
        opened.complaints[:] = [text for text in opened.complaints if "CONTEXT_LOST" not in text]
