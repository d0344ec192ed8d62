"""Pictures of trained splats: as they were trained, beside the exact blend; and lit, with what stands among them."""

import numpy as np
import pytest

import pointshade_gl as ps

from ..reference.trained_splats import blended
from ..support.trained_splats import BALL, RADIUS, ball_over_floor, looking_down

CAMERA, POSE = looking_down()
LAMP = np.array([0.3, 1, 0.6])
MATT = ps.Material(ambient=0, diffuse=1, specular=0)


def decibels(picture, exact, cover):
    """Of what is covered, over white."""
    alpha = picture[..., 3:] / 255
    error = (picture[..., :3] / 255 * alpha + 1 - alpha) - np.clip(exact + 1 - cover[..., None], 0, 1)
    return -10 * np.log10((error[cover > 0.02] ** 2).mean())


@pytest.mark.parametrize(("degree", "more"), [(0, {}), (3, {}), (1, {"antialiased": True})])
def test_the_default_picture_is_the_exact_blend(renderer, degree, more):
    cloud = ball_over_floor(400, degree=degree, **more)
    picture = renderer.render(cloud, camera=CAMERA, pose=POSE)
    assert decibels(picture, *blended(cloud, CAMERA, POSE)) > 50


def test_splats_of_several_nodes_are_sorted_together(renderer):
    cloud = ball_over_floor(300)
    halves = [
        ps.PointCloud(cloud.positions[k::2], gaussians=cloud.gaussians.select(np.arange(len(cloud))[k::2]),
                      splat="gaussian", shading="none")
        for k in (0, 1)
    ]  # fmt: skip
    one, two = (
        renderer.render(source, camera=CAMERA, pose=POSE) for source in (cloud, ps.Scene([*map(ps.Node, halves)]))
    )
    assert np.abs(one.astype(int) - two).max() <= 1


def test_a_node_turns_moves_and_scales_splats(renderer):
    cloud = ball_over_floor(300, degree=2)
    place = np.eye(4)
    place[:3, :3] = 0.5 * np.array([[0.8, 0, 0.6], [0, 1, 0], [-0.6, 0, 0.8]])
    place[:3, 3] = 0.4, -0.2, 0.3
    seen = place @ POSE
    seen[:3, :3] *= 2
    one = renderer.render(cloud, camera=CAMERA, pose=POSE)
    other = renderer.render(ps.Scene([ps.Node(cloud, transform=place)]), camera=CAMERA, pose=seen)
    assert np.abs(one.astype(int) - other).max() <= 2


def test_a_wall_hides_what_lies_behind_it(renderer):
    cloud = ball_over_floor(400)
    corners = np.array([[-2, 0.5, 0.0], [0, 0.5, 0], [0, -2, 0], [-2, -2, 0]], np.float32)
    wall = ps.Scene([ps.Node(ps.Mesh(corners, [(0, 1, 2), (0, 2, 3)], color=(0.2, 0.5, 0.3), shading="none"))])
    before = renderer.render_depth(wall, camera=CAMERA, pose=POSE)
    behind = renderer.render(wall, camera=CAMERA, pose=POSE)
    picture = renderer.render(ps.Scene([*wall.nodes, ps.Node(cloud)]), camera=CAMERA, pose=POSE)
    exact, cover = blended(cloud, CAMERA, POSE, before)
    back = np.where(behind[..., 3:] > 0, behind[..., :3] / 255, 1)
    shown = picture[..., :3] / 255 * (picture[..., 3:] / 255) + 1 - picture[..., 3:] / 255
    error = shown - np.clip(exact + (1 - cover[..., None]) * back, 0, 1)
    assert (before > 0).sum() > 500 and -10 * np.log10((error**2).mean()) > 50


LARGE, _ = looking_down((240, 180))


def true_surface(camera=LARGE):
    """Depth, normal and whether it is the ball, of each pixel; depth infinite where nothing is."""
    v, u = np.mgrid[: camera.height, : camera.width]
    x, y = camera.ray_at(u, v)
    way, eye = np.stack([x, y, np.ones_like(x)], -1) @ POSE[:3, :3].T, POSE[:3, 3]
    a, b, c = (way**2).sum(-1), way @ (eye - BALL), ((eye - BALL) ** 2).sum() - RADIUS**2
    root = b * b - a * c
    ball = np.where(root > 0, (-b - np.sqrt(np.maximum(root, 0))) / a, np.inf)
    floor = np.where(way[..., 1] > 0, -eye[1] / np.where(way[..., 1] > 0, way[..., 1], 1), np.inf)
    at = eye + way * floor[..., None]
    floor = np.where((np.abs(at[..., [0, 2]]) < 1.4).all(-1), floor, np.inf)
    z, is_ball = np.minimum(ball, floor), ball < floor
    normal = np.where(
        is_ball[..., None], (eye + way * np.where(is_ball, ball, 0)[..., None] - BALL) / RADIUS, (0.0, -1, 0)
    )
    return z, normal, is_ball, eye + way * np.where(np.isfinite(z), z, 0)[..., None]


def inside(mask):
    """All but the rim of a mask, 3 pixels wide."""
    for _ in range(3):
        mask = mask & np.roll(mask, 1, 0) & np.roll(mask, -1, 0) & np.roll(mask, 1, 1) & np.roll(mask, -1, 1)
    return mask


def test_depth_and_normals_are_those_of_the_surface(renderer):
    cloud, (z, normal, is_ball, _) = ball_over_floor(8000, wide=0.03), true_surface()
    depth = renderer.render_depth(cloud, camera=LARGE, pose=POSE)
    for part in (inside(is_ball & np.isfinite(z)), inside(~is_ball & np.isfinite(z))):
        assert (depth[part] > 0).mean() > 0.99
        assert np.median(np.abs(depth - z)[part]) < 0.03
    shown = renderer.render(cloud, camera=LARGE, pose=POSE, show="normals")[..., :3] / 127.5 - 1
    found = (shown * [1, -1, -1]) @ POSE[:3, :3].T
    found /= np.linalg.norm(found, axis=-1, keepdims=True)
    angles = np.degrees(np.arccos((found * normal).sum(-1).clip(-1, 1)))
    assert np.median(angles[inside(is_ball)]) < 6 and np.median(angles[inside(~is_ball & np.isfinite(z))]) < 6


def test_beside_a_rim_lies_what_is_behind(renderer):
    cloud, (z, _, is_ball, _) = ball_over_floor(8000, wide=0.03), true_surface()
    bands = [is_ball]
    for _ in range(3):
        last = bands[-1]
        bands.append(last | np.roll(last, 1, 0) | np.roll(last, -1, 0) | np.roll(last, 1, 1) | np.roll(last, -1, 1))
    beside = bands[3] & ~bands[1] & np.isfinite(z)
    depth = renderer.render_depth(cloud, camera=LARGE, pose=POSE)
    assert beside.sum() > 100 and (np.abs(depth - z)[beside] < 0.15).mean() > 0.9


def linear(picture):
    return ((picture[..., :3] / 255) ** 2.2).mean(-1)


def test_splats_shade_each_other(renderer):
    cloud, (z, _, is_ball, at) = ball_over_floor(8000, wide=0.03), true_surface()
    lamp = LAMP / np.linalg.norm(LAMP)
    plain, shaded = (
        linear(
            renderer.render(cloud, ps.Light(direction=tuple(lamp), shadow=has), camera=LARGE, pose=POSE, material=MATT)
        )
        for has in (False, True)
    )
    to_ball = BALL - at
    past = np.linalg.norm(to_ball + lamp * (to_ball @ -lamp)[..., None], axis=-1) < RADIUS
    floor = inside(np.isfinite(z) & ~is_ball)
    dark = shaded < 0.5 * plain
    assert inside(past & floor).sum() > 10
    assert dark[inside(past & floor)].mean() > 0.9 and dark[inside(floor & ~past)].mean() < 0.05


def test_splats_and_frames_shade_each_other(renderer):
    cloud, lamp = ball_over_floor(2000, floor=False).styled(shading="phong"), ps.Light(direction=(0, 1, 0), shadow=True)
    corners = np.array([[-2, 0.3, -2], [2, 0.3, -2], [2, 0.3, 2], [-2, 0.3, 2]], np.float32)
    floor = ps.Node(ps.Mesh(corners, [(0, 1, 2), (0, 2, 3)], material=MATT), shadow=True)
    lid = ps.Node(ps.Mesh(corners * [0.5, 1, 0.5] + [0, -1.9, 0], [(0, 1, 2), (0, 2, 3)]), shadow=True)
    draw = lambda *nodes: linear(renderer.render(ps.Scene([*nodes]), lamp, camera=CAMERA, pose=POSE))  # noqa: E731
    alone, with_ball = draw(floor), draw(floor, ps.Node(cloud))
    uncovered = renderer.render(cloud, camera=CAMERA, pose=POSE)[..., 3] == 0
    shadow = uncovered & (with_ball < 0.5 * alone)
    assert 20 < shadow.sum() < 0.2 * uncovered.sum()
    ball = renderer.render(cloud, camera=CAMERA, pose=POSE)[..., 3] > 250
    under_lid = draw(ps.Node(cloud), lid)
    assert under_lid[ball].mean() < 0.5 * draw(ps.Node(cloud))[ball].mean()


def test_light_is_shown_where_it_is_asked_for(renderer):
    cloud = ball_over_floor(300)
    own = renderer.render(cloud, camera=CAMERA, pose=POSE)
    asked = (
        {"light": ps.Light(direction=(0, 0, 1))},
        {"environment": "studio"},
        {"ambient_occlusion": True},
    )
    for options in asked:
        assert (renderer.render(cloud, camera=CAMERA, pose=POSE, **options) != own).any(), options
    for options in ({"light": ps.Light(direction=(0, 0, 1)), "shading": "none"}, {"yaw": 0.0}):
        kept = renderer.render(cloud, camera=CAMERA, pose=POSE, **options)
        assert (kept == own).all()
    lit = renderer.render(ps.Scene([ps.Node(cloud)]), ps.Light(direction=(0, 0, 1)), camera=CAMERA, pose=POSE)
    assert (lit == renderer.render(cloud, ps.Light(direction=(0, 0, 1)), camera=CAMERA, pose=POSE)).all()


def test_light_from_all_around_is_the_same_after_other_light(renderer):
    cloud = ball_over_floor(300)
    one = renderer.render(cloud, camera=CAMERA, pose=POSE, environment="studio")
    with ps.Renderer() as other:
        other.render(cloud, ps.Light(direction=(0, 0, 1)), camera=CAMERA, pose=POSE)
        assert (other.render(cloud, camera=CAMERA, pose=POSE, environment="studio") == one).all()


def test_surfaces_seen_at_a_slant_have_no_black_specks(renderer):
    cloud = ball_over_floor(2500)
    lit = renderer.render(cloud, yaw=25.0, pitch=20.0, environment="sky")
    assert (lit[..., 3] > 200).mean() > 0.2
    assert not ((lit[..., 3] > 200) & (lit[..., :3].max(-1) < 6)).any()


def test_samples_of_splats_alone_are_no_softer(renderer):
    cloud = ball_over_floor(300)
    one, many = (renderer.render(cloud, camera=CAMERA, pose=POSE, samples=n) for n in (1, 4))
    visible = one[..., 3] > 30
    assert np.abs(one.astype(int) - many)[visible].max() <= 3


@pytest.mark.parametrize(
    "options", [{"show": "normals"}, {"show": "depth"}, {"shading": "edl"}, {"ground": True, "samples": 2}]
)
def test_other_pictures_of_splats(renderer, options):
    cloud = ball_over_floor(800, floor=False, wide=0.08)
    picture = renderer.render(cloud, camera=CAMERA, pose=POSE, **options)
    assert picture[CAMERA.height // 2, CAMERA.width // 2, 3] == 255 and len(np.unique(picture)) > 20


def test_as_discs_and_none(renderer):
    cloud = ball_over_floor(300)
    assert renderer.render(cloud.styled(splat="disc"), camera=CAMERA, pose=POSE)[..., 3].any()
    none = ps.PointCloud(np.zeros((0, 3)), gaussians=cloud.gaussians.select(np.arange(0)), splat="gaussian")
    assert not renderer.render(none, camera=CAMERA, pose=POSE).any()
    away = POSE.copy()
    away[:3, 2] *= -1
    away[:3, 0] *= -1
    assert not renderer.render(cloud, camera=CAMERA, pose=away).any()
