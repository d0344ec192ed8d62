"""Pictures with ambient occlusion and environments: against the CPU mirror, closed formulas, and what they promise."""

from functools import partial
from itertools import pairwise

import numpy as np
import pytest

import pointshade_gl as ps
from pointshade_gl.estimation.ground import up_and_floor
from pointshade_gl.gpu.shading import occlusion as visibility
from pointshade_gl.pipeline.light_setup import environment_light_of
from pointshade_gl.scene.appearance import Appearance
from pointshade_gl.scene.camera import Eye
from pointshade_gl.scene.environment import Environment
from pointshade_gl.scene.graph import Scene
from pointshade_gl.scene.light import check_lights
from pointshade_gl.scene.node import Node
from pointshade_gl.scene.objects import PointObject
from pointshade_gl.scene.settings import OutputSettings

from ..reference.render import render as mirror_render
from ..support import frames

WHITE = ps.Material(ambient=1, diffuse=1, specular=0)
SUN = ps.Light(direction=(0.4, 1, 0.8), shadow=True)


def gradient(low=0.1):
    """An environment that is bright above, a bit bluer on one side."""
    rows, columns = np.mgrid[:16, :32]
    sky = np.where(rows < 8, 1.4 - rows / 8, low)[..., None] * np.array([0.9, 1, 1])
    return Environment(sky + 0.3 * np.cos(columns / 32 * 2 * np.pi)[..., None] * np.array([0, 0, 1]) + 0.3)


LIT = [
    {"ambient_occlusion": True},
    {"ambient_occlusion": 0.3, "samples": 3, "ground": (0, -1, 0), "background": "white"},
    {"environment": gradient(), "ambient_occlusion": False},
    {"environment": gradient(), "environment_rotation": 40, "environment_intensity": 1.5},
    {"environment": gradient(), "samples": 2, "ground": (0, -1, 0), "background": "white"},
]


@pytest.mark.parametrize(
    ("shading", "options"),
    [(shading, options) for k, options in enumerate(LIT) for shading in ("phong", ("gouraud", "flat")[k % 2])],
    ids=lambda value: value if isinstance(value, str) else " ".join(value),
)
def test_pictures_are_those_of_the_mirror(rasterizer, monkeypatch, shading, options):
    frame, material = frames.sphere(), ps.Material(0.5, 0.6, 0.4, 20)
    pose = ps.orbit_pose(None, frame.pivot, 20, -15)
    monkeypatch.setattr(visibility, "POINTS_ON_CPU", frame.depth.size // 4)
    monkeypatch.setattr(visibility, "POINTS", frame.depth.size // 4)
    finish, look = OutputSettings(**options), Appearance(material, normals="triangles-8", shading=shading)
    actual = rasterizer.render(frame, SUN, material, pose=pose, normals="triangles-8", shading=shading, **options)
    found = np.nan_to_num(rasterizer.estimate_normals(frame, "triangles-8"))
    scene = Scene((Node(PointObject(frame, look=look)),), frame.camera, frame.pose)
    around = environment_light_of(finish, frame, scene, check_lights(SUN), [material], up_and_floor)
    eye = Eye.at_distance(frame.camera, pose, frame.scale)
    more = {"finish": finish, "surroundings": around, "stride": 2}
    mirror = mirror_render(frame, found, [SUN], look, eye, rasterizer.name, **more)
    off = np.abs(actual.astype(int) - mirror).max(-1)
    assert (off <= 2).mean() > 0.99, f"{(off > 2).mean():.2%} differ, by {off.max()}"
    assert np.abs(actual.astype(float) - mirror).mean() < 0.2


def test_nothing_changes_where_it_is_not_wanted(renderer):
    """The default material has a tenth of ambient light: that is not more than a tenth."""
    frame = frames.sphere()
    plain = renderer.render(frame, SUN)
    assert (renderer.render(frame, SUN, ambient_occlusion=False) == plain).all()
    assert (renderer.render(frame, SUN, environment_intensity=3, environment_rotation=20) == plain).all()
    darker = renderer.render(frame, SUN, ambient_occlusion=True)
    assert (darker != plain).any()
    much = ps.Material(ambient=0.5)
    off = renderer.render(frame, SUN, much, ambient_occlusion=False)
    assert (renderer.render(frame, SUN, much) == renderer.render(frame, SUN, much, ambient_occlusion=True)).all()
    assert (renderer.render(frame, SUN, much) != off).any()


def test_lamps_are_never_hidden(renderer):
    frame, only_lamps = frames.sphere(), ps.Material(ambient=0)
    plain = renderer.render(frame, SUN, only_lamps, ambient_occlusion=False)
    assert (renderer.render(frame, SUN, only_lamps, ambient_occlusion=True) == plain).all()


@pytest.mark.parametrize("turned", [0, 25])
def test_a_white_environment_lights_an_open_plane_white(renderer, turned):
    """Also with what hides it looked at: a plane hides nothing of itself."""
    frame = frames.tilted_plane()
    frame = ps.Frame(np.full((*frame.depth.shape, 3), 188, np.uint8), frame.depth, frame.camera)
    options = {"light": [], "material": WHITE, "environment": np.ones((4, 8, 3)), "yaw": turned}
    picture = renderer.render(frame, **options)
    seen = picture[..., :3][picture[..., 3] == 255]
    assert np.abs(seen.astype(int) - 188).max() <= 1
    half = renderer.render(frame, **options, environment_intensity=0.5)[..., :3][picture[..., 3] == 255]
    assert np.abs(half.astype(int) - 137).max() <= 2  # 188 is half of the light, so this is a quarter


def crease(degrees=45.0, size=(120, 90)):
    """Two planes that meet in a level edge, seen from in front: a wall above a floor, both leaning to the viewer."""
    camera = ps.Camera.from_fov(60, *size)
    rays = camera.rays()
    lean, far = np.tan(np.radians(degrees)), 2.0
    depth = far / (1 + np.abs(rays[..., 1]) / lean)
    return ps.Frame(np.full((*depth.shape, 3), 255, np.uint8), depth.astype(np.float32), camera)


def test_a_right_angle_takes_half_of_the_light_at_its_edge(renderer):
    """There each plane hides a quarter of the sphere from the other: the half that it sees weighs half."""
    frame = crease()
    picture = renderer.render(frame, [], ps.Material(1, 0, 0), ambient_occlusion=1.5)[..., 0] / 255
    light = np.where(picture < 0.04, picture / 12.92, ((picture + 0.055) / 1.055) ** 2.4).mean(1)
    rows = len(light)
    assert light[rows // 2 - 3 : rows // 2 + 3].mean() == pytest.approx(0.5, abs=0.08)
    assert light[:6].mean() > 0.8 and light[-6:].mean() > 0.8
    assert (np.diff(light[rows // 2 + 2 : -6 : 4]) > -0.01).all(), "it grows brighter away from the edge"


def test_an_environment_lights_from_its_side(renderer):
    """A sphere under light from above only; turned about up it stays, turned over it is lit from below."""
    frame, half = frames.sphere(), np.zeros((8, 16, 3))
    half[:4] = 1
    shine = partial(renderer.render, frame, [], ps.Material(0, 1, 0), environment=half, ambient_occlusion=False)
    up_down = np.diag([1.0, -1, -1])  # camera axes to y up
    picture = shine(environment_rotation=up_down)[..., 0].astype(float)
    known, rows = frame.depth > 0, np.arange(frame.depth.shape[0])[:, None]
    middle = rows[known.any(1)].mean()
    above, below = known & (rows < middle - 10), known & (rows > middle + 10)
    assert picture[above].mean() > picture[below].mean() + 40
    level = np.diag([1.0, -1, -1]) @ np.array([[0, 0, 1], [0, 1, 0], [-1, 0, 0]])
    assert np.abs(shine(environment_rotation=level)[..., 0] - picture)[known].max() <= 1
    over = shine(environment_rotation=np.diag([1.0, 1, 1]))[..., 0].astype(float)
    assert over[below].mean() > over[above].mean() + 40


def test_one_bright_patch_shines_like_a_lamp_of_its_light(renderer):
    """Of highlights: an environment is many lamps. Its diffuse light is smoother, by spherical harmonics of order 2."""
    frame, patch = frames.sphere(), np.zeros((64, 128, 3))
    row, column = 20, 96  # up to the right, behind the eye
    patch[row, column] = 300
    above, around = np.pi * (0.5 - (row + 0.5) / 64), 2 * np.pi * ((column + 0.5) / 128 - 0.5)
    towards = np.array([np.cos(above) * np.cos(around), np.sin(above), np.cos(above) * np.sin(around)])
    solid = 2 * np.pi / 128 * (np.sin(np.pi * (0.5 - row / 64)) - np.sin(np.pi * (0.5 - (row + 1) / 64)))
    to_sky, shiny = np.diag([1.0, -1, -1]), ps.Material(0, 0, 1, 20)
    lamp = ps.Light(direction=-to_sky.T @ towards, intensity=300 * solid / np.pi)
    by_lamp = renderer.render(frame, lamp, shiny, ambient_occlusion=False)[..., 0].astype(float)
    options = {"environment": patch, "environment_rotation": to_sky, "ambient_occlusion": False}
    by_patch = renderer.render(frame, [], shiny, **options)[..., 0].astype(float)
    known = frame.depth > 0
    assert by_lamp[known].max() > 100
    assert np.abs(by_lamp - by_patch)[known].mean() < 3
    assert abs(by_lamp[known].max() - by_patch[known].max()) < 10


@pytest.mark.parametrize("kind", ["mesh", "set", "grid", "cloud"])
def test_every_kind_of_object_takes_part(renderer, kind):
    """The light from all around is darker in a corner: of frames, meshes and clouds."""
    frame = crease()
    if kind == "mesh":
        board = [(-1, -1, 2), (1, -1, 2), (1, 0, 2), (-1, 0, 2), (-1, 0, 0.5), (1, 0, 0.5)]
        faces = [(0, 1, 2), (0, 2, 3), (3, 2, 5), (3, 5, 4)]
        mesh = ps.Mesh(np.array(board, np.float32), np.array(faces), material=ps.Material(1, 0, 0))
        source = ps.Scene([ps.Node(content=mesh)], frame.camera, ps.orbit_pose(None, (0, 0, 1.7), 0, 20))
        options = {}
    elif kind == "cloud":
        points = frame.camera.unproject(frame.depth).reshape(-1, 3)
        source, options = ps.PointCloud(points, material=ps.Material(1, 0, 0)), {"camera": frame.camera}
    else:
        source = [frame, frame] if kind == "set" else frame
        options = {"material": ps.Material(1, 0, 0)} | ({"splat": "mesh"} if kind == "grid" else {})
    if kind != "mesh":
        options["pose"] = np.eye(4)
    pictures = [renderer.render(source, [], ambient_occlusion=one, **options) for one in (1.0, False)]
    seen = (pictures[0][..., 3] == 255) & (pictures[1][..., 3] == 255)
    shares = [np.where(seen, one[..., 0], 0).astype(float) for one in pictures]
    ratio = shares[0].sum(1) / np.maximum(shares[1].sum(1), 1)
    rows = np.nonzero(seen.sum(1) > 40)[0]
    darkest = rows[np.argmin(ratio[rows])]
    assert ratio[darkest] < 0.85, "the corner is darker"
    assert ratio[rows[-4:]].mean() > ratio[darkest] + 0.1, "away from it there is more light"


def test_a_mesh_darkens_the_frame_on_which_it_stands(renderer):
    """And only nearby; the frame's own part is not counted twice."""
    frame = frames.tilted_plane()
    wall = ps.Frame(np.full((*frame.depth.shape, 3), 255, np.uint8), np.full_like(frame.depth, 2.0), frame.camera)
    corners = np.array([(-0.2, -0.2, 1.6), (0.2, -0.2, 1.6), (0.2, 0.2, 1.6), (-0.2, 0.2, 1.6)], np.float32)
    board = ps.Mesh(corners, np.array([(0, 1, 2), (0, 2, 3)]))
    look = ps.Appearance(ps.Material(1, 0, 0))
    nodes = [ps.Node(content=ps.PointObject(wall, look=look)), ps.Node(content=board)]
    scene = ps.Scene(nodes, wall.camera)
    pose = ps.orbit_pose(None, (0, 0, 2), 35, 0)
    dark = renderer.render(scene, [], pose=pose, ambient_occlusion=0.6)[..., 0].astype(float)
    light = renderer.render(scene, [], pose=pose, ambient_occlusion=False)[..., 0].astype(float)
    alone = renderer.render(ps.Scene(nodes[:1], wall.camera), [], pose=pose, ambient_occlusion=0.6)[..., 0]
    shown = (light == 255) & (alone > 0)
    loss = np.where(shown, 255 - dark, 0)
    assert loss.max() > 12
    assert np.abs(alone[shown].astype(float) - 255).max() <= 2, "a plane hides nothing of itself"
    assert (loss > 3).sum() < 0.6 * shown.sum()


def test_a_film_of_views_does_not_flicker(renderer):
    """What a frame knows of its points turns with them: over small turns they keep their light."""
    frame = crease()
    material, pictures = ps.Material(1, 0, 0), []
    for yaw in np.linspace(-3, 3, 7):
        pictures.append(renderer.render(frame, [], material, yaw=yaw, ambient_occlusion=1.0)[..., 0].astype(float))
    middle = np.s_[20:-20, 30:-30]
    steps = [np.abs(b - a)[middle].mean() for a, b in pairwise(pictures)]
    assert max(steps) < 1.5


def test_exposure_counts_the_light_from_all_around(renderer):
    frame = frames.sphere()
    renderer.render(frame, [], WHITE, environment=np.full((4, 8, 3), 0.25), exposure="auto", ambient_occlusion=False)
    assert renderer.exposure == pytest.approx(2, abs=0.15)


def test_environments_and_their_options_are_checked():
    with pytest.raises(ValueError, match=r"\(h, w, 3\)"):
        ps.OutputSettings(environment=np.ones((4, 8)))
    with pytest.raises(ValueError, match="negative"):
        ps.OutputSettings(environment=-np.ones((4, 8, 3)))
    with pytest.raises(ValueError, match="environment_rotation"):
        ps.OutputSettings(environment_rotation=np.ones((3, 3)))
    with pytest.raises(ValueError, match="ambient_occlusion"):
        ps.OutputSettings(ambient_occlusion=-1)
    with pytest.raises(TypeError, match="ambient_occlusion"):
        ps.OutputSettings(ambient_occlusion="much")


@pytest.mark.parametrize("count", [2, 3])
def test_several_frames_that_agree_see_as_much_as_one(rasterizer, count):
    """The mean of equal visibilities is the same: its sums are added up as those of normals are."""
    frame = crease()
    options = {"light": [], "material": ps.Material(1, 0, 0), "ambient_occlusion": 1.0, "yaw": 10}
    alone, several = rasterizer.render(frame, **options), rasterizer.render([frame] * count, **options)
    seen = (alone[..., 3] == 255) & (several[..., 3] == 255)
    assert seen.mean() > 0.5 and np.ptp(alone[seen][:, 0]) > 40
    assert np.abs(alone[seen].astype(float) - several[seen]).mean() < 1


def test_an_environment_stands_still_over_a_stream(renderer):
    """Of noisy frames of a floor each tells another up; the first of a stream decides, another stream begins anew."""
    rng, rays = np.random.default_rng(2), frames.CAMERA.rays()
    lean = np.array([0, -np.cos(0.6), -np.sin(0.6)])
    depth = np.where(rays @ lean < -0.1, 1 / np.maximum(-(rays @ lean), 0.1), 0)
    found = []
    for stream in ("a", "a", "a", "b"):
        noisy = (depth * (1 + rng.normal(0, 0.004, depth.shape))).astype(np.float32)
        renderer.render(ps.Frame(None, noisy, frames.CAMERA, source=stream), environment="sky", notes=lambda _: None)
        found.append(renderer.surroundings.to_sky)
    assert found[0] == found[1] == found[2] != found[3]
    assert np.array(found[0])[1] @ lean > 0.99, "up is that of the floor"
