"""Compares the functions of cloud_splat.glsl and cloud_front.glsl with their mirrors, and with what they promise."""

import numpy as np
import pytest

from ..reference import cloud_front, cloud_splat
from ..reference.camera import project
from ..reference.cloud_splat import CloudSplat
from ..reference.vectors import dot, length, normalize

F = np.float32
COUNT = 2000
K = np.array([[520.0, -480.0, 310.0, 250.0]], F)
BALL = "CloudSplat(c, vec3(0), r), o, k"
DISC = "CloudSplat(c, n, r), n, e, o, k"
EDGES = {"whole": lambda n: np.zeros_like(n), "cut": lambda n: normalize(np.cross(n, (0.3, 0.5, 0.2))).astype(F)}


def close(answer, mirror, **tolerance):
    mirror = np.asarray(mirror).reshape(len(answer), -1)
    tolerance = {"atol": 1e-5, "rtol": 1e-5} | tolerance
    np.testing.assert_allclose(answer[:, : mirror.shape[1]], mirror, **tolerance)


@pytest.fixture
def splats():
    """Seeded random splats in front of a camera, and offsets of pixels that about half of them cover."""
    rng = np.random.default_rng(31)
    z = rng.uniform(0.5, 4, (COUNT, 1))
    centre = (np.concatenate([rng.uniform(-0.8, 0.8, (COUNT, 2)), np.ones((COUNT, 1))], -1) * z).astype(F)
    normal = rng.normal(size=(COUNT, 3))
    normal = cloud_splat.facing((normal / np.linalg.norm(normal, axis=1, keepdims=True)).astype(F), centre)
    radius = (z * rng.uniform(0.005, 0.3, (COUNT, 1))).astype(F)
    offset = (np.abs(K[:, :2]) * radius / z * rng.uniform(-1.2, 1.2, (COUNT, 2))).astype(F)
    return CloudSplat(centre, normal, radius), offset


def hits(gpu, call, **inputs):
    """What the GPU answers of hit_ball and hit_disc: depth and outside (n, 2), and normals (n, 3)."""
    numbers = gpu("cloud_splat.glsl", f"{call}.depth, {call}.outside, 0, 0", **inputs)
    return numbers[:, :2], gpu("cloud_splat.glsl", f"{call}.normal, 0", **inputs)[:, :3]


def agree_where_decided(numbers, normals, mirror):
    """All but what lies on the very rim is equal."""
    decided = np.abs(mirror.outside[:, 0] - 1) > 1e-4
    assert decided.mean() > 0.98 and 0.2 < (mirror.depth > 0).mean() < 0.8
    assert ((numbers[:, :1] > 0) == (mirror.depth > 0))[decided].all()
    close(numbers[decided], np.concatenate([mirror.depth, mirror.outside], -1)[decided], atol=2e-5, rtol=2e-5)
    close(normals[decided], mirror.normal[decided], atol=5e-3)  # a root at the rim of a ball
    inner = mirror.outside[:, 0] < 0.98
    close(normals[inner], mirror.normal[inner], atol=3e-5)


def test_normals_are_turned_to_the_viewer_and_made_steeper(gpu, splats):
    rng = np.random.default_rng(2)
    (centre, normal, _), turned = splats[0], rng.choice([-1, 1], (COUNT, 1)).astype(F)
    close(gpu("cloud_splat.glsl", "facing(n, c), 0", n=turned * normal, c=centre), normal)
    steep = cloud_splat.steeper(normal, centre)
    close(gpu("cloud_splat.glsl", "steeper(n, c), 0", n=normal, c=centre), steep, atol=2e-5)
    cosine = -dot(steep, normalize(centre))[:, 0]
    kept = -dot(normal, normalize(centre))[:, 0] >= 0.12
    assert cosine.min() > 0.1199 and 0.8 < kept.mean() < 0.95
    assert (steep[kept] == normal[kept]).all() and cosine[~kept] == pytest.approx(0.12, abs=1e-5)
    np.testing.assert_allclose(length(steep), 1, atol=1e-5)


def test_a_ball_is_met_as_by_its_mirror(gpu, splats):
    splat, offset = splats[0]._replace(normal=np.zeros((COUNT, 3), F)), splats[1]
    inputs = {"c": splat.centre, "r": splat.radius, "o": offset, "k": K}
    agree_where_decided(*hits(gpu, f"hit_ball({BALL})", **inputs), cloud_splat.hit_ball(splat, offset, K))


@pytest.mark.parametrize("edge", EDGES)
def test_a_disc_is_met_as_by_its_mirror(gpu, splats, edge):
    splat, offset = splats[0]._replace(normal=cloud_splat.steeper(splats[0].normal, splats[0].centre)), splats[1] / 2
    onward = EDGES[edge](splat.normal)
    inputs = {"c": splat.centre, "n": splat.normal, "r": splat.radius, "e": onward, "o": offset, "k": K}
    mirror = cloud_splat.hit_disc(splat, splat.normal, onward, offset, K)
    agree_where_decided(*hits(gpu, f"hit_disc({DISC})", **inputs), mirror)


def test_the_middle_pixel_is_met_however_thin_a_disc_is_seen(gpu, splats):
    splat, rng = splats[0]._replace(radius=np.full((COUNT, 1), 1e-4, F)), np.random.default_rng(4)
    normal, offset = cloud_splat.steeper(splat.normal, splat.centre), rng.uniform(-1, 1, (COUNT, 2)).astype(F)
    inputs = {"c": splat.centre, "n": normal, "r": splat.radius, "e": np.zeros_like(normal), "o": offset, "k": K}
    depth = hits(gpu, f"hit_disc({DISC})", **inputs)[0][:, 0]
    is_middle = np.abs(offset).max(-1) <= 0.5
    assert (depth[is_middle] > 0).all() and np.abs(depth - splat.centre[:, 2])[is_middle].max() <= 2.001e-4
    assert (depth[~is_middle] > 0).mean() < 0.2


def in_float64(splat, offset):
    """The pixel's ray, (n, 3) float64 of depth 1, and the splat's centre."""
    centre, k = splat.centre.astype(float), K.astype(float)
    at = project(centre, k[0]) + offset
    return np.concatenate([(at - k[:, 2:]) / k[:, :2], np.ones((COUNT, 1))], -1), centre


def test_a_ball_is_a_sphere(gpu, splats):
    """Also far off the axis: the formula of the school, in float64."""
    splat, offset = splats
    ray, centre = in_float64(splat, offset)
    a, b, c = (ray * ray).sum(-1), (ray * centre).sum(-1), (centre**2).sum(-1) - splat.radius[:, 0].astype(float) ** 2
    meets = b * b - a * c
    z = np.where(meets > 0, (b - np.sqrt(np.maximum(meets, 0))) / a, 0)
    inputs = {"c": splat.centre, "r": splat.radius, "o": offset, "k": K}
    numbers, normals = hits(gpu, f"hit_ball({BALL})", **inputs)
    clear = np.abs(meets) > 1e-3 * a * splat.radius[:, 0] ** 2
    assert clear.mean() > 0.98 and ((numbers[:, 0] > 0) == (z > 0))[clear].all()
    met = clear & (z > 0)
    np.testing.assert_allclose(numbers[met, 0], z[met], atol=2e-5)
    np.testing.assert_allclose(
        normals[met], ((ray * z[:, None] - centre) / splat.radius)[met], atol=3e-3
    )  # rounded most at the rim


def test_a_ball_keeps_its_digits_a_thousand_radii_away(gpu):
    """As a sun sees it: the depth of its front is known to a thousandth of the radius, and so are its normals."""
    side = np.linspace(-0.98, 0.98, 41)
    x, y = (one.ravel() for one in np.meshgrid(side, side))
    inside = x * x + y * y < 0.95
    x, y = x[inside], y[inside]
    centre, radius, focal = np.array([[0.37, -0.21, 1000.0]], F), F(1), 1e5
    offset = np.stack([x, y], -1).astype(F) * F(focal / 1000)
    inputs = {"c": centre, "r": np.full((len(x), 1), radius), "o": offset, "k": np.array([[focal, focal, 0, 0]], F)}
    numbers, normals = hits(gpu, f"hit_ball({BALL})", **inputs)
    root = np.sqrt(1 - x * x - y * y)
    np.testing.assert_allclose(numbers[:, 0] - 1000, -root, atol=2e-3)
    np.testing.assert_allclose(normals, np.stack([x, y, -root], -1), atol=3e-3)


def test_a_disc_lies_in_its_plane(gpu, splats):
    """Its depth is where the ray meets the plane, and nothing of it is farther from the centre than its radius."""
    splat = splats[0]._replace(normal=cloud_splat.steeper(splats[0].normal, splats[0].centre))
    offset = splats[1] / 2
    ray, centre = in_float64(splat, offset)
    z = (centre * splat.normal).sum(-1) / (ray * splat.normal).sum(-1)
    edge = np.zeros_like(splat.normal)
    inputs = {"c": splat.centre, "n": splat.normal, "r": splat.radius, "e": edge, "o": offset, "k": K}
    numbers, _ = hits(gpu, f"hit_disc({DISC})", **inputs)
    away = np.linalg.norm(ray * z[:, None] - centre, axis=-1) / splat.radius[:, 0]
    clear = (np.abs(away - 1) > 1e-3) & (np.abs(offset).max(-1) > 0.5)
    assert clear.mean() > 0.9 and ((numbers[:, 0] > 0) == (away < 1))[clear].all()
    met = clear & (away < 1)
    np.testing.assert_allclose(numbers[met, 0], z[met], atol=3e-5, rtol=3e-5)
    np.testing.assert_allclose(numbers[met, 1], away[met] ** 2, atol=2e-3)


@pytest.mark.parametrize("kind", ["ball", "disc"])
def test_the_extent_is_that_of_the_mirror_and_holds_all_that_is_met(gpu, splats, kind):
    splat, offset = splats
    splat = splat._replace(radius=np.minimum(splat.radius, 0.49 * splat.centre[:, 2:]).astype(F))
    if kind == "ball":
        splat = splat._replace(normal=np.zeros((COUNT, 3), F))
        hit = cloud_splat.hit_ball(splat, offset, K)
    else:
        splat = splat._replace(normal=cloud_splat.steeper(splat.normal, splat.centre))
        hit = cloud_splat.hit_disc(splat, splat.normal, np.zeros((COUNT, 3), F), offset, K)
    inputs = {"c": splat.centre, "n": splat.normal, "r": splat.radius, "k": K}
    found = gpu("cloud_splat.glsl", "splat_extent(CloudSplat(c, n, r), k), 0, 0", **inputs)[:, :2]
    close(found, cloud_splat.splat_extent(splat, K), atol=1e-3, rtol=1e-4)
    met = hit.depth[:, 0] > 0
    assert 0.1 < met.mean() < 0.9
    assert (np.abs(offset) <= np.maximum(found, 0.5) + 1e-3)[met].all()
    tight = found / (np.abs(K[:, :2]) * splat.radius / splat.centre[:, 2:])
    assert np.quantile(tight, 0.99) < 2


def test_weights_and_normals_at_outlines(gpu, splats):
    rng = np.random.default_rng(6)
    (centre, normal, _), beside = splats[0], rng.normal(size=(COUNT, 3)).astype(F)
    outside, ray = rng.uniform(0, 1, (COUNT, 1)).astype(F), normalize(centre)
    close(gpu("cloud_splat.glsl", "hit_weight(o)", o=outside), cloud_splat.hit_weight(outside))
    close(gpu("cloud_splat.glsl", "facing_weight(n, c)", n=normal, c=centre), cloud_splat.facing_weight(normal, centre))
    expected = cloud_splat.outline_normal(normal, beside, ray)
    decided = np.abs(dot(normal, beside)[:, 0]) > 1e-5
    found = gpu("cloud_splat.glsl", "outline_normal(n, b, r), 0", n=normal, b=beside, r=ray)
    close(found[decided], expected[decided], atol=3e-5)
    turned = dot(normal, beside)[:, 0] < 0
    assert 0.3 < turned.mean() < 0.7 and (expected[~turned] == normal[~turned]).all()
    aside = turned & (np.abs(dot(normal, ray)[:, 0]) < cloud_splat.OUTLINE)
    np.testing.assert_allclose(dot(expected, ray)[aside], 0, atol=1e-5, err_msg="turned normals look sideways")


NEAR = 0.25


def cores(holes=0.4):
    """A depth picture, (h, w) of 1 - near/z: a slanted surface with holes, before a wall, beside nothing."""
    rng = np.random.default_rng(12)
    v, u = np.mgrid[0:40, 0:60]
    z = np.where((u - 30) ** 2 + (v - 20) ** 2 < 150, 1.0 + 0.004 * u, 2.0)
    z[:, :14] = 0
    z[rng.random(z.shape) < holes] = 0
    return np.where(z > 0, 1 - NEAR / np.where(z > 0, z, 1), 1).astype(F), z


def test_depths_of_the_front_and_steps_round_a_pixel(gpu):
    picture, z = cores()
    v, u = np.mgrid[-2:42, -2:62]
    pixel = np.stack([u.ravel(), v.ravel()], -1)
    found = gpu("cloud_front.glsl", f"front_depth(cores_map, ivec2(p), {NEAR})", p=pixel, cores_map=picture)[:, 0]
    close(found[:, None], cloud_front.front_depth(picture, pixel, NEAR))
    assert (found.reshape(44, 64)[2:-2, 2:-2] > 0).tolist() == (z > 0).tolist() and not found.reshape(44, 64)[:2].any()
    for direction in range(8):
        distance = np.linspace(1, 60, 500, dtype=F)[:, None]
        step = gpu("cloud_front.glsl", f"vec2(ring_step({direction}, d)), 0, 0", d=distance)[:, :2]
        mirror = cloud_front.ring_step(direction, distance[:, 0])
        assert (step != mirror).any(-1).mean() <= 0.002, "a half pixel may fall either way"
        np.testing.assert_allclose(np.linalg.norm(mirror, axis=-1), distance[:, 0], atol=0.8)


@pytest.mark.parametrize(("step_back", "distance"), [(0.3, 2.0), (0.01, 4.5)])
def test_pairs_of_places_around_a_hole(gpu, step_back, distance):
    picture, _ = cores(0.2)
    v, u = np.mgrid[0:40, 0:60]
    pixel = np.stack([u.ravel(), v.ravel()], -1)
    z = cloud_front.front_depth(picture, pixel, NEAR)
    call = f"around_hole(cores_map, ivec2(p), {NEAR}, z, {step_back}, {distance}, 4)"
    inputs = {"p": pixel, "z": z[:, None], "cores_map": picture}
    mirror = cloud_front.around_hole(picture, pixel, NEAR, z, step_back, np.full(z.shape, distance, F), 4)
    close(gpu("cloud_front.glsl", f"{call}, 0", **inputs), mirror)
    assert set(mirror[:, 0].astype(int).tolist()) == {0, 1, 2, 3, 4}
    shown = gpu("cloud_front.glsl", f"shows_surface({call}, {step_back}) ? 1.0 : 0.0", **inputs)[:, 0] > 0
    expected = cloud_front.shows_surface(mirror, step_back)
    assert (shown == expected).all() and 0.02 < expected.mean() < 0.5


def test_what_is_before_a_depth_or_before_nothing(gpu):
    other, z = (one.reshape(-1, 1).astype(F) for one in np.meshgrid([0, 1, 1.5, 1.9, 2.5], [0, 1, 2]))
    found = gpu("cloud_front.glsl", "is_before(o, z, 0.3) ? 1.0 : 0.0", o=other, z=z)[:, 0] > 0
    assert (found == cloud_front.is_before(other, z, 0.3)[:, 0]).all()
    assert found.reshape(3, 5).tolist() == [
        [False, True, True, True, True],
        [False] * 5,
        [False, True, True, False, False],
    ]


@pytest.mark.parametrize("ring", [(2.0, 1.6), (4.0, 3.2), (0.1, 0.1), (500.0, 500.0)])
def test_holes_are_closed_as_by_the_mirror(gpu, ring):
    picture, _ = cores()
    v, u = np.mgrid[0:40, 0:60]
    pixel = np.stack([u.ravel(), v.ravel()], -1)
    call = f"closed_depth(cores_map, ivec2(p), {NEAR}, 0.3, vec2{ring})"
    found = gpu("cloud_front.glsl", call, p=pixel, cores_map=picture)[:, :1]
    mirror = cloud_front.closed_depth(picture, pixel, NEAR, 0.3, np.array(ring, F))
    decided = np.isclose(found[:, 0], mirror, rtol=1e-5)
    assert decided.mean() > 0.998


def test_holes_in_a_surface_are_closed_and_what_is_beside_it_stays(gpu):
    """A hole before a wall gets the surface's depth; the wall beside the surface and nothing beside the wall stay."""
    z = np.full((40, 60), 2.0)
    v, u = np.mgrid[0:40, 0:60]
    disc = (u - 30) ** 2 + (v - 20) ** 2
    z[disc < 150] = 1.0
    z[:, :8] = 0
    for hole in ((30, 20), (26, 22), (33, 15)):
        z[hole[1], hole[0]] = 2.0 if hole[0] % 2 else 0
    picture = np.where(z > 0, 1 - NEAR / np.where(z > 0, z, 1), 1).astype(F)
    pixel = np.stack([u.ravel(), v.ravel()], -1)
    call = f"closed_depth(cores_map, ivec2(p), {NEAR}, 0.3, vec2(2, 2))"
    found = gpu("cloud_front.glsl", call, p=pixel, cores_map=picture)[:, 0].reshape(40, 60)
    np.testing.assert_allclose(found[disc < 130], 1, rtol=1e-5)
    np.testing.assert_allclose(found[(disc > 170) & (u >= 9)], 2, rtol=1e-5)
    assert not found[:, :7].any()
