"""The cameras of shadows: they see all that may shade, and waste little of their pictures."""

import numpy as np
import pytest

import pointshade_gl as ps
from pointshade_gl.scene.camera import view_matrix
from pointshade_gl.scene.shadow_cameras import RIM, Extent, shadow_views

RNG = np.random.default_rng(1)
CORNERS = RNG.uniform((-0.8, -0.3, 1.1), (0.7, 0.5, 2.4), (24, 3))
CENTRE = (CORNERS.min(0) + CORNERS.max(0)) / 2
EXTENT = Extent(CORNERS, CENTRE, float(np.linalg.norm(CORNERS - CENTRE, axis=-1).max()), 0.004)


def views_of(light):
    (views, ((first, count),)) = shadow_views([light], EXTENT)
    assert (first, count) == (0, len(views))
    return views


def places(view):
    """Where a shadow's camera sees the corners: (n, 2) pixels, from the middle; and (n,) their depth over near."""
    camera = view.eye.camera
    x, y, z = (CORNERS @ (turn := view_matrix(np.eye(4), view.eye.pose))[:3, :3].T + turn[:3, 3]).T
    return np.stack([camera.fx * x / z, camera.fy * y / z], -1), z / view.eye.near


def lights():
    for direction in RNG.normal(size=(6, 3)):
        yield ps.Light(direction=direction, shadow=True)
    for direction in RNG.normal(size=(6, 3)):
        away = direction / np.linalg.norm(direction) * EXTENT.radius
        yield ps.Light(position=CENTRE + 1.5 * away, shadow=True)
        yield ps.Light(position=CENTRE + 5 * away, direction=-away, cone=(20, 60), shadow=True)


@pytest.mark.parametrize("light", list(lights()))
def test_a_view_shows_all_corners_and_they_fill_it(light):
    (view,) = views_of(light)
    place, depth = places(view)
    half = view.eye.camera.width / 2 - RIM
    assert (np.abs(place) < half + 0.6).all() and (depth >= 1).all()
    assert np.ptp(place, 0).max() > 0.9 * 2 * half


def test_a_narrow_spot_is_seen_no_wider_than_its_cone():
    away = np.array((0.3, -0.8, -0.5))
    (view,) = views_of(ps.Light(position=CENTRE + 3 * away, direction=-away, cone=(3, 5), shadow=True))
    camera = view.eye.camera
    assert camera.width / 2 - RIM == pytest.approx(camera.fx * np.tan(np.radians(5)))
    np.testing.assert_allclose(view.eye.pose[:3, 2], -away / np.linalg.norm(away))


def test_from_a_light_among_things_six_views_show_all_corners():
    views = views_of(ps.Light(position=CENTRE, shadow=True))
    seen = [
        (np.abs(place) < view.eye.camera.width / 2).all(-1) & (depth > 0)
        for view in views
        for place, depth in [places(view)]
    ]
    assert len(views) == 6 and np.any(seen, 0).all()


@pytest.mark.parametrize(("away", "count"), [(0.8, 6), (1.5, 1)])
def test_an_area_light_is_seen_as_a_point_light_of_all_sides(away, count):
    """Its cone, which no spot says, does not end its views."""
    position = CENTRE - (0, away * EXTENT.radius, 0)
    lamp = ps.Light(position, (0, 1, 0), size=(1, 1), cone=(1, 2), shadow=True)
    views, point = views_of(lamp), views_of(ps.Light(position, shadow=True))
    assert len(views) == len(point) == count
    for view, other in zip(views, point, strict=True):
        np.testing.assert_array_equal(view.eye.pose, other.eye.pose)
        assert view.eye.camera == other.eye.camera


def test_a_contact_is_a_pixel_of_the_frame_wide_and_never_finer_than_the_scene():
    sun = ps.Light(direction=(0, 0, 1), shadow=True)
    for grain, contact in ((0.004, 1.2 * 0.004), (0, 0.0005 * EXTENT.radius)):
        ((view,), _) = shadow_views([sun], EXTENT._replace(grain=grain))
        assert view.contact == pytest.approx(contact)


@pytest.mark.parametrize("away", [1e4, 1e9, 5e17])
@pytest.mark.parametrize("cone", [None, (10, 30), (0, 90)])
def test_a_lamp_far_away_casts_its_shadows_as_the_sun_does(away, cone):
    direction = np.array((0.48, -0.6, 0.64))
    spot = {} if cone is None else {"direction": direction, "cone": cone}
    spot |= {"size": (1, 1)} if cone == (0, 90) else {}
    (lamp,) = views_of(ps.Light(position=CENTRE - away * direction, shadow=True, **spot))
    (sun,) = views_of(ps.Light(direction=direction, shadow=True))
    assert lamp.eye.camera.fx == pytest.approx(sun.eye.camera.fx, rel=1e-6)
    assert lamp.eye.near == pytest.approx(sun.eye.near)
    np.testing.assert_allclose(lamp.eye.pose, sun.eye.pose, atol=1e-6 * EXTENT.radius * 1000)


def test_coarse_ones_have_fewer_pixels_and_see_all_corners():
    for light in lights():
        (fine,), (coarse,) = (shadow_views([light], EXTENT, coarse=times)[0] for times in (1, 3))
        assert coarse.eye.camera.width == fine.eye.camera.width // 3
        np.testing.assert_array_equal(coarse.eye.pose, fine.eye.pose)
        assert np.abs(places(coarse)[0]).max() <= coarse.eye.camera.width / 2 - RIM + 1e-6
