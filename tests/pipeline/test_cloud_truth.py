"""Pictures of clouds against formulas: a sphere, a single ball near, aside and in a sun's eyes, a torus, shadows."""

import numpy as np
import pytest

import pointshade_gl as ps
from pointshade_gl.scene.graph import scene_of

from ..support.clouds import cloud

CAMERA = ps.Camera(500.0, 500.0, 319.5, 239.5, 640, 480)
SUN = ps.Light(direction=(0.5, 1, 0.5), shadow=True)


def surfaces(renderer, scene):
    """(h, w) depth and (h, w, 3) normals, camera axes, 0 where nothing is seen."""
    normals = np.nan_to_num(renderer.render_normals(scene))
    return renderer.render_depth(scene), normals


def rays(camera):
    x, y = camera.ray_at(*np.meshgrid(np.arange(camera.width), np.arange(camera.height)))
    return np.stack([x, y, np.ones_like(x)], -1)


def sphere_depth(camera, centre, radius):
    """(h, w) depth of a sphere, 0 beside it, by the formula of the school in float64; and the distance from its rim:
    the discriminant over radius squared."""
    ray, centre = rays(camera), np.array(centre, float)
    a, b, c = (ray * ray).sum(-1), ray @ centre, centre @ centre - radius**2
    meets = b * b - a * c
    depth = np.where(meets > 0, (b - np.sqrt(np.maximum(meets, 0))) / a, 0)
    return depth, meets / (a * radius**2)


def sphere_points(count, seed):
    v = np.random.default_rng(seed).normal(size=(count, 3))
    return v / np.linalg.norm(v, axis=1, keepdims=True)


def angles(found, true):
    return np.degrees(np.arccos(np.clip((found * true).sum(-1), -1, 1)))


@pytest.mark.parametrize("turns", [1, -1])
def test_discs_of_a_sphere_make_a_sphere(renderer, turns):
    """With its own normals, whichever way they look: no holes, its outline, its depth and its normals."""
    v, centre, radius = sphere_points(20000, 71), np.array((0.2, -0.1, 2.5)), 0.5
    made = ps.PointCloud(radius * v + centre, turns * v)
    depth, normals = surfaces(renderer, ps.Scene((ps.Node(made),), CAMERA))
    truth, inside = sphere_depth(CAMERA, centre, radius)
    spacing = np.sqrt(4 * np.pi / 20000) * radius
    assert (depth > 0)[inside > 0.02].all(), "no holes"
    assert not depth[inside < -0.1].any()
    assert abs((depth > 0).sum() / (truth > 0).sum() - 1) < 0.01, "as large as the sphere"
    off = np.abs(depth - truth)[inside > 0.1]
    assert off.mean() < 0.03 * spacing and off.max() < 0.5 * spacing
    error = angles(normals, (rays(CAMERA) * truth[..., None] - centre) / radius)
    assert error[inside > 0.02].mean() < 0.5 and np.quantile(error[inside > 0.02], 0.99) < 4


@pytest.mark.parametrize(
    ("centre", "radius"),
    [((0.1, 0.0, 2), 0.8), ((1.1, -0.85, 2), 0.3), ((0, 0, 2), 0.007), ((-0.6, 0.4, 1.0), 0.2), ((0, 0, 1), 0.49)],
    ids=["large", "aside", "small", "near", "nearest"],
)
def test_a_single_ball_is_a_sphere(renderer, centre, radius):
    """Also where it is larger than the driver's points, and cut by the picture."""
    made = ps.PointCloud([centre], splat="ball", point_size=radius)
    depth, normals = surfaces(renderer, ps.Scene((ps.Node(made),), CAMERA))
    truth, inside = sphere_depth(CAMERA, centre, radius)
    clear = np.abs(inside) > 1e-3
    assert (truth > 0).sum() > 5
    assert ((depth > 0) == (truth > 0))[clear].all()
    met = clear & (truth > 0)
    np.testing.assert_allclose(depth[met], truth[met], atol=1e-5 * radius + 2e-6)
    expected = (rays(CAMERA) * truth[..., None] - centre) / radius
    assert angles(normals, expected)[met & (inside > 0.01)].max() < 0.2


@pytest.mark.parametrize("light", [SUN, ps.Light(position=(-1, -2, 1.5), shadow=True)], ids=["sun", "lamp"])
@pytest.mark.parametrize("radius", [0.3, 0.02])
def test_a_ball_shades_itself_where_it_turns_away_and_nowhere_else(renderer, light, radius):
    """From a sun a thousand radii away, too: no stripes. Of the lit half nothing is in shadow."""
    made = ps.PointCloud([(0, 0, 2)], splat="ball", point_size=radius)
    camera = ps.Camera(150 / radius, 150 / radius, 319.5, 239.5, 640, 480)
    scene = ps.Scene((ps.Node(made),), camera)
    lit, plain = (renderer.render(scene, ps.Light(**{**vars(light), "shadow": on})) for on in (True, False))
    truth, inside = sphere_depth(camera, (0, 0, 2), radius)
    point = rays(camera) * truth[..., None]
    normal = (point - (0, 0, 2)) / radius
    toward = -np.array(light.direction) if light.position is None else np.array(light.position) - point
    cosine = (normal * toward).sum(-1) / np.linalg.norm(toward, axis=-1)
    sure = (inside > 0.01) & (np.abs(cosine) > 0.06)
    assert (sure & (cosine > 0)).sum() > 5000
    assert not np.abs(lit.astype(int) - plain)[sure].any()


@pytest.mark.parametrize(("count", "most"), [(60_000, 0.9), pytest.param(400_000, 0.35, marks=pytest.mark.system)])
def test_normals_in_the_view_of_an_estimated_torus(renderer, count, most):
    """The mean error of the normal at the drawn place, degrees."""
    made = ps.PointCloud(cloud("torus", count, 314).positions, up="z")
    scene = scene_of(made)
    depth, normals = surfaces(renderer, scene)
    seen = depth > 0
    turn, shift = scene.pose[:3, :3], scene.pose[:3, 3]
    place = (rays(scene.camera) * depth[..., None])[seen] @ turn.T + shift
    ring = place * (1, 1, 0)
    away = place - ring / np.linalg.norm(ring, axis=1, keepdims=True)
    far = np.linalg.norm(away, axis=1)
    error = angles(normals[seen] @ turn.T, away / far[:, None])
    assert seen.mean() > 0.2 and error.mean() <= most
    assert np.abs(far - 0.4).mean() < 0.05 * np.sqrt(4 * np.pi**2 * 0.4 / count)


@pytest.mark.parametrize("light", [SUN, ps.Light(position=(-2, -3, 3), shadow=True)], ids=["sun", "lamp"])
@pytest.mark.parametrize(("shape", "count", "most"), [("sphere", 20000, 0.001), ("torus", 60000, 0.004)])
def test_no_acne(renderer, shape, count, most, light):
    """Of what faces the light hardly a pixel is in shadow, though discs rise over their neighbours."""
    made = ps.PointCloud(cloud(shape, count, 12).positions, up="z")
    scene = scene_of(made)
    lit, plain = (renderer.render(scene, ps.Light(**{**vars(light), "shadow": on})) for on in (True, False))
    depth, normals = surfaces(renderer, scene)
    turn = scene.pose[:3, :3]
    place = rays(scene.camera) * depth[..., None] @ turn.T + scene.pose[:3, 3]
    toward = -np.array(light.direction) if light.position is None else np.array(light.position) - place
    cosine = (normals @ turn.T * toward).sum(-1) / np.linalg.norm(toward, axis=-1)
    facing = (depth > 0) & (cosine > 0.25)
    shaded = facing & (np.abs(lit.astype(int) - plain).max(-1) > 8)
    if shape == "torus":  # it stands in its own light only where the ring hides its other side
        ring = place * (1, 1, 0)
        facing &= np.linalg.norm(ring, axis=-1) > 1
    assert facing.sum() > 30000 and (shaded & facing).sum() <= most * facing.sum()


def test_the_shadow_of_a_disc_on_a_floor_is_where_the_sun_puts_it(renderer):
    """A round sheet of points over a sheet: an ellipse of the sheet's size, and no shadow elsewhere."""
    rng = np.random.default_rng(8)
    angle, away = rng.uniform(0, 2 * np.pi, 8000), 0.3 * np.sqrt(rng.random(8000))
    sheet = np.stack([away * np.cos(angle), np.full(8000, -0.2), 2.5 + away * np.sin(angle)], -1)
    floor = np.stack([rng.uniform(-1, 1, 30000), np.full(30000, 0.4), rng.uniform(1.5, 3.5, 30000)], -1)
    nodes = tuple(ps.Node(ps.PointCloud(one, np.tile((0.0, -1, 0), (len(one), 1)))) for one in (sheet, floor))
    scene = ps.Scene(nodes, CAMERA, ps.orbit_pose(None, (0, 0.2, 2.5), 0, 45))
    lit, plain = (renderer.render(scene, ps.Light(direction=(0.5, 1, 0.2), shadow=on)) for on in (True, False))
    depth = renderer.render_depth(scene)
    place = rays(CAMERA) * depth[..., None] @ scene.pose[:3, :3].T + scene.pose[:3, 3]
    on_floor = (depth > 0) & (np.abs(place[..., 1] - 0.4) < 0.01)
    far = np.hypot(place[..., 0] - 0.3, place[..., 2] - 2.62) / 0.3
    dark = np.abs(lit.astype(int) - plain).max(-1) > 8
    assert dark[on_floor & (far < 0.95)].mean() > 0.999
    assert dark[on_floor & (far > 1.07)].mean() < 0.001
    assert (on_floor & (far < 0.95)).sum() > 3000


def test_a_ball_stands_on_its_ground(renderer):
    """The ground lies under the ball, not through its middle: its shadow is an ellipse that begins below it."""
    made = ps.PointCloud([(0, 0, 2)], splat="ball", point_size=0.3)
    scene = ps.Scene((ps.Node(made),), CAMERA, ps.orbit_pose(None, (0, 0, 2), 0, 40))
    image = renderer.render(scene, ps.Light(direction=(0.6, 1, 0), shadow=True), ground=(0, -1, 0))
    reach = 0.3 * np.sqrt(1.36)  # of the shadow, whose middle is .18 aside

    def at(x):
        u, v = CAMERA.pixel_at(*((x, 0.3, 2) - scene.pose[:3, 3]) @ scene.pose[:3, :3])
        return image[round(float(v)), round(float(u))].tolist()

    assert at(0)[3] == 255, "the ball itself"
    for x in (0.4, 0.17 + 0.97 * reach):
        assert at(x)[:3] == [0, 0, 0] and at(x)[3] > 100, "the shadow beside it"
    assert at(0.19 + 1.03 * reach) == at(-0.5) == [0, 0, 0, 0]


def leaves(count=250):
    """A scan of leaves over a ground: where each ray of a pinhole ends, (h, w, 3) camera axes, and that camera."""
    camera = ps.Camera(320, 320, 89.5, 79.5, 180, 160)
    rng = np.random.default_rng(3)
    middles = rng.normal(size=(count, 3)) * (0.35, 0.35, 0.35) + (0, -0.1, 5)
    normals = rng.normal(size=(count, 3))
    ray = np.stack([*camera.ray_at(*np.meshgrid(np.arange(180), np.arange(160))), np.ones((160, 180))], -1)
    z = np.where(ray[..., 1] > 0, 1.2 / np.maximum(ray[..., 1], 1e-9), 9.0).clip(max=9)
    for middle, normal in zip(middles, normals, strict=True):
        at = (middle @ normal) / (ray @ normal)
        z = np.where((np.linalg.norm(ray * at[..., None] - middle, axis=-1) < 0.07) & (at > 0), np.minimum(z, at), z)
    return ray * z[..., None], camera


def test_points_of_leaves_leave_free_what_rays_passed_through(renderer):
    """Of one ray in ten nothing is known but the picture: it ends where the leaves and the ground are."""
    ends, camera = leaves()
    is_kept = np.random.default_rng(1).random(ends.shape[:2]) > 0.1
    depth = renderer.render_depth(ps.Scene((ps.Node(ps.PointCloud(ends[is_kept])),), camera))
    off = depth - ends[..., 2]
    near = 3 * ends[..., 2] / camera.fx  # three points aside
    assert (off < -near)[depth > 0].mean() < 0.045
    assert (np.abs(off) < near)[~is_kept].mean() > 0.9
