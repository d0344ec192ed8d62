"""A page at rest, against the picture that `render` makes of as many samples: outlines, soft shadows, backgrounds."""

from dataclasses import replace

import numpy as np
import pytest

import pointshade_gl as ps
from pointshade_gl.page import draw_page
from pointshade_gl.scene.sample_pattern import light_part, moved_light, pixel_offset

from ..support import frames
from ..support.browser import altered
from ..support.page_functions import run_script
from .test_clouds import board, cloud, data_of, scene_of
from .test_pictures import SHADOW_SIDE, as_given, drawn, moved
from .test_pictures import small_shadows as small_shadows
from .test_pictures import test_a_browser_starts as test_a_browser_starts  # first: no page costs more than others
from .test_pictures import test_it_can_draw_what_pages_need as test_it_can_draw_what_pages_need

SAMPLES = 16  # that a page has at rest
FEW = 3  # of them, where each adds the same; an odd number lies in the middle of pixels
MOVED = """async () => {
  pointshade.state = { ...pointshade.state, yaw: 2 };
  // Slow pages draw later.
  for (let k = 0; pointshade.drawing.count && k < 20; ++k) await new Promise(requestAnimationFrame);
  return pointshade.drawing.count;
}"""
FIRST = """() => {
  const { drawing } = pointshade, { view, lights } = pointshade.seen();
  drawing.draw(view, lights, { shadows: true });
  const before = drawing.read();
  drawing.refine();
  return drawing.read().reduce((most, value, k) => Math.max(most, Math.abs(value - before[k])), 0);
}"""
LEAST = 40, 44  # dB at outlines, and of the whole picture
OF_CLOUDS = 36, 43  # the same: at an outline a pixel is of this or of that side
LAMPS = {
    "ball": ps.Light(position=(-0.5, -0.6, 0.3), radius=0.15, shadow=True),
    "sun": ps.Light(direction=(0.5, 0.4, 1), angle=8, shadow=True),
    "area": ps.Light((0.6, -0.5, 0.4), (-0.5, 0.4, 1), size=(0.5, 0.2), watts=15, shadow=True),
}


@pytest.fixture(scope="module")
def points():
    with ps.Renderer(rasterizer="points") as made:
        yield made


def decibels(actual, expected, where):
    """PSNR of colours over black."""
    colors = [picture[where][:, :3] * (picture[where][:, 3:] / 255) for picture in (actual, expected)]
    return 10 * np.log10(255**2 / max(np.square(colors[0] - colors[1]).mean(), 1e-9))


def check(opened, points, source, changes, size, samples=SAMPLES, least=LEAST, given=None, **look):
    """At rest the page shows what `render` makes of its samples, also where one sample is not enough."""
    own = source.framed() if isinstance(source, ps.Scene) else source[0] if isinstance(source, list) else source
    camera = own.camera if isinstance(source, ps.Scene) else own.picture_camera
    picture, place, lights = drawn(opened, changes, size, given, samples)
    lights = [moved(light, own.pose) for light in lights]
    options = look | {"light": lights, "camera": camera.fitted(*size), "pose": own.pose @ place}
    one, expected = (points.render(source, samples=count, **options).astype(float) for count in (1, samples))
    outlines = np.abs(one - expected).max(-1) > 8
    assert 0.0005 < outlines.mean() < 0.5
    found = decibels(picture, expected, outlines), decibels(picture, expected, outlines | True)
    assert found[0] >= least[0] and found[1] >= least[1], (changes, found)
    assert opened.complaints == []


@pytest.fixture(scope="module")
def soft(browser, points):
    """A page of a lamp that is soft."""
    page = draw_page(points, frames.sphere_before_wall(), light=LAMPS["sun"])
    with browser.shown(altered(page, SHADOW_SIDE=SHADOW_SIDE)) as opened:
        yield opened


@pytest.mark.gl
@pytest.mark.usefixtures("small_shadows")
def test_a_page_keeps_how_large_lamps_are(points):
    data = data_of(draw_page(points, frames.sphere_before_wall(), light=list(LAMPS.values())))
    for kept, lamp in zip([data["held"], *data["lights"]], LAMPS.values(), strict=True):
        assert {name: as_given(kept[name]) for name in ("radius", "angle", "size", "shadow")} == {
            "radius": lamp.radius, "angle": lamp.angle, "size": lamp.size, "shadow": True,
        }  # fmt: skip


@pytest.mark.browser
@pytest.mark.gl
class TestPictures:
    @pytest.mark.system
    @pytest.mark.data
    @pytest.mark.parametrize("name", ["vase", "tum_fr3_kinect1"])
    def test_frames_have_smooth_outlines(self, browser, points, shared_data, name):
        frame = ps.load_frame(name) if name == "vase" else ps.load_frame(shared_data / name)
        with browser.shown(draw_page(points, frame)) as opened:
            for changes in ({}, {"yaw": 20, "pitch": -10, "distance": 0.8}):
                check(opened, points, frame, changes, (640, 480))

    @pytest.mark.parametrize(
        "options", [{"background": "#336699"}, {"tone": "neutral"}, {"ambient_occlusion": True}], ids=str
    )
    def test_it_is_finished_as_a_still(self, browser, points, options):
        frame, light = frames.sphere_before_wall(), ps.Light(position=(-0.5, -0.5, 0), intensity=2)
        with browser.shown(draw_page(points, frame, light=light, **options)) as opened:
            check(opened, points, frame, {"yaw": 15}, (160, 120), FEW, **options)

    @pytest.mark.usefixtures("small_shadows")
    @pytest.mark.parametrize("name", ["sun", "ball", "area"])
    def test_shadows_are_soft(self, soft, points, name):
        check(soft, points, frames.sphere_before_wall(), {"yaw": 20}, (160, 120), FEW, given=[LAMPS[name]])

    @pytest.mark.system
    @pytest.mark.parametrize(("name", "samples"), [("ball", 5), ("sun", SAMPLES)])
    def test_soft_shadows_are_fine(self, browser, points, name, samples):
        frame = frames.sphere_before_wall()
        with browser.shown(draw_page(points, frame, light=LAMPS[name])) as opened:
            check(opened, points, frame, {"yaw": 20}, (320, 240), samples)

    @pytest.mark.usefixtures("small_shadows")
    def test_clouds_become_finer(self, browser, points):
        scene = scene_of(cloud(), board())
        with browser.shown(altered(draw_page(points, scene), SHADOW_SIDE=SHADOW_SIDE)) as opened:
            check(opened, points, scene, {"yaw": 15}, (160, 120), FEW, OF_CLOUDS)

    @pytest.mark.system
    def test_a_scene_with_meshes(self, browser, points):
        scene = ps.load_scene("demo")
        with browser.shown(draw_page(points, scene)) as opened:
            check(opened, points, scene, {"yaw": 15, "pitch": 5}, (320, 240), 5)


@pytest.fixture(scope="module")
def opened(browser, points):
    page = draw_page(points, frames.sphere_before_wall(), light=ps.Light(direction=(0.5, 0.4, 1), shadow=True))
    with browser.shown(altered(page, SHADOW_SIDE=SHADOW_SIDE), refines=True) as opened:
        yield opened


@pytest.mark.browser
@pytest.mark.gl
class TestRefining:
    def test_it_begins_with_the_picture_that_was_there(self, opened):
        opened.wait_for("pointshade.drawing.isFine")  # from now on only this test draws
        assert opened.page.evaluate(FIRST) <= 1

    def test_until_it_is_fine_it_stays_in_the_middle_of_its_pixels(self, opened):
        """After an even number of samples the mean lies beside it: that is not shown."""
        shown = [drawn(opened, {"yaw": 7}, samples=samples)[0].astype(int) for samples in (1, 2, 3)]
        assert np.array_equal(shown[0], shown[1]) or np.abs(shown[0] - shown[1]).max() <= 1
        assert np.abs(shown[2] - shown[1]).max() > 20

    def test_what_moves_ends_it_at_once_and_rest_begins_it_again(self, opened):
        opened.page.evaluate("pointshade.state = { ...pointshade.state, yaw: 1 }")
        opened.wait_for("pointshade.drawing.count > 1")
        assert opened.page.evaluate(MOVED) == 0
        opened.wait_for("pointshade.drawing.isFine")
        assert opened.page.evaluate("pointshade.drawing.count") == SAMPLES


HOME = ps.orbit_pose(None, (0.3, 0.1, 1.5), 25, -40)
SCRIPT = """
const { lights, centre, toWorld } = value;
return lights.map((light) => [...Array(20).keys()].map((k) => {
  const { position, direction } = movedLight(light, k, centre, toWorld);
  const { cx, cy } = shiftedCamera({ cx: 0, cy: 0 }, k);
  return [position ?? direction, [-cx, -cy], lightPart(k)];
}));
"""


def test_samples_lie_where_those_of_stills_lie():
    turn, centre = HOME[:3, :3], np.array([0.1, 0.2, 1.4])
    lights = [*LAMPS.values(), replace(LAMPS["area"], direction=(0, 1, 0)), replace(LAMPS["sun"], direction=(0, 0, 1))]
    given = []
    for light in lights:
        home = moved(light, np.linalg.inv(np.block([[turn, np.zeros((3, 1))], [np.zeros((1, 3)), 1]])))
        given.append(vars(home) | {"size": light.size})
    values = {"lights": given, "centre": (turn.T @ centre).tolist(), "toWorld": turn.tolist()}
    names = ("state.js", "lights.js", "shadows.js", "samples.js")
    for light, found in zip(lights, run_script(SCRIPT, values, *names), strict=True):
        for k, (place, offset, part) in enumerate(found):
            expected = moved_light(light, k, centre)
            value = expected.direction if expected.position is None else expected.position
            scale = 1 if expected.position else np.linalg.norm(value) / np.linalg.norm(place)
            np.testing.assert_allclose(scale * (turn @ place), value, atol=1e-12)
            np.testing.assert_allclose(offset, pixel_offset(k), atol=1e-15)
            assert part == pytest.approx(light_part(k))
