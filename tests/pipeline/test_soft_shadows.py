"""Lights that are larger than a point, against ray-traced ones: a sphere on a plane."""

from dataclasses import replace

import numpy as np
import pytest

import pointshade_gl as ps
from pointshade_gl.bench.tracing import as_frame, decode, encode, patch, sphere, trace

from ..benchmarks.traced_light import shade
from ..support.drivers import need_compute
from ..truth.measures import occluder

CENTRE, RADIUS = (0, 0.1, 1.6), 0.3
CAMERA, POSE = ps.Camera.from_fov(50, 160, 120), ps.orbit_pose(None, (0, 0.2, 1.6), 0, 25)
MATTE = ps.Material(ambient=0, diffuse=1, specular=0)
FLOOR = (0, 0.4, 1.6), (1.2, 0, 0), (0, 0, 1.2)
BALL = ps.Light(position=(-0.6, -1.2, 1), radius=0.2, shadow=True)
SUN = ps.Light(direction=(0.5, 1, 0.3), angle=12, shadow=True)
POINT = {"radius": 0.0, "angle": 0.0, "size": None}
AREA = ps.Light((-0.3, -0.7, 1.2), (0.2, 1, 0.3), size=(0.6, 0.2), watts=9, shadow=True)


def grey(points):
    return np.full(points.shape, 0.6)


SURFACES = [sphere(CENTRE, RADIUS, grey), patch(*FLOOR, grey)]


def sphere_mesh(count=48):
    """As a globe: rings of `count` corners from pole to pole."""
    down, round_ = np.linspace(0, np.pi, count // 2 + 1)[:, None], np.linspace(0, 2 * np.pi, count + 1)[:-1]
    way = np.stack(np.broadcast_arrays(np.sin(down) * np.cos(round_), np.cos(down), np.sin(down) * np.sin(round_)), -1)
    first = np.arange(way[:-1, :, 0].size)
    right = first // count * count + (first + 1) % count
    faces = np.concatenate(
        [np.stack([first, right, first + count], -1), np.stack([right, right + count, first + count], -1)]
    )
    way = way.reshape(-1, 3)
    return ps.Mesh(way * RADIUS + CENTRE, faces, normals=way, color=(0.6,) * 3)


def floor_mesh():
    centre, u, v = map(np.array, FLOOR)
    corners = [centre + a * u + b * v for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
    return ps.Mesh(corners, [(0, 1, 2), (0, 2, 3)], color=(0.6,) * 3)


def points_of(light, count=60):
    """Lights without size that fill it: a rectangle in rows, or a disc to the sphere in a spiral (Vogel 1979)."""
    if light.is_area:
        along = np.array(light.direction) / np.linalg.norm(light.direction)
        x = np.cross((0, 1, 0), along) / np.linalg.norm(np.cross((0, 1, 0), along))
        a, b = ((np.arange(n) + 0.5) / n - 0.5 for n in (12, 5))
        places = np.stack(np.meshgrid(a * light.size[0], b * light.size[1]), -1).reshape(-1, 2)
        return [replace(light, position=light.position + p @ np.stack([x, np.cross(along, x)])) for p in places]
    area, turn = (np.arange(count) + 0.5) / count, np.pi * (3 - 5**0.5) * np.arange(count)
    disc = np.sqrt(area) * np.array([np.cos(turn), np.sin(turn)])
    towards = np.subtract(CENTRE, light.position) if light.position else np.array(light.direction)
    towards = towards / np.linalg.norm(towards)
    x = np.cross(towards, (0, 0, 1)) / np.linalg.norm(np.cross(towards, (0, 0, 1)))
    off = disc.T @ np.stack([x, np.cross(towards, x)])
    if light.position:
        return [replace(light, position=tuple(light.position + light.radius * o), radius=0) for o in off]
    far = np.tan(np.radians(light.angle) / 2)
    return [replace(light, direction=tuple(towards + far * o), angle=0) for o in off]


def traced(light):
    """(h, w, 3) sRGB, 0 to 255, and where the floor is seen."""
    hits, total = trace(SURFACES, CAMERA, POSE), 0
    lights = points_of(light)
    for one in lights:
        total = total + shade(hits, one, ps.Material(), POSE[:3, 3], occluder(hits, one, SURFACES)[0]) / len(lights)
    return encode(total), hits.surface == 1


def psnr(image, truth, where):
    return 10 * np.log10(255**2 / ((np.asarray(image[..., :3], float) - truth)[where] ** 2).mean())


@pytest.mark.parametrize(
    "light", [pytest.param(BALL, marks=pytest.mark.system), SUN, AREA], ids=["ball", "sun", "area"]
)
def test_the_shadow_of_a_sphere_on_a_plane_is_that_of_a_light_of_this_size(renderer, light):
    scene = ps.Scene((ps.Node(sphere_mesh()), ps.Node(floor_mesh())), CAMERA, POSE)
    truth, floor = traced(light)
    image = renderer.render(scene, light, samples=32)
    alone = floor & (image[..., 3] == 255)  # beside outlines
    assert psnr(image, truth, alone) >= 44
    one, hard = (renderer.render(scene, lamp) for lamp in (light, replace(light, **POINT)))
    assert psnr(one, truth, alone) >= psnr(hard, truth, alone) + 3  # with one sample it is soft already
    few = renderer.render(scene, light, samples=4)
    assert psnr(few, truth, alone) >= 35


def test_the_shadow_of_leaves_under_a_wide_light_shows_no_strokes(renderer):
    """Each sample blurs as far as its part of the light is wide: sharper shadows would lie side by side."""
    rng, sun = np.random.default_rng(4), ps.Light(direction=(0.5, 1, 0.3), angle=40, shadow=True)
    middle, turn = rng.uniform((-0.3, -0.3, 1.4), (0.3, -0.1, 1.9), (14, 3)), rng.uniform(0, np.pi, 14)
    way = np.stack([np.cos(turn), 0 * turn, np.sin(turn)], -1)
    side = np.cross(way, (0, 1, 0))
    corners = np.stack([middle + a * way + b * side for a, b in ((-0.12, 0), (0, -0.03), (0.12, 0), (0, 0.03))], 1)
    faces = np.array([(0, 1, 2), (0, 2, 3)]) + 4 * np.arange(14)[:, None, None]
    leaves = ps.Mesh(corners.reshape(-1, 3), faces.reshape(-1, 3))
    scene, floor = ps.Scene((ps.Node(leaves), ps.Node(floor_mesh())), CAMERA, POSE), np.zeros((120, 160), bool)
    floor[62:115, 40:130] = True  # below all leaves
    one, few, many = (renderer.render(scene, sun, samples=n) for n in (1, 4, 256))
    truth = np.asarray(many[..., :3], float)
    assert truth[floor].min() < 170
    assert psnr(one, truth, floor) >= 31 and psnr(few, truth, floor) >= 35


@pytest.mark.parametrize("shadow", [False, True])
def test_an_area_light_shines_by_the_cosine_and_from_its_front_only(renderer, shadow):
    wall = ps.Mesh([(-9, -3, 2), (9, -3, 2), (9, 3, 2), (-9, 3, 2)], [(0, 1, 2), (0, 2, 3)], material=MATTE)
    camera, angle = ps.Camera(20, 20, 39.5, 0, 80, 1), np.radians(40)
    aimed = np.array((np.sin(angle), 0, np.cos(angle)))
    lamp = ps.Light((0, 0, 1), aimed, size=(0.01, 0.01), intensity=0.9, shadow=shadow)
    (image,) = renderer.render(ps.Scene((ps.Node(wall),), camera), lamp)
    ray = np.stack([(np.arange(80) - 39.5) / 20 * 2, np.zeros(80), np.ones(80)], -1)  # from the lamp to the wall
    ray /= np.linalg.norm(ray, axis=-1, keepdims=True)
    expected = encode(0.9 * ray[:, 2] * np.maximum(ray @ aimed, 0))
    np.testing.assert_allclose(image[:, 0], expected, atol=0.6)
    assert (image[:8, 0] == 0).all() and (image[:, 3] == 255).all() and image[:, 0].max() > 200


def test_points_cast_and_receive_soft_shadows(renderer):
    frame = as_frame(trace(SURFACES, CAMERA, POSE), CAMERA, POSE)
    truth, floor = traced(BALL)
    assert psnr(renderer.render(frame, BALL, samples=32), truth, floor) >= 38


def test_both_rasterizers_shade_a_plane_alike_that_their_light_grazes(renderer):
    """The far floor's points are large and steep splats in the light's view: their tilt counts."""
    need_compute(renderer)
    frame = as_frame(trace(SURFACES, CAMERA, POSE), CAMERA, POSE)
    with ps.Renderer(rasterizer="points") as points, ps.Renderer(rasterizer="compute") as compute:
        own, other = (r.render(frame, BALL, samples=3) for r in (points, compute))
    assert psnr(own, np.asarray(other[..., :3], float), frame.depth > 0) >= 50


def test_penumbrae_grow_with_the_distance_of_what_casts_them(renderer):
    """A straight edge over a floor, in slanting light: it ends where the light's two rims, 10 degrees off, end it."""
    sun, wide = (
        ps.Light(direction=(1, 1, 0), angle=20, shadow=True, intensity=0.7),
        np.tan(np.radians([55, 35])) @ (1, -1),
    )
    pose, camera = ps.orbit_pose(None, (0, 0, 2), 0, 60), ps.Camera(200, 200, 99.5, 9.5, 200, 20)
    for height in (0.1, 0.2, 0.4):
        scene = ps.Scene((ps.Node(flat((-2, 2), 0)), ps.Node(flat((-2, 0), -height))), camera, pose)
        picture = renderer.render(scene, sun, samples=32, ambient_occlusion=False)
        light = np.asarray(picture[10, 100:, 0], float)
        share = (decode(light) - decode(light.min())) / (decode(light.max()) - decode(light.min()))
        assert ((share > 0.02) & (share < 0.98)).sum() / 100 == pytest.approx(wide * height, rel=0.2, abs=0.02)


def flat(x, y):
    """A horizontal mesh between two x, at a y; no corner exactly beside the viewer, where SwiftShader divides by 0."""
    corners = [(x[0], y, -2.1), (x[1], y, -2.1), (x[1], y, 6), (x[0], y, 6)]
    return ps.Mesh(corners, [(0, 1, 2), (0, 2, 3)], material=ps.Material(specular=0))


@pytest.mark.parametrize(
    ("values", "complaint"),
    [
        ({"position": (0, 0, 0), "angle": 1}, "a light with a position has a radius"),
        ({"direction": (0, 0, 1), "radius": 1}, "a directional light has an angle"),
        ({"position": (0, 0, 0), "radius": -1}, "light radius must be a number from 0"),
        ({"angle": 121}, "light angle must be a number from 0 to 120"),
    ],
)
def test_impossible_sizes_of_lights_are_named(values, complaint):
    with pytest.raises(ValueError, match=complaint):
        ps.Light(**values)


@pytest.mark.parametrize("away", [1e6, 1e18])
@pytest.mark.parametrize("angle", [0.0, 2.0])
def test_a_lamp_at_any_distance_lights_and_shades_as_the_sun_does(renderer, away, angle):
    frame, direction = as_frame(trace(SURFACES, CAMERA, POSE), CAMERA, POSE), np.array((0.48, 0.8, 0.36))
    samples, radius = 4 if angle else 1, away * np.tan(np.radians(angle / 2))
    lamp = ps.Light(position=tuple(-away * direction), radius=radius, shadow=True)
    sun = ps.Light(direction=direction, angle=angle, shadow=True)
    shaded, expected, unshaded = (
        renderer.render(frame, light=light, samples=samples)[..., :3].astype(int)
        for light in (lamp, sun, replace(sun, shadow=False))
    )
    assert np.abs(expected - unshaded).mean() > 2
    assert np.abs(shaded - expected).mean() < 0.3
