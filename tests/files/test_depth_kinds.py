"""Kinds of depth: each is compared with its definition for single pixels; what counts as missing."""

import math

import numpy as np
import pytest

import pointshade_gl as ps
from pointshade_gl.files.depth.depth_kinds import KINDS, RANGED, to_metres

CAMERA = ps.Camera(50, -60, 18.0, 11.5, 40, 30)
Z = np.random.default_rng(4).uniform(1.5, 3, (30, 40))


def refuse(text):
    raise AssertionError(f"an unexpected note: {text}")


def convert(raw, kind="z", scale=1.0, baseline=None, note=refuse):
    return to_metres(np.asarray(raw), CAMERA, kind, scale, baseline, note)


def ray(u, v):
    return (u - CAMERA.cx) / CAMERA.fx, (v - CAMERA.cy) / CAMERA.fy, 1.0


RAW = {  # what a sensor of each kind stores for the depth z at pixel (u, v)
    "z": lambda z, u, v: z,
    "ray": lambda z, u, v: math.hypot(*(z * x for x in ray(u, v))),
    "plane": lambda z, u, v: math.dist([z * x for x in ray(u, v)], ray(u, v)),
    "inverse": lambda z, u, v: 1 / z,
    "disparity": lambda z, u, v: CAMERA.fx * 0.12 / z,
}
SCALED = tuple(RAW)  # a Kinect's disparity has no unit to choose


@pytest.mark.parametrize("kind", SCALED)
@pytest.mark.parametrize("scale", [1.0, 256.0])
def test_every_kind_gives_the_depth_it_was_made_from(kind, scale):
    raw = np.array([[RAW[kind](Z[v, u], u, v) for u in range(40)] for v in range(30)])
    raw = raw / scale if kind == "inverse" else raw * scale
    raw = raw * scale**2 if kind == "inverse" else raw  # z = scale / raw
    np.testing.assert_allclose(convert(raw, kind, scale, 0.12), Z, rtol=1e-12)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("hole", [0.0, -1.0, np.nan, np.inf])
def test_holes_stay_holes_in_every_kind(kind, hole):
    raw = 300 * Z
    raw[3, 4] = hole
    metres = convert(raw, kind, 1000.0 if kind in RANGED else 1.0, 0.1)
    assert metres[3, 4] == 0
    assert np.count_nonzero(metres) == Z.size - 1


def test_inverse_depth_without_a_scale_is_laid_between_1_and_10_metres():
    notes = []
    raw = np.array([[0, 51, 102], [153, 204, 255]], np.uint8)
    metres = to_metres(raw, ps.Camera(9, 9, 1, 1, 3, 2), "inverse", None, None, notes.append)
    np.testing.assert_allclose(1 / metres, [[0.1, 0.28, 0.46], [0.64, 0.82, 1.0]])  # linear in 1/z, 0 is the farthest
    assert len(notes) == 1 and "largest value is put at 1 m, its smallest at 10 m" in notes[0]


def test_inverse_depth_without_a_scale_keeps_negative_values_and_drops_infinite_ones():
    raw = Z - 2
    raw[0, :3] = np.nan, np.inf, -np.inf
    metres = convert(raw, "inverse", None, note=[].append)
    assert (metres[0, :3] == 0).all()
    assert np.count_nonzero(metres) == Z.size - 3
    assert (metres.max(), metres[metres > 0].min()) == pytest.approx((10, 1))


def test_inverse_depth_that_does_not_vary_is_refused():
    with pytest.raises(ValueError, match="inverse depth must vary, got 7 everywhere"):
        convert(np.full((30, 40), 7, np.uint8), "inverse", None)


def test_depth_without_a_scale_is_laid_between_1_and_10_metres():
    notes = []
    raw = np.array([[0, 51, 102], [153, np.nan, 255]], np.float32)
    metres = to_metres(raw, ps.Camera(9, 9, 1, 1, 3, 2), "z", None, None, notes.append)
    np.testing.assert_allclose(metres, [[1, 2.8, 4.6], [6.4, 0, 10]])
    assert notes == ["depth has no scale: its largest value is put at 10 m, its smallest at 1 m"]


def test_inverse_depth_is_laid_between_the_true_ends_where_they_are_given():
    raw = np.rint(255 * (1 / Z - 1 / Z.max()) / (1 / Z.min() - 1 / Z.max())).astype(np.uint8)
    given = {"depth": raw, "intrinsics": CAMERA, "depth_kind": "inverse", "notes": (notes := []).append}
    true = ps.load_frame(**given, near=float(Z.min()), far=float(Z.max()))
    assert notes == [] and abs(1 / true.depth - 1 / Z).max() < 0.51 / 255 * np.ptp(1 / Z)
    guessed = ps.load_frame(**given)
    assert abs(guessed.depth / Z - 1).max() > 0.5
    assert "wrong ones bend surfaces: pass the true ones as near and far with depth_kind='inverse'" in notes[0]


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        ({"near": 2}, "pass near for its largest value and a larger far for its smallest, got 2 and None"),
        ({"near": 3, "far": 2}, "got 3 and 2"),
        ({"near": 1, "far": np.inf}, "got 1 and inf"),
        ({"near": 1, "far": 2, "depth_scale": 5}, "pass depth_scale or near and far, not both"),
    ],
)
def test_ends_of_inverse_depth_that_cannot_be_are_refused(options, sentence):
    with pytest.raises(ValueError, match=sentence):
        ps.load_frame(depth=Z, intrinsics=CAMERA, depth_kind="inverse", **options)


def test_disparity_is_counted_from_where_the_cameras_see_infinity():
    raw = CAMERA.fx * 0.12 / Z - 31.5
    metres = to_metres(raw, CAMERA, "disparity", 1.0, 0.12, refuse, doffs=31.5)
    assert (raw < 0).any(), "what is farther than infinity of the other camera is a distance, too"
    np.testing.assert_allclose(metres, Z, rtol=1e-12)


def test_disparity_that_was_not_found_is_no_distance():
    raw = np.array([[-3, 0, np.inf], [np.nan, -40, 9]])
    metres = to_metres(raw, ps.Camera(9, 9, 1, 1, 3, 2), "disparity", 1.0, 0.12, refuse, doffs=31.5)
    np.testing.assert_array_equal(metres > 0, [[True, False, False], [False, False, True]])


def test_raw_disparity_of_a_kinect_becomes_metres_and_2047_is_missing():
    """Within 3 % of the two formulas in use: NYU's toolbox (Silberman 2012) and Burrus' (2010), which differ by 5 %."""
    raw = np.array([[0, 500, 700, 900], [1000, 1050, 1086, 2047]], np.uint16)
    metres = to_metres(raw, ps.Camera(9, 9, 1, 1, 4, 2), "kinect", 1.0, None, refuse)
    known = metres > 0
    np.testing.assert_array_equal(known, [[False, True, True, True], [True, True, False, False]])
    seen, nyu = metres[known], 351.3 / (1092.5 - raw[known])
    burrus = 1 / (3.3309495161 - 0.0030711016 * raw[known])
    np.testing.assert_allclose(seen, nyu, rtol=0.03)
    np.testing.assert_allclose(seen[:4], burrus[:4], rtol=0.06)


def test_disparity_needs_a_baseline():
    with pytest.raises(ValueError, match="pass baseline in metres"):
        convert(Z, "disparity")
    with pytest.raises(ValueError, match=r"baseline must be a finite number above 0, got -0\.1"):
        convert(Z, "disparity", baseline=-0.1)


def test_16_bit_values_from_65500_are_missing_and_counted():
    notes = []
    raw = np.full((30, 40), 1500, np.uint16)
    raw[0, :4] = 65499, 65500, 65520, 65535
    metres = convert(raw, "z", 1000.0, note=notes.append)
    assert metres[0, :4].tolist() == [65.499, 0, 0, 0]
    assert notes == ["3 depth values from 65500 to 65535 are taken as missing"]


def test_markers_that_were_moved_with_the_points_are_missing_too():
    notes = []
    raw = np.full((30, 40), 1500, np.uint16)
    raw[0] = np.linspace(65440, 65510, 40)  # one plane, as a sensor that aligns depth and colour leaves it
    assert (convert(raw, "z", 1000.0, note=notes.append)[0] == 0).all()
    assert notes == ["40 depth values from 65400 to 65535 are taken as missing"]
    raw[1, :5] = 63000  # something stands right before it: a far wall, no marker
    assert np.count_nonzero(convert(raw, "z", 1000.0, note=notes.append)[0]) == np.count_nonzero(raw[0] < 65500)


@pytest.mark.parametrize("kind", ["inverse", "disparity"])
def test_the_nearest_points_of_inverse_depth_are_no_markers(kind):
    raw = np.linspace(30000, 65535, 1200).astype(np.uint16).reshape(30, 40)
    assert convert(raw, kind, 1.0, 0.1).all()


@pytest.mark.parametrize("value", [1e10, 65504.0, 1000.0, 0.7])
def test_a_constant_background_is_missing_and_told(value):
    notes = []
    raw = Z.copy()
    raw[:5] = value
    metres = convert(raw, note=notes.append)
    assert not metres[:5].any()
    np.testing.assert_array_equal(metres[5:], Z[5:])
    assert len(notes) == 1 and f"the depth value {value:g} of 17% of the pixels is taken as background" in notes[0]


def test_the_share_of_a_background_is_that_of_the_known_pixels():
    raw = np.zeros((30, 40))
    raw[:10], raw[0, :8] = Z[:10], 1000  # 8 of 400 known: exactly 2 %
    assert not convert(raw, note=[].append)[0, :8].any()
    raw[0, 7] = Z[0, 7]
    assert (convert(raw)[0, :7] == 1000).all()


def test_a_wall_within_twice_the_distance_is_no_background():
    raw = Z.copy()
    raw[:5] = 2 * Z[5:].max()
    np.testing.assert_array_equal(convert(raw), raw)


def test_a_plane_that_fills_the_picture_is_no_background():
    assert (convert(np.full((30, 40), 2.0)) == 2).all()


def test_a_plane_with_an_outlier_is_no_background():
    raw = np.full((30, 40), 2.0)
    raw[3, 4] = 9
    np.testing.assert_array_equal(convert(raw), raw)


@pytest.mark.parametrize("kind", SCALED)
def test_16_bits_are_looked_up_with_the_same_result_as_wider_numbers(kind):
    """Blocks of rows, too: this picture has several."""
    camera, notes = ps.Camera(900, 900, 700, 300, 1400, 600), []
    raw = np.random.default_rng(6).integers(300, 4000, (600, 1400)).astype(np.uint16)
    raw[:, :400], raw[5] = 40_000, 0  # a background, and holes
    results = [
        to_metres(raw.astype(dtype), camera, kind, 1000.0, 0.1, notes.append)
        for dtype in (np.uint16, ">u2", np.int32, np.float32, np.float64)
    ]
    for result in results[1:]:
        np.testing.assert_array_equal(result, results[0])
    assert len(notes) == 5 and len(set(notes)) == 1 and "the depth value 40000 of 29%" in notes[0]
    assert not results[0][5].any() and results[0][0, 400:].all() and not results[0][:, :400].any()
    single = to_metres(raw, camera, kind, 1000.0, 0.1, notes.append, np.float32)
    np.testing.assert_array_equal(single, results[0].astype(np.float32))


def test_depth_beyond_float_is_not_an_accident():
    raw = Z.copy()
    raw[3, 4] = 1e-320
    assert convert(raw, "inverse", 1e300)[3, 4] == np.inf  # a warning would be an error here
