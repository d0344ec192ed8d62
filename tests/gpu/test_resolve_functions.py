"""splat_corners.glsl and resolve.glsl: each function is compared with its mirror, at edges and on planes."""

import numpy as np
import pytest

from ..reference import camera, resolve, texels
from ..reference import depth_lookup as look_up
from ..reference import splat_corners as corners
from ..reference.splat import carry_footprint
from ..reference.vectors import texel
from .test_shader_functions import COUNT, TARGET, VIEW, VIEW_GLSL, F

WIDTH, HEIGHT, EDGE = 24, 18, 12  # columns from EDGE on are another surface, much nearer
K = np.array([30.0, -28.0, 11.0, 9.0], F)
SEEN = "Seen(at, w, ivec2(p), own, corners_at(surface_map, at))"
SEE = f"see_splat(surface_map, ivec2(p), q, k, {VIEW_GLSL}, t, rim)"
LOOK = f"look_up(surface_map, w, h > 0.5, q, k, {VIEW_GLSL}, t)"


def two_planes(holes=0.0):
    """A surface map: a slanted plane, and another in front of its right half."""
    rng = np.random.default_rng(8)
    v, u = np.mgrid[0:HEIGHT, 0:WIDTH]
    ray = camera.pixel_ray(np.stack([u, v], -1).astype(F), K)
    normal = np.where(u[..., None] < EDGE, F([0.2, -0.1, -1]), F([-0.3, 0.2, -1]))
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    z = np.where(u < EDGE, F(-2), F(-1.2)) / (normal * ray).sum(-1)
    surface_map = np.concatenate([normal, z[..., None]], -1).astype(F)
    surface_map[rng.random((HEIGHT, WIDTH)) < holes] = 0
    return surface_map


def nearest_pixel(at):
    return np.clip(np.round(at), 0, (WIDTH - 1, HEIGHT - 1)).astype(int)


def positions(surface_map, margin=-1.5):
    """Random positions; in a hole nothing is ever seen."""
    rng = np.random.default_rng(4)
    at = rng.uniform(margin, (WIDTH - 1 - margin, HEIGHT - 1 - margin), (COUNT, 2)).astype(F)
    return at[texel(surface_map, nearest_pixel(at))[:, 3] > 0]


def seen_at(surface_map, at):
    """What is seen at these positions if it is the splat of the nearest pixel; and the same as inputs for the GPU."""
    pixel, w = nearest_pixel(at), np.full(len(at), 0.5, F)
    seen = resolve.Seen(at, w, pixel, texel(surface_map, pixel), corners.corners_at(surface_map, at))
    return seen, {"surface_map": surface_map, "at": at, "w": w[:, None], "p": pixel.astype(F), "own": seen.own}


def close(gpu_answer, mirror, missed=0, **tolerance):
    """Equal, except where a decision exactly on the border differs."""
    mirror = np.asarray(mirror).reshape(len(gpu_answer), -1)
    off = ~np.isclose(gpu_answer[:, : mirror.shape[1]], mirror, **({"atol": 1e-5, "rtol": 1e-5} | tolerance)).all(-1)
    assert off.sum() <= missed, (gpu_answer[off], mirror[off])


def test_surface_at_texel_at_and_corners_at(gpu):
    surface_map = two_planes(holes=0.1)
    at = positions(surface_map)
    expected = corners.corners_at(surface_map, at)
    call = "corners_at(surface_map, at)"
    inputs = {"surface_map": surface_map, "at": at}
    pixels = gpu("splat_corners.glsl", f"{call}.low, {call}.high", **inputs)
    assert (pixels == np.concatenate([expected.low, expected.high], -1)).all()
    for name in "abcd":
        assert (gpu("splat_corners.glsl", f"{call}.{name}", **inputs) == getattr(expected, name)).all()
    pixel = np.clip(np.floor(at), 0, (WIDTH - 1, HEIGHT - 1))
    answer = gpu("splat_corners.glsl", "surface_at(surface_map, ivec2(p))", surface_map=surface_map, p=pixel)
    assert (answer == corners.surface_at(surface_map, pixel.astype(int))).all()
    answer = gpu("splat_corners.glsl", "texel_at(surface_map, ivec2(p))", surface_map=-surface_map, p=pixel)
    assert (answer == texels.texel_at(-surface_map, pixel.astype(int))).all()
    pixel = pixel[:, ::-1] - 5  # some are outside
    answer = gpu("splat_corners.glsl", "texel_or_zero(surface_map, ivec2(p))", surface_map=surface_map, p=pixel)
    assert (answer == texels.texel_or_zero(surface_map, pixel.astype(int))).all()
    assert 0.1 < (answer != 0).any(-1).mean() < 0.9


def test_seen_corner_and_its_pixel_and_surface(gpu):
    surface_map = two_planes(holes=0.1)
    at = positions(surface_map)
    around = corners.corners_at(surface_map, at)
    w_at = np.where(np.random.default_rng(1).random(len(at)) < 0.5, F(0.5), F(0.8))
    side = corners.seen_corner(around, at, w_at)
    expected = [side, corners.corner_pixel(around, side), corners.corner_surface(around, side)]
    c, inputs = "corners_at(surface_map, at)", {"surface_map": surface_map, "at": at, "w": w_at[:, None]}
    calls = f"seen_corner({c}, at, w)", *(f"corner_{x}({c}, seen_corner({c}, at, w))" for x in ("pixel", "surface"))
    for call, mirror, rest in zip(calls, expected, (", 0, 0", ", 0, 0", ""), strict=True):
        close(gpu("splat_corners.glsl", call + rest, **inputs), mirror, missed=1)
    assert (side.mean(0) > 0.2).all() and (side.mean(0) < 0.8).all()
    assert (texel(surface_map, expected[1]) == expected[2]).all()


def test_seen_corner_beside_an_edge_is_on_the_surface_of_that_depth():
    surface_map, at = two_planes(), np.tile(F([EDGE - 0.5, 9.5]), (2, 1))
    around = corners.corners_at(surface_map, at)
    w_at = 1 / np.array([around.a[0, 3], around.b[0, 3]])
    assert corners.seen_corner(around, at, w_at)[:, 0].tolist() == [False, True]


def test_corner_weights(gpu):
    surface_map = two_planes(holes=0.1)
    at = positions(surface_map)
    seen, inputs = seen_at(surface_map, at)
    slope = np.random.default_rng(2).uniform(-5e-3, 5e-3, at.shape).astype(F)
    w = 1 / seen.own[:, 3]
    expected = corners.corner_weights(seen.corners, at, seen.pixel.astype(F), w, slope)
    call = "corner_weights(corners_at(surface_map, at), at, p, w, s)"
    answer = gpu("splat_corners.glsl", call, **(inputs | {"w": w[:, None], "s": slope}))
    close(answer, expected, missed=1)
    assert 0.2 < (expected > 0).mean() < 0.95


@pytest.fixture
def splats():
    """Pixels, and the target pixels near the middle of their splats."""
    rng = np.random.default_rng(6)
    surface_map = two_planes()
    pixel = rng.integers(0, (WIDTH, HEIGHT), (COUNT, 2))
    own = texel(surface_map, pixel)
    centre = carry_footprint(pixel.astype(F), own[:, 3], own[:, :3], K, VIEW, TARGET).centre
    target_pixel = (centre + rng.uniform(-1, 1, (COUNT, 2))).astype(F)
    return surface_map, pixel, target_pixel


def rim_depths():
    """1/z of the rims among the splats."""
    return np.where(np.arange(COUNT) % 4 == 0, F(0.6), F(0))


def test_see_splat(gpu, splats):
    surface_map, pixel, target_pixel = splats
    seen = resolve.see_splat(surface_map, pixel, target_pixel, K, VIEW, TARGET, rim_depths())
    inputs = {"surface_map": surface_map, "p": pixel.astype(F), "q": target_pixel, "k": K[None], "t": TARGET[None]}
    inputs["rim"] = rim_depths()[:, None]
    close(gpu("resolve.glsl", f"{SEE}.at, {SEE}.inverse_depth, 0", **inputs)[:, :2], seen.at, atol=1e-3)
    close(gpu("resolve.glsl", f"{SEE}.inverse_depth", **inputs), seen.inverse_depth)
    assert (gpu("resolve.glsl", f"{SEE}.pixel, 0, 0", **inputs)[:, :2] == seen.pixel).all()
    assert (gpu("resolve.glsl", f"{SEE}.own", **inputs) == seen.own).all()
    close(gpu("resolve.glsl", f"{SEE}.corners.d", **inputs), seen.corners.d, missed=1)


def test_look_up_finds_what_see_splat_saw(gpu, splats):
    """By 1/z alone. The margins of splats overlap, so sometimes the neighbour is found."""
    surface_map, pixel, target_pixel = splats
    drawn = resolve.see_splat(surface_map, pixel, target_pixel, K, VIEW, TARGET, np.zeros(COUNT, F))
    hidden = np.zeros((COUNT, 1), bool)
    found = resolve.look_up(surface_map, drawn.inverse_depth, hidden[:, 0], target_pixel, K, VIEW, TARGET)
    np.testing.assert_allclose(found.at, drawn.at, atol=1e-3)
    same = (found.pixel == pixel).all(-1)
    assert same.mean() > 0.8 and (np.abs(found.pixel - found.at)[found.own[:, 3] > 0] < 0.61).all()
    inputs = {"surface_map": surface_map, "q": target_pixel, "k": K[None], "t": TARGET[None]}
    inputs |= {"w": drawn.inverse_depth[:, None], "h": hidden}
    close(gpu("resolve.glsl", f"{LOOK}.at, {LOOK}.inverse_depth, 0", **inputs)[:, :2], found.at, atol=1e-3)
    close(gpu("resolve.glsl", f"{LOOK}.pixel, 0, 0", **inputs), found.pixel, missed=5)
    close(gpu("resolve.glsl", f"{LOOK}.own", **inputs), found.own, missed=5)


def test_what_is_hidden_in_the_frame_is_looked_up_at_the_pixel_whose_plane_goes_on(gpu):
    """The left plane goes on behind the right one; it is seen there by a formula, from the side."""
    surface_map = two_planes()
    surface_map[:, EDGE - 2 : EDGE + 2, 3] *= -1  # rims
    rng = np.random.default_rng(9)
    at = rng.uniform((EDGE - 0.4, 0), (EDGE + 1.3, HEIGHT - 1), (COUNT, 2)).astype(F)
    normal = surface_map[0, 0, :3]
    z = surface_map[0, 0, 3] * (normal @ camera.pixel_ray(np.zeros(2, F), K)) / (camera.pixel_ray(at, K) @ normal)
    there = camera.pixel_ray(at, K) * z[:, None] @ VIEW[:3, :3].T + VIEW[:3, 3]
    hidden, w = np.arange(COUNT)[:, None] % 4 > 0, (1 / there[:, 2:]).astype(F)
    inputs = {"surface_map": surface_map, "q": camera.project(there, TARGET), "k": K[None], "t": TARGET[None]}
    found = resolve.look_up(surface_map, w[:, 0], hidden[:, 0], inputs["q"], K, VIEW, TARGET)
    close(gpu("resolve.glsl", f"{LOOK}.pixel, {LOOK}.at", **inputs, w=w, h=hidden)[:, :2], found.pixel, missed=2)
    close(gpu("resolve.glsl", f"{LOOK}.at, 0, 0", **inputs, w=w, h=hidden), found.at, missed=2, atol=1e-3)
    assert (found.pixel[hidden[:, 0], 0] == EDGE - 1).all() and (found.at == found.pixel)[hidden[:, 0]].all()
    assert (found.pixel[hidden[:, 0], 1] == np.round(at[hidden[:, 0], 1])).mean() > 0.99
    np.testing.assert_allclose(found.at[~hidden[:, 0]], at[~hidden[:, 0]], atol=1e-3)


def test_hidden_mark(gpu):
    bits = np.random.default_rng(10).integers(0, 2**20, (COUNT, 1))
    hidden = np.arange(COUNT)[:, None] % 2 > 0
    marked = look_up.hidden_mark(bits.astype(np.uint32), hidden)
    close(gpu("depth_lookup.glsl", "float(hidden_mark(uint(b), h > 0.5))", b=bits, h=hidden), marked)
    assert ((marked & 1 == 1) == hidden).all() and (marked >> 1 == bits >> 1).all()


def test_seen_weights(gpu):
    surface_map = two_planes(holes=0.1)
    seen, inputs = seen_at(surface_map, positions(surface_map))
    expected = resolve.seen_weights(seen, K)
    close(gpu("resolve.glsl", f"seen_weights({SEEN}, k)", **inputs, k=K[None]), expected, missed=1)
    assert (expected[:, 0] > 0).any() and (expected == 0).any()


def test_weights_are_1_in_all_on_a_plane_and_0_across_an_edge():
    surface_map = two_planes()
    at = positions(surface_map, margin=1)
    seen, _ = seen_at(surface_map, at)
    weight = resolve.seen_weights(seen, K)
    across = np.stack([x[:, 0] for x in corners.four(seen.corners.low, seen.corners.high)], -1) < EDGE
    across = across != (seen.pixel[:, :1] < EDGE)
    assert across.any() and not weight[across].any()
    assert weight[~across.any(-1)].sum(-1) == pytest.approx(1, abs=1e-5)
    inside = ~across.any(-1) & (weight.min(-1) > 0)
    assert (resolve.color_position(seen, weight) == np.where(inside[:, None], at, seen.pixel)).all()


@pytest.mark.parametrize("few", [False, True])
def test_mix_normal_mix_light_and_color_position(gpu, few):
    """few: weights of almost 0, for which the value of the seen pixel is used."""
    surface_map = two_planes()
    seen, inputs = seen_at(surface_map, positions(surface_map))
    rng = np.random.default_rng(7)
    light_map, weight = rng.random((HEIGHT, WIDTH, 4)).astype(F), rng.random(seen.own.shape).astype(F)
    weight = np.where(rng.random(weight.shape) < 0.8, weight * F(1e-4 if few else 0.5), F(0))
    normal = resolve.mix_normal(seen, weight)
    close(gpu("resolve.glsl", f"mix_normal({SEEN}, m), 0", **inputs, m=weight), normal)
    light = resolve.mix_light(seen, weight, light_map)
    close(gpu("resolve.glsl", f"mix_light({SEEN}, m, light_map), 0", **inputs, m=weight, light_map=light_map), light)
    assert (light == texel(light_map, seen.pixel)[..., :3]).all() == few
    at = resolve.color_position(seen, weight)
    assert (gpu("resolve.glsl", f"color_position({SEEN}, m), 0, 0", **inputs, m=weight)[:, :2] == at).all()
    assert 0.2 < (at == seen.at).all(-1).mean() < 0.8


def test_a_picture_of_the_frame_s_size_is_read_at_the_corners_that_are_known(gpu):
    """With the very bits that picture_at finds, also beyond the outermost pixels."""
    surface_map = two_planes()
    seen, inputs = seen_at(surface_map, positions(surface_map, margin=-0.9))
    color_map = np.random.default_rng(7).random((HEIGHT, WIDTH, 4)).astype(F)
    weight, size = resolve.seen_weights(seen, K), np.array([[WIDTH, HEIGHT]], F)
    inputs |= {"m": weight, "color_map": color_map, "s": size}
    mixed = gpu("resolve.glsl", f"mix_color({SEEN}, m, color_map), 0", **inputs)
    close(mixed, resolve.mix_color(seen, weight, color_map))
    assert (mixed == gpu("resolve.glsl", f"picture_at(color_map, color_position({SEEN}, m), s), 0", **inputs)).all()
    assert 0.3 < (weight.min(-1) > 0).mean() < 0.99


def test_a_normal_mixed_on_a_plane_is_the_plane_s():
    surface_map = two_planes()
    seen, _ = seen_at(surface_map, positions(surface_map, margin=1))
    np.testing.assert_allclose(resolve.mix_normal(seen, resolve.seen_weights(seen, K)), seen.own[:, :3], atol=1e-6)
