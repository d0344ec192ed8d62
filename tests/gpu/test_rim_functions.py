"""rim_marks.glsl, rims.glsl and rim_splat.glsl: each function is compared with its mirror, at outlines and creases."""

import numpy as np
import pytest

import pointshade_gl as ps
from pointshade_gl.bench.scenes import box, grey, pose_at
from pointshade_gl.bench.tracing import as_frame, moved_surface, plane, sphere, trace
from pointshade_gl.scene.camera import view_matrix

from ..reference import rim_marks, rim_splat, rims
from ..reference.inverse_depth import pixel_grid
from ..reference.normals_star import estimate_star
from ..reference.splat import carry_footprint
from ..reference.splat_corners import surface_at
from ..reference.vectors import texel
from ..support import frames

F = np.float32
K = np.array(frames.CAMERA.intrinsics, F)
FOUND = "estimate_rim(surface_map, ivec2(p), k)"
AROUND = "look_around(surface_map, ivec2(p), k)"
MADE = "Rim(s.xy, s.z, s.w, t, h, mat4x3(a, b, c, d))"


def surface_of(frame):
    """(h, w, 4) normals by the star, and depth with rims marked."""
    grid, k = pixel_grid(frame.depth), np.array(frame.camera.intrinsics, F)
    normals = estimate_star(frame.depth, grid, k, 0.0)[..., :3]
    return np.concatenate([normals, rim_marks.mark_rim(frame.depth, grid, k)[..., None]], -1).astype(F)


def rim_pixels(surface_map):
    return np.argwhere(surface_map[..., 3] < 0)[:, ::-1]


def things_before_wall():
    """A box of which two sides and the top are seen, and a ball; the wall goes on behind them."""
    turned = moved_surface(box((0.25, 0.25, 0.25)), pose_at((-0.35, 0.05, 1.5), 35, -20))
    things = [turned, sphere((0.35, 0.02, 1.5), 0.35, grey), plane((0.1, 0, -1), (0, 0, 2.4), grey)]
    return as_frame(trace(things, frames.CAMERA), frames.CAMERA)


@pytest.fixture(scope="module")
def surface_map():
    """With a few holes."""
    frame = things_before_wall()
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


def found_rims(surface_map):
    """Rim pixels, their rims, and both as inputs of MADE."""
    pixel = rim_pixels(surface_map)
    rim = rims.estimate_rim(surface_map, pixel, K)
    made = {"s": np.column_stack(rim[:3]), "t": rim.slope, "h": rim.hidden}
    made |= dict(zip("abcd", np.moveaxis(rim.folds, 1, 0), strict=True))
    return pixel, rim, made | {"p": pixel.astype(F), "k": K[None]}


def test_rim_marks(gpu):
    rng, k, noise, most = np.random.default_rng(1), K[None], F(0.005), F(3.9)
    beside = rng.choice([0.0, -0.03, 0.02, 0.2, -0.4, 1e6], (400, 4)).astype(F)
    facing, pixel = rng.normal(0, 1e-3, (400, 1)).astype(F), rng.integers(0, 3, (400, 2)).astype(F)
    focal, inside = rim_marks.mean_focal_length(K), pixel > 0
    inputs = {"b": beside, "f": facing, "k": k, "p": pixel, "m": np.full((1, 1), most), "s": np.full((1, 1), noise)}
    close(
        gpu("rim_marks.glsl", "rise_of(b.x, f, mean_focal_length(k)), 0, 0, 0", **inputs),
        rim_marks.rise_of(beside[:, 0], facing[:, 0], focal),
    )
    answer = gpu("rim_marks.glsl", "ends_along(b.xy, bvec2(p), f, mean_focal_length(k), m), 0, 0, 0", **inputs)
    close(answer, rim_marks.ends_along(beside[:, :2], inside, facing[:, 0], focal, most))
    expected = rim_marks.is_rim(beside, pixel.T, (3, 4), K, noise)
    close(gpu("rim_marks.glsl", "is_rim(b, ivec2(p), ivec2(3, 4), k, s), 0, 0, 0", **inputs), expected)
    assert 0.2 < expected.mean() < 0.95
    rises = rng.uniform(-30, 5, (400, 2)).astype(F)
    answer = gpu("rim_marks.glsl", "ends_before(s.x, s.y), 0, 0, 0", s=rises)
    close(answer, rim_marks.ends_before(rises[:, 0], rises[:, 1]))


@pytest.mark.parametrize("noise", [0.0, 0.002])
@pytest.mark.parametrize("make", [frames.sphere_before_wall, frames.holes, frames.tilted_plane, things_before_wall])
def test_mark_rim(gpu, make, noise):
    depth = make().depth
    grid = pixel_grid(depth)
    expected = rim_marks.mark_rim(depth, grid, K, noise)
    for rows in np.array_split(np.stack(grid, -1), 2):  # no texture is large enough for all in a row
        inputs = {"depth_map": depth, "p": rows.reshape(-1, 2), "k": K[None], "s": np.full((1, 1), noise)}
        answer = gpu("rim_marks.glsl", "mark_rim(depth_map, ivec2(p), k, s), 0, 0, 0", **inputs)
        assert (answer[:, 0] == texel(expected, rows.astype(int)).ravel()).all()
    assert (np.abs(expected) == depth).all()


def test_directions(gpu):
    k = np.arange(4)
    answer = gpu("rims.glsl", "direction_of(int(n)), 0, 0", n=k[:, None])
    assert (answer[:, :2] == rims.direction_of(k)).all()
    assert rims.direction_of(k).tolist() == [[-1, 0], [1, 0], [0, -1], [0, 1]]


def test_where_other_frames_cut_rims_off(gpu):
    rng = np.random.default_rng(7)
    votes, off = rng.uniform(-4, 4, (500, 2)).astype(F), rng.uniform(-1, 1, (500, 2)).astype(F)
    cuts = rim_marks.end_cut(votes[:, 0], votes[:, 1])
    close(gpu("rim_marks.glsl", "end_cut(v.x, v.y), 0, 0, 0", v=votes), cuts)
    around = np.stack([np.roll(cuts, k) for k in range(4)], -1)
    cut_off = rim_marks.is_cut_off(around, off)
    answer = gpu("rim_marks.glsl", "float(is_cut_off(c, o)), 0, 0, 0", c=around, o=off)[:, 0]
    assert (answer != cut_off).sum() <= 1 and 0.2 < cut_off.mean() < 0.8
    half = np.array([rim_marks.end_cut(F(1), F(-1)), 0, 0, 0], F)  # as many for it here as against it at the next pixel
    to_left = np.array([(-0.45, 0.9), (-0.55, 0), (0.9, 0)], F)
    assert rim_marks.is_cut_off(half, to_left).tolist() == [False, True, False]


def test_look_around(gpu, surface_map):
    pixel = rim_pixels(surface_map)
    inputs = {"surface_map": surface_map, "p": pixel.astype(F), "k": K[None]}
    around = rims.look_around(surface_map, pixel, K)
    off = np.random.default_rng(2).integers(-2, 3, (len(pixel), 2))
    expected = rims.rise_around(surface_map, around, off)
    call = "rise_at(surface_map, ivec2(p), ivec2(o), z, f, mean_focal_length(k)), 0, 0, 0"
    own = {"z": around.here[:, None], "f": around.facing, "o": off.astype(F)}
    close(gpu("rims.glsl", call, **inputs, **own), expected, atol=1e-2)
    call = f"rise_around(surface_map, {AROUND}, ivec2(o)), 0, 0, 0"
    close(gpu("rims.glsl", call, **inputs, o=off.astype(F)), expected, atol=1e-2)
    answer = gpu("rims.glsl", f"{AROUND}.here, {AROUND}.facing, {AROUND}.focal", **inputs)
    close(answer, np.stack([around.here, *around.facing.T, np.full(len(pixel), around.focal)], -1))
    close(gpu("rims.glsl", f"{AROUND}.tilt, 0, 0", **inputs), around.tilt, missed=0.005, atol=1e-2, rtol=1e-3)
    for name in ("rises", "farther"):
        close(gpu("rims.glsl", f"{AROUND}.{name}", **inputs), getattr(around, name), atol=1e-2)
    bits = gpu("rims.glsl", f"own_pixels(surface_map, {AROUND}) & 4095, own_pixels(surface_map, {AROUND}) >> 12, 0, 0",
               **inputs)  # fmt: skip
    own = rims.own_pixels(surface_map, around)
    close(bits, np.stack([own & 4095, own >> 12], -1), missed=0.002)


def test_borne_out_and_is_less(gpu):
    rng = np.random.default_rng(9)
    tilt, rises = rng.uniform(-8, 8, (300, 2)).astype(F), rng.uniform(-20, 20, (300, 4)).astype(F)
    expected = rims.borne_out(tilt, rises)
    close(gpu("rims.glsl", "borne_out(t, r), 0, 0", t=tilt, r=rises), expected)
    assert 0.1 < expected.mean() < 0.9
    close(gpu("rims.glsl", "is_less(r, t.x)", t=tilt[:1], r=rises), rims.is_less(rises, tilt[0, 0]))


def test_hidden_pixels_and_folds(gpu, surface_map):
    pixel = rim_pixels(surface_map)
    inputs = {"surface_map": surface_map, "p": pixel.astype(F), "k": K[None]}
    around = rims.look_around(surface_map, pixel, K)
    hidden = rims.hidden_pixels(around)
    close(gpu("rims.glsl", f"hidden_pixels({AROUND})", **inputs), hidden, missed=0.005)
    assert {0, 1, 2} == set(hidden.ravel())
    found = np.stack([rims.fold_at(surface_map, around, k, K) for k in range(4)], 1)
    for k in range(4):
        answer = gpu("rims.glsl", f"fold_at(surface_map, {AROUND}, {k}, k), 0", **inputs)
        close(answer, found[:, k], missed=0.005, atol=1e-3)
    assert (found[..., 0] > 0).any()


def test_estimate_rim(gpu, surface_map):
    pixel, rim, _ = found_rims(surface_map)
    inputs = {"surface_map": surface_map, "p": pixel.astype(F), "k": K[None]}
    outline = rims.estimate_outline(surface_map, rims.look_around(surface_map, pixel, K))
    for call, mirror in ((FOUND, rim), (f"estimate_outline(surface_map, {AROUND})", outline)):
        answer = gpu("rims.glsl", f"{call}.outward, {call}.width, {call}.drop", **inputs)
        close(answer, np.column_stack(mirror[:3]), missed=0.005, atol=1e-2, rtol=1e-2)
    assert (rim.drop > 0).mean() > 0.1 and (rim.drop == 0).mean() > 0.1


def test_estimate_what_a_rim_hides(gpu, surface_map):
    pixel, rim, _ = found_rims(surface_map)
    inputs = {"surface_map": surface_map, "p": pixel.astype(F), "k": K[None]}
    close(gpu("rims.glsl", f"{FOUND}.slope, 0, 0", **inputs), rim.slope, missed=0.005)
    close(gpu("rims.glsl", f"{FOUND}.hidden", **inputs), rim.hidden, missed=0.01)
    for k in range(4):
        close(gpu("rims.glsl", f"{FOUND}.folds[{k}], 0", **inputs), rim.folds[:, k], missed=0.005, atol=1e-3)


def test_borders_of_pixels(gpu):
    rng = np.random.default_rng(3)
    bits, direction = rng.random((300, 5, 5)) < 0.7, rims.direction_of(rng.integers(0, 4, 300))
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
    close(gpu("rims.glsl", f"{call}.outward, {call}.width, {call}.drop", **inputs), np.column_stack(rim[:3]))


def test_rim_at_is_nothing_but_an_outline(gpu):
    numbers = np.random.default_rng(10).random((20, 4)).astype(F)
    rim, call = rims.rim_at(numbers[:, :2], numbers[:, 2], numbers[:, 3]), "rim_at(a.xy, a.z, a.w)"
    assert (gpu("rims.glsl", f"{call}.outward, {call}.width, {call}.drop", a=numbers) == numbers).all()
    assert (np.column_stack(rim[:3]) == numbers).all()
    rest = gpu("rims.glsl", f"{call}.slope.x, {call}.hidden.xy, {call}.folds[3].z", a=numbers)
    assert not rest.any() and not any(part.any() for part in rim[3:])


def test_bent_rim(gpu, surface_map):
    pixel = rim_pixels(surface_map)
    direction, count = rims.direction_of(np.random.default_rng(4).integers(0, 4, len(pixel))), len(pixel)
    straight = rims.rim_at(np.tile(F([0.6, 0.8]), (count, 1)), np.full(count, F(0.3)), np.zeros(count, F))
    around = rims.look_around(surface_map, pixel, K)
    own, rise = rims.own_pixels(surface_map, around), rims.rise_around(surface_map, around, -direction)
    line = rims.border_line(own, direction)
    expected = rims.bent_rim(surface_map, around, own, direction, rise, line, straight)
    seen = f"own_pixels(surface_map, {AROUND})"
    call = f"bent_rim(surface_map, {AROUND}, {seen}, ivec2(o), a, l, rim_at(vec2(0.6, 0.8), 0.3, 0.0))"
    inputs = {"surface_map": surface_map, "p": pixel.astype(F), "k": K[None], "o": direction}
    answer = gpu(
        "rims.glsl", f"{call}.outward, {call}.width, {call}.drop", **inputs, a=rise[:, None], l=line
    )  # fmt: skip
    close(answer, np.column_stack(expected[:3]), missed=0.005, atol=1e-2, rtol=1e-2)
    assert (expected.drop > 0).mean() > 0.05


def test_where_rims_reach(gpu, surface_map):
    _, rim, inputs = found_rims(surface_map)
    off = np.random.default_rng(11).uniform(-3, 3, (len(rim.width), 2)).astype(F)
    off[::2] *= F([0.1, 1])
    opened, reach = rim_splat.open_reach(rim), rim_splat.rim_reach(rim)
    close(gpu("rim_splat.glsl", f"open_reach({MADE})", **inputs), opened)
    close(gpu("rim_splat.glsl", f"rim_reach({MADE})", **inputs), reach)
    answer = gpu("rim_splat.glsl", f"is_hidden({MADE}, o), 0, 0, 0", **inputs, o=off)
    close(answer, rim_splat.is_hidden(rim, off))
    comes = rim_splat.rim_comes_to(off, opened, reach)
    close(gpu("rim_splat.glsl", "rim_comes_to(o, x, y), 0, 0, 0", o=off, x=opened, y=reach), comes)
    assert (comes & rim_splat.is_hidden(rim, off)).any() and not comes.all()
    close(gpu("rim_splat.glsl", f"rim_diameter({MADE}), 0, 0, 0", **inputs), rim_splat.rim_diameter(rim))


def test_slopes_and_folds_of_rims(gpu, surface_map, turned):
    pixel, rim, inputs = found_rims(surface_map)
    ray, focal = rim_splat.pixel_ray(pixel.astype(F), K), rims.mean_focal_length(K)
    slope = rim_splat.rim_slope(rim, ray, K)
    close(gpu("rim_splat.glsl", f"rim_slope({MADE}, pixel_ray(p, k), k), 0, 0", **inputs), slope)
    rng = np.random.default_rng(12)
    off = rng.uniform(-1, 1, pixel.shape).astype(F)
    call = f"fold_drop({MADE}, l, o, mean_focal_length(k)), 0, 0, 0"
    drop = rim_splat.fold_drop(rim, slope, off, focal)
    close(gpu("rim_splat.glsl", call, **inputs, l=slope, o=off), drop, atol=1e-3)
    assert (drop > 0).any() and (drop >= 0).all()
    before, start = rng.normal(0, 1, pixel.shape).astype(F), np.column_stack([off, np.ones(len(off))]).astype(F)
    change, closer = rng.normal(0, 1, start.shape).astype(F), rng.uniform(0.8, 1.2, (len(pixel), 1)).astype(F)
    met = rim_splat.meet_folds(rim, before.T, closer[:, 0], focal, start, change)
    call = f"meet_folds({MADE}, e, z, mean_focal_length(k), x, y), 0, 0, 0"
    lines = {"e": before, "z": closer, "x": start, "y": change}
    close(gpu("rim_splat.glsl", call, **inputs, **lines), met, missed=0.005, rtol=1e-3)
    assert (met == rim_marks.BOTTOMLESS).any() and (met > rim_marks.BOTTOMLESS).any()


def test_rims_in_a_view(gpu, surface_map, turned):
    (view, glsl), (pixel, rim, inputs) = turned, found_rims(surface_map)
    centre, own = pixel.astype(F), surface_at(surface_map, pixel)
    splat = carry_footprint(centre, own[:, 3], own[:, :3], K, view, K)
    box = rim_splat.rim_box(rim, centre, own, K, view, K)
    inputs |= {"own": own, "w": splat.inverse_depth[:, None]}
    inputs["q"] = np.round(np.random.default_rng(5).uniform(box[:, :2], box[:, 2:])).astype(F)
    close(gpu("rim_splat.glsl", f"rim_box({MADE}, p, own, k, {glsl}, k)", **inputs), box, atol=1e-2)
    call = f"meet_rim({MADE}, p, own, w, q, k, {glsl}, k), 0"
    met, off = rim_splat.meet_rim(rim, centre, own, splat.inverse_depth, inputs["q"], K, view, K)
    answer = gpu("rim_splat.glsl", call, **inputs)
    close(answer[:, :1], met, missed=0.01)
    close(answer[:, 1:], off, missed=0.01, atol=1e-3)
    assert (met > 0).mean() > 0.1 and (met == 0).any()


def test_draws_rim(gpu, surface_map, turned):
    (view, glsl), pixel = turned, rim_pixels(surface_map)
    centre, own = pixel.astype(F), surface_at(surface_map, pixel)
    call = f"draws_rim(carry_footprint(p, own.w, own.xyz, k, {glsl}, t), own.w, k, t), 0, 0, 0"
    for enlarged in (1, 20):
        target = K * F(enlarged)
        footprint = carry_footprint(centre, own[:, 3], own[:, :3], K, view, target)
        drawn = rim_splat.draws_rim(footprint, own[:, 3], K, target)
        close(gpu("rim_splat.glsl", call, p=centre, own=own, k=K[None], t=target[None]), drawn)
        assert drawn.any() == (enlarged == 1)


def test_roots_of(gpu):
    numbers = np.random.default_rng(6).normal(size=(300, 3)).astype(F)
    numbers[0], numbers[1] = (1, -3, 0), (2, 4, 2)  # a root of 0, and a double one
    roots = rim_splat.roots_of(*numbers.T)
    close(gpu("rim_splat.glsl", "roots_of(a.x, a.y, a.z), 0, 0", a=numbers), roots, missed=0.01, rtol=1e-3)
    assert (roots[:, 0] == rim_marks.BOTTOMLESS).any() and roots[1].tolist() == [-1, -1]
