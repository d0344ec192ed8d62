"""A sequence as a page: what is kept of its frames, how many bytes they take, and how they play."""

import base64
import json
import re
import zlib

import numpy as np
import pytest

import pointshade_gl as ps
from pointshade_gl.page import draw_page, write_page
from pointshade_gl.page.films import FILM_QUALITIES, KEY_EVERY, STAYING_COLOR, FilmCoder, frames_of
from pointshade_gl.page.page_surfaces import PageSurface

from ..support import frames
from ..support.page_functions import run_script
from .test_pictures import as_given, likeness
from .test_pictures import test_a_browser_starts as test_a_browser_starts  # first: no page costs more than others
from .test_pictures import test_it_can_draw_what_pages_need as test_it_can_draw_what_pages_need

browser_test = pytest.mark.browser
pytestmark = pytest.mark.gl


def shaken(count=4, size=1.0):
    """Frames of one ball, each from a little further to the left, with poses."""
    ball, made = frames.sphere_before_wall(), []
    with ps.Renderer() as renderer:
        for k in range(count):
            pose = np.eye(4)
            pose[0, 3] = -0.02 * k * size
            color = renderer.render(ball, pose=pose, shading="none")[..., :3]
            depth = np.nan_to_num(renderer.render_depth(ball, pose=pose))
            made.append(ps.Frame(color, depth, ball.camera, pose))
    return made


NOTE_NUMBERS = """() => {
  const show = pointshade.player.show.bind(pointshade.player);
  pointshade.player.show = (frame) => { seen.add(frame.number); show(frame); };
}"""
AS_SHOWN = """async (changes) => {
  pointshade.state = { ...START, ...pointshade.data.start, ...changes };
  await new Promise(requestAnimationFrame);
  const { data, drawing, player, state } = pointshade, pixels = drawing.read();
  let text = "";
  for (let k = 0; k < pixels.length; k += 8192) text += String.fromCharCode(...pixels.subarray(k, k + 8192));
  const own = light(state, data.stage, player.way, data.held), [width, height] = drawing.size;
  const cast = { ...own, shadow: own.shadow && state.shadows };
  return { width, height, pixels: btoa(text), place: pose(state, data.stage), light: cast };
}"""


@pytest.fixture(scope="module")
def points():
    with ps.Renderer(rasterizer="points") as made:
        yield made


def surface(rng, noise=0.003, height=48, width=64, wave=0.0):
    """A noisy slope with waves in noisy colours, with holes and rims."""
    y, x = np.mgrid[:height, :width]
    depth = (2 + 0.01 * x + 0.2 * np.sin(0.2 * x + wave)) * (1 + noise * rng.normal(size=x.shape))
    depth[rng.random(x.shape) < 0.02] *= -1
    depth[10:20, 10:30] = 0
    normals = np.stack([0.03 * rng.normal(size=x.shape), 0.03 * rng.normal(size=x.shape), -np.ones(x.shape)], -1)
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    colors = (np.stack([x, y, x + y], -1) % 200 + rng.integers(0, 5, (height, width, 3))).astype(np.uint8)
    fixed = np.ones(1, np.float32), (60.0, 60.0, 32.0, 24.0), np.eye(4), 1.0, False, 0
    return PageSurface(normals.astype(np.float32), depth.astype(np.float32), colors, None, *fixed)


DECODE = """
const take = (k) => value.bodies[k], size = value.width * value.height;
let kinds = null, codes = null;
return value.heads.map((head, k) => {
  const bytes = new Uint8Array(take(k)), now = bytes.slice(0, size);
  if (head.changes[0]) for (let n = 0; n < size; ++n) now[n] ^= kinds[n];
  const numbers = wholeNumbers(bytes.slice(size, size + head.count * head.depthBytes), head.count, head.depthBytes);
  codes = head.changes[1] ? changedCodes(codes, now, numbers) : predictedCodes(value.width, value.height, now, numbers);
  kinds = now;
  return [[...kinds], [...codes]];
});"""


@pytest.mark.parametrize("is_still", [True, False])
def test_the_page_reads_depths_as_they_were_kept_as_keys_and_as_differences(is_still):
    rng = np.random.default_rng(1)
    coder, heads, bodies, kept, depths = FilmCoder(FILM_QUALITIES["exact"], 0.003, 2.0), [], [], [], []
    for k in range(KEY_EVERY + 1):
        one = surface(rng, noise=0.0005, wave=0 if is_still else 2 * k)
        head, packed = coder.code(one)
        heads.append(head)
        bodies.append(list(zlib.decompress(packed)))
        kept.append(coder._kept)
        depths.append(one.depth)
    assert [head["changes"][1] for head in heads[:-1]] == [False] + [is_still] * (KEY_EVERY - 1)
    assert not any(heads[-1]["changes"])  # a key at last, for the slider
    value = {"heads": heads, "bodies": bodies, "width": 64, "height": 48}
    for (kinds, codes), one, depth in zip(run_script(DECODE, value, "film.js"), kept, depths, strict=True):
        assert np.array_equal(np.reshape(kinds, depth.shape), one.kinds)
        assert np.array_equal(np.reshape(codes, depth.shape), one.codes)
        known = depth != 0
        error = np.abs(2.0 * np.exp(one.codes[known] * coder.step) / np.abs(depth[known]) - 1)
        assert error.max() < 1.51 * coder.step * 1.01  # half a step, and one that stays


def test_errors_of_colors_do_not_add_up():
    rng = np.random.default_rng(2)
    coder = FilmCoder(FILM_QUALITIES["exact"], 0.003, 2.0)
    found = []
    for _ in range(KEY_EVERY):
        one = surface(rng)
        head, _ = coder.code(one)
        planes = coder._kept.colors[:48].astype(float)
        luma = one.colors @ [0.299, 0.587, 0.114]
        found.append(np.sqrt(np.square(planes - luma)[one.depth != 0].mean()))
    assert head["changes"][3]
    assert max(found) < max(2 * found[0], STAYING_COLOR)


@pytest.mark.system
def test_no_frame_takes_more_than_300_kb_at_640x480():
    rng = np.random.default_rng(3)
    one = surface(rng, noise=0.001, height=480, width=640)
    one = one._replace(colors=rng.integers(80, 130, (480, 640, 3), np.uint8))  # nothing that could be predicted
    coder = FilmCoder(FILM_QUALITIES["exact"], 0.006, 2.0)
    assert all(len(coder.code(one)[1]) * 4 / 3 <= 300_000 for _ in range(2))


def test_a_page_of_a_sequence_says_what_it_needs(renderer, tmp_path):
    with pytest.raises(ValueError, match="a single frame does not play"):
        write_page(renderer, tmp_path / "a.html", frames.sphere(), fps=10)
    with pytest.raises(ValueError, match="fps"):
        write_page(renderer, tmp_path / "a.html", [frames.sphere()] * 2, fps=0)
    small = ps.Frame(None, np.ones((4, 4), np.float32), ps.Camera(4, 4, 2, 2, 4, 4))
    with pytest.raises(ValueError, match="have one size: frame 1 has 4x4"):
        write_page(renderer, tmp_path / "a.html", [frames.sphere(), small], fps=10)
    assert list(tmp_path.iterdir()) == []


def test_of_long_sequences_a_page_has_the_first_frames_and_says_so(capsys):
    ball = frames.sphere()
    assert len(frames_of([ball] * 301)) == 300 and "first 300 of 301" in capsys.readouterr().err
    assert len(frames_of([ball] * 301, 301)) == 301


def save(folder, sequence):
    for k, frame in enumerate(sequence):
        for name, one, write in (("color", frame.color, ps.save_image), ("depth", frame.depth, ps.save_depth)):
            (folder / name).mkdir(parents=True, exist_ok=True)
            write(folder / name / f"{k:04d}.png", one)
    camera = sequence[0].camera
    values = {name: getattr(camera, name) for name in ("fx", "fy", "cx", "cy", "width", "height")}
    (folder / "intrinsics.json").write_text(json.dumps(values))


def test_the_command_line_plays_a_sequence_unless_one_frame_is_asked_for(typed, tmp_path):
    save(tmp_path / "many", shaken(3))
    code, out, _ = typed("render many -o a.html --fps 5")
    text = (tmp_path / "a.html").read_text(encoding="utf-8")
    assert code == 0 and "in which 3 frames play" in out
    assert text.count('class="frame"') == 3 and '"fps":5' in text
    assert typed("render many -o b.html --frames 2")[0] == 0
    assert (tmp_path / "b.html").read_text(encoding="utf-8").count('class="frame"') == 2
    assert typed("render many -o c.html --frame 1")[0] == 0
    assert 'class="frame"' not in (tmp_path / "c.html").read_text(encoding="utf-8")
    code, _, err = typed("render vase -o d.html --frames 2")
    assert code == 2 and "leave out --frames" in err


@browser_test
def test_each_frame_looks_as_its_still(browser, points):
    """Also after a jump, and from elsewhere: each is seen by its own camera."""
    sequence = shaken(4)
    with browser.shown(draw_page(points, sequence, fps=5), size=(320, 320)) as opened:
        if opened.page.evaluate("pointshade.player.isPlaying"):
            opened.page.keyboard.press("Space")
        for k, changes in ((3, {}), (0, {"yaw": 15}), (2, {"yaw": 15})):
            opened.page.evaluate("(k) => pointshade.player.jump(k)", k)
            opened.wait_for(f"pointshade.player.index === {k} && pointshade.player.target === null")
            found = opened.page.evaluate(AS_SHOWN, changes)
            size = found["width"], found["height"]
            picture = np.frombuffer(base64.b64decode(found["pixels"]), np.uint8).reshape(size[1], size[0], 4)
            light = ps.Light(**{name: as_given(value) for name, value in found["light"].items()})
            camera, pose = sequence[k].camera.fitted(*size), sequence[k].pose @ found["place"]
            psnr, coverage = likeness(picture, points.render(sequence[k], light=light, camera=camera, pose=pose))
            assert psnr > 33 and coverage < 0.003, (k, changes, psnr, coverage)
        assert opened.complaints == []


@pytest.fixture(scope="module")
def shown(browser, renderer):
    with browser.opened(draw_page(renderer, shaken(4), fps=20)) as page:
        page.wait_until_drawn()
        yield page
        assert page.complaints == []


@browser_test
@pytest.mark.system
class TestPlaying:
    def test_it_plays_again_and_again_until_space_and_the_button_play_on(self, shown):
        shown.page.evaluate("window.seen = new Set()")
        shown.page.evaluate(NOTE_NUMBERS)
        shown.wait_for("seen.size === 4")
        shown.page.keyboard.press("Space")
        assert shown.page.locator("#play").get_attribute("aria-label") == "Play"
        at = shown.page.evaluate("new Promise(requestAnimationFrame).then(() => pointshade.player.index)")
        shown.page.wait_for_timeout(200)
        assert shown.page.evaluate("pointshade.player.index") == at
        shown.page.locator("#play").click()
        shown.wait_for(f"pointshade.player.index !== {at}")

    def test_the_light_follows_while_it_plays(self, shown):
        before = shown.state["lightAt"]
        shown.page.mouse.move(200, 100)
        shown.page.mouse.move(300, 150, steps=4)
        assert shown.state["lightAt"] != before

    def test_the_slider_shows_its_frame_by_mouse_and_keys(self, shown):
        slider = shown.page.locator("#frame")
        box = slider.bounding_box()
        shown.page.mouse.click(box["x"] + box["width"] - 9, box["y"] + box["height"] / 2)
        shown.wait_for("pointshade.player.index === 3 && !pointshade.player.isPlaying")
        assert shown.page.locator("#number").inner_text() == "4 / 4"
        yaw = shown.state["yaw"]
        slider.press("ArrowLeft")
        shown.wait_for("pointshade.player.index === 2")
        assert shown.state["yaw"] == yaw  # the object is not turned by the slider's keys
        slider.press("b")  # other keys mean the same as always
        assert shown.state["lit"] is False
        slider.press("b")

    def test_what_waits_is_bounded(self, shown):
        assert shown.page.evaluate("pointshade.player.ready.length") <= 3


def test_frames_lie_apart_in_the_file(renderer):
    """So that a page holds what is packed, and of what is decoded a few frames."""
    found = re.findall(r'class="frame">([^<]*)<', draw_page(renderer, [frames.sphere()] * 3, fps=5))
    assert len(found) == 3 and all(zlib.decompress(base64.b64decode(one)) for one in found)
