"""Environments: pictures of the whole sphere, checked once; and those by formula, against what they promise."""

import numpy as np
import pytest

import pointshade_gl as ps
from pointshade_gl.estimation.environment_light import lobe_map, radiance_bands
from pointshade_gl.scene.environment import BEHIND_LEFT, NAMES, WIDEST, Environment

RNG = np.random.default_rng(3)


def test_a_picture_is_kept_as_it_is_and_a_copy_cannot_be_written_to():
    picture = RNG.random((8, 16, 3)).astype(np.float32)
    kept = Environment(picture, "mine").picture
    picture[:] = 0
    assert kept.mean() > 0.3 and kept.dtype == np.float32
    with pytest.raises(ValueError, match="read-only"):
        kept[0, 0] = 1


@pytest.mark.parametrize("size", [(300, 600), (512, 1024), (700, 1400), (1, 2000), (1100, 2201)], ids=str)
def test_wide_pictures_are_reduced_and_keep_their_light(size):
    picture = np.full((*size, 3), 2.0)
    picture[:, : size[1] // 2] = 4
    kept = Environment(picture).picture
    assert kept.shape[1] <= WIDEST and kept.shape[0] == max(size[0] // -(-size[1] // WIDEST), 1)
    assert kept.mean() == pytest.approx(3, abs=0.01) and kept[:, 0].mean() == 4 and kept[:, -1].mean() == 2


@pytest.mark.parametrize(
    ("picture", "kind", "says"),
    [
        (np.zeros((4, 8)), ValueError, r"\(h, w, 3\) linear radiance of 0 or above, got the shape \(4, 8\)"),
        (np.zeros((4, 8, 4)), ValueError, "got the shape"),
        (np.zeros((0, 8, 3)), ValueError, "got the shape"),
        (np.full((2, 4, 3), -0.1), ValueError, "negative, not finite or above"),
        (np.full((2, 4, 3), np.nan), ValueError, "negative, not finite or above"),
        (np.full((2, 4, 3), 1e30), ValueError, "negative, not finite or above"),
        ("text", ValueError, "must be sky or studio.*load_environment reads files"),
        ("Sky", ValueError, r"did you mean sky\?"),
        (3j, TypeError, "environment must be"),
        (object(), TypeError, "environment must be"),
    ],
)
def test_what_is_no_environment_is_told(picture, kind, says):
    with pytest.raises(kind, match=says):
        ps.OutputSettings(environment=picture)


def test_a_name_gives_the_same_object_each_time():
    assert Environment.of("sky") is ps.OutputSettings(environment="sky").environment
    assert Environment.of("studio").name == "studio" and ps.OutputSettings(environment=None).environment is None
    with pytest.raises(ValueError, match=r"unknown environment 'stduio' \(did you mean studio\?\)"):
        Environment.of("stduio")


def test_it_is_shown_in_one_line():
    assert repr(Environment.of("sky")) == "Environment(256x128 pixels, 'sky')"
    assert repr(Environment(np.ones((2, 4, 3)))) == "Environment(4x2 pixels)"


def test_a_finish_lists_and_compares_its_environment():
    finish = ps.OutputSettings(environment="sky", environment_rotation=np.eye(3))
    assert (
        finish
        == ps.OutputSettings(environment="sky", environment_rotation=np.eye(3))
        != ps.OutputSettings(environment="studio")
    )
    assert finish.options["environment"] is Environment.of("sky") and hash(finish)
    assert ps.OutputSettings(**finish.options) == finish


def reflected(picture, normal):
    """(3,) irradiance / pi, without bands: the sum over all pixels."""
    height, width = picture.shape[:2]
    elevation = np.pi * (0.5 - (np.arange(height) + 0.5) / height)[:, None]
    azimuth = 2 * np.pi * ((np.arange(width) + 0.5) / width - 0.5)
    x, y, z = normal
    cosine = np.cos(elevation) * (x * np.cos(azimuth) + z * np.sin(azimuth)) + np.sin(elevation) * y
    weight = np.maximum(cosine, 0) * np.cos(elevation) * 2 * np.pi**2 / (height * width)
    return np.einsum("rc,rck->k", weight, picture) / np.pi


@pytest.mark.parametrize("name", NAMES)
def test_white_that_faces_up_is_white_under_every_environment(name):
    picture = Environment.of(name).picture
    assert reflected(picture, (0, 1, 0)).mean() == pytest.approx(1, abs=0.01)
    assert picture.min() > 0.02 and picture.shape == (128, 256, 3)
    assert reflected(picture, (0, -1, 0)).mean() < 0.2  # the ground is dim


@pytest.mark.parametrize("name", NAMES)
def test_the_light_comes_mostly_from_the_viewers_upper_left(name):
    bands = radiance_bands(Environment.of(name).picture).mean(1)
    azimuth = np.degrees(np.arctan2(bands[3], bands[1]))
    assert bands[2] > 0 and abs(azimuth - BEHIND_LEFT) < 45


def test_the_sky_is_blue_and_warmer_by_its_sun_which_is_missing():
    sky = Environment.of("sky").picture
    zenith, low = sky[0].mean(0), sky[60]
    assert zenith[2] > 1.3 * zenith[0] and sky.max() < 4
    by_sun = sky[35, int(256 * (0.5 + BEHIND_LEFT / 360))]
    assert by_sun[0] / by_sun[2] > 1.5 * zenith[0] / zenith[2]
    assert by_sun.mean() == pytest.approx(sky.mean(-1).max(), rel=0.1)
    assert low.mean() > sky[20].mean(0).min()
    assert abs(np.diff(sky, axis=0)).max() < 1  # the horizon is hazy


def test_the_studio_shows_soft_boxes_in_highlights():
    studio = Environment.of("studio").picture
    assert np.ptp(studio, axis=-1).max() == 0 and studio.max() > 8
    lobes = lobe_map(studio, 100)[..., 0]
    assert lobes.max() > 5 and np.median(lobes) < 0.5
    assert abs(np.diff(studio, axis=1)).max() < 0.6 * studio.max()  # their edges are soft


@pytest.mark.parametrize(
    ("option", "value", "says"),
    [
        ("environment_intensity", -1, "environment_intensity must be a number from 0"),
        ("environment_intensity", np.nan, "environment_intensity must be"),
        ("environment_rotation", [1, 2], r"must be degrees, or a rotation of shape \(3, 3\)"),
        ("environment_rotation", 2 * np.eye(3), "a rotation"),
        ("environment_rotation", np.diag([1, 1, -1]), "a rotation"),
        ("environment_rotation", np.full((3, 3), np.nan), "a rotation"),
        ("environment_rotation", np.inf, "environment_rotation must be"),
        ("ambient_occlusion", -0.1, "ambient_occlusion must be a number from 0"),
    ],
)
def test_impossible_settings_of_light_from_all_around_are_named(option, value, says):
    with pytest.raises(ValueError, match=says):
        ps.OutputSettings(**{option: value})


@pytest.mark.parametrize("value", ["auto", [1], None])
def test_a_rotation_and_an_occlusion_of_another_kind_are_named(value):
    with pytest.raises((TypeError, ValueError), match="environment_rotation must be"):
        ps.OutputSettings(environment_rotation=value)
    if value is not None:
        with pytest.raises(TypeError, match="ambient_occlusion must be"):
            ps.OutputSettings(ambient_occlusion=value)


def test_settings_of_light_from_all_around_are_plain_values():
    finish = ps.OutputSettings(environment_rotation=np.float32(30), ambient_occlusion=np.bool_(True))
    assert finish.environment_rotation == 30.0 and finish.ambient_occlusion is True
    assert ps.OutputSettings(ambient_occlusion=0).ambient_occlusion is False
    assert ps.OutputSettings(ambient_occlusion=0.5).ambient_occlusion == 0.5
    turned = ps.OutputSettings(environment_rotation=[[0, 0, 1], [0, 1, 0], [-1, 0, 0]]).environment_rotation
    assert turned == ((0, 0, 1), (0, 1, 0), (-1, 0, 0))
