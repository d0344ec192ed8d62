"""Pages of point clouds: what they draw, against what `render` draws of the same points, and what they hold of them."""

import base64
import json
import re

import numpy as np
import pytest

import pointshade_gl as ps
from pointshade_gl.page import draw_page
from pointshade_gl.page.page_contents import reduced
from pointshade_gl.renderer.requests import RenderRequest

from ..support import frames
from ..support.browser import altered
from .test_pictures import SHADOW_SIDE, check, check_hurry, drawn, likeness
from .test_pictures import small_shadows as small_shadows
from .test_pictures import test_a_browser_starts as test_a_browser_starts  # first: no page costs more than others
from .test_pictures import test_it_can_draw_what_pages_need as test_it_can_draw_what_pages_need

pytestmark = pytest.mark.gl
browser_test = pytest.mark.browser
LEAST, SMALL = 43, 36  # dB: at an outline a pixel is of this or of that side; small splats have more of it
SIDE = [({"yaw": 25, "pitch": 10, "shadows": True, "lightAt": [-1.0, -0.3]}, [240, 180])]
SUN = ps.Light(direction=(1, 0.6, 0.8), shadow=True)
CAMERA, FEW = ps.Camera.from_fov(45, 320, 240), ps.Camera.from_fov(45, 32, 24)


@pytest.fixture(scope="module")
def points():
    with ps.Renderer(rasterizer="points") as made:
        yield made


def torus(count=6000, seed=5):
    """A coloured torus that lies on its side, y down."""
    around, across = np.random.default_rng(seed).uniform(0, 2 * np.pi, (2, count))
    ring = 1 + 0.4 * np.cos(across)
    at = np.stack([ring * np.cos(around), ring * np.sin(around), 0.4 * np.sin(across)], -1)
    colors = np.stack([np.full(count, 200), 90 + 80 * np.sin(around), 150 + 60 * np.cos(across)], -1).astype(np.uint8)
    return at, colors


def cloud(**look):
    at, colors = torus()
    return ps.PointCloud(at.astype(np.float32), colors=colors, **look)


def scene_of(*contents, light=SUN):
    """The contents and a light before a camera at z -4."""
    pose = np.eye(4)
    pose[2, 3] = -4
    return ps.Scene(tuple(map(ps.Node, (*contents, light))), camera=CAMERA, pose=pose)


def board():
    return ps.Mesh([(-2, -2, 1), (2, -2, 1), (2, 2, 1), (-2, 2, 1)], [(0, 1, 2), (0, 2, 3)], color=(0.6, 0.7, 0.5))


def data_of(page):
    return json.loads(re.search(r'id="data">(.*?)</script>', page)[1])


def bytes_of(page):
    return len(base64.b64decode(re.search(r'id="parts">([^<]*)<', page)[1]))


@browser_test
@pytest.mark.parametrize("count", [0, pytest.param(1, marks=pytest.mark.system)])
def test_a_cloud_of_next_to_nothing_is_shown(browser, renderer, count):
    with browser.shown(draw_page(renderer, ps.PointCloud(np.eye(3)[:count]))) as opened:
        drawn(opened, {})


@pytest.mark.usefixtures("small_shadows")
@browser_test
@pytest.mark.parametrize(
    ("look", "least"),
    [
        ({}, LEAST),
        ({"splat": "ball", "point_size": 0.04}, SMALL),
        ({"splat": "ball", "point_size": "4px"}, SMALL),
        ({"point_size": "3px"}, SMALL),
        ({"shading": "edl"}, LEAST),
        ({"shading": "none"}, LEAST),
        ({"material": ps.Material(0.3, 0.5, 0.6, 8)}, LEAST),
    ],
    ids=str,
)
def test_a_cloud_looks_as_rendered(browser, points, look, least):
    scene = scene_of(cloud(**look), board())
    with browser.shown(altered(draw_page(points, scene), SHADOW_SIDE=SHADOW_SIDE)) as opened:
        check(opened, points, scene, SIDE, least)


@pytest.mark.usefixtures("small_shadows")
@browser_test
@pytest.mark.parametrize("clouds", [1, pytest.param(2, marks=pytest.mark.system)])
def test_clouds_stand_among_meshes_and_frames(browser, points, clouds):
    """Each hides the others and casts its shadow on them."""
    frame = ps.Node(ps.PointObject(frames.sphere()), transform=np.diag([0.9, 0.9, 0.9, 1]) + frames_shift())
    small = np.diag([0.6, 0.6, 0.6, 1.0])
    small[:3, 3] = 0.4, 0.2, -0.6
    scene = scene_of(cloud(), board())
    more = [frame, ps.Node(cloud(splat="ball"), transform=small)][:clouds]
    scene = ps.Scene((*scene.nodes, *more), scene.camera, scene.pose)
    with browser.shown(altered(draw_page(points, scene), SHADOW_SIDE=SHADOW_SIDE)) as opened:
        check(opened, points, scene, SIDE, LEAST)


@pytest.mark.usefixtures("small_shadows")
@browser_test
@pytest.mark.parametrize("shading", ["phong", "flat"])
def test_the_colours_of_a_mesh_are_those_of_its_corners(browser, points, shading):
    colors = np.array([(255, 0, 0), (0, 255, 0), (0, 0, 255), (255, 255, 0)], np.uint8)
    mesh = ps.Mesh(board().positions, board().faces, colors=colors, shading=shading)
    scene = scene_of(cloud(), mesh)
    with browser.shown(altered(draw_page(points, scene), SHADOW_SIDE=SHADOW_SIDE)) as opened:
        check(opened, points, scene, SIDE, LEAST)


def frames_shift():
    shift = np.zeros((4, 4))
    shift[:3, 3] = -0.6, -0.4, -1.5
    return shift


@pytest.mark.usefixtures("small_shadows")
@browser_test
@pytest.mark.parametrize("shading", ["none", "edl"])
def test_a_cloud_alone_begins_as_render_draws_it_and_can_be_lit(browser, points, shading):
    own = cloud(shading=shading, up="z")
    seen = {"yaw": 20, "light": SUN, "camera": CAMERA}
    with browser.shown(altered(draw_page(points, own, **seen), SHADOW_SIDE=SHADOW_SIDE)) as opened:
        assert opened.state["shading"] == shading
        for name in (shading, "phong"):
            expected = points.render(own.styled(shading=name), **seen)
            psnr, coverage = likeness(drawn(opened, {"shading": name})[0], expected)
            assert psnr >= LEAST and coverage <= 0.001


@pytest.mark.usefixtures("small_shadows")
@browser_test
@pytest.mark.parametrize("kind", ["sizes", "georeferenced", "given normals"])
def test_what_points_know_themselves_is_kept(browser, points, kind):
    at, colors = torus()
    chance = np.random.default_rng(8)
    made = {
        "sizes": lambda: ps.PointCloud(at, colors=colors, sizes=chance.uniform(0, 0.1, len(at)), splat="ball"),
        "georeferenced": lambda: ps.PointCloud(at, colors=colors, origin=(637_000, 4_849_000, 120), up="z"),
        "given normals": lambda: ps.PointCloud(at, chance.normal(size=at.shape) + at, colors),
    }[kind]()
    with browser.shown(altered(draw_page(points, made, light=SUN, camera=CAMERA), SHADOW_SIDE=SHADOW_SIDE)) as opened:
        psnr, coverage = likeness(drawn(opened, {})[0], points.render(made, light=SUN, camera=CAMERA))
        assert psnr >= SMALL and coverage <= 0.001


@browser_test
def test_the_edge_of_a_sheet_is_as_sharp_as_rendered(browser, points):
    x, y = np.random.default_rng(4).uniform(-1, 1, (2, 3000))
    sheet = ps.PointCloud(np.stack([x, y, 0.3 * x * y], -1))
    scene = scene_of(sheet)
    page = draw_page(points, scene)
    assert data_of(page)["things"][0]["edges"] > 100
    with browser.shown(page) as opened:
        check(opened, points, scene, [({"yaw": -15}, None)], least=60)


NO_FLOATS = """
  const given = WebGL2RenderingContext.prototype.getExtension;
  WebGL2RenderingContext.prototype.getExtension = function (name) {
    return name === "EXT_float_blend" ? null : given.call(this, name);
  };
"""


@pytest.mark.usefixtures("small_shadows")
@browser_test
def test_where_floats_cannot_be_added_half_floats_are(browser, points):
    scene = scene_of(cloud(), board())
    with browser.shown(altered(draw_page(points, scene), SHADOW_SIDE=SHADOW_SIDE), before=NO_FLOATS) as opened:
        assert opened.page.evaluate("pointshade.drawing.format") == "rgba16f"
        check(opened, points, scene, SIDE, least=36)


SMALL_POINTS = """
  const given = WebGL2RenderingContext.prototype.getParameter;
  WebGL2RenderingContext.prototype.getParameter = function (name) {
    return name === this.ALIASED_POINT_SIZE_RANGE ? new Float32Array([1, 2]) : given.call(this, name);
  };
"""


@pytest.mark.usefixtures("small_shadows")
@browser_test
@pytest.mark.parametrize("splat", ["disc", pytest.param("ball", marks=pytest.mark.system)])
def test_where_the_largest_points_are_small_splats_are_quads(browser, points, splat):
    scene = scene_of(cloud(splat=splat), board())
    with browser.shown(altered(draw_page(points, scene), SHADOW_SIDE=SHADOW_SIDE), before=SMALL_POINTS) as opened:
        assert opened.page.evaluate("pointshade.drawing.clouds.largest") == 2
        check(opened, points, scene, [(SIDE[0][0], [160, 120])], SMALL)
        made = opened.page.evaluate(
            "[...pointshade.drawing.clouds.programs.made.keys()].filter((key) => key.includes('clouds/splat'))"
        )
        assert made and all('"QUADS":1' in key for key in made)


@pytest.mark.usefixtures("small_shadows")
@browser_test
@pytest.mark.parametrize(("look", "most"), [({}, 6), ({"splat": "ball", "point_size": 0.04}, 10)], ids=str)
def test_in_a_hurry_few_points_stand_for_all_and_nothing_of_that_stays(browser, points, look, most):
    with browser.shown(altered(draw_page(points, scene_of(cloud(**look))), SHADOW_SIDE=SHADOW_SIDE)) as opened:
        check_hurry(opened, SIDE[0][0], [160, 120], most)


@browser_test
def test_a_double_click_on_a_cloud_turns_around_its_point(browser, points):
    with browser.shown(draw_page(points, scene_of(cloud()))) as opened:
        ring, hole = opened.page.evaluate("""() => {
          const { width, height } = document.getElementById("picture");
          const [x, y] = [width / 2, height / 2].map(Math.round);
          return [x + Math.round(0.3 * height), x].map((across) => pointshade.drawing.depthAt(across, y));
        }""")
        assert 3 < ring < 4.5 and hole == 0


@pytest.mark.parametrize("count", [0, 1, 2, 3])
def test_few_points_are_a_page(renderer, count):
    page = draw_page(renderer, ps.PointCloud(np.eye(3)[:count]))
    (head,) = data_of(page)["things"]
    assert head["count"] == count


def test_a_point_takes_twelve_bytes_at_most(renderer):
    at, colors = torus(40_000)
    chance = np.random.default_rng(3).integers(0, 40, colors.shape, dtype=np.uint8)
    page = draw_page(renderer, ps.PointCloud(at, colors=colors - chance))
    assert bytes_of(page) <= 12 * 40_000


def test_a_stray_point_does_not_coarsen_the_others(renderer):
    at, _ = torus(2000)
    steps = [
        data_of(draw_page(renderer, ps.PointCloud(some)))["things"][0]["step"] for some in (at, [*at, [1e5, 0, 0]])
    ]
    assert steps[1] == pytest.approx(steps[0], rel=0.1)


def test_large_clouds_are_shown_by_an_even_sample_which_a_note_tells(renderer, capsys):
    at, colors = torus(4000)
    whole = ps.PointCloud(at, colors=colors, sizes=np.ones(4000))
    page = draw_page(renderer, whole, largest=30, camera=FEW)
    (head,) = data_of(page)["things"]
    assert head["count"] == pytest.approx(900, rel=0.1)
    told = capsys.readouterr().err
    sentence = f"of 4 000 points an even sample is drawn, {head['count']} points"
    assert sentence in told and data_of(page)["leftOut"] == [sentence]
    draw_page(renderer, whole, camera=FEW)
    assert "sample" not in capsys.readouterr().err


def test_clouds_of_a_scene_share_what_a_page_may_hold():
    at, colors = torus(4000)
    clouds = [ps.PointCloud(at, colors=colors, sizes=np.ones(4000)), ps.PointCloud(at[:1000], seen_from=(1, 2, 3))]
    request = RenderRequest(ps.Scene((ps.Node(clouds[0]), ps.Node(tuple(clouds)))))
    scene = reduced(request, 2048, 900, 9000).source
    (small,), (again, other) = (node.content for node in scene.nodes)
    assert again is small  # one cloud stays one
    assert len(small) == pytest.approx(400, rel=0.2) and len(other) == pytest.approx(100, rel=0.3)
    assert (small.sizes == np.float32(np.sqrt(10))).all() and (other.seen_from == (1, 2, 3)).all()
    known = {tuple(place): tuple(color) for place, color in zip(at.tolist(), colors.tolist(), strict=True)}
    assert all(
        known[tuple(p)] == tuple(c) for p, c in zip(small.positions.tolist(), small.colors.tolist(), strict=True)
    )


def test_a_page_of_few_pixels_has_all_points(renderer):
    """The picture for browsers without WebGL 2 needs fewer."""
    at, _ = torus(9000)
    (head,) = data_of(draw_page(renderer, ps.PointCloud(at), camera=FEW, largest=2048))["things"]
    assert head["count"] == 9000


@pytest.mark.parametrize("suffix", ["ply", "glb"])
def test_the_command_line_writes_a_page_of_a_cloud(typed, tmp_path, suffix):
    at, colors = torus(500)
    own = ps.PointCloud(at.astype(np.float32), colors=colors, up="y")
    if suffix == "glb":
        ps.save_scene(tmp_path / "torus.glb", ps.Scene((ps.Node(own),)))
    else:
        ps.save_points(tmp_path / "torus.ply", own)
    code, out, _ = typed(f"render torus.{suffix} -o torus.html --picture-size 160x120")
    assert code == 0 and re.match(r"torus.html: a page of 0\.\d\d MB", out)
    (head,) = data_of((tmp_path / "torus.html").read_text(encoding="utf-8"))["things"]
    assert (head["kind"], head["count"]) == ("cloud", 500)


def test_a_notebook_shows_a_cloud(renderer):
    assert data_of(ps.show(cloud()).html)["things"][0]["kind"] == "cloud"
