"""Compares each function of shaders/common with its mirror, on random arguments."""

import importlib

import numpy as np
import pytest

from ..reference import (
    camera,
    color,
    inverse_depth,
    lights,
    phong,
    picture,
    shadow,
    shadowed_lights,
    splat,
    texels,
    tone,
)
from ..reference import (
    depth_lookup as look_up,
)
from ..support.shader_function import COMMON, functions_of

F = np.float32
COUNT = 500
K = np.array([520.0, -480.0, 310.0, 250.0], F)
TARGET = np.array([400.0, 410.0, 200.0, 150.0], F)


def turned(degrees=(10.0, -20.0, 5.0), shift=(0.1, -0.2, 0.3)):
    x, y, z = np.radians(degrees)
    rx = np.array([[1, 0, 0], [0, np.cos(x), -np.sin(x)], [0, np.sin(x), np.cos(x)]])
    ry = np.array([[np.cos(y), 0, np.sin(y)], [0, 1, 0], [-np.sin(y), 0, np.cos(y)]])
    rz = np.array([[np.cos(z), -np.sin(z), 0], [np.sin(z), np.cos(z), 0], [0, 0, 1]])
    view = np.eye(4, dtype=F)
    view[:3, :3], view[:3, 3] = rx @ ry @ rz, shift
    return view


VIEW = turned()
VIEW_GLSL = "mat4(" + ", ".join(f"{x:.9g}" for x in VIEW.T.ravel()) + ")"


@pytest.fixture
def draw():
    """Seeded random arguments: directions, points, numbers."""
    rng = np.random.default_rng(3)

    class Draw:
        def numbers(self, low, high, n=1):
            return rng.uniform(low, high, (COUNT, n)).astype(F)

        def directions(self):
            v = rng.normal(size=(COUNT, 3))
            return (v / np.linalg.norm(v, axis=1, keepdims=True)).astype(F)

        def facing(self, ray):
            n = self.directions()
            return np.where((n * ray).sum(-1, keepdims=True) > 0, -n, n)

    return Draw()


def agree(gpu_answer, mirror, atol=1e-5, rtol=1e-5):
    mirror = np.asarray(mirror).reshape(COUNT, -1)
    np.testing.assert_allclose(gpu_answer[:, : mirror.shape[1]], mirror, atol=atol, rtol=rtol)


@pytest.mark.parametrize("path", COMMON, ids=lambda path: path.stem)
def test_every_shader_function_has_a_mirror_of_the_same_name(path):
    names = functions_of(path)
    mirror = importlib.import_module(f"tests.reference.{path.stem}")
    assert names, f"{path.name} holds no function"
    assert [name for name in names if not hasattr(mirror, name)] == []


def test_pixel_ray_and_project(gpu, draw):
    pixel, z = draw.numbers(-50, 700, 2), draw.numbers(0.5, 4)
    agree(gpu("camera.glsl", "pixel_ray(p, k), 0", p=pixel, k=K[None]), camera.pixel_ray(pixel, K))
    point = camera.pixel_ray(pixel, K) * z
    agree(gpu("camera.glsl", "project(p, k), 0, 0", p=point, k=K[None]), camera.project(point, K), atol=1e-3)


def test_srgb_curves(gpu, draw):
    rgb = draw.numbers(0, 1, 3)
    agree(gpu("color.glsl", "srgb_to_linear(c), 0", c=rgb), color.srgb_to_linear(rgb))
    agree(gpu("color.glsl", "linear_to_srgb(c), 0", c=rgb), color.linear_to_srgb(rgb))


def test_srgb_curves_are_a_fraction_of_an_8_bit_step_from_the_standard():
    encoded = np.linspace(0, 1, 4096)[:, None]
    linear = np.where(encoded < 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)
    assert np.abs(color.linear_to_srgb(linear.astype(F)) - encoded).max() < 0.0125 / 255
    slope = np.gradient(linear[:, 0], encoded[:, 0])[:, None]
    assert (np.abs(color.srgb_to_linear(encoded.astype(F)) - linear) / slope).max() < 0.0135 / 255


def test_srgb_curves_bring_every_8_bit_step_back():
    steps = np.arange(256, dtype=F)[:, None]
    assert (np.round(color.linear_to_srgb(color.srgb_to_linear(steps / 255)) * 255) == steps).all()


def test_attenuation(gpu, draw):
    d, k = draw.numbers(0.1, 5), np.array([[1, 0.5, 0.2]], F)
    agree(gpu("phong.glsl", "attenuation(d, k)", d=d, k=k), phong.attenuation(d, k[0]))


@pytest.mark.parametrize("specular", [0.0, 0.3])
def test_phong(gpu, draw, specular):
    n, v, to_light, albedo = draw.directions(), draw.directions(), draw.directions(), draw.numbers(0, 1, 3)
    m, light = np.array([0.1, 0.9, specular, 32], F), np.array([1, 0.5, 0.2], F)
    answer = gpu("phong.glsl", "phong(n, v, l, c, m, e), 0", n=n, v=v, l=to_light, c=albedo, m=m[None], e=light[None])
    agree(answer, phong.phong(n, v, to_light, albedo, m, light), atol=2e-5)


def test_phong_of_a_lit_mirror_direction_is_the_formula_worked_by_hand():
    up = np.array([[0, 0, -1]], F)
    answer = phong.phong(up, up, up, np.full((1, 3), 0.5, F), np.array([0.1, 0.9, 0.3, 32], F), np.ones(3, F))
    assert answer == pytest.approx(0.9 * 0.5 + 0.3)


def test_light_surface_with_a_point_a_directional_and_a_touching_light(gpu, draw):
    points = camera.pixel_ray(draw.numbers(0, 400, 2), TARGET) * draw.numbers(0.5, 3)
    points[0] = (0.25, 0.5, 1)
    n, albedo = draw.facing(points), draw.numbers(0, 1, 3)
    rows = np.zeros((3, 3, 4), F)
    rows[0, 0], rows[0, 1, :3], rows[0, 2, :3] = (-1, -1, 0, 1), (1, 0.9, 0.8), (1, 0.1, 0.1)
    rows[1, 0], rows[1, 1, :3] = (1, 1, 2, 0), (0.2, 0.2, 0.4)
    rows[2, 0], rows[2, 1, :3], rows[2, 2, :3] = (0.25, 0.5, 1, 1), (0.5, 0.5, 0.5), (1, 0, 0)
    m = np.array([0.1, 0.9, 0.3, 32], F)
    eye = np.array([[0.1, -0.2, 0.3]], F)
    inputs = {"p": points, "e": eye, "n": n, "c": albedo, "m": m[None]}
    answer = gpu("lights.glsl", "light_surface(p, e, n, c, m, vec3(1), rows_map, 3), 0", **inputs, rows_map=rows)
    agree(answer, lights.light_surface(points, eye[0], n, albedo, m, np.ones(3, F), rows, 3), atol=3e-5)
    for row in rows:
        only = "mat4(" + ", ".join(f"{x:.9g}" for x in row.ravel()) + ", 0, 0, 0, 0)"
        answer = gpu("lights.glsl", f"light_surface_alone(p, e, n, c, m, vec3(1), {only}), 0", **inputs)
        agree(answer, lights.light_surface_alone(points, eye[0], n, albedo, m, np.ones(3, F), row), atol=3e-5)


SIDE, LIGHT_NEAR, CONTACT = 64, 0.5, 0.01


def light_views(turns=(VIEW,), spread=0, farther=(0, 0, 0, 0)):
    """Views of lights as shaders read them, (n, 6, 4), their tiles side by side; `turns` take points to their axes.
    spread: pixels that a shadow blurs for a unit of 1/z; farther: of a point, where noise is larger."""
    rows = np.zeros((len(turns), 6, 4), F)
    for k, (row, turn) in enumerate(zip(rows, turns, strict=True)):
        row[:3], row[3], row[4] = turn[:3], (40, 31.5, k * SIDE, 0), (LIGHT_NEAR, SIDE, CONTACT, spread)
        row[5] = farther
    return rows


def occluders(tiles=1):
    """A shadow map of random depths between 0.6 and 3, a quarter of it empty."""
    rng = np.random.default_rng(5)
    z = rng.uniform(0.6, 3, (SIDE, tiles * SIDE)).astype(F)
    return np.where(rng.random(z.shape) < 0.25, F(1), F(1) - F(LIGHT_NEAR) / z).astype(F)


def test_occluder_at_is_0_where_nothing_is_and_below_outside_its_tile(gpu, draw):
    depth, pixel = occluders(2), np.floor(draw.numbers(-4, SIDE + 4, 2))
    tile, reach = np.array([40, 31.5, SIDE, 0], F), np.array([LIGHT_NEAR, SIDE, CONTACT, 0], F)
    call = "occluder_at(shadow_map, p, t, r)"
    answer = gpu("shadow.glsl", call, p=pixel, t=tile[None], r=reach[None], shadow_map=depth)
    expected = shadow.occluder_at(depth, pixel, tile, reach)
    agree(answer, expected)
    inside = ((pixel >= 0) & (pixel < SIDE)).all(-1)
    assert (expected[~inside] == -1).all() and 0.6 < (expected[inside] > 0).mean() < 0.9


def test_tent_weighs_three_pixels_by_one_in_all(gpu, draw):
    offset = draw.numbers(-0.5, 0.5)
    weights = shadow.tent(offset[:, 0])
    agree(gpu("shadow.glsl", "tent(o), 0", o=offset), weights)
    assert weights.sum(-1) == pytest.approx(1) and (weights >= 0).all()
    assert (weights * (-1, 0, 1)).sum(-1) == pytest.approx(offset[:, 0], abs=1e-6)  # the middle of the three is there


def test_light_share(gpu, draw):
    turns = VIEW, turned((-15, 10, 80), (-0.2, 0.1, 0.5))
    depth, views = occluders(2), light_views(turns, farther=(0.1, 0.2, 0.9, 0.05))
    points, n = camera.pixel_ray(draw.numbers(-100, 500, 2), TARGET) * draw.numbers(0.1, 3), draw.directions()
    n[:9] = (0, 0, 1)
    for row in (0, 1):
        call = f"light_share(shadow_map, views_map, {row}, p, n)"
        answer = gpu("shadow.glsl", call, p=points, n=n, shadow_map=depth, views_map=views)
        expected = shadow.light_share(depth, views, row, points, n)
        agree(answer, expected)
        assert (expected == 0).any() and (expected == 1).any() and (expected % 1 > 0).mean() > 0.2


@pytest.mark.parametrize("spread", [3, 12, 60])
def test_light_share_of_a_light_larger_than_a_point(gpu, draw, spread):
    turns = VIEW, turned((-15, 10, 80), (-0.2, 0.1, 0.5))
    depth, views = smooth_occluders(), light_views(turns, spread, (0.1, 0.2, 0.9, 0))
    points, n = camera.pixel_ray(draw.numbers(-100, 500, 2), TARGET) * draw.numbers(0.1, 3), draw.directions()
    for row in (0, 1):
        call = f"light_share(shadow_map, views_map, {row}, p, n)"
        answer = gpu("shadow.glsl", call, p=points, n=n, shadow_map=depth, views_map=views, SHADOWS=2)
        expected = shadow.light_share(depth, views, row, points, n)
        same = np.abs(answer[:, 0] - expected[:, 0]) < 1e-3
        assert same.mean() > 0.97  # a position between two pixels may be rounded to either
        assert (expected == 0).any() and (expected == 1).any() and (expected % 1 > 0).mean() > 0.2


def smooth_occluders():
    """A shadow map of two tiles: a ball and a strip between 1 and 2, over nothing."""
    u, v = np.meshgrid(np.arange(2 * SIDE) % SIDE, np.arange(SIDE))
    z = np.where(np.hypot(u - 24, v - 30) < 16, 1 + 0.001 * u, np.where(np.abs(u - 50) < 5, 2.0, np.inf))
    return (F(1) - F(LIGHT_NEAR) / z).astype(F)


@pytest.mark.parametrize("spread", [8, 24, 30])
def test_light_share_past_a_straight_edge_is_that_of_a_disc(spread):
    """Half of a plane at 1 before one at 2: along its shadow's rim the light is the open segment of a disc."""
    u = np.arange(SIDE)
    depth = np.broadcast_to(np.where(u < 32, F(1 - LIGHT_NEAR), F(1)), (SIDE, SIDE))
    blur, at = spread / 2, np.linspace(16, 47, 200)
    points = np.stack([(at - 31.5) / 40, np.zeros(200), np.ones(200)], -1).astype(F) * 2
    eye = light_views((np.eye(4, dtype=F),), spread)
    share = shadow.light_share(depth, eye, 0, points, np.broadcast_to(np.array((0, 0, -1), F), points.shape))[:, 0]
    t = np.clip((at - 31.5) / blur, -1, 1)
    expected = 1 - (np.arccos(t) - t * np.sqrt(1 - t * t)) / np.pi
    assert np.abs(share - expected).mean() < 0.035 and np.abs(share - expected).max() < 0.16


@pytest.mark.parametrize("spread", [0, 20])
def test_light_share_of_a_slanted_plane_in_its_own_shadow_is_1_and_behind_a_wall_0(spread):
    """The plane as a shadow map sees it, 24 bits deep; then moved away from the light, by more than the contact."""
    eye, n = light_views((np.eye(4, dtype=F),), spread), np.array([0.8, 0.3, -0.5], F) / F(np.sqrt(0.98))
    u, v = np.meshgrid(np.arange(SIDE), np.arange(SIDE))
    rays = np.stack([(u - 31.5) / 40, (v - 31.5) / 40, np.ones(u.shape)], -1)
    w = np.maximum(rays @ n / (np.array([0, 0, 2]) @ n), 0.05)  # 1/z
    depth = (np.round((1 - LIGHT_NEAR * w) * (2**24 - 1)) / (2**24 - 1)).astype(F)
    inside = np.pad(np.ones((SIDE - 2, SIDE - 2), bool), 1)  # outside the picture nothing is in the way
    on_it = (inside & (w > 0.15) & (w < 1.3)).nonzero()
    points = (rays / w[..., None])[on_it].astype(F)
    normals = np.broadcast_to(n, points.shape)
    assert (shadow.light_share(depth, eye, 0, points, normals) == 1).all()
    behind = shadow.light_share(depth, eye, 0, points - F(0.1) * n, normals)
    assert (behind == 0).mean() > 0.9
    assert (shadow.light_share(np.ones_like(depth), eye, 0, points, normals) == 1).all()


def test_cube_face(gpu, draw):
    direction = draw.directions()
    direction[:6] = [(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1)]
    direction[6:9] = [(1, 1, 1), (-1, -1, -1), (0, 1, 1)]
    faces = shadow.cube_face(direction)
    agree(gpu("shadow.glsl", "cube_face(d)", d=direction), faces)
    assert faces[:9].tolist() == [0, 1, 2, 3, 4, 5, 0, 1, 2]


def test_spot_cone(gpu, draw):
    direction, l = draw.directions(), draw.directions()  # noqa: E741
    cosines = np.array([0.8, 0.1], F)
    answer = gpu("lights.glsl", "spot_cone(d, l, c)", d=direction, l=l, c=cosines[None])
    expected = lights.spot_cone(direction, l, cosines)
    agree(answer, expected)
    assert (expected[(direction * -l).sum(-1) > 0.81] == 1).all()
    assert (expected[(direction * -l).sum(-1) < 0.09] == 0).all()
    sharp = lights.spot_cone(direction, l, np.array([0.5, 0.5], F))
    agree(gpu("lights.glsl", "spot_cone(d, l, vec2(0.5))", d=direction, l=l), sharp, atol=1e-3)


def test_shadowed_lights_of_each_kind_of_light(gpu, draw):
    """Directional, point, spot, a light inside the surface, area; all but the fourth with shadows, then without."""
    points = camera.pixel_ray(draw.numbers(0, 400, 2), TARGET) * draw.numbers(0.5, 3)
    points[0] = (0.25, 0.5, 1)
    n, albedo = draw.facing(points), draw.numbers(0, 1, 3)
    to_world = turned((40, 10, -20))[:3, :3]
    views, depth = light_views([turned((a, b, 0)) for a in (5, -10) for b in (0, 15, -20, 90)]), occluders(8)
    rows = np.zeros((5, 5, 4), F)
    rows[:, 2, 0], rows[:, 3, 3], rows[:, 4, 2] = 1, -1, 1
    rows[0, 0], rows[0, 1, :3], rows[0, 3, 3] = (1, 1, 2, 0), (0.2, 0.2, 0.4), 0
    rows[1, 0], rows[1, 1, :3], rows[1, 2, :3] = (-1, -1, 0, 1), (1, 0.9, 0.8), (1, 0.1, 0.1)
    rows[1, 3, 3], rows[1, 4, 2] = 1, 6
    rows[2, 0], rows[2, 1, :3], rows[2, 3], rows[2, 4] = (
        (1, -1, 0, 1),
        (0.5, 0.5, 0.2),
        (0, 0.6, 0.8, 7),
        (0.9, 0.5, 1, 0),
    )
    rows[3, 0], rows[3, 1, :3] = (0.25, 0.5, 1, 1), (0.5, 0.5, 0.5)
    rows[4, 0], rows[4, 1, :3], rows[4, 2, :3] = (-0.5, -0.4, 0.5, 1), (0.3, 0.9, 0.5), (0, 0, 1)
    rows[4, 3], rows[4, 4] = (0.6, 0, 0.8, 1), (1, 0.7, 6, 1)
    m, ambient = np.array([0.1, 0.9, 0.3, 32], F), np.array([0.5, 0.7, 0.9], F)
    eye = np.array([[0.1, -0.2, 0.3]], F)
    turn = "mat3(" + ", ".join(f"{x:.9g}" for x in to_world.T.ravel()) + ")"
    call = f"light_surface_shadowed(p, e, n, c, m, a, rows_map, 5, shadow_map, views_map, {turn}), 0"
    found = []
    for _ in range(2):
        inputs = {"m": m[None], "a": ambient[None], "rows_map": rows, "shadow_map": depth, "views_map": views}
        answer = gpu("shadowed_lights.glsl", call, p=points, e=eye, n=n, c=albedo, **inputs)
        found.append(
            shadowed_lights.light_surface_shadowed(
                points, eye[0], n, albedo, m, ambient, rows, 5, depth, views, to_world
            )
        )
        agree(answer, found[-1], atol=3e-5)
        rows[:, 3, 3] = -1
    assert (found[0] <= found[1]).all() and (found[0] < found[1]).any(-1).mean() > 0.2


def test_neutral_tone(gpu, draw):
    light = draw.numbers(0, 1, 3) * 10 ** draw.numbers(-2, 4)
    light[:100] = light[:100, :1]
    light[0], light[1], light[2] = (np.inf, 1, 0), (0.8, 0.04, 0.04), 0
    answer = gpu("tone.glsl", "neutral_tone(light), 0", light=light)
    agree(answer, tone.neutral_tone(light))
    assert (answer >= 0).all() and (answer <= 1).all()


def test_depth_outside_the_picture_is_missing(gpu):
    depth = np.random.default_rng(1).uniform(1, 2, (15, 20)).astype(F)
    v, u = np.mgrid[0:15, 0:20]
    pixel = np.stack([u.ravel(), v.ravel()], -1).astype(F)
    for offset in ((0, 0), (-3, 1), (2, -4), (0, 15)):
        answer = gpu("texels.glsl", f"depth_at(depth_map, ivec2(p), ivec2{offset})", p=pixel, depth_map=depth)
        mirror = texels.depth_at(depth, inverse_depth.pixel_grid(depth), offset)
        assert (answer[:, 0] == mirror.ravel()).all()


def test_sample_picture_and_rescale_position(gpu, draw):
    colors = np.random.default_rng(1).random((5, 7, 4)).astype(F)
    position = draw.numbers(-1, 8, 2)
    position[:50] = np.floor(position[:50])
    answer = gpu("picture.glsl", "sample_picture(color_map, p), 0", p=position, color_map=colors)
    agree(answer, picture.sample_picture(colors, position))
    sizes = np.array([[7, 5]], F), np.array([[70, 15]], F)
    answer = gpu("picture.glsl", "rescale_position(p, a, b), 0, 0", p=position, a=sizes[0], b=sizes[1])
    agree(answer, picture.rescale_position(position, sizes[0][0], sizes[1][0]))


def test_sample_sharply(gpu, draw):
    colors = np.random.default_rng(1).random((5, 7, 4)).astype(F)
    position = draw.numbers(-1, 8, 2)
    position[:50] = np.floor(position[:50])
    answer = gpu("picture.glsl", "sample_sharply(color_map, p), 0", p=position, color_map=colors)
    agree(answer, picture.sample_sharply(colors, position))
    share = draw.numbers(0, 1)
    weights = picture.cubic_weights(share[:, 0])
    agree(gpu("picture.glsl", "cubic_weights(s)", s=share), weights)
    np.testing.assert_allclose(weights.sum(-1), 1, atol=1e-6)
    between = np.array([[2, 3], [2.5, 2.25]], F)
    np.testing.assert_allclose(picture.sample_sharply(colors, between[:1])[0], colors[3, 2, :3], atol=1e-6)
    slanted = np.broadcast_to(np.linspace(0.2, 0.8, 7, dtype=F)[None, :, None], (5, 7, 4))
    np.testing.assert_allclose(picture.sample_sharply(slanted, between[1:])[0], 0.45, atol=1e-6)


def test_picture_at_scales_the_position(gpu, draw):
    colors, size = np.random.default_rng(1).random((5, 7, 4)).astype(F), np.array([[14, 20]], F)
    position = draw.numbers(-1, 20, 2)
    answer = gpu("picture.glsl", "picture_at(color_map, p, s), 0", p=position, s=size, color_map=colors)
    agree(answer, picture.picture_at(colors, position, size[0]))


def carried(draw):
    pixel, z = draw.numbers(0, 600, 2), draw.numbers(0.5, 4)
    normal = draw.facing(camera.pixel_ray(pixel, K))
    return pixel, z, normal, splat.carry_footprint(pixel, z[:, 0], normal, K, VIEW, TARGET)


def test_inverse_depth_slope(gpu, draw):
    pixel, z, normal, _ = carried(draw)
    ray = camera.pixel_ray(pixel, K)
    answer = gpu("splat.glsl", "inverse_depth_slope(n, r, z, k), 0, 0", n=normal, r=ray, z=z, k=K[None])
    agree(answer, splat.inverse_depth_slope(normal, ray, z[:, 0], K))


def test_carry_footprint(gpu, draw):
    pixel, z, normal, mirror = carried(draw)
    call = f"carry_footprint(p, z, n, k, {VIEW_GLSL}, t)"
    inputs = {"p": pixel, "z": z, "n": normal, "k": K[None], "t": TARGET[None]}
    agree(gpu("splat.glsl", f"{call}.to_target", **inputs), mirror.to_target, atol=1e-3, rtol=1e-3)
    agree(gpu("splat.glsl", f"{call}.centre, 0, 0", **inputs), mirror.centre, atol=2e-3)
    agree(gpu("splat.glsl", f"{call}.inverse_depth", **inputs), mirror.inverse_depth)
    agree(gpu("splat.glsl", f"{call}.tilt, 0, 0", **inputs), mirror.tilt, atol=1e-5, rtol=1e-3)


def test_a_footprint_near_the_camera_bends(gpu, draw):
    """Seen from a metre beside a point that is a metre away, depth changes by up to 1 / MIN_COSINE within a pixel."""
    pixel = np.tile(np.array([[310.0, 250.0]], F), (COUNT, 1))
    z, normal, k = np.ones((COUNT, 1), F), draw.facing(np.array([[0, 0, 1]], F)), np.array([[5, -5, 310, 250]], F)
    mirror = splat.carry_footprint(pixel, z[:, 0], normal, k[0], VIEW, TARGET)
    call = f"carry_footprint(p, z, n, k, {VIEW_GLSL}, t)"
    inputs = {"p": pixel, "z": z, "n": normal, "k": k, "t": TARGET[None]}
    assert mirror.bend.any(-1).mean() > 0.1
    answer = gpu("splat.glsl", f"{call}.bend, 0, 0", **inputs)[:, :2]
    np.testing.assert_allclose(answer, mirror.bend, atol=1e-5, rtol=1e-3)
    reach = draw.numbers(0.5, 9)
    rim = np.abs(splat.splat_bends(mirror, reach[:, 0]) - splat.FLAT) < 1e-4
    heeded = gpu("splat.glsl", f"splat_bend({call}, r), 0, 0", r=reach, **inputs)[:, :2]
    np.testing.assert_allclose(heeded[~rim], splat.splat_bend(mirror, reach[:, 0])[~rim], atol=1e-5, rtol=1e-3)
    assert heeded.any(-1).mean() > 0.1
    bends = gpu("splat.glsl", f"splat_bends({call}, r)", r=reach, **inputs)[:, 0]
    np.testing.assert_allclose(bends[~rim], splat.splat_bends(mirror, reach[:, 0])[~rim], rtol=2e-3, atol=1e-5)
    near = 0.5 / np.median(mirror.inverse_depth)
    ahead = gpu("splat.glsl", f"splat_is_ahead({call}, {near:.9g}) ? 1.0 : 0.0", **inputs)[:, 0] > 0
    assert (ahead != splat.splat_is_ahead(mirror, near)).sum() <= 1
    extent = gpu("splat.glsl", f"footprint_extent({call}, r, false), 0, 0", r=reach, **inputs)[:, :2]
    expected = splat.footprint_extent(mirror, reach[:, 0], False)
    np.testing.assert_allclose(extent[~rim], expected[~rim], rtol=5e-3)


def test_inverse_depth_within_a_footprint(gpu, draw):
    pixel, z, normal, mirror = carried(draw)
    offset, inverse = draw.numbers(-1, 1, 2), splat.invert_footprint(mirror.to_target)
    call = f"footprint_inverse_depth(carry_footprint(p, z, n, k, {VIEW_GLSL}, t), i, o)"
    inputs = {"p": pixel, "z": z, "n": normal, "k": K[None], "t": TARGET[None], "i": inverse, "o": offset}
    expected = splat.footprint_inverse_depth(mirror, inverse, offset)
    tame = np.abs(expected / mirror.inverse_depth - 1) < 0.5
    assert tame.mean() > 0.9
    np.testing.assert_allclose(gpu("splat.glsl", call, **inputs)[tame, 0], expected[tame], rtol=1e-3)


def test_the_jacobian_is_the_derivative_of_the_warp():
    """On a plane the carried footprint must match differences of the warp itself, in float64."""
    view, ray = VIEW.astype(float), lambda p: np.array([(p[0] - K[2]) / K[0], (p[1] - K[3]) / K[1], 1.0])
    n = np.array([0.3, -0.2, -0.9]) / np.linalg.norm([0.3, -0.2, -0.9])
    start, z = np.array([300.0, 200.0]), 1.7
    offset = n @ ray(start) * z

    def warp(p):
        point = view[:3, :3] @ (ray(p) * offset / (n @ ray(p))) + view[:3, 3]
        return TARGET[:2] * point[:2] / point[2] + TARGET[2:]

    numeric = [(warp(start + e) - warp(start - e)) / 2e-3 for e in np.eye(2) * 1e-3]
    mirror = splat.carry_footprint(start[None].astype(F), np.array([z], F), n[None].astype(F), K, VIEW, TARGET)
    assert mirror.to_target[0] == pytest.approx(np.concatenate(numeric), rel=1e-4)


def test_the_bend_makes_the_way_back_exact_however_far():
    """Where a pixel 40 pixels off is carried, it comes back from: the Jacobian alone would miss it."""
    view = VIEW.copy()
    view[:3, 3] = -0.5, 0.3, -1.2
    n = np.array([0.5, -0.4, -0.6], F) / np.linalg.norm([0.5, -0.4, -0.6]).astype(F)
    k, start = np.array([40.0, 40, 30, 30], F), np.array([30.0, 30], F)
    mirror = splat.carry_footprint(start[None], np.array([2], F), n[None], k, view, TARGET)
    inverse = splat.invert_footprint(mirror.to_target)
    assert mirror.bend.any()
    for off in ((4, 3), (-5, 2), (2, -6)):
        ray = camera.pixel_ray(start + np.array(off, F), k)
        point = ray * (n @ camera.pixel_ray(start, k) * 2 / (n @ ray))
        seen = camera.project(view[:3, :3] @ point + view[:3, 3], TARGET)
        back = splat.carry_offset_back(inverse, mirror.bend, seen - mirror.centre)[0]
        assert back[:2] == pytest.approx(off, abs=0.02) and back[2] > 0
        assert splat.carry_offset_back(inverse, 0 * mirror.bend, seen - mirror.centre)[0, :2] != pytest.approx(
            off, abs=0.2
        )


@pytest.mark.parametrize("is_round", [False, True])
def test_reach_extent_inverse_and_cover(gpu, draw, is_round):
    mirror = carried(draw)[3]
    size, offset, flag = draw.numbers(0.5, 3), draw.numbers(-2, 2, 2), str(is_round).lower()
    reach = splat.splat_reach(size[:, 0], is_round)
    agree(gpu("splat.glsl", f"splat_reach(s, {flag})", s=size), reach)
    agree(gpu("splat.glsl", f"exact_reach(s, {flag})", s=size), splat.exact_reach(size[:, 0], is_round))
    made = "Footprint(vec2(0), t, 1.0, vec2(0), b)"
    bend = draw.numbers(-0.1, 0.1, 2)
    bent = mirror._replace(bend=bend)
    extent = gpu(
        "splat.glsl", f"footprint_extent({made}, r, {flag}), 0, 0", t=mirror.to_target, b=bend, r=reach[:, None]
    )
    agree(extent, splat.footprint_extent(bent, reach, is_round))
    inverse = splat.invert_footprint(mirror.to_target)
    agree(gpu("splat.glsl", "invert_footprint(t)", t=mirror.to_target), inverse, rtol=1e-4)
    agree(gpu("splat.glsl", "carry_offset_back(i, b, o), 0", i=inverse, b=bend, o=offset),
          splat.carry_offset_back(inverse, bend, offset), rtol=1e-3)  # fmt: skip
    call = f"footprint_covers(i, b, o, r, {flag}) ? 1.0 : 0.0"
    covered = gpu("splat.glsl", call, i=inverse, b=bend, o=offset, r=reach[:, None])[:, 0] > 0
    expected = splat.footprint_covers(inverse, bend, offset, reach, is_round)
    assert (covered != expected).sum() <= 1  # a decision on the very rim may fall either way
    assert 0.1 < expected.mean() < 0.9


def test_lies_on_plane(gpu, draw):
    z, own, off = draw.numbers(0.999, 1.001), np.ones((COUNT, 1), F), np.floor(draw.numbers(0, 4, 2))
    z[::7], own[::11] = 0, 0
    slope = draw.numbers(-1e-4, 1e-4, 2)
    answer = gpu("splat.glsl", "lies_on_plane(z, o, w, s, 0.0005) ? 1.0 : 0.0", z=z, o=off, w=own, s=slope)[:, 0] > 0
    expected = splat.lies_on_plane(z[:, 0], off, own[:, 0], slope, 0.0005)
    assert (answer != expected).sum() <= 1  # a decision on the very rim may fall either way
    assert 0.2 < expected.mean() < 0.8
    assert not splat.lies_on_plane(own[:, 0], 0 * off, own[:, 0], slope, 0).any()


def test_a_surface_seen_from_its_edge_has_no_inverse():
    assert not splat.invert_footprint(np.array([[1.0, 2.0, 2.0, 4.0]], F)).any()


def test_source_position_and_inverse_depth_there(gpu, draw):
    pixel, z, normal, mirror = carried(draw)
    target_pixel = mirror.centre + draw.numbers(-1, 1, 2)
    call = f"source_position(carry_footprint(p, z, n, k, {VIEW_GLSL}, t), p, q), 0, 0"
    inputs = {"p": pixel, "z": z, "n": normal, "k": K[None], "t": TARGET[None], "q": target_pixel}
    at = look_up.source_position(mirror, pixel, target_pixel)
    tame = np.abs(at - pixel).max(-1) < 3
    answer = gpu("depth_lookup.glsl", call, **inputs)[:, :2]
    assert tame.sum() > COUNT / 2
    np.testing.assert_allclose(answer[tame], at[tame], atol=0.01)
    w, ray = 1 / z, camera.pixel_ray(pixel, K)
    slope = splat.inverse_depth_slope(normal, ray, z[:, 0], K)
    answer = gpu("depth_lookup.glsl", "inverse_depth_at(a, p, w, s)", a=at, p=pixel, w=w, s=slope)
    agree(answer, look_up.inverse_depth_at(at, pixel, w[:, 0], slope), rtol=1e-4)


def test_carry_back_undoes_the_warp(gpu, draw):
    """What carry_footprint carries into the view comes back to its place."""
    pixel, z, _, mirror = carried(draw)
    assert (mirror.inverse_depth > 0).all()
    back = look_up.carry_back(mirror.centre, mirror.inverse_depth, TARGET, VIEW, K)
    np.testing.assert_allclose(back[:, :2], pixel, atol=0.01)
    np.testing.assert_allclose(back[:, 2], 1 / z[:, 0], rtol=1e-4)
    inputs = {"q": mirror.centre, "w": mirror.inverse_depth[:, None], "t": TARGET[None], "k": K[None]}
    answer = gpu("depth_lookup.glsl", f"carry_back(q, w, t, {VIEW_GLSL}, k), 0", **inputs)
    np.testing.assert_allclose(answer[:, :3], back, rtol=1e-4, atol=1e-3)


def test_pixel_of_is_exact_where_floats_are_not(gpu):
    columns, rows = 7919, np.array([0, 1, 2117, 4001, 5000])
    index = (rows[:, None] * columns + np.array([0, 1, columns // 2, columns - 1])).ravel()
    pair = np.stack([index // 10000, index % 10000], -1).astype(F)  # beyond 2**24 a float is no number of a pixel
    answer = gpu("depth_lookup.glsl", f"pixel_of(int(i.x) * 10000 + int(i.y), {columns}), 0, 0", i=pair)
    assert (answer[:, :2] == look_up.pixel_of(index, columns)).all()


def test_look_up_error_is_least_for_the_splat_that_is_seen(gpu, draw):
    z = draw.numbers(1.9, 2.1)
    z[::7] = 0
    at = draw.numbers(1, 28, 2)
    corner, w_at = np.round(at + draw.numbers(-0.4, 0.4, 2)), np.full((COUNT, 1), 0.5, F)
    answer = gpu("depth_lookup.glsl", "look_up_error(z, c, a, w)", z=z, c=corner, a=at, w=w_at)
    expected = look_up.look_up_error(z[:, 0], corner, at, w_at[:, 0])
    agree(answer, expected)
    assert 0.2 < (expected < 1).mean() < 0.95


def test_neighbour_weight(gpu, draw):
    z = draw.numbers(1.96, 2.08)  # some within 2 % of the plane at 2 m, some not
    z[::7] = 0
    pixel = np.floor(draw.numbers(1, 28, 2))
    at = pixel + draw.numbers(-0.6, 0.6, 2)
    corner = np.floor(at) + np.floor(draw.numbers(0, 2, 2))
    w, slope = np.full((COUNT, 1), 0.5, F), np.full((COUNT, 2), 0.001, F)
    answer = gpu("depth_lookup.glsl", "neighbour_weight(z, c, a, p, w, s)", z=z, c=corner, a=at, p=pixel, w=w, s=slope)
    expected = look_up.neighbour_weight(z[:, 0], corner, at, pixel, w[:, 0], slope)
    agree(answer, expected)
    assert 0.2 < (expected > 0).mean() < 0.95
