"""grid.glsl where the mesh ends: each function is compared with its mirror, on a box and a ball before a wall."""

import numpy as np
import pytest

import pointshade_gl as ps
from pointshade_gl.scene.camera import view_matrix

from ..reference import grid
from ..reference.camera import mean_focal_length, pixel_ray, project
from ..reference.grid_pass import triangle_map_of
from ..reference.splat_corners import surface_at
from ..reference.vectors import texel
from ..support import frames
from .test_rim_functions import K, close, surface_of, things_before_wall

F = np.float32
COUNT = 800


@pytest.fixture(scope="module")
def surface_map():
    return surface_of(things_before_wall())


@pytest.fixture(scope="module")
def triangle_map(surface_map):
    return triangle_map_of(surface_map, frames.CAMERA, (0.0, 0.0))


@pytest.fixture(scope="module")
def places(surface_map):
    """Pixels (n, 2), half of them beside an edge; places around; 1/z there on the pixel's plane, or a little off."""
    rng = np.random.default_rng(2)
    rims, size = np.argwhere(surface_map[..., 3] < 0)[:, ::-1], surface_map.shape[1::-1]
    pixel = np.where(np.arange(COUNT)[:, None] % 2, rng.choice(rims, COUNT), rng.integers(2, np.array(size) - 2))
    at = (pixel + rng.uniform(-1.6, 1.6, (COUNT, 2))).astype(F)
    own = surface_at(surface_map, pixel)
    slope = grid.inverse_depth_slope(own[:, :3], pixel_ray(pixel.astype(F), K), own[:, 3], K)
    w_at = 1 / own[:, 3] + ((at - pixel) * slope).sum(-1)
    return pixel, at, (w_at * rng.choice([1, 1.0002, 1.02], COUNT)).astype(F)


def test_how_far_a_pixel_goes_on(gpu, surface_map, places):
    pixel = places[0]
    own, focal = surface_at(surface_map, pixel), mean_focal_length(K)
    slope = own[:, 3:] * grid.inverse_depth_slope(own[:, :3], pixel_ray(pixel.astype(F), K), own[:, 3], K)
    inputs = {"surface_map": surface_map, "p": pixel.astype(F), "k": K[None]}
    off = np.array((2, -1))
    hidden = grid.hides(surface_map, pixel, off, own[:, 3], slope, focal)
    call = "hides(surface_map, ivec2(p), ivec2(2, -1), z, s, mean_focal_length(k)) ? 1.0 : 0.0"
    close(gpu("grid.glsl", call, **inputs, z=own[:, 3:], s=slope), hidden, missed=0.003)
    reach = grid.edge_reach(surface_map, pixel, K)
    close(gpu("grid.glsl", "edge_reach(surface_map, ivec2(p), k)", **inputs), reach, missed=0.005)
    assert 0.02 < hidden.mean() < 0.9 and {0.5, 2.5} <= set(reach.ravel())


def test_edges_go_on_only_behind_what_is_nearer(surface_map):
    """Every pixel that a reach covers is nearer than the plane, by 1.5 pixels of depth."""
    v, u = np.nonzero(surface_map[..., 3])
    pixel = np.stack([u, v], -1)
    reach, own = grid.edge_reach(surface_map, pixel, K), surface_at(surface_map, pixel).astype(float)
    towards = (own[:, :3] * pixel_ray(pixel.astype(F), K)).sum(-1)
    for k, outward in enumerate([(-1, 0), (0, -1), (1, 0), (0, 1)]):
        for far in (1, 2):
            there = pixel + far * np.array(outward)
            goes_on = reach[:, k] > far
            on_plane = own[:, 3] * towards / (own[:, :3] * pixel_ray(there.astype(F), K)).sum(-1)
            seen = np.abs(texel(surface_map, there[goes_on])[:, 3])
            assert goes_on.any() and (seen < on_plane[goes_on] * (1 - 1.4 / K[0])).all()


def test_edge_slope_and_pieces(gpu, surface_map, places):
    rng, pixel = np.random.default_rng(3), places[0].astype(F)
    own, hidden = surface_at(surface_map, places[0]), rng.random((COUNT, 2)) < 0.5
    slope = grid.edge_slope(own, pixel, hidden, K)
    inputs = {"own": own, "p": pixel, "h": hidden, "k": K[None]}
    close(gpu("grid.glsl", "edge_slope(own, p, bvec2(h), k), 0, 0", **inputs), slope)
    corner, triangles = rng.integers(0, 4, COUNT), rng.choice([0, 1, 2, 5, 6], COUNT)
    w, reach = 1 / own[:, 3], rng.choice([0.5, 1.5, 2.5], (COUNT, 4)).astype(F)
    found = grid.edge_piece(w, triangles, corner, slope, reach)
    inputs = {"w": w[:, None], "t": triangles[:, None], "c": corner[:, None], "s": slope, "r": reach}
    call = "edge_piece(w, int(t), int(c), s, r)"
    for part, rest in (("plane", ", 0"), ("box", ""), ("side", ", 0")):
        close(gpu("grid.glsl", f"{call}.{part}{rest}", **inputs), getattr(found, part))
    corners = (w[:, None] + rng.normal(0, 0.01, (COUNT, 4))).astype(F)
    second = rng.random(COUNT) < 0.5
    inputs = {"w": corners, "t": triangles[:, None], "n": second[:, None]}
    found = grid.triangle_piece(corners, triangles, second)
    for part, rest in (("plane", ", 0"), ("box", ""), ("side", ", 0")):
        close(gpu("grid.glsl", f"triangle_piece(w, int(t), n > 0.5).{part}{rest}", **inputs), getattr(found, part))


def test_covers_corner_and_first_side(gpu):
    triangles, corner = (x.ravel() for x in np.meshgrid([0, 1, 2, 3, 5, 6], np.arange(4)))
    expected = [grid.covers_corner(t, c) for t, c in zip(triangles, corner, strict=True)]
    inputs = {"t": triangles[:, None], "c": corner[:, None]}
    close(gpu("grid.glsl", "covers_corner(int(t), int(c)) ? 1.0 : 0.0", **inputs), expected)
    close(gpu("grid.glsl", "first_side(int(t)), 0", **inputs), grid.first_side(triangles))


def test_what_of_a_pixels_own_square_is_seen(gpu, surface_map, triangle_map, places):
    pixel, at, w_at = places
    maps = {"surface_map": surface_map, "triangle_map": triangle_map}
    inputs = maps | {"p": pixel.astype(F), "at": at, "w": w_at[:, None], "k": K[None]}
    w = grid.edge_inverse_depth(surface_map, triangle_map, pixel, at, K)
    answer = gpu("grid.glsl", "edge_inverse_depth(surface_map, triangle_map, ivec2(p), at, k), 0, 0, 0", **inputs)
    close(answer, w, missed=0.003)
    assert 0.1 < (w > 0).mean() < 0.9
    error = np.minimum(grid.edge_error(surface_map, triangle_map, pixel, at, w_at, K), 10)
    call = "min(edge_error(surface_map, triangle_map, ivec2(p), at, w, k), 10.0), 0, 0, 0"
    close(gpu("grid.glsl", call, **inputs), error, missed=0.003, atol=1e-6)
    found = grid.edge_pixel(surface_map, triangle_map, at, w_at, K)
    answer = gpu("grid.glsl", "edge_pixel(surface_map, triangle_map, at, w, k), 0, 0", **inputs)
    close(answer, found, missed=0.005)


@pytest.fixture(scope="module")
def turned():
    """The way to a camera on the side of the frame's pivot, and its GLSL."""
    view = view_matrix(np.eye(4), ps.orbit_pose(None, (0, 0, 1.5), 30, -10)).astype(F)
    return view, "mat4(" + ", ".join(f"{x:.9g}" for x in view.T.ravel()) + ")"


def test_look_up_grid(gpu, surface_map, triangle_map, places, turned):
    (view, glsl), (_, at, w_at) = turned, places
    there = pixel_ray(at, K) / w_at[:, None] @ view[:3, :3].T + view[:3, 3]
    inputs = {"q": project(there, K), "w": 1 / there[:, 2:], "k": K[None]}
    inputs |= {"surface_map": surface_map, "triangle_map": triangle_map}
    light_map = np.random.default_rng(4).random((*surface_map.shape[:2], 4)).astype(F)
    seen = grid.look_up_grid(surface_map, triangle_map, inputs["w"][:, 0], inputs["q"], K, view, K)
    look = f"look_up_grid(surface_map, triangle_map, w, q, k, {glsl}, k)"
    close(gpu("grid.glsl", f"{look}.at, {look}.inverse_depth, 0", **inputs)[:, :2], seen.at, atol=2e-3)
    close(gpu("grid.glsl", f"{look}.inverse_depth, 0, 0, 0", **inputs), seen.inverse_depth, missed=0.005)
    answer = gpu("grid.glsl", f"{look}.pixel, {look}.triangle, {look}.is_whole ? 1.0 : 0.0", **inputs)
    close(answer, np.column_stack([seen.pixel, seen.triangle, seen.is_whole]), missed=0.005)
    close(
        gpu("grid.glsl", f"grid_color_position({look}), 0, 0", **inputs),
        grid.grid_color_position(seen),
        missed=0.005,
        atol=2e-3,
    )
    close(
        gpu("grid.glsl", f"grid_normal(surface_map, {look}), 0", **inputs),
        grid.grid_normal(surface_map, seen),
        missed=0.005,
        atol=2e-3,
    )
    call = f"grid_light(lit_map, {look}), 0"
    close(
        gpu("grid.glsl", call, **inputs, lit_map=light_map), grid.grid_light(light_map, seen), missed=0.005, atol=5e-3
    )
    assert 0.1 < (seen.triangle > 0).mean() < 0.9 and seen.is_whole.any()


def test_grid_facet(gpu, surface_map, triangle_map, places, turned):
    (view, glsl), (_, at, w_at) = turned, places
    there = pixel_ray(at, K) / w_at[:, None] @ view[:3, :3].T + view[:3, 3]
    inputs = {"q": project(there, K), "w": 1 / there[:, 2:], "k": K[None]}
    inputs |= {"surface_map": surface_map, "triangle_map": triangle_map}
    seen = grid.look_up_grid(surface_map, triangle_map, inputs["w"][:, 0], inputs["q"], K, view, K)
    look = f"look_up_grid(surface_map, triangle_map, w, q, k, {glsl}, k)"
    for found, mirror in zip(("middle", "facet"), grid.grid_facet(surface_map, seen, K), strict=True):
        body = f"vec3 middle, facet; grid_facet(surface_map, {look}, k, middle, facet);"
        close(gpu("grid.glsl", f"{found}, 0", before=body, **inputs), mirror, missed=0.005, atol=1e-3)


def test_triangle_weights(gpu):
    """In all 1; each corner has all of it at its own place."""
    place = np.random.default_rng(5).uniform(0, 1, (COUNT, 2)).astype(F)
    for triangle in (1, 2, 5, 6):
        weights = grid.triangle_weights(np.full(COUNT, triangle), place)
        close(gpu("grid.glsl", f"triangle_weights({triangle}, p)", p=place), weights)
        np.testing.assert_allclose(weights.sum(-1), 1, atol=1e-6)
        np.testing.assert_allclose(weights @ [(0, 0), (1, 0), (0, 1), (1, 1)], place, atol=1e-6)
