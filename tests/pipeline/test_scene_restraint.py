"""What a scene does not use costs nothing, by counts of passes and draws. Odd scenes give a picture or one sentence."""

from dataclasses import replace

import numpy as np
import pytest

import pointshade_gl as ps
from pointshade_gl.scene.camera import Eye
from pointshade_gl.scene.visible import coarser, coarser_step, in_view

from ..support import frames

SUN = ps.Light(direction=(0.3, 0.5, 1), shadow=True)
SPOT = ps.Light(position=(-0.5, -0.8, -0.3), direction=(0.5, 0.8, 1.5), cone=(20, 30), shadow=True)
TILE = ps.Mesh([(-0.1, -0.1, 0), (0.1, -0.1, 0), (0.1, 0.1, 0), (-0.1, 0.1, 0)], [(0, 1, 2), (0, 2, 3)])
FRAME = frames.sphere()


def at(x, y, z, content=TILE, **options):
    place = np.eye(4)
    place[:3, 3] = x, y, z
    return ps.Node(content, transform=place, **options)


def counted(renderer, *arguments, **options):
    before = renderer.steps.counts.copy()
    image = renderer.render(*arguments, **options)
    return {name: n for name, n in (renderer.steps.counts - before).items() if n}, image


@pytest.fixture
def fresh(renderer):
    with ps.Renderer() as made:
        yield made


def test_an_unlit_frame_is_splatted_and_looked_up(fresh):
    assert counted(fresh, FRAME, shading="none")[0] == {"upload": 1, "surface": 1, "splats": 1, "resolve": 1}


def test_one_light_without_a_shadow_takes_no_shadow_pass(fresh):
    scene = ps.Scene((ps.Node(ps.PointObject(FRAME)), at(0, 0.3, 1)), camera=frames.CAMERA)
    ran = counted(fresh, scene, replace(SUN, shadow=False))[0]
    assert ran == {"upload": 1, "surface": 1, "splats": 1, "mesh": 1, "surfaces": 1, "light": 1}


def test_two_lights_with_shadows_take_one_view_each(fresh):
    scene = ps.Scene((ps.Node(ps.PointObject(FRAME)), at(0, 0.3, 1)), camera=frames.CAMERA)
    ran = counted(fresh, scene, [SUN, SPOT])[0]
    steps = {"upload": 1, "surface": 1, "bridge": 1, "splats": 3, "mesh": 3, "shadows": 1, "surfaces": 1, "light": 1}
    assert ran == steps


def test_a_node_that_casts_no_shadow_is_not_drawn_into_it(fresh):
    scene = ps.Scene((ps.Node(ps.PointObject(FRAME), shadow=False), at(0, 0.3, 1)), camera=frames.CAMERA)
    ran = counted(fresh, scene, SUN)[0]
    assert (ran["splats"], ran["mesh"]) == (1, 2)


def test_nodes_out_of_view_cost_no_draw(fresh):
    """50 nodes: 5 in front of the camera, the others behind it, beside it and far to the side."""
    seen = [at(0.1 * k - 0.2, 0, 2) for k in range(5)]
    behind = [at(0.1 * k, 0, -1 - k) for k in range(15)]
    aside = [at(5 + k, 0, 2) for k in range(15)] + [at(0, -5 - k, 2) for k in range(15)]
    ran, image = counted(fresh, ps.Scene((*behind, *seen, *aside), camera=frames.CAMERA))
    assert ran == {"culled": 45, "mesh": 5, "surfaces": 1, "light": 1}
    assert (image == fresh.render(ps.Scene(tuple(seen), camera=frames.CAMERA))).all()


def test_what_moves_decides_what_runs(fresh):
    scene = ps.Scene((ps.Node(ps.PointObject(FRAME)), at(0, 0.3, 1)), camera=frames.CAMERA)
    plain = ps.Light(position=(1, 0, 0))
    counted(fresh, scene, [SUN, plain])
    assert counted(fresh, scene, [SUN, replace(plain, position=(0, 1, 0))])[0] == {"light": 1}
    aside = ps.orbit_pose(None, (0, 0, 1.5), 10)
    ran = counted(fresh, scene, [SUN, plain], pose=aside)[0]
    assert ran == {"splats": 1, "mesh": 1, "surfaces": 1, "light": 1}
    ran = counted(fresh, scene, [replace(SUN, direction=(-0.3, 0.5, 1)), plain], pose=aside)[0]
    assert ran == {"splats": 1, "mesh": 1, "shadows": 1, "light": 1}


def test_boxes_are_culled_only_when_nothing_of_them_can_show():
    box = TILE.corners
    for x, y, z, shows in ((0, 0, 2, True), (0, 0, -2, False), (9, 0, 2, False), (0, 9, 2, False), (0.9, 0, 2, True)):
        assert in_view(box + np.array([x, y, z]), [8], Eye(frames.CAMERA, np.eye(4), 0.01)) == [shows]
    around = 20 * TILE.corners + (0, 0, 0.5)
    assert in_view(np.concatenate([around, -around]), [16], Eye(frames.CAMERA, np.eye(4), 0.01)) == [True]
    boxes = (box + np.array([[(0, 0, 2)], [(9, 0, 2)], [(0, 0, 3)]])).reshape(-1, 3)
    seen = in_view(boxes, [8, 0, 8, 8], Eye(frames.CAMERA, np.eye(4), 0.01))
    assert seen.tolist() == [True, False, False, True]  # what has no box is not seen


def test_a_distant_object_is_drawn_from_fewer_points_and_looks_the_same(fresh):
    far = ps.orbit_pose(None, FRAME.pivot, 0, 0, -6)
    scene = ps.Scene((ps.Node(ps.PointObject(FRAME)), at(0, 0, -90)), camera=frames.CAMERA)
    placed = scene.instances[0]
    step = coarser_step(placed, Eye(frames.CAMERA, far, 0.01))
    assert step in (4, 8) and coarser_step(placed, Eye(frames.CAMERA, np.eye(4), 0.01)) == 1
    few = coarser(FRAME, step)
    assert few.points_known < FRAME.points_known / step
    exact = fresh.render(FRAME, pose=far)
    image = fresh.render(scene, pose=far)
    assert (image != exact).any()
    both = (exact[..., 3] > 0) & (image[..., 3] > 0)
    assert ((exact[..., 3] > 0) != (image[..., 3] > 0)).sum() < 0.2 * both.sum()
    assert np.abs(exact.astype(int) - image)[both].mean() < 4


def test_splats_larger_than_their_pixel_stay_as_large_in_the_distance(fresh):
    """Drawn from fewer points, each of them grows by less: the outline is the same."""
    depth = np.zeros((120, 160), np.float32)
    depth[40:80, 60:100] = 1.5
    board = ps.Node(ps.PointObject(ps.Frame(None, depth, frames.CAMERA), point_size=21))
    far = ps.orbit_pose(None, (0, 0, 1.5), 0, 0, -6)
    alone, among = (ps.Scene((board, *rest), camera=frames.CAMERA, pose=far) for rest in ((), (at(0, 0, -90),)))
    assert coarser_step(among.things[0], Eye(frames.CAMERA, far, 0.01)) == 4
    exact, image = (fresh.render(scene)[..., 3] > 0 for scene in (alone, among))
    assert exact.sum() > 60 and (exact != image).sum() <= 0.15 * exact.sum()


def test_a_large_splat_is_seen_when_its_pixel_is_out_of_view(fresh):
    depth = np.zeros((120, 160), np.float32)
    depth[60, 2] = 1.5
    frame = ps.Frame(None, depth, frames.CAMERA)
    aside = np.eye(4)
    aside[0, 3] = 0.1  # the pixel is 6 pixels beyond the left rim of the view
    for size, seen in ((1, False), (40, True)):
        scene = ps.Scene(
            (ps.Node(ps.PointObject(frame, point_size=size)), at(0, 0, -90)), camera=frames.CAMERA, pose=aside
        )
        assert fresh.render(scene).any() == seen


@pytest.mark.parametrize(("fx", "fy"), [(131, 20), (20, 131), (131, -20)])
def test_pixels_that_are_not_square_are_judged_by_their_longer_side(fx, fy):
    """Of such a frame neighbours lie far apart in one direction: it is drawn coarser only when these fall together."""
    frame = ps.Frame(None, np.full((120, 160), 1.5), ps.Camera(fx, fy, 79.5, 59.5, 160, 120))
    (placed,) = ps.Scene((ps.Node(ps.PointObject(frame)),)).things
    away = np.eye(4)
    away[2, 3] = -8
    pixels = 1.5 / 20 * 131 / 9.5  # between neighbours, in the view
    assert 1 / pixels < 2 and coarser_step(placed, Eye(frames.CAMERA, away, 0.01)) == 1


@pytest.mark.parametrize(("shape", "away"), [((12, 12), 2000), ((3, 100), 300), ((100, 3), 300), ((1, 1), 1e5)])
def test_small_and_thin_frames_far_away_are_drawn(fresh, shape, away):
    camera = ps.Camera(20, 20, shape[1] / 2, shape[0] / 2, shape[1], shape[0])
    frame = ps.Frame(None, np.ones(shape), camera)
    scene = ps.Scene((at(0, 0, away, ps.PointObject(frame)), at(0, 0, 2)), camera=frames.CAMERA)
    assert fresh.render(scene).shape == (120, 160, 4)


def test_a_frame_alone_is_drawn_from_all_its_points_at_any_distance(fresh):
    far = ps.orbit_pose(None, FRAME.pivot, 0, 0, -6)
    alone = ps.Scene((ps.Node(ps.PointObject(FRAME)),), camera=frames.CAMERA)
    assert (fresh.render(alone, pose=far) == fresh.render(FRAME, pose=far)).all()


def test_a_scene_without_a_camera_is_seen_whole(fresh):
    scene = ps.Scene((at(5, 1, -3), at(-2, 0, 4))).framed()
    centre, radius = scene.bounds
    ahead = np.linalg.inv(scene.pose) @ [*centre, 1]
    assert ahead[:2] == pytest.approx(0, abs=1e-6) and ahead[2] > radius
    image = fresh.render(ps.Scene((at(5, 1, -3), at(-2, 0, 4))))
    rim = np.concatenate([image[0], image[-1], image[:, 0], image[:, -1]])
    assert image[..., 3].any() and not rim[..., 3].any()


ODD = {
    "no lights": ((at(0, 0, 2),), []),
    "100 lights": (
        (at(0, 0, 2), ps.Node(ps.PointObject(FRAME))),
        [ps.Light(position=(0, -1, 0), intensity=0.01)] * 100,
    ),
    "a light inside the surface": ((at(0, 0, 2),), [ps.Light(position=(0, 0, 2), shadow=True)]),
    "a light in a point": (
        (ps.Node(ps.PointObject(FRAME)),),
        [ps.Light(position=(0, 0, 1), shadow=True)],
    ),
    "the viewer's own light with a shadow": ((at(0, 0, 2),), [ps.Light(shadow=True)]),
    "30 point lights with shadows": ((at(0, 0, 2),), [ps.Light(position=(0, -1, 0), shadow=True)] * 30),
    "no nodes": ((), [SUN]),
    "all hidden": ((at(0, 0, 2, visible=False),), [SUN]),
    "a mesh without faces": ((ps.Node(ps.Mesh(np.zeros((0, 3)), np.zeros((0, 3), int))),), [SUN]),
    "a triangle without area": ((ps.Node(ps.Mesh([(0, 0, 2)] * 3, [(0, 1, 2)])),), [SUN]),
    "a mirrored mesh": ((ps.Node(TILE, transform=np.diag([-1.0, 1, 1, 1])),), [SUN]),
    "no points": ((ps.Node(ps.PointObject(ps.Frame(None, np.zeros((4, 5)), ps.Camera(9, 9, 2, 2, 5, 4)))),), [SUN]),
}


@pytest.mark.parametrize("name", ODD)
def test_odd_scenes_are_drawn(fresh, name):
    nodes, lights = ODD[name]
    image = fresh.render(ps.Scene(nodes, camera=frames.CAMERA), lights)
    assert image.shape == (120, 160, 4)
    assert image.any() == (name not in ("no nodes", "all hidden", "a mesh without faces", "a triangle without area",
                                        "a mirrored mesh", "no points"))  # fmt: skip
    assert (fresh.render(FRAME) == fresh.render(FRAME)).all()


def test_a_sheared_point_object_is_named(fresh):
    shear = np.eye(4)
    shear[0, 1] = 0.5
    scene = ps.Scene((ps.Node(ps.PointObject(FRAME), "bent", shear),), camera=frames.CAMERA)
    with pytest.raises(ValueError, match="node 'bent': a point object takes rotation"):
        fresh.render(scene)
    assert fresh.render(FRAME).any()


def test_a_changed_splat_size_is_drawn_anew(fresh):
    """A new object with the same array, changed in place: sizes are compared by content."""
    sizes = np.ones(FRAME.depth.shape, np.float32)

    def scene(size):
        return ps.Scene((ps.Node(ps.PointObject(FRAME, point_size=size)),), camera=frames.CAMERA)

    whole = fresh.render(scene(sizes), SUN)
    assert counted(fresh, scene(sizes), SUN)[0] == {"light": 1}
    sizes[60, 40:120] = 0
    assert (fresh.render(scene(sizes), SUN) != whole).any()


def test_what_moves_out_of_view_moves_the_near_plane_of_the_rest(fresh):
    def scene(away):
        near, far = np.eye(4), np.eye(4)
        near[2, 3], far[:3, 3] = -0.3, (0, 0, -away)
        nodes = ps.Node(ps.PointObject(FRAME), transform=near), ps.Node(ps.PointObject(FRAME), transform=far)
        return ps.Scene(nodes, camera=frames.CAMERA)

    fresh.render(scene(20), SUN)
    moved = fresh.render(scene(2000), SUN)
    fresh.steps.forget()
    assert (fresh.render(scene(2000), SUN) == moved).all()


def test_sizes_that_were_written_into_are_drawn_anew(fresh):
    sizes = np.full(FRAME.depth.shape, 2, np.float32)
    assert fresh.render(FRAME, point_size=sizes).any()
    sizes[:] = 0
    assert not fresh.render(FRAME, point_size=sizes).any()
