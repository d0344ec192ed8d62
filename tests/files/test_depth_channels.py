"""Depth that is packed: bytes spread over channels, 16-bit floats, lengths of rays. Only what is packed is unpacked."""

from __future__ import annotations

import numpy as np
import pytest

import pointshade_gl as ps
from pointshade_gl.files.depth.depth_files import count_codes, find_channels, is_half, join_channels
from pointshade_gl.files.depth.planes import is_ray_length

CAMERA = ps.Camera(280, 290, 159.5, 119.5, 320, 240)
X, Y = np.meshgrid((np.arange(320) - 159.5) / 280, (np.arange(240) - 119.5) / 290)
LONGER = np.sqrt(1 + X**2 + Y**2)


def room_depth() -> np.ndarray:
    """(240, 320) metres: a floor, a ceiling and two walls that meet in a corner."""
    planes = [(0, 1, 0.02, 1.2), (0, -1, 0.05, 1.5), (0.7, 0.02, 0.7, 2.8), (-0.6, 0, 0.8, 2.5)]
    depths = [d / np.maximum(a * X + b * Y + c, 1e-3) for a, b, c, d in planes]
    return np.min(depths, axis=0)


@pytest.mark.parametrize("order", [(0, 1), (2, 1), (1, 0)])
def test_16_bits_in_two_channels_are_found_and_joined(order):
    code = np.rint(room_depth() * 1000).astype(np.uint16)
    image = np.zeros((240, 320, 3), np.uint8)
    image[..., order[0]], image[..., order[1]] = code & 255, code >> 8
    assert find_channels(image) == order
    np.testing.assert_array_equal(join_channels(image, order), code)


@pytest.mark.parametrize("order", [(0, 1, 2), (2, 1, 0)])
def test_24_bits_in_three_channels_are_found(order):
    code = np.rint(room_depth() * 8 / 1000 * (2**24 - 1)).astype(np.uint32)
    image = np.zeros((240, 320, 3), np.uint8)
    for k, channel in enumerate(order):
        image[..., channel] = code >> 8 * k & 255
    assert find_channels(image) == order
    np.testing.assert_array_equal(join_channels(image, order), code)


def test_a_float_in_four_channels_is_found():
    depth = room_depth().astype("<f4")
    image = depth.view(np.uint8).reshape(240, 320, 4)[..., (2, 1, 0, 3)].copy()
    assert find_channels(image) == (2, 1, 0, 3)
    np.testing.assert_array_equal(join_channels(image, (2, 1, 0, 3)), depth)


def test_photographs_and_coloured_depth_are_no_channels():
    matplotlib = pytest.importorskip("matplotlib")
    depth = room_depth()
    levels = (depth - depth.min()) / np.ptp(depth)
    for name in ("jet", "turbo", "viridis", "inferno", "Spectral_r"):
        assert find_channels((matplotlib.colormaps[name](levels)[..., :3] * 255).astype(np.uint8)) is None
    assert find_channels(np.random.default_rng(0).integers(0, 256, (240, 320, 3), np.uint8)) is None


@pytest.mark.data
def test_real_photographs_are_no_channels(shared_data):
    from pointshade_gl.files.pictures.picture_files import read_image

    for path in sorted((shared_data / "icl_livingroom_23views/color").iterdir())[::4]:
        assert find_channels(read_image(path)) is None


def test_bits_of_16_bit_floats_are_told_from_millimetres():
    depth = room_depth()
    halves = depth.astype(np.float16).view(np.uint16)
    millimetres = np.rint(depth * 1000).astype(np.uint16)
    far = np.rint(depth * 10_100).astype(np.uint16)  # all between the bits of 0.1 m and of infinity
    assert is_half(halves, count_codes(halves))
    assert not is_half(millimetres, count_codes(millimetres))
    assert not is_half(far, count_codes(far))


@pytest.mark.parametrize("scale", [1000, 5000, 1e6])
def test_lengths_of_rays_are_told_from_depth(scale):
    depth = room_depth()
    assert is_ray_length(np.rint(depth * LONGER * scale) / scale, CAMERA)
    assert not is_ray_length(np.rint(depth * scale) / scale, CAMERA)


def test_depth_stays_depth_whatever_camera_is_guessed():
    for focal in (150, 280, 600):
        assert not is_ray_length(room_depth(), ps.Camera(focal, focal, 159.5, 119.5, 320, 240))


def test_rays_are_read_as_such_with_a_note(tmp_path):
    np.save(tmp_path / "depth.npy", (room_depth() * LONGER).astype(np.float32))
    notes: list[str] = []
    frame = ps.load_frame(depth=tmp_path / "depth.npy", intrinsics=CAMERA, notes=notes.append)
    np.testing.assert_allclose(frame.depth, room_depth(), rtol=1e-4)
    assert any("lengths of rays" in note and "depth_kind='z'" in note for note in notes)
