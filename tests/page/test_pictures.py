"""What a page draws, against what `render` draws by the points rasteriser: the same camera, pose, lights and look."""

import base64
from dataclasses import replace

import numpy as np
import pytest

import pointshade_gl as ps
from pointshade_gl.page import draw_page
from pointshade_gl.scene import shadow_cameras

from ..support import frames, view_sets
from ..support.browser import altered

pytestmark = [pytest.mark.browser, pytest.mark.gl]
PSNR, COVERAGE = 55, 0.001  # at least, where both draw; at most, by how much the covered share differs
DRAW = """([changes, size, others, samples, hurries]) => {
  const { data, drawing } = pointshade, state = { ...START, ...data.start, ...changes };
  const camera = size ? fitted(data.camera, ...size) : data.camera;
  const place = pose(state, data.stage), own = [light(state, data.stage, HOME, data.held), ...data.lights];
  const lights = others ?? own;
  drawing.draw({ camera, pose: place }, lights, { shading: state.shading, shadows: state.shadows, hurries });
  while (samples > 1 && drawing.count < samples) drawing.refine();
  const pixels = drawing.read();
  let text = "";
  for (let k = 0; k < pixels.length; k += 8192) text += String.fromCharCode(...pixels.subarray(k, k + 8192));
  const cast = lights.map((one) => ({ ...one, shadow: one.shadow && state.shadows }));
  const [width, height] = drawing.size;
  return { width, height, pixels: btoa(text), place, lights: cast };
}"""
SHADOW_SIDE = 128  # pixels of a shadow map where it needs not be as fine as people see it
VIEWS = [  # changes of the state, and the size of the picture
    ({}, None),
    ({"yaw": 25, "pitch": 10, "lightAt": [0.5, 0.1]}, [400, 300]),
    ({"yaw": -20, "pitch": -15, "distance": 0.7, "lightAt": [-0.8, 1.0]}, [320, 320]),
]


@pytest.fixture(scope="module")
def points():
    with ps.Renderer(rasterizer="points") as made:
        yield made


@pytest.fixture
def small_shadows(monkeypatch):
    """Shadow maps of `render` that are as small as those of a page with another SHADOW_SIDE."""
    monkeypatch.setattr(shadow_cameras, "SHADOW_SIDE", SHADOW_SIDE)


def drawn(opened, changes, size=None, lights=None, samples=1, hurries=False):
    """A picture of the page, (h, w, 4), the pose of who looks, in home axes, and the lights there."""
    found = opened.page.evaluate(DRAW, [changes, size, lights and list(map(vars, lights)), samples, hurries])
    picture = np.frombuffer(base64.b64decode(found["pixels"]), np.uint8)
    lights = [ps.Light(**{name: as_given(value) for name, value in light.items()}) for light in found["lights"]]
    return picture.reshape(found["height"], found["width"], 4), np.array(found["place"]), lights


def as_given(value):
    return tuple(value) if isinstance(value, list) else value


def moved(light, home):
    """A light of home axes, in the world."""
    place = None if light.position is None else tuple(home[:3, :3] @ light.position + home[:3, 3])
    direction = None if light.direction is None else tuple(home[:3, :3] @ light.direction)
    return replace(light, position=place, direction=direction)


def likeness(actual, expected):
    """PSNR where both draw, and by how much the covered share differs."""
    covered = [picture[..., 3] > 0 for picture in (actual, expected)]
    both = covered[0] & covered[1]
    error = np.square(actual[both][:, :3].astype(float) - expected[both][:, :3]).mean()
    return 10 * np.log10(255**2 / max(error, 1e-9)), abs(covered[0].mean() - covered[1].mean())


def check(opened, points, source, views, least=PSNR, given=None, **look):
    """The page shows the views as `render` does."""
    own = source.framed() if isinstance(source, ps.Scene) else source[0] if isinstance(source, list) else source
    camera = own.camera if isinstance(source, ps.Scene) else own.picture_camera
    for changes, size in views:
        picture, place, lights = drawn(opened, changes, size, given)
        seen = camera if size is None else camera.fitted(*size)
        lights = [moved(light, own.pose) for light in lights]
        options = look | ({"shading": changes["shading"]} if "shading" in changes else {})
        expected = points.render(source, light=lights, camera=seen, pose=own.pose @ place, **options)
        assert expected[..., 3].any()
        psnr, coverage = likeness(picture, expected)
        assert psnr >= least and coverage <= COVERAGE, (changes, psnr, coverage)
    assert opened.complaints == []


def test_a_browser_starts(browser):
    assert browser.unseen.is_connected()


ADDED_FLOATS = """() => {
  const gl = document.createElement("canvas").getContext("webgl2"), program = gl.createProgram(), texts = {
    VERTEX_SHADER: "void main() { gl_Position = vec4(0, 0, 0, 1); gl_PointSize = 8.0; }",
    FRAGMENT_SHADER: "out vec4 color; void main() { color = vec4(0.75); }",
  };
  const needed = ["EXT_color_buffer_float", "EXT_float_blend"].map((name) => gl.getExtension(name));
  for (const [kind, text] of Object.entries(texts)) {
    const shader = gl.createShader(gl[kind]);
    gl.shaderSource(shader, `#version 300 es\nprecision highp float;\n${text}`);
    gl.compileShader(shader);
    gl.attachShader(program, shader);
  }
  gl.linkProgram(program);
  gl.useProgram(program);
  const sum = gl.createTexture(), found = new Float32Array(4);
  gl.bindTexture(gl.TEXTURE_2D, sum);
  gl.texStorage2D(gl.TEXTURE_2D, 1, gl.RGBA32F, 1, 1);
  gl.bindFramebuffer(gl.FRAMEBUFFER, gl.createFramebuffer());
  gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, sum, 0);
  gl.viewport(0, 0, 1, 1);
  gl.enable(gl.BLEND);
  gl.blendFunc(gl.ONE, gl.ONE);
  for (let k = 0; k < 3; ++k) gl.drawArrays(gl.POINTS, 0, 1);
  gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.FLOAT, found);
  return [needed.every(Boolean), ...found];
}"""


def test_it_can_draw_what_pages_need(browser):
    page = '<head></head><body class="live"></body><script>const REST = 0;</script>'
    with browser.shown(page) as opened:
        assert opened.page.evaluate(ADDED_FLOATS) == [True, *[2.25] * 4]


def test_sizes_of_each_point(browser, points):
    frame = frames.sphere()
    sizes = np.random.default_rng(0).uniform(0, 2, frame.depth.shape).astype(np.float32)
    with browser.shown(draw_page(points, frame, point_size=sizes)) as opened:
        check(opened, points, frame, [({"yaw": 15, "pitch": 5}, None)], point_size=sizes)


@pytest.mark.system
@pytest.mark.data
@pytest.mark.parametrize("name", ["vase", "tum_fr3_kinect1", "realsense_box_2"])
def test_frames_look_as_rendered(browser, points, shared_data, name):
    frame = ps.load_frame(name) if name == "vase" else ps.load_frame(shared_data / name)
    frame = frame.with_up(frame.upright)  # turned about the middle of what it shows
    least = PSNR if name == "vase" else 54  # noisy normals, rounded, tip single splats before others
    with browser.shown(draw_page(points, frame)) as opened:
        check(opened, points, frame, VIEWS, least)


def larger_colors(frame):
    """The frame with each pixel's colour twice a side."""
    return ps.Frame(frame.color.repeat(2, 0).repeat(2, 1), frame.depth, frame.camera, frame.pose)


def upside_down(frame):
    """The frame with the last row first, which a negative fy says."""
    camera = replace(frame.camera, fy=-frame.camera.fy)
    return ps.Frame(frame.color[::-1], frame.depth[::-1], camera, frame.pose)


@pytest.mark.parametrize("change", [larger_colors, upside_down])
def test_colors_larger_than_the_depth_and_a_negative_fy(browser, points, change):
    frame = change(frames.sphere_before_wall())
    with browser.shown(draw_page(points, frame)) as opened:
        check(opened, points, frame, [(changes, [320, 240]) for changes, _ in VIEWS[:2]])


@pytest.fixture(scope="module")
def sphere(browser, points):
    page = draw_page(points, frames.sphere_before_wall())
    with browser.shown(altered(page, SHADOW_SIDE=SHADOW_SIDE)) as opened:
        yield opened


@pytest.mark.parametrize("shading", ["none", "flat", "gouraud", "phong", "edl"])
def test_every_shading(sphere, points, shading):
    check(sphere, points, frames.sphere_before_wall(), [(VIEWS[1][0] | {"shading": shading}, None)])


def test_a_page_that_begins_in_another_shading_can_be_lit(browser, points):
    frame = frames.sphere_before_wall()
    with browser.shown(draw_page(points, frame, shading="none")) as opened:
        check(opened, points, frame, [({"shading": "none"}, None), ({"shading": "phong"}, None)])


def test_what_was_shown_before_does_not_matter(sphere):
    state = {"yaw": 5}
    first = drawn(sphere, state)[0]
    for changes, size in ((VIEWS[1][0], None), (state | {"shading": "flat"}, None), (state, [99, 77])):
        assert not np.array_equal(drawn(sphere, changes, size)[0], first)
    assert np.array_equal(drawn(sphere, state)[0], first)


@pytest.mark.parametrize(
    "options",
    [
        {"ambient_occlusion": True, "material": ps.Material(0.6, 0.6, 0.2)},
        {"environment": "studio", "material": ps.Material(0.1, 0.8, 3, 40), "environment_rotation": 30},
        {"environment": "sky", "ambient_occlusion": False, "environment_intensity": 0.7},
    ],
    ids=lambda options: " ".join(options),
)
def test_light_from_all_around(browser, points, options):
    frame = frames.sphere_before_wall()
    page = draw_page(points, frame, **options)
    with browser.shown(page) as opened:
        views = [(VIEWS[1][0], [160, 120]), (VIEWS[1][0] | {"shading": "flat"}, None)]
        check(opened, points, frame, views, least=45, **options)


def small_scene():
    """A ball that stands out of a triangle, with a light that casts a shadow."""
    board = ps.Mesh([(-1, -0.8, 1.6), (1, -0.8, 1.6), (0, 1, 1.6)], [(0, 1, 2)], color=(0.7, 0.4, 0.3))
    contents = ps.PointObject(frames.sphere()), board, ps.Light(position=(-0.6, -0.7, 0.3), shadow=True)
    return ps.Scene(tuple(map(ps.Node, contents)), camera=frames.CAMERA)


def demo():
    return ps.load_scene("demo")


SCENES = [
    pytest.param(small_scene, [160, 120], id="small"),
    pytest.param(demo, [320, 240], id="demo", marks=pytest.mark.system),
]


@pytest.mark.usefixtures("small_shadows")
@pytest.mark.parametrize(("make", "size"), SCENES)
def test_meshes_and_frames_hide_light_from_each_other(browser, points, make, size):
    scene, least = make(), 45 if make is small_scene else 34
    page = draw_page(points, scene, ambient_occlusion=True, environment="sky")
    with browser.shown(altered(page, SHADOW_SIDE=SHADOW_SIDE)) as opened:
        check(opened, points, scene, [({}, size)], least, ambient_occlusion=True, environment="sky")


LAMP = ps.Light(position=(0.3, -0.4, 0.2), color=(1, 0.5, 0.2), attenuation=(0.5, 0.1, 0.2))
SUN = ps.Light(direction=(0.5, 0.4, 1))
LIGHTS = {
    "several": [SUN, LAMP],
    "spot": [SUN, ps.Light(position=(0, -0.5, 0), direction=(0, 0.4, 1), cone=(10, 25))],
    "shadow": [replace(SUN, shadow=True), LAMP],
    "area": [ps.Light((0.6, -0.5, 0.4), (-0.5, 0.4, 1), size=(0.4, 0.1), watts=15, shadow=True), LAMP],
    "all around": [SUN, ps.Light(position=(0, 0, 1.4), shadow=True)],
}


@pytest.mark.parametrize("name", LIGHTS)
@pytest.mark.usefixtures("small_shadows")
def test_every_kind_of_light(sphere, points, name):
    least = PSNR if name == "several" else 45  # at edges of shadows and cones a pixel is lit or not
    check(sphere, points, frames.sphere_before_wall(), [({"yaw": 20, "shadows": True}, None)], least, LIGHTS[name])


def test_light_above_white_rolls_off_except_where_none_is_seen(browser, points):
    frame, light = frames.sphere_before_wall(), ps.Light((-0.5, -0.5, 0), intensity=4)
    with browser.shown(draw_page(points, frame, light=light, tone="neutral")) as opened:
        check(opened, points, frame, [({}, None)], tone="neutral")
        check(opened, points, frame, [({"shading": "none"}, None)])


ESTIMATED = """() => {
  const { gl, things } = pointshade.drawing, [thing] = things, known = Boolean(thing.rims.known);
  Object.assign(thing, { isFilm: true, rims: makeIndices(gl, thing.kinds, 2) });
  return [known, thing.rims.count];
}"""


def test_rims_that_are_known_are_those_that_each_view_would_estimate(browser, points):
    changes = {"yaw": 20, "shadows": True}
    page = altered(draw_page(points, frames.sphere_before_wall()), SHADOW_SIDE=SHADOW_SIDE)
    with browser.shown(page) as opened:
        known = [drawn(opened, changes, size)[0] for size in (None, [90, 70])]
        is_known, count = opened.page.evaluate(ESTIMATED)
        assert is_known and count > 100
        drawn(opened, {})
        assert all(np.array_equal(drawn(opened, changes, one.shape[1::-1])[0], one) for one in known)


def test_shadows_are_switched_off_and_on(sphere):
    pictures = [drawn(sphere, {"shadows": on}, None, LIGHTS["shadow"])[0] for on in (True, False, True)]
    assert np.array_equal(pictures[0], pictures[2])
    assert (pictures[1][..., :3].astype(int) - pictures[0][..., :3]).max() > 50


@pytest.mark.parametrize(
    "look", [{"point_size": 2.5}, {"splat": "round"}, {"point_size": "fill"}, {"normals": "plane-fit-5"}], ids=str
)
def test_every_splat(browser, points, look):
    frame = frames.holes()
    with browser.shown(draw_page(points, frame, **look)) as opened:
        check(opened, points, frame, [({"yaw": 15, "pitch": 5}, None)], **look)


@pytest.mark.parametrize(("make", "size"), SCENES)
def test_a_scene_with_meshes_lights_and_shadows(browser, points, make, size):
    scene = make()
    with browser.shown(draw_page(points, scene)) as opened:
        check(opened, points, scene, [({"yaw": 15, "pitch": 5}, size)], least=45)


@pytest.mark.usefixtures("small_shadows")
def test_eye_dome_lighting_beside_light(browser, points):
    """A board in its own colours, darker where the lit ball stands out of it."""
    scene = small_scene()
    ball, board, light = scene.nodes
    scene = replace(scene, nodes=(ball, replace(board, content=replace(board.content, shading="edl")), light))
    with browser.shown(altered(draw_page(points, scene), SHADOW_SIDE=SHADOW_SIDE)) as opened:
        check(opened, points, scene, [({"yaw": 15, "pitch": 5}, [160, 120])], least=45)


def test_it_begins_as_render_draws_it(browser, points):
    frame = frames.sphere_before_wall()
    options = {"light": ps.Light(position=(0.5, -0.3, 0.2), intensity=0.8), "yaw": 12, "pitch": 7, "dolly": 0.2}
    options |= {"material": ps.Material(diffuse=0.6, specular=0.5, shininess=12), "shading": "gouraud"}
    with browser.shown(draw_page(points, frame, **options)) as opened:
        psnr, coverage = likeness(drawn(opened, {})[0], points.render(frame, **options))
        assert psnr >= PSNR and coverage <= COVERAGE


@pytest.mark.system
def test_small_pages_are_nearly_as_good(browser, points):
    frame = ps.load_frame("vase")
    with browser.shown(draw_page(points, frame, quality="small")) as opened:
        check(opened, points, frame, [(changes, [320, 240]) for changes, _ in VIEWS[:2]], least=40)


def test_several_frames_are_one_surface_and_the_help_says_so(browser, points):
    frame = frames.sphere_before_wall()
    both = [frame, ps.Frame(frame.color, frame.depth, frame.camera, frame.pose)]
    with browser.shown(draw_page(points, both)) as opened:
        check(opened, points, both, [({}, None), ({"yaw": 10}, None)], least=40)
        opened.page.keyboard.press("h")
        assert "several frames are one surface" in opened.page.locator("#left-out").inner_text()


SEEN = {"yaw": 8, "pitch": 5}, [160, 120]


@pytest.mark.parametrize(
    ("changes", "options"),
    [({"shadows": True}, {}), ({"shading": "flat"}, {}), ({}, {"ambient_occlusion": True}), ({"shading": "none"}, {})],
)
def test_frames_without_noise_are_joined_in_each_view_as_rendered(browser, points, small_shadows, changes, options):
    """Each frame's splats, and where they end by what the others see: no spikes beside outlines."""
    cut_out = [np.where(one.depth < 1.8, one.depth, 0) for one in view_sets.three_views()]
    views = [view_sets.replaced(one, depth=depth) for one, depth in zip(view_sets.three_views(), cut_out, strict=True)]
    with browser.shown(altered(draw_page(points, views, **options), SHADOW_SIDE=SHADOW_SIDE)) as opened:
        assert opened.page.evaluate("pointshade.data.leftOut") == []
        check(opened, points, views, [(SEEN[0] | changes, SEEN[1])], least=45, **options)


MOVE = """async (changes) => {
  const { drawing } = pointshade, draw = drawing.draw;
  let found = null;
  drawing.draw = (...given) => (draw.apply(drawing, given), (found = drawing.isCoarse));
  pointshade.state = { ...pointshade.state, ...changes };
  while (found === null) await new Promise(requestAnimationFrame);
  delete drawing.draw;
  return found;
}"""


def check_hurry(opened, changes, size, most):
    """In a hurry a picture is half as fine and differs by less than `most` in the mean; nothing of that stays."""
    fine, rested = (drawn(opened, changes, size, samples=samples)[0] for samples in (1, 3))
    drawn(opened, {}, size)
    coarse = drawn(opened, changes, size, hurries=True)[0]
    assert coarse.shape == (60, 80, 4)
    assert np.abs(fine.astype(float).reshape(60, 2, 80, 2, 4).mean((1, 3)) - coarse).mean() < most
    assert np.array_equal(drawn(opened, changes, size, samples=3, hurries=True)[0], rested)


@pytest.mark.parametrize(("make", "most"), [(view_sets.three_views, 4), (frames.sphere_before_wall, 6)])
def test_in_a_hurry_they_are_drawn_coarsely_and_nothing_of_that_stays(browser, points, small_shadows, make, most):
    changes, size = SEEN[0] | {"shadows": True}, SEEN[1]
    with browser.shown(altered(draw_page(points, make()), SHADOW_SIDE=SHADOW_SIDE)) as opened:
        check_hurry(opened, changes, size, most)


def test_in_a_hurry_a_light_that_moves_casts_coarse_shadows_at_first(browser, points):
    changes, size = SEEN[0] | {"shadows": True}, SEEN[1]
    there = changes | {"lightAt": [0.4, 0.2]}
    with browser.shown(altered(draw_page(points, frames.sphere_before_wall()), SHADOW_SIDE=512)) as opened:
        fine, rested = (drawn(opened, there, size, samples=samples)[0] for samples in (1, 3))
        drawn(opened, changes, size)
        hurried = drawn(opened, there, size, hurries=True)[0]
        assert opened.page.evaluate("pointshade.drawing.hasCoarseShadows && !pointshade.drawing.isShown")
        assert 0 < np.abs(fine.astype(float) - hurried).mean() < 4
        assert np.array_equal(drawn(opened, there, size, samples=3, hurries=True)[0], rested)


@pytest.mark.system
def test_slow_pages_hurry_while_the_view_moves_and_light_what_is_known_as_it_is(browser, points):
    with browser.shown(altered(draw_page(points, view_sets.three_views()), SLOW=0, REST=0), refines=True) as opened:
        opened.wait_for("pointshade.drawing.isFine")
        assert opened.page.evaluate(MOVE, {"yaw": 4})
        opened.wait_for("pointshade.drawing.isFine")
        assert not opened.page.evaluate(MOVE, {"lightAt": [0.4, 0.2]})
        opened.wait_for("pointshade.drawing.isFine")


def test_frames_with_noise_agree_with_render_where_they_are_one_surface(browser, points):
    views = [view_sets.noisy(view, k) for k, view in enumerate(view_sets.three_views())]
    with browser.shown(draw_page(points, views)) as opened:
        picture, place, lights = drawn(opened, *SEEN)
        seen = views[0].camera.fitted(*SEEN[1])
        lights = [moved(light, views[0].pose) for light in lights]
        psnr, coverage = likeness(picture, points.render(views, light=lights, camera=seen, pose=views[0].pose @ place))
        assert psnr > 30 and coverage < 0.02
