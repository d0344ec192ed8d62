"""A page in a notebook's cell: complete, cut off from the notebook, and it leaves the notebook's wheel alone."""

import pytest

import pointshade_gl as ps
from pointshade_gl.page import page_file as cell

from ..support import frames

FRAME = frames.sphere()


@pytest.fixture(scope="module")
def made(renderer):
    return cell.draw_cell(renderer, FRAME, height=300, title='a "sphere" & more')


@pytest.fixture
def notebook(browser, made):
    """The cell between others, so high that the notebook scrolls; and the page in it. A click there is kept."""
    other = '<p style="height: 100px; margin: 0">In [1]</p>'
    with browser.opened(f"<!doctype html><title>notebook</title>{other}{made._repr_html_()}{6 * other}") as opened:
        inside = opened.page.frame_locator("iframe")
        inside.locator("body.live").wait_for(timeout=60_000)
        yield opened, inside
        assert opened.complaints == []


@pytest.mark.gl
def test_it_is_the_page_in_a_frame_that_can_reach_nothing(made):
    text = made._repr_html_()
    assert text.count("<") == 2 and 'sandbox="allow-scripts allow-downloads"' in text and "height: 300px" in text
    assert 'title="a &quot;sphere&quot; &amp; more"' in text
    assert repr(made) == f"Cell({len(made.html) / 1e6:.1f} MB, 300 pixels high)"


@pytest.mark.gl
def test_what_a_notebook_would_drop_is_made_smaller(renderer, made, monkeypatch):
    assert cell.draw_cell(renderer, FRAME, quality="exact", height=300, title='a "sphere" & more').html == made.html
    monkeypatch.setattr(cell, "MAX_CELL_BYTES", 10_000)
    small = cell.draw_cell(renderer, FRAME)
    assert small.html == cell.draw_cell(renderer, FRAME, quality="small").html
    assert len(cell.draw_cell(renderer, FRAME, quality="exact").html) > len(small.html)


@pytest.mark.gl
@pytest.mark.parametrize(
    ("options", "error", "words"),
    [
        ({"height": 50}, ValueError, "height must be a whole number of pixels from 120"),
        ({"quality": "huge"}, ValueError, "quality"),
        ({"title": 3}, TypeError, "title must be a text"),
        ({"light": "red"}, TypeError, "light must be a Light"),
    ],
)
def test_bad_options_are_named(options, error, words):
    with pytest.raises(error, match=words):
        ps.show(FRAME, **options)


@pytest.mark.gl
def test_frames_still_show_themselves_as_pictures():
    assert not hasattr(FRAME, "_repr_html_") and FRAME._repr_png_().startswith(b"\x89PNG")


@pytest.mark.system
@pytest.mark.gl
@pytest.mark.browser
class TestInANotebook:
    def test_the_light_follows_the_mouse(self, notebook):
        opened, inside = notebook
        box = opened.page.locator("iframe").bounding_box()
        marker = inside.locator("#marker")
        before = marker.bounding_box()
        opened.page.mouse.move(box["x"] + 100, box["y"] + 50)
        opened.page.mouse.move(box["x"] + 400, box["y"] + 200, steps=8)
        assert marker.bounding_box()["x"] > before["x"] + 50
        assert opened.outside == []

    def test_it_cannot_reach_the_notebook(self, notebook):
        opened, _ = notebook
        reach = "(() => { try { return parent.document.title; } catch (error) { return error.name; } })()"
        assert opened.page.frames[1].evaluate(reach) == "SecurityError"

    def test_the_wheel_scrolls_the_notebook_until_the_page_is_clicked(self, notebook):
        opened, inside = notebook
        frame = opened.page.frames[1]
        box = opened.page.locator("iframe").bounding_box()
        opened.page.mouse.move(box["x"] + 200, box["y"] + 100)
        opened.page.mouse.wheel(0, 20)
        opened.wait_for("scrollY > 0")
        assert frame.evaluate("pointshade.state.distance") == 1
        opened.page.mouse.down()
        opened.page.mouse.up()
        opened.page.mouse.move(box["x"] + 210, box["y"] + 100)
        scrolled = opened.page.evaluate("scrollY")
        opened.page.mouse.wheel(0, 100)
        inside.locator("body.live").evaluate("() => new Promise((done) => setTimeout(done, 300))")
        assert frame.evaluate("pointshade.state.distance") > 1
        assert opened.page.evaluate("scrollY") == scrolled

    def test_it_saves_pictures(self, notebook):
        opened, inside = notebook
        with opened.page.expect_download() as found:
            inside.locator("#save").click()
        assert found.value.suggested_filename == "a -sphere- & more.png"

    def test_the_first_click_only_takes_the_focus(self, notebook):
        opened, _ = notebook
        frame, mouse = opened.page.frames[1], opened.page.mouse
        box = opened.page.locator("iframe").bounding_box()
        x, y = box["x"] + 200, box["y"] + 100
        mouse.move(x, y)
        before = frame.evaluate("pointshade.state")
        mouse.down()
        mouse.move(x + 90, y + 30, steps=4)
        mouse.up()
        frame.wait_for_function("document.hasFocus()")  # the browser hands the focus over by a message
        assert frame.evaluate("pointshade.state") == before
        mouse.click(x, y)
        assert not frame.evaluate("pointshade.state.lightMode")
