"""Point clouds in scenes: sizes, order, places, near and far viewers, what is drawn again and what is kept."""

import numpy as np
import pytest

import pointshade_gl as ps
from pointshade_gl.gpu.clouds.cloud_store import CloudPoints
from pointshade_gl.scene import shadow_cameras
from pointshade_gl.scene.visible import points_at

from ..support import frames
from ..support.clouds import cloud
from ..support.compare import compare_images

CAMERA = ps.Camera(250.0, 250.0, 159.5, 119.5, 320, 240)
SUN = ps.Light(direction=(0.5, 1, 0.5), shadow=True)


def ball(count=4000, centre=(0, 0, 2), radius=0.4, color=(200, 200, 200), seed=3, **options):
    """A sphere of points with its normals."""
    found = cloud("sphere", count, seed)
    colors = np.tile(np.array(color, np.uint8), (count, 1))
    return ps.PointCloud(radius * found.positions + np.array(centre), found.normals, colors, **options)


def alone(content, **options):
    return ps.Scene((ps.Node(content, **options),), CAMERA)


def drawn(renderer):
    """What the last picture had on the GPU of its clouds."""
    return [one.points for one in renderer._pipeline.gpu_scene.drawn.values()]


def width(renderer, content):
    """How many columns a cloud covers in the picture."""
    return int((renderer.render(alone(content))[..., 3] > 0).any(0).sum())


@pytest.mark.parametrize(
    ("size", "expected"), [(0.2, 50), ("0.2", 50), ("0.2m", 50), ("31px", 62), (" 31 PX", 62), ("0.2x", 50)]
)
def test_a_size_is_in_world_units_pixels_or_spacings(renderer, size, expected):
    """Of a single ball, whose spacing counts as 1, at depth 2; the focal length is 250."""
    assert width(renderer, ps.PointCloud([(0, 0, 2)], splat="ball", point_size=size)) == pytest.approx(expected, abs=2)


def test_a_spacing_is_that_of_the_surface(renderer):
    grid = np.stack(np.meshgrid(np.arange(-8.0, 9), np.arange(-8.0, 9), [0.0]), -1).reshape(-1, 3)
    made = ps.PointCloud(0.2 * grid + (0, 0, 2), splat="ball", point_size="0.25x")
    columns = (renderer.render(alone(made))[..., 3] > 0).any(0)[100:220]
    edges = np.flatnonzero(np.diff(columns.astype(int)))
    widths = np.diff(edges)[int(columns[0]) :: 2]
    assert len(widths) > 2 and widths.mean() == pytest.approx(12.5, abs=1.5)


def test_sizes_of_their_own(renderer):
    places = [(-0.6, 0, 2), (0.1, 0, 2), (0.7, 0, 2)]
    made = ps.PointCloud(places, sizes=(0.2, 0.1, 0), splat="ball")
    columns = (renderer.render(alone(made))[..., 3] > 0).any(0)
    assert columns[:120].sum() == pytest.approx(50, abs=2) and columns[140:200].sum() == pytest.approx(25, abs=2)
    assert not columns[210:].any(), "a point of size 0 is not drawn"
    doubled = (renderer.render(alone(made.styled(point_size="2x")))[..., 3] > 0).any(0)
    assert doubled[:145].sum() == pytest.approx(105, abs=2)


@pytest.mark.parametrize("splat", ["disc", "ball"])
def test_clouds_meshes_and_frames_hide_each_other(renderer, splat):
    """A board through a ball of points: in front of it on one side, behind it on the other. A frame's wall is behind
    both."""
    made = ball(shading="none", splat=splat, point_size=0.03 if splat == "ball" else None)
    board = ps.Mesh([(-1, -0.05, 1.2), (1, -0.05, 2.8), (1, 0.05, 2.8), (-1, 0.05, 1.2)], [(0, 1, 2), (0, 2, 3)],
                    color=(1, 0, 0), shading="none")  # fmt: skip
    wall = ps.Frame(np.full((120, 160, 3), (0, 0, 255), np.uint8), np.full((120, 160), 2.1), frames.CAMERA)
    nodes = (ps.Node(made), ps.Node(board), ps.Node(ps.PointObject(wall, shading="none")))
    image = renderer.render(ps.Scene(nodes, CAMERA)).astype(int)
    row, u = image[120], np.arange(320)
    ray = (u - CAMERA.cx) / CAMERA.fx
    board_z = 2.0 / (1 - 0.8 * ray)
    inside = np.maximum(4 - (1 + ray**2) * (4 - 0.16), 0)
    ball_z = np.where(inside > 0.02, (2 - np.sqrt(inside)) / (1 + ray**2), np.inf)
    kinds = np.argmin([ball_z, board_z, np.full(320, 2.1)], 0)
    nearest = np.sort([ball_z, board_z, np.full(320, 2.1)], 0)
    sure = nearest[1] - nearest[0] > 0.06
    colors = np.array([(200, 200, 200), (255, 0, 0), (0, 0, 255)])
    on_board = (np.abs(ray) < 0.3) & (np.abs(np.abs(ray) - 0.204) > 0.02) & sure  # not at the ball's rim
    for kind in (0, 1, 2):
        chosen = on_board & (kinds == kind)
        assert chosen.sum() > 8 and (np.abs(row[chosen, :3] - colors[kind]) < 3).all(-1).mean() > 0.95, kind


def test_two_clouds_are_in_order_and_shade_each_other(renderer):
    red, green = ball(color=(255, 0, 0), shading="none"), ball(centre=(0.7, 0, 3), color=(0, 255, 0), shading="none")
    nodes = ps.Node(red), ps.Node(green)
    one, other = (renderer.render(ps.Scene(several, CAMERA)) for several in (nodes, nodes[::-1]))
    assert not compare_images(one, other) and one[120, 160].tolist() == [255, 0, 0, 255]
    assert one[120, 230].tolist() == [0, 255, 0, 255]
    lit = [alone_or_both(renderer, ball(), ball(radius=0.2, centre=(-0.35, -0.7, 1.65)), k) for k in (1, 2)]
    darker = (lit[0].astype(int) - lit[1])[60:95, 115:160].max()
    assert darker > 60


def alone_or_both(renderer, large, small, count):
    camera = ps.Camera(CAMERA.fx, CAMERA.fy, CAMERA.cx, CAMERA.cy, CAMERA.width, CAMERA.height)
    nodes = tuple(map(ps.Node, (large, small)))[:count]
    return renderer.render(ps.Scene(nodes, camera), SUN)


def test_a_node_may_turn_move_and_scale_a_cloud(renderer):
    made, turn = ball(centre=(0, 0, 0)), ps.orbit_pose(None, (0, 0, 0), 40, 20)[:3, :3]
    world = np.eye(4)
    world[:3, :3], world[:3, 3] = 2.5 * turn, (0.1, 0.2, 4)
    placed = renderer.render(alone(made, transform=world), SUN)
    moved = ps.PointCloud(made.positions @ world[:3, :3].T + world[:3, 3], made.normals @ turn.T, made.colors)
    assert not compare_images(placed, renderer.render(alone(moved), SUN))
    sized = ps.PointCloud(made.positions, made.normals, made.colors, point_size=0.02)
    large = ps.PointCloud(moved.positions, moved.normals, made.colors, point_size=0.05)
    assert not compare_images(renderer.render(alone(sized, transform=world)), renderer.render(alone(large)))
    with pytest.raises(ValueError, match="one scale for all axes"):
        renderer.render(alone(made, transform=np.diag([1, 2, 1, 1.0])))


def test_what_is_hidden_or_out_of_view_is_not_drawn(renderer):
    made = ball()
    assert not renderer.render(alone(made, visible=False)).any()
    behind = ps.Scene((ps.Node(made),), CAMERA, ps.orbit_pose(None, (0, 0, 0), 180))
    before = renderer.steps.counts.copy()
    assert not renderer.render(behind).any()
    counts = renderer.steps.counts - before
    assert counts["culled"] == 1 and counts["splats"] == 0


def test_a_node_without_shadow_casts_none(renderer):
    floor = np.random.default_rng(1).uniform(-1, 1, (9000, 3)) * (1, 0, 1) + (0, 0.5, 2)
    ground = ps.Node(ps.PointCloud(floor, np.tile((0.0, -1, 0), (9000, 1))))
    images = [renderer.render(ps.Scene((ps.Node(ball(), shadow=on), ground), CAMERA), SUN) for on in (True, False)]
    plain = renderer.render(ps.Scene((ps.Node(ball()), ground), CAMERA), ps.Light(direction=SUN.direction))
    assert compare_images(images[0], plain)
    floor_part = np.s_[174:]
    assert not compare_images(images[1][floor_part], plain[floor_part])
    assert compare_images(images[0][floor_part], plain[floor_part])


@pytest.mark.parametrize("splat", ["disc", "ball"])
def test_far_from_zero_the_picture_is_the_same(renderer, splat):
    """Georeferenced: float32 alone would tell half metres apart."""
    far = np.array((4.8e6, -3.2e6, 1.1e6))
    here = ball(centre=(0, 0, 0), splat=splat)
    there = ps.PointCloud(here.positions, here.normals, here.colors, origin=far, splat=splat)
    whole = ps.PointCloud(here.positions + far, here.normals, here.colors, splat=splat)
    pose = ps.orbit_pose(None, (0, 0, 0), 20, 10)
    pose[:3, 3] = -2 * pose[:3, 2]
    moved = pose.copy()
    moved[:3, 3] += far
    expected = renderer.render(ps.Scene((ps.Node(here),), CAMERA, pose), SUN)
    for made in (there, whole):
        assert not compare_images(renderer.render(ps.Scene((ps.Node(made),), CAMERA, moved), SUN), expected)
    assert not compare_images(renderer.render(there), renderer.render(here))


def test_from_afar_fewer_points_are_drawn_and_the_picture_stays(renderer):
    """Beside one of all points, each as large as they lie apart, within 34 dB, and its outline within 3 %."""
    made, camera = ball(120_000), ps.Camera(500, 500, 319.5, 239.5, 640, 480)
    images, counts = [], []
    for one in (made, made.styled(point_size=2 * 0.4 * np.sqrt(4 * np.pi / 120_000))):
        images.append(renderer.render(ps.Scene((ps.Node(one),), camera)).astype(float))
        counts.append(drawn(renderer)[0].count)
    assert counts[0] < 80_000 and counts[1] == 120_000
    both = (images[0][..., 3] > 0) & (images[1][..., 3] > 0)
    error = np.sqrt(np.mean((images[0] - images[1])[both] ** 2))
    assert 20 * np.log10(255 / error) > 34
    covered = [(image[..., 3] > 0).sum() for image in images]
    assert covered[0] == pytest.approx(covered[1], rel=0.03)
    for away in (6, 30):
        pose = np.eye(4)
        pose[2, 3] = 2 - away
        renderer.render(ps.Scene((ps.Node(made),), camera, pose))
        counts.append(drawn(renderer)[0].count)
    assert counts[0] > counts[2] > counts[3] > 0


def test_levels_are_parts_of_each_other():
    made = ps.PointCloud(np.zeros((50_000, 3)))
    finer = set(range(50_000))
    assert points_at(made, 0) is None
    for level in range(1, 6):
        some = points_at(made, level)
        assert set(some.tolist()) <= finer and (np.diff(some) > 0).all()
        assert len(some) == pytest.approx(50_000 / 2**level, rel=0.1)
        finer = set(some.tolist())


def test_points_of_a_size_in_the_world_are_never_left_out(renderer):
    made = ball(120_000, point_size=0.003)
    scene = ps.Scene((ps.Node(made),), CAMERA, ps.orbit_pose(None, (0, 0, 2), dolly=-20))
    renderer.render(scene)
    assert drawn(renderer)[0].count == 120_000


def test_seen_from_inside_walls_are_on_all_sides(renderer):
    """Of a room of points. Those too near are left out, and nothing else."""
    room = cloud("box", 60_000, 9)
    made = ps.PointCloud(room.positions, room.normals)
    for yaw, pitch in ((0, 0), (35, 20), (130, -35)):
        pose = ps.orbit_pose(None, (0, 0, 0), yaw, pitch)
        pose[:3, 3] = 0.2, -0.3, 0.1
        depth = renderer.render_depth(ps.Scene((ps.Node(made),), CAMERA, pose))
        ray = np.stack([*CAMERA.ray_at(*np.meshgrid(np.arange(320), np.arange(240))), np.ones((240, 320))], -1)
        ray = ray @ pose[:3, :3].T
        walls = (np.sign(ray) - pose[:3, 3]) / np.where(ray == 0, 1e-9, ray)
        truth = walls.min(-1)
        assert (depth == 0).mean() < 0.002
        assert (np.abs(depth - truth) > 0.05)[depth > 0].mean() < 0.01


@pytest.mark.parametrize("size", [1e-12, 1e-3, 5.0, 1e6, "1000px", "100000px", "0.0001x", "500x", 0])
@pytest.mark.parametrize("splat", ["disc", "ball"])
def test_any_size_gives_a_picture(renderer, monkeypatch, size, splat):
    monkeypatch.setattr(shadow_cameras, "SHADOW_SIDE", 256)
    scene = ps.Scene((ps.Node(ball(500, splat=splat, point_size=size)),), CAMERA.resized(160, 120))
    image = renderer.render(scene, SUN)
    assert image.shape == (120, 160, 4)
    if size == 0:
        assert not image.any()


@pytest.mark.parametrize("count", [0, 1, 2, 3, 7])
@pytest.mark.parametrize("splat", ["disc", "ball"])
def test_few_points_are_seen(renderer, count, splat):
    """Also without normals and sizes, with a shadow on a ground; none at all give an empty picture."""
    places = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0.5), (1, 1, 1), (0, 0, 1), (2, 1, 0), (0.5, 2, 1)])[:count]
    made = ps.PointCloud(places, splat=splat)
    image = renderer.render(made, SUN, ground=True, samples=2)
    share = (image[..., 3] > 0).mean()
    assert share == 0 if count == 0 else 0.02 < share < 0.98
    normals = np.tile((0.0, 0, -1), (count, 1))
    assert renderer.render(ps.PointCloud(places, normals, splat=splat)).any() == (count > 0)


def test_points_without_a_plane_among_discs_are_balls(renderer):
    """A bush beside a sheet: its points do not become plates, and hold its outline."""
    rng = np.random.default_rng(2)
    sheet = np.stack([rng.uniform(-0.7, -0.1, 6000), rng.uniform(-0.4, 0.4, 6000), np.full(6000, 2.0)], -1)
    bush = 0.25 * rng.uniform(-1, 1, (400, 3)) + (0.4, 0, 2)
    made = ps.PointCloud(np.concatenate([sheet, bush]))
    depth = renderer.render_depth(alone(made))
    (points,) = drawn(renderer)
    discs, balls = (sum(one.size for one in buffers) // 36 for buffers in (points.discs, points.others))
    assert balls > 300 and discs > 5900
    assert (depth[80:160, 180:240] > 0).mean() > 0.15
    assert not depth[:, 252:].any() and not depth[:80, 170:].any()


@pytest.mark.parametrize(
    "finish", [{}, {"samples": 3, "background": "white", "ground": (0, -1, 0)}], ids=["plain", "finished"]
)
def test_the_same_call_gives_the_same_picture(renderer, finish):
    scene = alone(ball())
    first = renderer.render(scene, SUN, **finish)
    other = renderer.render(alone(ball(300)), SUN, **finish)
    assert (renderer.render(scene, SUN, **finish) == first).all() and not (other == first).all()
    if finish:
        assert (first[..., 3] == 255).all() and first[0, 0].tolist() == [255, 255, 255, 255]
        groundless = renderer.render(scene, SUN, samples=3, background="white")
        assert ((groundless[..., :3] == 255) & (first[..., :3] < 200)).all(-1).sum() > 300, "a shadow on the ground"


def test_another_light_draws_nothing_of_a_cloud_again(renderer):
    scene = alone(ball())
    renderer.render(scene, ps.Light(position=(1, 0, 0)))
    before = renderer.steps.counts.copy()
    renderer.render(scene, ps.Light(position=(-1, 0, 0)))
    counts = renderer.steps.counts - before
    assert (counts["splats"], counts["surfaces"], counts["light"]) == (0, 0, 1)


def test_a_cloud_that_only_looks_otherwise_is_not_uploaded_again(renderer, monkeypatch):
    made, uploads = ball(), []
    real = CloudPoints.__init__
    monkeypatch.setattr(CloudPoints, "__init__", lambda self, *args: (uploads.append(args), real(self, *args))[1])
    plain = renderer.render(alone(made))
    assert len(uploads) == 1
    styles = [{"material": ps.Material(specular=0)}, {"shading": "none"}, {"point_size": 0.05}, {"point_size": "4px"}]
    for style in styles:
        assert compare_images(renderer.render(alone(made.styled(**style))), plain), style
    renderer.render(made)  # its own view
    assert len(uploads) == 1
    renderer.render(alone(ball(seed=4)))
    assert len(uploads) == 2
