"""Pages of trained splats: what they draw, against what `render` blends of the same, and what they hold of them."""

import base64
import json
import re

import numpy as np
import pytest

import pointshade_gl as ps
from pointshade_gl.page import draw_page, page_file, parts
from pointshade_gl.page.page_contents import arranged, reduced
from pointshade_gl.page.parts import FOLDER, SCRIPTS, SCRIPTS_OF
from pointshade_gl.renderer.requests import RenderRequest
from pointshade_gl.scene.gaussians import palette_of

from ..support import frames
from ..support.browser import altered
from ..support.page_functions import run_script
from ..support.trained_splats import ball_over_floor
from .test_pictures import SHADOW_SIDE, as_given, moved
from .test_pictures import points as points
from .test_pictures import small_shadows as small_shadows
from .test_pictures import test_a_browser_starts as test_a_browser_starts  # first: no page costs more than others

pytestmark = pytest.mark.gl
browser_test = pytest.mark.browser
UNLIT, LIT = 42, 38  # dB of what is covered, at least: a pixel of a shadow's rim is of this or of that side
SIZE = 240, 180
SUN = ps.Light(direction=(1, 1, 0.6), shadow=True)
DRAW = """async ([changes, size]) => {
  const { data, drawing } = pointshade, state = { ...START, ...data.start, ...changes }, { layer } = drawing;
  const camera = fitted(data.camera, ...size), place = pose(state, data.stage);
  const lights = [light(state, data.stage, HOME, data.held), ...data.lights];
  const shading = state.lit ? state.shading : "none";
  const draw = () => drawing.draw({ camera, pose: place }, lights, { shading, shadows: state.shadows });
  layer.changed = () => {};
  draw();
  const stale = !layer.isSorted;
  while (!layer.isSorted) await new Promise((done) => setTimeout(done, 5));
  draw();
  let text = "";
  for (const byte of drawing.read()) text += String.fromCharCode(byte);
  const shown = lights.map((one) => ({ ...one, shadow: one.shadow && state.shadows }));
  return { pixels: btoa(text), place, lights: shown, stale, hasWorker: Boolean(layer.worker) };
}"""


def drawn(opened, source, changes=None, renderer=None, **options):
    """How like the page's picture is to that of `render`, dB of what is covered, and what the page tells of it."""
    found = opened.page.evaluate(DRAW, [changes or {}, SIZE])
    actual = np.frombuffer(base64.b64decode(found["pixels"]), np.uint8).reshape(*SIZE[::-1], 4)
    showing = arranged(RenderRequest.of(source, **options))
    if "light" in options or (changes or {}).get("lit"):
        held = [ps.Light(**{name: as_given(value) for name, value in one.items()}) for one in found["lights"]]
        options["light"] = [moved(one, showing.home) for one in held]
    seen = {"camera": showing.camera.fitted(*SIZE), "pose": showing.home @ found["place"]}
    expected = np.asarray(renderer.render(source, **seen, **options))
    covered = (actual[..., 3] > 5) & (expected[..., 3] > 5)
    assert covered.mean() > 0.05 and ((actual[..., 3] > 5) != (expected[..., 3] > 5)).mean() < 0.01
    return decibels(actual, expected, covered), found


def decibels(actual, expected, covered):
    one, other = ((p[..., :3] / 255.0 * (p[..., 3:] / 255.0))[covered] for p in (actual, expected))
    return -10 * np.log10(max(np.square(one - other).mean(), 1e-9))


def data_of(page):
    return json.loads(re.search(r'id="data">(.*?)</script>', page)[1])


def head_of(page):
    (head,) = (one for one in data_of(page)["things"] if one["kind"] == "splats")
    return head


@browser_test
@pytest.mark.parametrize(("degree", "more"), [(0, {}), (2, {"antialiased": True})], ids=str)
def test_a_page_blends_as_render_does_and_sorts_again_when_it_turns(browser, renderer, degree, more):
    cloud = ball_over_floor(600, degree=degree, **more)
    with browser.shown(draw_page(renderer, cloud)) as opened:
        psnr, first = drawn(opened, cloud, renderer=renderer)
        assert psnr >= UNLIT and first["hasWorker"] and not first["stale"]
        psnr, turned = drawn(opened, cloud, {"yaw": 75, "pitch": 15}, renderer=renderer)
        assert psnr >= UNLIT and turned["stale"]  # until the worker has sorted
        assert opened.complaints == []


@pytest.mark.usefixtures("small_shadows")
@browser_test
@pytest.mark.parametrize(
    "options",
    [{}, *(pytest.param(one, marks=pytest.mark.system) for one in ({"light": SUN}, {"environment": "sky"}))],
    ids=str,
)
def test_light_and_shadows_are_those_of_render(browser, renderer, options):
    cloud = ball_over_floor(2500)
    page = altered(draw_page(renderer, cloud, **options), SHADOW_SIDE=SHADOW_SIDE)
    assert data_of(page)["start"].get("lit", True) == bool(options)  # unlit until light is asked for
    with browser.shown(page) as opened:
        psnr, _ = drawn(opened, cloud, {"lit": True, "yaw": 25, "pitch": 20}, renderer=renderer, **options)
        assert psnr >= LIT and opened.complaints == []


def among(*contents):
    """A scene of splats and these, seen from afar."""
    pose = np.eye(4)
    pose[:3, 3] = 0, -0.5, -4
    nodes = [ps.Node(content, transform=place) for content, place in contents]
    return ps.Scene((*nodes, ps.Node(ball_over_floor(400))), camera=ps.Camera.from_fov(45, *SIZE), pose=pose)


def wall():
    corners = np.array([[-1.97, 0.53, 0.0], [0.01, 0.53, 0], [0.01, -1.97, 0], [-1.97, -1.97, 0]], np.float32)
    return ps.Mesh(corners, [(0, 1, 2), (0, 2, 3)], color=(0.2, 0.5, 0.3), shading="none")


@browser_test
def test_what_stands_before_splats_hides_them(browser, points):
    place = np.diag([0.3, 0.3, 0.3, 1.0])
    place[:3, 3] = 0.4, -0.8, -1.6
    source = among((wall(), np.eye(4)), (ps.PointObject(frames.sphere(), shading="none"), place))
    with browser.shown(draw_page(points, source)) as opened:
        psnr, _ = drawn(opened, source, renderer=points)
        assert psnr >= LIT
        away = opened.page.evaluate("[[60, 60], [120, 80]].map((at) => pointshade.drawing.depthAt(...at))")
        assert away == pytest.approx([4, 3.5], abs=0.1)


@browser_test
def test_more_samples_need_no_other_blend(browser, renderer):
    source = among((wall(), np.eye(4)))
    with browser.shown(draw_page(renderer, source)) as opened:
        drawn(opened, source, renderer=renderer)
        count = "[0, 1, 2].map(() => (pointshade.drawing.refine(), pointshade.drawing.layer.version))"
        first, *others = opened.page.evaluate(count)
        assert others == [first, first]


NO_WORKER = "window.Worker = class { constructor() { throw new Error('not here'); } };"


@browser_test
def test_where_no_worker_may_be_started_the_page_sorts_itself(browser, renderer):
    cloud = ball_over_floor(300)
    with browser.shown(draw_page(renderer, cloud), before=NO_WORKER) as opened:
        psnr, found = drawn(opened, cloud, {"yaw": 75}, renderer=renderer)
        assert psnr >= UNLIT and not found["hasWorker"] and not found["stale"]


NO_FLOATS = """
  const given = WebGL2RenderingContext.prototype.getExtension;
  WebGL2RenderingContext.prototype.getExtension = function (name) {
    return name === "EXT_float_blend" ? null : given.call(this, name);
  };
"""


@browser_test
@pytest.mark.parametrize("changes", [{}, pytest.param({"lit": True}, marks=pytest.mark.system)])
def test_where_floats_cannot_be_blended_half_floats_are(browser, renderer, changes):
    cloud = ball_over_floor(2500)
    with browser.shown(draw_page(renderer, cloud), before=NO_FLOATS) as opened:
        psnr, _ = drawn(opened, cloud, changes, renderer=renderer)
        assert psnr >= 34 and opened.complaints == []


@browser_test
def test_b_lights_splats_that_begin_unlit(browser, renderer):
    with browser.shown(draw_page(renderer, ball_over_floor(300))) as opened:
        assert not opened.state["lit"]
        opened.page.keyboard.press("b")
        assert opened.state["lit"] and opened.state["shading"] == "phong"
        middle = "[0.5, 0.5].map((share, k) => Math.round(share * pointshade.drawing.size[k]))"
        assert opened.page.evaluate(f"pointshade.drawing.depthAt(...{middle})") > 0


def test_the_farthest_come_first():
    places = np.random.default_rng(1).normal(size=(500, 3))
    way = [0.6, 0.0, 0.8]
    script = "return [...depthOrder(Float32Array.from(value[0]), value[1], DIGIT)];"
    order = run_script(script, [places.ravel().tolist(), way], "state.js", "draw.js", "splats.js")
    assert sorted(order) == list(range(500))
    depths = (places @ way)[order]
    assert (np.diff(depths) < 1e-5).all()


def test_a_splat_takes_twenty_bytes_of_the_file_at_most(renderer):
    cloud = ball_over_floor(8000)
    page = draw_page(renderer, cloud, camera=ps.Camera.from_fov(40, 32, 24))
    parts = re.search(r'id="parts">([^<]*)<', page)[1]
    assert len(parts) <= 22 * len(cloud) and head_of(page)["count"] == len(cloud)


def test_only_pages_with_splats_have_their_script_and_may_start_a_worker(renderer):
    text = (FOLDER / SCRIPTS_OF["splats"]).read_text(encoding="utf-8")
    with_splats, without = draw_page(renderer, ball_over_floor(20)), draw_page(renderer, frames.sphere())
    assert text in with_splats and "worker-src blob:" in with_splats
    assert text not in without and "worker-src" not in without and SCRIPTS_OF["splats"] not in SCRIPTS


def test_of_too_many_splats_those_that_show_most_are_kept():
    clouds = [ball_over_floor(300), ball_over_floor(200, seed=7)]
    request = RenderRequest(ps.Scene(tuple(map(ps.Node, clouds))))
    scene = reduced(request, 2048, 10**6, 0, 500).source
    kept = [one for node in scene.nodes for one in node.content]
    assert sum(map(len, kept)) == 500 and all(one.is_gaussian for one in kept)
    shown = [np.sort(one.gaussians.scales, 1)[:, 1:].prod(1) * one.gaussians.opacities for one in (*clouds, *kept)]
    assert np.concatenate(shown[2:]).mean() > np.concatenate(shown[:2]).mean()
    whole = reduced(request, 2048, 10**6, 0, 1500).source
    assert [len(one) for node in whole.nodes for one in node.content] == [900, 600]


def test_a_note_tells_how_many_were_left_out(renderer, monkeypatch, capsys):
    quality = {"exact": parts.QUALITIES["exact"]._replace(splats=100)}
    monkeypatch.setattr(page_file, "QUALITIES", quality)
    page = draw_page(renderer, ball_over_floor(100), camera=ps.Camera.from_fov(40, 32, 24))
    assert head_of(page)["count"] == 100
    assert "of 300 splats those that show most are drawn, 100 splats" in capsys.readouterr().err


@pytest.mark.parametrize("count", [0, 1])
def test_next_to_no_splats_are_a_page(renderer, count):
    cloud = ball_over_floor(1, floor=False)
    cloud = ps.PointCloud(
        cloud.positions[:count], gaussians=cloud.gaussians.select(np.arange(count)), splat="gaussian", shading="auto"
    )
    assert head_of(draw_page(renderer, cloud, camera=ps.Camera.from_fov(40, 32, 24)))["count"] == count


def test_splats_of_several_clouds_are_one_part(renderer):
    place = np.diag([0.5, 0.5, 0.5, 1.0])
    place[:3, 3] = 1, 2, 3
    lit = ball_over_floor(20).styled(shading="phong")
    scene = ps.Scene((ps.Node(lit), ps.Node(ball_over_floor(30, degree=1), transform=place)))
    page = draw_page(renderer, scene, camera=ps.Camera.from_fov(40, 32, 24))
    head = head_of(page)
    assert (head["count"], head["harmonics"], head["isMixed"], head["shading"]) == (150, 3, True, "phong")


def test_a_palette_has_all_rows_or_such_as_are_like_them():
    rng = np.random.default_rng(2)
    few = rng.integers(-127, 128, (50, 9))[rng.integers(0, 50, 4000)]
    entries, labels = palette_of(few, is_exact=False)
    assert len(entries) == 50 and (entries[labels] == few).all()
    middles = rng.integers(-90, 90, (300, 9))
    many = middles[rng.integers(0, 300, 9000)] + rng.integers(-3, 4, (9000, 9))
    entries, labels = palette_of(many, is_exact=False)
    assert len(entries) <= 33**2 and np.abs(entries[labels] - many).mean() < 3
    entries, labels = palette_of(many, is_exact=True)
    assert (entries[labels] == many).all()
