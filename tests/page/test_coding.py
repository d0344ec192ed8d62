"""What a page keeps of a picture: exactly what it says, in few bytes, and the page's script reads the same."""

import numpy as np
import pytest

from pointshade_gl.page import parts as coding
from pointshade_gl.page.parts import QUALITIES

from ..support.page_functions import run_script


def decode_depth(codes, nearest, step):
    """Mirror of decode.js."""
    return nearest * np.exp(codes * step)


def decode_normals(codes, bits):
    """Mirror of decode.js."""
    u, v = (codes / (2**bits - 1) * 2 - 1).T
    z = np.abs(u) + np.abs(v) - 1
    inward = np.maximum(z, 0)
    x, y = (a - np.where(a >= 0, inward, -inward) for a in (u, v))
    n = np.stack([x, y, z], -1)
    return n / np.linalg.norm(n, axis=1, keepdims=True)


def planes(seed):
    """A random plane with holes, some of whole rows and columns."""
    rng = np.random.default_rng(seed)
    height, width = rng.integers(1, 40, 2)
    values = np.cumsum(rng.integers(-(10 ** rng.integers(1, 6)), 10 ** rng.integers(1, 6), (height, width)), 1)
    known = rng.random((height, width)) < rng.choice([0.0, 0.3, 0.9, 1.0])
    known[: rng.integers(0, 3)] = False
    known[:, : rng.integers(0, 3)] = False
    return values, known


@pytest.mark.parametrize("seed", range(12))
@pytest.mark.parametrize("quality", QUALITIES)
def test_depths_are_as_exact_as_promised_in_any_range(seed, quality):
    rng = np.random.default_rng(seed)
    low, high = np.sort(rng.uniform(-12, 12, 2))
    depth = np.exp(rng.uniform(low, high, 500)).astype(np.float32)
    step = QUALITIES[quality].depth_step
    codes, nearest = coding.code_depth(depth, step)
    assert codes.min() == 0
    assert np.abs(decode_depth(codes, nearest, step) / depth - 1).max() <= 0.501 * step


def test_one_depth_and_none_have_codes_too():
    codes, nearest = coding.code_depth(np.array([2.5]), 1e-6)
    assert (codes.tolist(), nearest) == ([0], 2.5)
    assert coding.code_depth(np.zeros(0), 1e-6)[0].tolist() == []


@pytest.mark.parametrize(("quality", "degrees"), [("exact", 0.02), ("small", 0.25)])
def test_normals_are_as_exact_as_promised_in_any_direction(quality, degrees):
    normals = np.random.default_rng(0).normal(size=(20_000, 3))
    normals = np.concatenate([normals, np.eye(3), -np.eye(3), np.ones((1, 3)), [[0, 1e-9, 1], [1, 1e-9, -1e-9]]])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    bits = QUALITIES[quality].normal_bits
    codes = coding.code_normals(normals, bits)
    assert codes.min() >= 0 and codes.max() < 2**bits
    chord = np.linalg.norm(decode_normals(codes, bits) - normals, axis=1)  # of small angles, nearly the angle
    assert np.degrees(chord.max()) < degrees


@pytest.mark.parametrize("seed", range(8))
def test_the_page_reads_planes_as_they_were(seed):
    values, known = planes(seed)
    data, size = coding.code_plane(values, known)
    assert len(data) == size * known.sum()
    inputs = {"data": list(data), "width": values.shape[1], "height": values.shape[0], "size": size}
    inputs |= {"known": known.ravel().astype(int).tolist(), "count": int(known.sum())}
    script = "const { width, height, known, count, size } = value, reader = new Reader(new Uint8Array(value.data));"
    script += "return [...wholePlane(reader, width, height, known, count, size)];"
    read = np.array(run_script(script, inputs, "decode.js"), np.int64).reshape(values.shape)
    assert np.array_equal(read[known], values[known])


@pytest.mark.parametrize("seed", range(4))
def test_the_page_reads_colors_as_they_were(seed):
    rng, (_, known) = np.random.default_rng(seed), planes(seed)
    colors = rng.integers(0, 256, (*known.shape, 3), np.uint8)
    inputs = {"data": list(coding.code_colors(colors, known)), "width": known.shape[1], "height": known.shape[0]}
    inputs |= {"known": known.ravel().astype(int).tolist(), "count": int(known.sum())}
    script = "const { width, height, known, count } = value, reader = new Reader(new Uint8Array(value.data));"
    script += "return [...colorPlanes(reader, width, height, known, count)];"
    read = np.array(run_script(script, inputs, "decode.js")).reshape(*known.shape, 4)
    assert np.array_equal(read[known][:, :3], colors[known])


@pytest.mark.parametrize("quality", QUALITIES)
def test_the_page_reads_depths_and_normals_as_the_mirror_does(quality):
    rng, chosen = np.random.default_rng(3), QUALITIES[quality]
    depths, normals = rng.integers(0, 10**6, 50), rng.integers(0, 2**chosen.normal_bits, (50, 2))
    data = bytes([1] * 40 + [2] * 10)
    known, planes, sizes = np.ones((5, 10), bool), [depths, *normals.T], []
    for plane in planes:
        part, size = coding.code_plane(plane.reshape(5, 10), known)
        data, sizes = data + part, [*sizes, size]
    head = {"width": 10, "height": 5, "count": 50, "depthBytes": sizes[0], "normalBytes": sizes[1:], "nearest": 0.7}
    head |= {"depthStep": chosen.depth_step, "normalBits": chosen.normal_bits}
    script = "return [...surfacePlane(new Reader(new Uint8Array(value.data)), value.head).surface];"
    read = np.array(run_script(script, {"data": list(data), "head": head}, "decode.js")).reshape(50, 4)
    sign = np.where(np.arange(50) < 40, 1, -1)  # rims are negative
    assert np.allclose(read[:, 3], sign * decode_depth(depths, 0.7, chosen.depth_step), rtol=1e-6)
    assert np.allclose(read[:, :3], decode_normals(normals, chosen.normal_bits), atol=1e-6)


def test_what_is_smooth_takes_few_bytes():
    y, x = np.mgrid[:200, :200]
    depth = 2 + 0.001 * x + 0.0005 * y
    codes, _ = coding.code_depth(depth, QUALITIES["exact"].depth_step)
    data, size = coding.code_plane(codes, np.ones((200, 200), bool))
    assert len(coding.pack(data)) < 0.15 * 200 * 200 * size
