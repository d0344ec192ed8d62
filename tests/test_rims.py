"""Rims: rim_marks.glsl, rims.glsl and rim_splat.glsl against their mirrors, and what they are for: clean outlines."""

import numpy as np
import pytest

import pointshade_gl as ps
from pointshade_gl.camera import view_matrix
from pointshade_gl.reference import rim_marks, rim_splat, rims
from pointshade_gl.reference.corners import surface_at
from pointshade_gl.reference.inverse_depth import pixel_grid
from pointshade_gl.reference.normals_star import estimate_star
from pointshade_gl.reference.rasterizers import rim_pairs
from pointshade_gl.reference.splat import carry_footprint
from pointshade_gl.reference.vectors import dot, texel

from . import frames
from .drivers import need_compute

F = np.float32
K = np.array(frames.CAMERA.intrinsics, F)
FOUND = "estimate_rim(surface_map, ivec2(p), k)"
AROUND = "look_around(surface_map, ivec2(p), k)"
CAMERA = ps.Camera(60.0, 60.0, 31.5, 23.5, 64, 48)
CENTRE, RADIUS = np.array([0.03, -0.02, 1.2]), 0.35


def surface_of(frame):
    """(h, w, 4) normals by the star, and depth with rims marked."""
    grid, k = pixel_grid(frame.depth), np.array(frame.camera.intrinsics, F)
    normals = estimate_star(frame.depth, grid, k, 0.0)[..., :3]
    return np.concatenate([normals, rim_marks.mark_rim(frame.depth, grid, k)[..., None]], -1).astype(F)


def rim_pixels(surface_map):
    return np.argwhere(surface_map[..., 3] < 0)[:, ::-1]


@pytest.fixture(scope="module")
def surface_map():
    """A sphere before a wall, with a few holes."""
    frame = frames.sphere_before_wall()
    missing = np.random.default_rng(8).random(frame.depth.shape) < 0.005
    return surface_of(ps.Frame(None, np.where(missing, 0, frame.depth), frame.camera))


@pytest.fixture(scope="module")
def turned():
    """The way to a camera on the side of the frame's pivot, and its GLSL."""
    view = view_matrix(np.eye(4), ps.orbit_pose(None, (0, 0, 1.5), 30, -10)).astype(F)
    return view, "mat4(" + ", ".join(f"{x:.9g}" for x in view.T.ravel()) + ")"


def close(answer, mirror, missed=0.0, **tolerance):
    """Equal, except for a share where a decision on its border fell differently."""
    mirror = np.asarray(mirror, float).reshape(len(answer), -1)
    same = np.isclose(answer[:, : mirror.shape[1]], mirror, **({"atol": 1e-4, "rtol": 1e-4} | tolerance)).all(-1)
    assert (~same).mean() <= missed, (answer[~same][:5], mirror[~same][:5])


def ball(camera, spot=CENTRE, radius=RADIUS):
    """A frame of a ball alone, and whether each ray hits it."""
    v, u = np.mgrid[0 : camera.height, 0 : camera.width]
    ray = np.stack([(u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy, np.ones(u.shape)], -1)
    a, b = (ray**2).sum(-1), ray @ spot
    rest = b * b - a * (spot @ spot - radius**2)
    depth = np.where(rest > 0, (b - np.sqrt(np.maximum(rest, 0))) / a, 0)
    return ps.Frame(None, depth.astype(F), camera)


def test_rim_marks(gpu):
    rng, k = np.random.default_rng(1), K[None]
    beside = rng.choice([0.0, -0.03, 0.2, -0.4, 1e6], (400, 4)).astype(F)
    facing, pixel = rng.normal(0, 1e-3, (400, 1)).astype(F), rng.integers(0, 3, (400, 2)).astype(F)
    focal, inside = rim_marks.mean_focal_length(K), pixel > 0
    inputs = {"b": beside, "f": facing, "k": k, "p": pixel}
    close(
        gpu("rim_marks.glsl", "rise_of(b.x, f, mean_focal_length(k)), 0, 0, 0", **inputs),
        rim_marks.rise_of(beside[:, 0], facing[:, 0], focal),
    )
    answer = gpu("rim_marks.glsl", "ends_along(b.xy, bvec2(p), f, mean_focal_length(k)), 0, 0, 0", **inputs)
    close(answer, rim_marks.ends_along(beside[:, :2], inside, facing[:, 0], focal))
    expected = rim_marks.is_rim(beside, pixel.T, (3, 4), K)
    close(gpu("rim_marks.glsl", "is_rim(b, ivec2(p), ivec2(3, 4), k), 0, 0, 0", **inputs), expected)
    assert 0.2 < expected.mean() < 0.9
    rises = rng.uniform(-30, 5, (400, 2)).astype(F)
    answer = gpu("rim_marks.glsl", "ends_before(s.x, s.y), 0, 0, 0", s=rises)
    close(answer, rim_marks.ends_before(rises[:, 0], rises[:, 1]))


@pytest.mark.parametrize("make", [frames.sphere_before_wall, frames.holes, frames.tilted_plane])
def test_mark_rim(gpu, make):
    depth = make().depth
    grid = pixel_grid(depth)
    expected = rim_marks.mark_rim(depth, grid, K)
    for rows in np.array_split(np.stack(grid, -1), 2):  # no texture is large enough for all in a row
        inputs = {"depth_map": depth, "p": rows.reshape(-1, 2), "k": K[None]}
        answer = gpu("rim_marks.glsl", "mark_rim(depth_map, ivec2(p), k), 0, 0, 0", **inputs)
        assert (answer[:, 0] == texel(expected, rows.astype(int)).ravel()).all()
    assert (np.abs(expected) == depth).all()


def test_the_border_of_the_picture_is_no_rim_and_a_slanted_plane_has_none():
    depth = frames.tilted_plane().depth
    assert (rim_marks.mark_rim(depth, pixel_grid(depth), K) > 0).all()


def test_rims(gpu, surface_map):
    pixel = rim_pixels(surface_map)
    inputs = {"surface_map": surface_map, "p": pixel.astype(F), "k": K[None]}
    around = rims.look_around(surface_map, pixel, K)
    off = np.random.default_rng(2).integers(-2, 3, (len(pixel), 2))
    call = "rise_at(surface_map, ivec2(p), ivec2(o), z, f, mean_focal_length(k)), 0, 0, 0"
    own = {"z": around.here[:, None], "f": around.facing, "o": off.astype(F)}
    expected = rims.rise_at(surface_map, pixel, off, around.here, around.facing, around.focal)
    close(gpu("rims.glsl", call, **inputs, **own), expected, atol=1e-2)
    answer = gpu("rims.glsl", f"{AROUND}.here, {AROUND}.facing, {AROUND}.focal", **inputs)
    close(answer, np.stack([around.here, *around.facing.T, np.full(len(pixel), around.focal)], -1))
    bits = gpu("rims.glsl", f"{AROUND}.own & 4095, {AROUND}.own >> 12, 0, 0", **inputs)
    close(bits, np.stack([around.own & 4095, around.own >> 12], -1), missed=0.002)
    found = rims.estimate_rim(surface_map, pixel, K)
    answer = gpu("rims.glsl", f"{FOUND}.outward, {FOUND}.width, {FOUND}.drop", **inputs)
    close(answer, np.column_stack(found), missed=0.005, atol=1e-2, rtol=1e-2)
    assert (found.drop > 0).mean() > 0.1 and (found.drop == 0).mean() > 0.1


def test_borders_of_pixels(gpu):
    rng = np.random.default_rng(3)
    bits, direction = rng.random((300, 5, 5)) < 0.7, rims.OUTWARD[rng.integers(0, 4, 300)]
    slope, where = rng.uniform(-1, 1, 200), rng.uniform(-2, 2, 200)
    v, u = np.mgrid[-2:3, -2:3]
    bits[:200] = u < where[:, None, None] + slope[:, None, None] * v
    own = (bits.reshape(300, 25) << np.arange(25)).sum(-1)
    parts = {"l": (own & 4095)[:, None], "h": (own >> 12)[:, None], "o": direction}
    mask = "int(l) | int(h) << 12"
    line = rims.border_line(own, direction)
    close(gpu("rims.glsl", f"border_line({mask}, ivec2(o)), 0", **parts), line)
    close(gpu("rims.glsl", f"is_own({mask}, ivec2(o)), 0, 0, 0", **parts), rims.is_own(own, direction))
    inputs = {"a": line, "o": direction, "d": rng.uniform(0, 1.2, (300, 1))}
    close(gpu("rims.glsl", "border_distance(a), 0, 0, 0", **inputs), rims.border_distance(line))
    held = rims.held_distance(inputs["d"][:, 0].astype(F), line)
    close(gpu("rims.glsl", "held_distance(d, a), 0, 0, 0", **inputs), held)
    rim = rims.straight_rim(line, direction)
    call = "straight_rim(a, ivec2(o))"
    close(gpu("rims.glsl", f"{call}.outward, {call}.width, {call}.drop", **inputs), np.column_stack(rim))


def test_bent_rim(gpu, surface_map):
    pixel = rim_pixels(surface_map)
    direction = rims.OUTWARD[np.random.default_rng(4).integers(0, 4, len(pixel))]
    straight = rims.Rim(np.tile(F([0.6, 0.8]), (len(pixel), 1)), np.full(len(pixel), F(0.3)), np.zeros(len(pixel), F))
    around = rims.look_around(surface_map, pixel, K)
    rise = rims.rise_at(surface_map, pixel, -direction, around.here, around.facing, around.focal)
    line = rims.border_line(around.own, direction)
    expected = rims.bent_rim(surface_map, around, direction, rise, line, straight)
    call = f"bent_rim(surface_map, {AROUND}, ivec2(o), a, l, Rim(vec2(0.6, 0.8), 0.3, 0.0))"
    inputs = {
        "surface_map": surface_map,
        "p": pixel.astype(F),
        "k": K[None],
        "o": direction,
        "a": rise[:, None],
        "l": line,
    }
    answer = gpu("rims.glsl", f"{call}.outward, {call}.width, {call}.drop", **inputs)
    close(answer, np.column_stack(expected), missed=0.005, atol=1e-2, rtol=1e-2)
    assert (expected.drop > 0).mean() > 0.05


def test_rim_splat(gpu, surface_map, turned):
    view, glsl = turned
    pixel = rim_pixels(surface_map)
    centre, own = pixel.astype(F), surface_at(surface_map, pixel)
    rim = rims.estimate_rim(surface_map, pixel, K)
    splat = carry_footprint(centre, own[:, 3], own[:, :3], K, view, K)
    box = rim_splat.rim_box(rim, centre, own, K, view, K)
    q = np.round(np.random.default_rng(5).uniform(box[:, :2], box[:, 2:])).astype(F)
    inputs = {"n": rim.outward, "s": np.column_stack([rim.width, rim.drop]), "p": centre, "own": own, "k": K[None]}
    made, w = "Rim(n, s.x, s.y)", splat.inverse_depth[:, None]
    close(gpu("rim_splat.glsl", f"rim_reach({made})", **inputs), rim_splat.rim_reach(rim))
    close(gpu("rim_splat.glsl", f"rim_diameter({made}), 0, 0, 0", **inputs), rim_splat.rim_diameter(rim))
    call = f"rim_slope({made}, pixel_ray(p, k), own, k), 0, 0"
    ray = rim_splat.pixel_ray(centre, K)
    close(gpu("rim_splat.glsl", call, **inputs), rim_splat.rim_slope(rim, ray, own, K))
    close(gpu("rim_splat.glsl", f"rim_box({made}, p, own, k, {glsl}, k)", **inputs), box, atol=1e-2)
    call = f"rim_inverse_depth({made}, p, own, w, q, k, {glsl}, k), 0, 0, 0"
    expected = rim_splat.rim_inverse_depth(rim, centre, own, splat.inverse_depth, q, K, view, K)
    close(gpu("rim_splat.glsl", call, **inputs, w=w, q=q), expected, missed=0.01)
    assert (expected > 0).mean() > 0.1 and (expected == 0).any()
    call = f"draws_rim(carry_footprint(p, own.w, own.xyz, k, {glsl}, t), own.w, k, t), 0, 0, 0"
    for enlarged in (1, 20):
        target = K * F(enlarged)
        footprint = carry_footprint(centre, own[:, 3], own[:, :3], K, view, target)
        drawn = rim_splat.draws_rim(footprint, own[:, 3], K, target)
        close(gpu("rim_splat.glsl", call, **inputs, t=target[None]), drawn)
        assert drawn.any() == (enlarged == 1)


def test_roots_of(gpu):
    numbers = np.random.default_rng(6).normal(size=(300, 3)).astype(F)
    numbers[0], numbers[1] = (1, -3, 0), (2, 4, 2)  # a root of 0, and a double one
    roots = rim_splat.roots_of(*numbers.T)
    close(gpu("rim_splat.glsl", "roots_of(a.x, a.y, a.z), 0, 0", a=numbers), roots, missed=0.01, rtol=1e-3)
    assert (roots[:, 0] == rim_marks.BOTTOMLESS).any() and roots[1].tolist() == [-1, -1]


def test_the_outline_of_a_ball_is_found_between_the_pixels():
    """From the pixel outward by the width, the ball ends: there the ray touches it. Its drop leads to that depth."""
    frame = ball(ps.Camera(300.0, 300.0, 159.5, 119.5, 320, 240))
    k, surface = np.array(frame.camera.intrinsics, F), surface_of(frame)
    pixel = rim_pixels(surface)
    rim = rims.estimate_rim(surface, pixel, k)
    bent = rim.drop > 0
    assert bent.mean() > 0.9
    end = pixel + rim.outward * rim.width[:, None]
    ray = rim_splat.pixel_ray(end, k)
    ray /= np.linalg.norm(ray, axis=-1, keepdims=True)
    touch = CENTRE @ CENTRE - RADIUS**2
    off = (np.sqrt(np.maximum(CENTRE @ CENTRE - (ray @ CENTRE) ** 2, 0)) - RADIUS) / 1.2 * 300
    assert np.abs(off[bent]).mean() < 0.1 and np.quantile(np.abs(off[bent]), 0.95) < 0.4
    # The outline's depth, where the ray touches the ball, in pixels behind the pixel's own.
    z = np.sqrt(touch) * ray[:, 2]
    own = frame.depth[pixel[:, 1], pixel[:, 0]]
    drop = 300 * (1 - own / z)
    assert np.median(np.abs(rim.drop - drop)[bent] / drop[bent]) < 0.15
    centre = CENTRE[:2] / CENTRE[2] * 300 + (159.5, 119.5)
    assert (dot(rim.outward, (pixel - centre).astype(F)) > 0).all()


def test_a_rim_at_the_own_camera_is_its_pixel():
    surface = surface_of(frames.holes())
    pixel = rim_pixels(surface)
    index = pixel[:, 1] * frames.CAMERA.width + pixel[:, 0]
    pairs = rim_pairs(surface, index, frames.CAMERA, frames.CAMERA, np.eye(4, dtype=F), 0.01)
    assert (pairs.source_index == index).all() and (pairs.q == pixel).all()


@pytest.mark.parametrize("kind", ["compute", "points"])
@pytest.mark.parametrize("yaw", [20, 40])
def test_the_silhouette_of_a_turned_ball_is_clean(kind, yaw, renderer):
    """As long as the true one of what the frame saw, where strips would make it a comb."""
    if kind == "compute":
        need_compute(renderer)
    frame, pose = ball(frames.CAMERA), ps.orbit_pose(None, CENTRE, yaw, 5)
    with ps.Renderer(rasterizer=kind) as made:
        drawn = made.render(frame, pose=pose)[..., 3] > 0
    # Truth: of the points that the turned camera sees on the ball, those that the frame's camera saw.
    v, u = np.mgrid[0:120, 0:160]
    ray = rim_splat.pixel_ray(np.stack([u, v], -1).astype(F), K) @ pose[:3, :3].T
    start = pose[:3, 3] - CENTRE
    a, b, c = (ray**2).sum(-1), ray @ start, start @ start - RADIUS**2
    rest = b * b - a * c
    seen = np.zeros(rest.shape, bool)
    for sign in (-1, 1):
        at = pose[:3, 3] + ((-b + sign * np.sqrt(np.maximum(rest, 0))) / a)[..., None] * ray
        seen |= (rest > 0) & (((at - CENTRE) * at).sum(-1) < 0)
    assert (drawn != seen).mean() < 0.004
    assert around(drawn) < 1.1 * around(seen)


def around(mask):
    return (mask[1:] != mask[:-1]).sum() + (mask[:, 1:] != mask[:, :-1]).sum()


def test_only_footprints_of_size_1_have_rims(renderer):
    """A size that differs for one far pixel leaves strips at the outline: the sizes are the caller's."""
    frame, pose = ball(CAMERA), ps.orbit_pose(None, CENTRE, 40, 5)
    one, other = (renderer.render(frame, pose=pose, size=size) for size in (1.0, 1.001))
    assert around(one[..., 3] > 0) < around(other[..., 3] > 0)


@pytest.mark.parametrize("method", ["star", "adaptive", "triangles-8", "central", "one-sided", "plane-fit-5", "given"])
def test_all_estimators_mark_the_same_rims(renderer, method):
    frame = ball(CAMERA)
    given = renderer.estimate_normals(frame, "star") if method == "given" else method
    pose = ps.orbit_pose(None, CENTRE, 40, 5)
    drawn = renderer.render(frame, pose=pose, normals=given)[..., 3] > 0
    star = renderer.render(frame, pose=pose, normals="star")[..., 3] > 0
    assert (drawn != star).mean() < 0.004


def test_a_picture_upside_down_has_the_same_rims():
    """Negative fy, as in ICL-NUIM."""
    camera = ps.Camera(60.0, -60.0, CAMERA.cx, CAMERA.height - 1 - CAMERA.cy, CAMERA.width, CAMERA.height)
    frame = ball(CAMERA)
    surface, other = surface_of(frame), surface_of(ps.Frame(None, frame.depth[::-1].copy(), camera))
    pixel = rim_pixels(surface)
    mirrored = np.stack([pixel[:, 0], CAMERA.height - 1 - pixel[:, 1]], -1)
    assert (texel(other, mirrored)[:, 3] == texel(surface, pixel)[:, 3]).all()
    rim = rims.estimate_rim(surface, pixel, np.array(CAMERA.intrinsics, F))
    same = rims.estimate_rim(other, mirrored, np.array(camera.intrinsics, F))
    np.testing.assert_allclose(same.outward * [1, -1], rim.outward, atol=1e-4)
    np.testing.assert_allclose(same.width, rim.width, atol=1e-4)
    np.testing.assert_allclose(same.drop, rim.drop, rtol=1e-3)


def test_a_frame_with_more_rims_than_the_list_has_room_for_is_drawn_with_all_of_them(renderer):
    """Every other pixel stands out: both rasterisers show the same of it."""
    depth = np.where(np.indices((60, 80)).sum(0) % 2, 1.0, 2.0)
    frame = ps.Frame(None, depth, ps.Camera(100, 100, 39.5, 29.5, 80, 60))
    images = []
    for rasterizer in ("auto", "points"):
        with ps.Renderer(rasterizer=rasterizer) as own:
            images.append(own.render(frame, yaw=10, normals="star"))
    covered = [image[..., 3] > 0 for image in images]
    assert (covered[0] != covered[1]).mean() < 0.01
    assert covered[0].mean() > 0.5
