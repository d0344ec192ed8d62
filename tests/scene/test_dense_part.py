"""Stray points are few and far from all others: they decide nothing about bounds."""

import numpy as np
import pytest

import pointshade_gl as ps
from pointshade_gl.estimation.ground import ground_under
from pointshade_gl.scene.dense_part import dense_part, main_points, sample_of
from pointshade_gl.scene.graph import scene_of

COUNT = 4000


def sphere(rng):
    way = rng.normal(size=(COUNT, 3))
    return way / np.linalg.norm(way, axis=1)[:, None]


def torus(rng):
    a, b = rng.uniform(0, 2 * np.pi, (2, COUNT))
    return np.stack([(1 + 0.4 * np.cos(b)) * np.cos(a), (1 + 0.4 * np.cos(b)) * np.sin(a), 0.4 * np.sin(b)], -1)


def plane(rng):
    return np.c_[rng.uniform(-1, 1, (COUNT, 2)), np.zeros(COUNT)]


def tree(rng):
    """Thin branches, each with three at its end."""
    ends, ways = [np.zeros((1, 3))], [np.array([[0, 0, 1.0]])]
    for level in range(1, 5):
        start = np.repeat(ends[-1] + ways[-1], 3, 0)
        way = ways[-1].repeat(3, 0) / 0.7 ** (level - 1) + rng.normal(0, 0.6, (3**level, 3))
        ends.append(start)
        ways.append(0.7**level * way / np.linalg.norm(way, axis=1)[:, None])
    start, way = np.concatenate(ends), np.concatenate(ways)
    length = np.linalg.norm(way, axis=1)
    chosen = rng.choice(len(way), COUNT, p=length / length.sum())
    return start[chosen] + way[chosen] * rng.random((COUNT, 1)) + rng.normal(0, 0.004, (COUNT, 3))


def rooms(rng):
    """Two boxes, seen from inside, of which the second has a quarter of the points."""
    sides = np.array([4, 3, 2.5])
    at, face = rng.random((COUNT, 3)) * sides, rng.integers(0, 6, COUNT)
    at[np.arange(COUNT), face % 3] = np.where(face < 3, 0, sides[face % 3])
    at[COUNT * 3 // 4 :] += (14, 5, 0)
    return at


def terrain(rng):
    x, y = rng.uniform(-50, 50, (2, COUNT))
    return np.stack([x, y, 3 * np.sin(x / 9) * np.cos(y / 13)], -1)


def with_strays(at, kind, share, reach, rng):
    """reach: half sizes of the cloud, that the farthest stray point is away."""
    count, half, middle = int(share * len(at)), np.ptp(at, axis=0).max() / 2, at.mean(0)
    way = rng.normal(size=(count, 3))
    if kind == "log":
        away = half * 10 ** rng.uniform(0, np.log10(reach), (count, 1))
        more = way / np.linalg.norm(way, axis=1)[:, None] * away
    elif kind == "box":
        more = half * reach * rng.uniform(-1, 1, (count, 3))
    else:
        more = half * (reach * np.array([0.6, 0.64, 0.48]) + 0.1 * way)
    return np.concatenate([at, middle + more])[rng.permutation(len(at) + count)]


def reach_of(scene):
    """What a picture sees across at the middle of a scene."""
    camera = scene.framed()
    return camera.scale * camera.camera.width / camera.camera.fx


SHAPES = sphere, torus, plane, tree, rooms, terrain


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("kind", ["log", "box", "clump"])
@pytest.mark.parametrize("reach", [10, 1000])
def test_pictures_are_framed_as_without_stray_points(shape, kind, reach):
    at = shape(np.random.default_rng(1))
    clean = ps.PointCloud(at, up="z")
    for share in (0.002, 0.01, 0.05):
        cloud = ps.PointCloud(with_strays(at, kind, share, reach, np.random.default_rng(2)), up="z")
        for framed in (lambda one: ps.Scene((ps.Node(one),)), scene_of):
            assert 1 / 1.3 < reach_of(framed(cloud)) / reach_of(framed(clean)) < 1.3, share
        low, clean_low = (ground_under(ps.Scene((ps.Node(one),)), (0, 0, 1))[3] for one in (cloud, clean))
        assert abs(low - clean_low) < 0.2 * np.ptp(at, axis=0).max()


@pytest.mark.parametrize("shape", SHAPES)
def test_without_stray_points_all_points_count(shape):
    for seed in range(3):
        at = shape(np.random.default_rng(seed))
        assert main_points(at) is sample_of(at) or len(main_points(at)) == len(at)
        assert dense_part(at) is None


def test_what_becomes_rarer_outwards_is_no_stray_point():
    rng = np.random.default_rng(3)
    way = sphere(rng)[:, :2]
    away = 10 ** rng.uniform(0, 1.5, COUNT)
    fading = np.c_[way / np.linalg.norm(way, axis=1)[:, None] * away[:, None], np.zeros(COUNT)]
    for at in (rng.normal(size=(20_000, 3)), fading):
        assert len(main_points(at)) == len(at)


def test_a_small_part_near_a_large_one_is_no_stray_clump():
    at = terrain(np.random.default_rng(4))
    at[: COUNT // 30] = at[: COUNT // 30] * 0.05 + (90, 0, 0)
    assert len(main_points(at)) == COUNT


@pytest.mark.parametrize(
    "at", [np.zeros((0, 3)), np.zeros((1, 3)), np.ones((500, 3)), np.eye(3), np.arange(9.0).reshape(3, 3)]
)
def test_hardly_any_places(at):
    assert len(main_points(at)) == len(at) and dense_part(at) is None


def test_places_as_far_as_numbers_go():
    at = np.concatenate([sphere(np.random.default_rng(5)), [[1e18, 0, 0], [0, -1e18, 1e18]]])
    part = dense_part(at)
    assert part is not None and part.holds(at).sum() == COUNT
