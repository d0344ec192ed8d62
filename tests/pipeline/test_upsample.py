"""Depth that is smaller than the colours is drawn at their size: what it looks like, what it costs, what it leaves."""

from dataclasses import fields, replace
from functools import cache

import numpy as np
import pytest

import pointshade_gl as ps
from pointshade_gl.bench.scenes import near_depth_edge
from pointshade_gl.bench.tracing import Hits, decode, encode, plane, trace
from pointshade_gl.scene.appearance import Appearance
from pointshade_gl.scene.visible import finer_camera

from ..benchmarks.traced_light import co_visible, near_edge, shade
from ..reference.upsample import guide_colors, snapped, upsampled
from ..support import frames
from ..support.compare import compare_images
from ..support.small_depth import COLOR, DEPTH, LARGE, RATIO, SMALL, clean, cropped, lidar, things
from ..support.viewing import drag, shown

F = np.float32
LIGHT = ps.Light(position=(-1.0, -1.0, -0.5))
SIDE = ps.orbit_pose(None, (0, 0, 1.6), 15)

SEEDS = 1, pytest.param(2, marks=pytest.mark.system)
SOME = np.s_[::2, ::2]  # pixels whose colours are judged, and the camera that sees just these
SPARSE = ps.Camera(*(x / 2 for x in LARGE.intrinsics), COLOR[0] // 2, COLOR[1] // 2)


@cache
def seen_from_side(seed, contrast):
    return trace(things(seed, contrast), SPARSE, SIDE)


def surface_drawn(renderer, frame, **look):
    """The surface (h, w, 4), unit normal and depth, that is drawn at the colours' size."""
    with renderer._in_use():
        store = renderer._pipeline.gpu_scene.frames
        (textures,) = store.upload([frame])
        drawn = store.find_points(textures, frame, Appearance(**look), frame.picture_camera)
        width, height = drawn.surface.size
        return np.frombuffer(drawn.surface.texture.read(), F).reshape(height, width, 4)


def psnr(image, truth, judged):
    error = image[judged][:, :3].astype(float) - truth[judged]
    return 10 * np.log10(255**2 / (error**2).mean())


def scores(renderer, known, seed, contrast=1.0):
    """% of wrong depths near edges, PSNR from the frame's own camera, PSNR from the side of what the frame saw."""
    frame, hits, _ = known
    depth = surface_drawn(renderer, frame)[..., 3]
    edge = near_depth_edge(hits.depth, hits.normals, LARGE, round(1.5 * RATIO))
    wrong = abs(depth - hits.depth) > 0.02 * hits.depth
    own = Hits(*(getattr(hits, field.name)[SOME] for field in fields(Hits)))
    own = replace(own, albedo=decode(frame.color[SOME].astype(float)))
    image = renderer.render(frame, LIGHT, camera=LARGE)[SOME]
    front = psnr(image, encode(shade(own, LIGHT, ps.Material(), np.zeros(3))), own.surface >= 0)
    seen = seen_from_side(seed, contrast)
    image = renderer.render(frame, LIGHT, camera=LARGE, pose=SIDE)[SOME]
    truth = encode(shade(seen, LIGHT, ps.Material(), SIDE[:3, 3]))
    return 100 * wrong[edge].mean(), front, psnr(image, truth, co_visible(seen, hits, LARGE, np.eye(4)))


@pytest.mark.parametrize("seed", SEEDS)
def test_outlines_of_clean_depth_are_those_of_the_colours(renderer, seed):
    wrong, front, side = scores(renderer, clean(seed), seed)
    assert wrong <= 1 and front >= 36 and side >= 27.5


@pytest.mark.system
@pytest.mark.parametrize("seed", SEEDS)
def test_outlines_of_low_contrast_are_mostly_found(renderer, seed):
    wrong, front, side = scores(renderer, clean(seed, 0.2), seed, 0.2)
    assert wrong <= 6 and front >= 36 and side >= 27.5


@pytest.mark.parametrize("seed", SEEDS)
def test_depth_by_wide_beams_gets_outlines(renderer, seed):
    wrong, front, side = scores(renderer, lidar(seed), seed)
    assert wrong <= 20 and front >= 25 and side >= 18.5
    as_taken = surface_drawn(renderer, clean(seed).frame)[..., 3]
    assert (as_taken != surface_drawn(renderer, lidar(seed).frame)[..., 3]).mean() > 0.9


def test_points_of_the_depth_alone_are_far_worse(renderer):
    """What `upsample="none"` draws: stairs, and with wide beams skirts, which calm light would hide in part."""
    for known in (clean(1), lidar(1)):
        own = replace(known.hits, albedo=decode(known.frame.color.astype(float)))
        truth, judged = encode(shade(own, LIGHT, ps.Material(), np.zeros(3))), known.hits.surface >= 0
        voted, alone = (
            psnr(renderer.render(known.frame, LIGHT, upsample=how, normals="adaptive"), truth, judged)
            for how in ("vote", "none")
        )
        assert alone < voted - 1.5


@pytest.mark.parametrize("make", [clean, pytest.param(lidar, marks=pytest.mark.system)])
def test_the_surface_is_that_of_the_mirror(renderer, make):
    frame = cropped(make(2).frame)
    intrinsics, picture = np.array(frame.camera.intrinsics, F), frame.color.astype(F) / F(255)

    def star(depth):
        normals = np.nan_to_num(renderer.estimate_normals(ps.Frame(None, depth, frame.camera), "star"))
        return np.concatenate([normals, depth[..., None]], -1)

    actual = surface_drawn(renderer, frame, normals="star")
    small, guide = star(frame.depth), guide_colors(picture, frame.depth.shape[::-1])
    if make is lidar:
        small = snapped(frame.depth, small, guide, intrinsics, star)
    expected = upsampled(small, guide, picture, intrinsics, picture.shape[1::-1])
    assert ((actual[..., 3] > 0) == (expected[..., 3] > 0)).all()
    assert (abs(actual - expected).max(-1) > 1e-5).mean() <= 0.001  # decisions near their thresholds


def test_texture_leaves_the_depth_of_a_plane_untouched(renderer):
    def checks(points):
        squares = np.floor(points[..., 0] * 20) + np.floor(points[..., 1] * 20)
        return np.where(squares[..., None] % 2 < 1, 0.9, 0.1) * np.ones(3)

    wall = plane((0.5, 0.2, -1), (0, 0, 1.5), checks)
    hits = trace([wall], LARGE)
    color = np.round(encode(hits.albedo)).astype(np.uint8)
    surface = surface_drawn(renderer, ps.Frame(color, trace([wall], SMALL).depth, SMALL))
    np.testing.assert_allclose(surface[..., 3], hits.depth, rtol=1e-5)
    np.testing.assert_allclose(surface[..., :3], hits.normals, atol=1e-4)


def test_a_crease_is_a_line_and_belongs_to_both_planes(renderer):
    """A floor before a wall, both of one colour: no vote could find where they meet."""
    parts = [plane((0, 0, -1), (0, 0, 2.2), np.ones_like), plane((0.2, -1, -0.1), (0, 0.5, 1.8), np.ones_like)]
    hits = trace(parts, LARGE)
    color = np.full((*COLOR[::-1], 3), 200, np.uint8)
    surface = surface_drawn(renderer, ps.Frame(color, trace(parts, SMALL).depth, SMALL))
    inner = np.s_[:, 15:-15]  # at the rim fewer samples show both planes
    np.testing.assert_allclose(surface[inner][..., 3], hits.depth[inner], rtol=0.006)
    assert ((surface[..., :3] * hits.normals).sum(-1) < 0.99).mean() < 0.0005


@pytest.mark.parametrize("make", [frames.sphere_before_wall, frames.holes])
def test_nothing_changes_where_the_sizes_agree(renderer, make):
    before = renderer.steps.counts["upsample"]
    voted = renderer.render(make(), LIGHT, pose=SIDE)
    assert (voted == renderer.render(make(), LIGHT, pose=SIDE, upsample="none")).all()
    assert renderer.steps.counts["upsample"] == before


def test_colours_smaller_than_the_depth_leave_its_size(renderer):
    frame = frames.sphere()
    frame = ps.Frame(frame.color[::2, ::2], frame.depth, frame.camera)
    assert frame.picture_camera == frame.camera
    assert renderer.render(frame).shape == (120, 160, 4)


def test_the_picture_has_the_size_of_larger_colours(renderer):
    frame = clean(1).frame
    np.testing.assert_allclose(frame.picture_camera.intrinsics, LARGE.intrinsics)
    assert renderer.render(frame).shape == (900, 1200, 4)
    color = renderer.render(frame, shading="none")[..., :3]
    np.testing.assert_array_equal(color, frame.color)


def test_a_new_view_or_light_does_not_vote_again(renderer):
    frame = cropped(clean(2).frame)
    renderer.render(frame)
    before = renderer.steps.counts.copy()
    renderer.render(frame, pose=SIDE)
    renderer.render(frame, LIGHT, pose=SIDE, shading="flat")
    assert set(renderer.steps.counts - before) == {"splats", "resolve", "light"}
    renderer.render(frame, camera=frame.picture_camera.resized(210, 150))
    assert (renderer.steps.counts - before)["upsample"] == 1
    again = renderer.render(frame)
    assert (again == renderer.render(cropped(clean(2).frame))).all()


def test_points_are_as_fine_as_the_view_but_no_finer_than_the_colours():
    frame = clean(1).frame

    def size(camera, **look):
        found = finer_camera(frame, Appearance(**look), camera)
        assert found == SMALL.resized(found.width, found.height)
        return found.width, found.height

    assert size(LARGE) == size(LARGE.resized(2400, 1800)) == COLOR
    assert size(LARGE.resized(600, 450)) == (600, 450)
    assert size(SMALL) == size(SMALL.resized(80, 60)) == DEPTH
    assert size(SMALL.fitted(640, 900)) == (640, 480)
    assert size(LARGE, upsample="none") == size(LARGE, point_size=2) == DEPTH
    assert size(LARGE, point_size=np.full(DEPTH[::-1], 0.5)) == DEPTH
    assert size(LARGE, point_size=1) == COLOR


def test_a_camera_of_odd_numbers_keeps_them_where_the_sizes_agree():
    """Resized to its own size, a camera may differ in the last digit."""
    odd = ps.Camera(131.7, 131.3, 79.37, 59.123, 160, 120)
    color = np.zeros((240, 320, 3), np.uint8)
    for picture in (color, color[:120, :160]):
        frame = ps.Frame(picture, np.ones((120, 160)), odd)
        assert finer_camera(frame, Appearance(), odd) is odd


def test_options_with_an_array_a_sample_still_work(renderer):
    frame = cropped(clean(2).frame)
    normals = np.nan_to_num(renderer.estimate_normals(frame, "star"))
    own = renderer.render(frame, LIGHT, normals=normals)
    assert compare_images(own, renderer.render(frame, LIGHT, normals="star")) == ""
    hidden = renderer.render(frame, LIGHT, point_size=np.zeros(frame.depth.shape))
    assert hidden.shape == own.shape and not hidden.any()
    noise = np.full(frame.depth.shape, 0.001)
    assert renderer.render(frame, LIGHT, noise=noise).shape == own.shape


@pytest.mark.parametrize("shading", ["none", "flat", "gouraud", "phong"])
def test_both_rasterizers_draw_the_same_large_points(renderer, shading):
    frame = cropped(clean(2).frame)
    with ps.Renderer(rasterizer="points") as points:
        other = points.render(frame, LIGHT, shading=shading)
    assert compare_images(renderer.render(frame, LIGHT, shading=shading), other) == ""


def test_an_object_of_a_scene_is_drawn_like_its_frame_and_casts_the_shadow_of_its_outline(renderer):
    known = clean(2)
    scene = ps.Scene((ps.Node(ps.PointObject(known.frame)),), camera=LARGE)
    assert (renderer.render(scene, LIGHT) == renderer.render(known.frame, LIGHT)).all()
    lamp = replace(LIGHT, shadow=True)
    large, small = (renderer.render(known.frame, lamp, upsample=how).astype(int) for how in ("vote", "none"))
    darker = (renderer.render(known.frame, LIGHT).astype(int) - large)[..., :3].max(-1) > 30
    assert 0.005 < darker.mean() < 0.3 and (large != small).any()


def test_holes_keep_their_outline_and_cut_out_pixels_stay_empty(renderer):
    """A red ball before nothing: its outline is that of the colours; where alpha is 0, nothing is drawn."""
    known = clean(1)
    ball = known.hits.surface == 1
    color = np.where(ball[..., None], (200, 40, 40), (40, 60, 200)).astype(np.uint8)
    rows, columns = (((np.arange(n) + 0.5) * RATIO).astype(int) for n in DEPTH[::-1])
    depth = np.where(ball[np.ix_(rows, columns)], known.frame.depth, 0)
    drawn = renderer.render(ps.Frame(color, depth, SMALL))[..., 3] > 0
    assert (drawn != ball)[near_edge(known.hits, 8)].mean() < 0.02
    alpha = np.where(np.arange(COLOR[0]) < 601, 255, 0)
    cut = np.concatenate([color, np.broadcast_to(alpha, ball.shape)[..., None].astype(np.uint8)], -1)
    drawn = renderer.render(ps.Frame(cut, known.frame.depth, SMALL))[..., 3] > 0
    assert not drawn[:, 601:].any() and drawn[:, :590].all()


def test_a_window_is_as_sharp_as_the_colours_and_a_drag_does_not_vote_again(open_viewer):
    viewer = open_viewer(cropped(clean(2).frame), window_size=None)
    assert viewer.camera is not None and viewer.camera.width >= 420
    before = shown(viewer)
    drag(viewer, (200, 150), (260, 150))
    assert (shown(viewer) != before).any()
    assert viewer.renderer.steps.counts["upsample"] == 1


def test_an_upsampling_that_is_unknown_is_named(renderer):
    with pytest.raises(ValueError, match=r"unknown upsample 'vot' \(did you mean vote\?\): known are vote, none"):
        renderer.render(frames.sphere(), upsample="vot")
