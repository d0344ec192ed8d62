"""Compares the functions of shaders/common/cloud_*.glsl with their mirrors."""

import numpy as np
import pytest

from pointshade_gl.gpu.clouds.cloud_planes import CellGrid

from ..reference import cloud_edges, cloud_moments, cloud_planes
from ..support.clouds import cloud

F = np.float32
COUNT = 400
MOST, RADIUS = 12, 0.1
MOMENTS = "Moments(w, o, s, p, q)"


def texture(values):
    """Values (n, k) one after the other, CLOUD_WIDTH in a row."""
    rows = -(-len(values) // cloud_moments.CLOUD_WIDTH)
    padded = np.zeros((rows * cloud_moments.CLOUD_WIDTH, values.shape[1]), values.dtype)
    padded[: len(values)] = values
    return padded.reshape(rows, cloud_moments.CLOUD_WIDTH, -1)


class Scene:
    """A noisy box in cells, and some of its points as those that are asked for."""

    def __init__(self):
        rng = np.random.default_rng(4)
        positions = cloud("box", 12000, 11, noise=0.2, stray=True).positions
        grid = CellGrid(positions, RADIUS)
        points = np.zeros((len(positions), 4), F)
        points[:, :3] = positions[grid.order]
        self.asked = rng.choice(len(points), COUNT, replace=False)
        self.here, self.cell = points[self.asked, :3], grid.cell_of[self.asked]
        self.points, self.ranges = texture(points), texture(grid.ranges().reshape(-1, 2))
        n = rng.normal(size=(len(points), 3))
        n /= np.linalg.norm(n, axis=1, keepdims=True)
        planes = np.concatenate([n * rng.uniform(1, 1.3, (len(n), 1)), rng.uniform(-0.3, 0.3, (len(n), 1))], -1)
        planes[::9] = 0
        self.planes = texture(planes.astype(F))
        self.maps = {
            "point_map": self.points,
            "range_map": self.ranges,
            "c": self.cell[:, None].astype(F),
            "h": self.here,
        }

    def moments(self, slab=None):
        slab = np.zeros((COUNT, 4), F) if slab is None else slab
        return cloud_moments.gather_moments(self.points, self.ranges, self.cell, self.here, RADIUS, slab, MOST)


@pytest.fixture(scope="module")
def scene():
    return Scene()


def near(answer, mirror, atol=1e-5, rtol=2e-5):
    mirror = np.asarray(mirror).reshape(len(mirror), -1)
    np.testing.assert_allclose(answer[:, : mirror.shape[1]], mirror, atol=atol, rtol=rtol)


def as_inputs(m):
    return {"w": m.weight[:, None], "o": m.offset, "s": m.squares, "p": m.products, "q": m.plain}


def slabs(count):
    rng = np.random.default_rng(8)
    n = rng.normal(size=(count, 3))
    n *= rng.uniform(2, 9, (count, 1)) / np.linalg.norm(n, axis=1, keepdims=True)
    return np.concatenate([n, rng.uniform(-1, 1, (count, 1))], -1).astype(F)


def test_cloud_texel(gpu):
    k = np.array([0, 1, 4095, 4096, 123456, 16777215])
    answer = gpu("cloud_moments.glsl", "cloud_texel(int(k)), 0, 0", k=k[:, None].astype(F))
    near(answer, cloud_moments.cloud_texel(k), atol=0)


@pytest.mark.parametrize("thin", [False, True])
def test_gather_moments(gpu, scene, thin):
    """With more points in a range than are looked at, and with a slab that leaves some of them out."""
    slab = slabs(COUNT) if thin else np.zeros((COUNT, 4), F)
    m = scene.moments(slab)
    call = f"gather_moments(point_map, range_map, int(c), h, {RADIUS:.9g}, slab, {MOST})"
    inputs = scene.maps | {"slab": slab}
    for part, zeros in (("weight", "0, 0, 0"), ("offset", "0"), ("squares", "0"), ("products", "0"), ("plain", "")):
        answer = gpu("cloud_moments.glsl", f"{call}.{part}, {zeros}".rstrip(", "), **inputs)
        differs = np.abs(
            answer[:, : getattr(m, part).reshape(COUNT, -1).shape[1]] - getattr(m, part).reshape(COUNT, -1)
        )
        assert (differs.max(-1) > 2e-4).sum() <= 2 * thin  # a decision on the rim of the slab may fall either way
    assert 3 < np.median(m.plain[:, 3]) < 60
    assert (scene.moments().plain[:, 3] - m.plain[:, 3]).any() == thin


def test_add_neighbour(gpu, draw_numbers):
    d, count = draw_numbers(-0.8, 0.8, 3), np.floor(draw_numbers(1, 5))
    zero = cloud_moments.Moments(np.zeros(COUNT, F), *(np.zeros((COUNT, 3), F),) * 3, np.zeros((COUNT, 4), F))
    m = cloud_moments.add_neighbour(zero, d, count[:, 0])
    call = "add_neighbour(Moments(0.0, vec3(0), vec3(0), vec3(0), vec4(0)), d, n)"
    near(gpu("cloud_moments.glsl", f"{call}.weight, {call}.products", d=d, n=count),
         np.concatenate([m.weight[:, None], m.products], -1))  # fmt: skip
    near(gpu("cloud_moments.glsl", f"{call}.plain", d=d, n=count), m.plain)
    assert 0.1 < (m.weight > 0).mean() < 0.95


@pytest.fixture
def draw_numbers():
    rng = np.random.default_rng(3)
    return lambda low, high, n=1: rng.uniform(low, high, (COUNT, n)).astype(F)


def random_covariance(draw_numbers, flat):
    """Entries of covariances with principal variances of which the least is small."""
    rng = np.random.default_rng(2)
    axes = np.linalg.qr(rng.normal(size=(COUNT, 3, 3)))[0]
    variances = np.sort(draw_numbers(0.02, 0.2, 3), -1) * (flat, 1, 1)
    c = np.einsum("nij,nj,nkj->nik", axes, variances, axes)
    squares = c[:, (0, 1, 2), (0, 1, 2)].astype(F)
    return squares, c[:, (1, 2, 0), (2, 0, 1)].astype(F), variances, axes[:, :, 0]


@pytest.mark.parametrize("flat", [1.0, 0.01, 0.0])
def test_principal_variances_and_axis(gpu, draw_numbers, flat):
    squares, products, variances, axis = random_covariance(draw_numbers, flat)
    mirror = cloud_planes.principal_variances(squares, products)
    np.testing.assert_allclose(mirror, variances, atol=2e-5)
    near(gpu("cloud_planes.glsl", "principal_variances(s, p), 0", s=squares, p=products), mirror, atol=2e-5)
    apart = mirror[:, 1] - mirror[:, 0] > 0.02
    least = mirror[:, :1]
    own = cloud_planes.principal_axis(squares, products, least[:, 0])
    answer = gpu("cloud_planes.glsl", "principal_axis(s, p, v), 0", s=squares, p=products, v=least)[:, :3]
    assert apart.mean() > 0.5
    for found in (own, answer):
        assert np.abs((found * axis).sum(-1))[apart].min() > 1 - 1e-5


def test_no_axis_where_all_are_alike(gpu):
    squares, products = np.full((5, 3), 0.1, F), np.zeros((5, 3), F)
    variances = cloud_planes.principal_variances(squares, products)
    assert (variances == F(0.1)).all() and not cloud_planes.principal_axis(squares, products, variances[:, 0]).any()
    answer = gpu("cloud_planes.glsl", "principal_axis(s, p, 0.1), 0", s=squares, p=products)
    assert not answer.any()


def test_fit_plane_and_lean(gpu, scene):
    m = scene.moments()
    m.plain[:20, 3] = 4
    plane = cloud_planes.fit_plane(m)
    answer = gpu("cloud_planes.glsl", f"fit_plane({MOMENTS})", **as_inputs(m))
    side = np.sign((answer[:, :3] * plane[:, :3]).sum(-1, keepdims=True))
    has = plane[:, :3].any(-1)
    decided = answer[:, :3].any(-1) == has
    assert (~decided).sum() <= 2 and 0.5 < has.mean() < 0.99  # at a threshold either way is right
    both = has & decided
    np.testing.assert_allclose(answer[both], (plane * side)[both], atol=2e-3)
    assert (answer[~has & decided, 3] == plane[~has & decided, 3]).all()
    lean = gpu("cloud_planes.glsl", f"lean_of({MOMENTS}, n)", n=plane, **as_inputs(m))
    near(lean, cloud_planes.lean_of(m, plane))


def test_planes_from_elsewhere_and_their_costs(gpu, scene, draw_numbers):
    planes, d = scene.planes.reshape(-1, 4)[:COUNT], draw_numbers(-0.6, 0.6, 3)
    moved = cloud_edges.plane_from(planes, d, 1.6)
    near(gpu("cloud_edges.glsl", "plane_from(n, d, 1.6)", n=planes, d=d), moved)
    near(gpu("cloud_edges.glsl", "vec4(cost_of(n, 0.002))", n=moved), cloud_edges.cost_of(moved, 0.002))
    near(gpu("cloud_edges.glsl", "slab_of(n, 0.0001)", n=planes[planes.any(-1)]),
         cloud_edges.slab_of(planes[planes.any(-1)], 0.0001), atol=1e-4, rtol=1e-4)  # fmt: skip
    thinner = gpu("cloud_edges.glsl", "vec4(is_thinner(n, m))", n=planes, m=planes[::-1])[:, 0] > 0
    assert (thinner == cloud_edges.is_thinner(planes, planes[::-1])).all() and thinner.any()


def test_elect_plane(gpu, scene, draw_numbers):
    least = draw_numbers(0.0, 0.02)
    call = f"elect_plane(point_map, plane_map, range_map, int(c), h, l, 0.001, {RADIUS:.9g}, 0.8, {MOST})"
    elected = cloud_edges.elect_plane(
        scene.points, scene.planes, scene.ranges, scene.cell, scene.here, least[:, 0], 0.001, RADIUS, 0.8, MOST
    )
    answer = gpu("cloud_edges.glsl", call, plane_map=scene.planes, l=least, **scene.maps)
    same = np.abs(answer - elected).max(-1) < 1e-4
    assert (~same).sum() <= 2  # of two that cost the same either may win
    assert 0.3 < elected.any(-1).mean() < 1


def test_nearest_points(gpu, scene):
    own = scene.planes.reshape(-1, 4)[: len(scene.points.reshape(-1, 4))][scene.asked][:, :3]
    call = f"nearest_points(point_map, plane_map, range_map, int(c), h, o, {RADIUS:.9g}, {MOST}), 0, 0"
    nearest = cloud_edges.nearest_points(
        scene.points, scene.planes, scene.ranges, scene.cell, scene.here, own, RADIUS, MOST
    )
    answer = gpu("cloud_edges.glsl", call, plane_map=scene.planes, o=own, **scene.maps)
    near(answer, nearest, atol=1e-4)
    assert 0.05 < np.median(nearest[:, 0]) < 1 and np.ptp(nearest[:, 1]) > 0.3
