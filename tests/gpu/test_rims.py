"""What rims are for: clean outlines, no gaps behind what is nearer, sharp creases."""

from functools import cache

import numpy as np
import pytest

import pointshade_gl as ps
from pointshade_gl.bench.scenes import box, pose_at
from pointshade_gl.bench.tracing import as_frame, encode, moved_surface, patch, plane, trace
from pointshade_gl.gpu.core.frame_textures import PointSurface

from ..reference import rim_marks, rim_splat, rims
from ..reference.depth_lookup import pixel_of
from ..reference.inverse_depth import pixel_grid
from ..reference.rasterizers import rim_pairs
from ..reference.vectors import dot, texel
from ..support import frames
from ..support.drivers import need_compute
from .test_rim_functions import rim_pixels, surface_of

F = np.float32
K = np.array(frames.CAMERA.intrinsics, F)
CAMERA = ps.Camera(60.0, 60.0, 31.5, 23.5, 64, 48)
CENTRE, RADIUS = np.array([0.03, -0.02, 1.2]), 0.35


def ball(camera, spot=CENTRE, radius=RADIUS):
    """A frame of a ball alone, and whether each ray hits it."""
    v, u = np.mgrid[0 : camera.height, 0 : camera.width]
    ray = np.stack([(u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy, np.ones(u.shape)], -1)
    a, b = (ray**2).sum(-1), ray @ spot
    rest = b * b - a * (spot @ spot - radius**2)
    depth = np.where(rest > 0, (b - np.sqrt(np.maximum(rest, 0))) / a, 0)
    return ps.Frame(None, depth.astype(F), camera)


def test_the_border_of_the_picture_is_no_rim_and_a_slanted_plane_has_none():
    depth = frames.tilted_plane().depth
    assert (rim_marks.mark_rim(depth, pixel_grid(depth), K) > 0).all()


def test_the_outline_of_a_ball_is_found_between_the_pixels():
    """From the pixel outward by the width, the ball ends: there the ray touches it. Its drop leads to that depth."""
    frame = ball(ps.Camera(300.0, 300.0, 159.5, 119.5, 320, 240))
    k, surface = np.array(frame.camera.intrinsics, F), surface_of(frame)
    pixel = rim_pixels(surface)
    beside = [texel(frame.depth, pixel + off) for off in rims.direction_of(np.arange(4))]
    pixel = pixel[np.min(beside, 0) == 0]  # beside others the ball goes on, and bends
    rim = rims.estimate_rim(surface, pixel, k)
    bent = rim.drop > 0
    assert bent.mean() > 0.9
    end = pixel + rim.outward * rim.width[:, None]
    ray = rim_splat.pixel_ray(end, k)
    ray /= np.linalg.norm(ray, axis=-1, keepdims=True)
    touch = CENTRE @ CENTRE - RADIUS**2
    off = (np.sqrt(np.maximum(CENTRE @ CENTRE - (ray @ CENTRE) ** 2, 0)) - RADIUS) / 1.2 * 300
    assert np.abs(off[bent]).mean() < 0.1 and np.quantile(np.abs(off[bent]), 0.95) < 0.4
    # The outline's depth, where the ray touches the ball, in pixels behind the pixel's own.
    z = np.sqrt(touch) * ray[:, 2]
    own = frame.depth[pixel[:, 1], pixel[:, 0]]
    drop = 300 * (1 - own / z)
    assert np.median(np.abs(rim.drop - drop)[bent] / drop[bent]) < 0.15
    centre = CENTRE[:2] / CENTRE[2] * 300 + (159.5, 119.5)
    assert (dot(rim.outward, (pixel - centre).astype(F)) > 0).all()


def test_a_rim_at_the_own_camera_is_its_pixel_and_elsewhere_lies_behind_others():
    frame = frames.holes()
    surface = surface_of(frame)
    pixel = rim_pixels(surface)
    index = pixel[:, 1] * frames.CAMERA.width + pixel[:, 0]
    pairs = rim_pairs(surface, index, frames.CAMERA, frames.CAMERA, np.eye(4, dtype=F), 0.01)
    own = (pairs.q == pixel_of(pairs.source_index, frames.CAMERA.width)).all(-1)
    assert (pairs.source_index[own] == index).all() and (pairs.is_hidden == ~own).all() and not own.all()
    assert (pairs.inverse_depth[~own] * texel(frame.depth, pairs.q[~own]) < 1).all()


@pytest.mark.parametrize("kind", ["compute", "points"])
@pytest.mark.parametrize("yaw", [20, 40])
def test_the_silhouette_of_a_turned_ball_is_clean(kind, yaw, renderer):
    """As long as the true one of what the frame saw, where strips would make it a comb."""
    if kind == "compute":
        need_compute(renderer)
    frame, pose = ball(frames.CAMERA), ps.orbit_pose(None, CENTRE, yaw, 5)
    with ps.Renderer(rasterizer=kind) as made:
        drawn = made.render(frame, pose=pose)[..., 3] > 0
    # Truth: of the points that the turned camera sees on the ball, those that the frame's camera saw.
    v, u = np.mgrid[0:120, 0:160]
    ray = rim_splat.pixel_ray(np.stack([u, v], -1).astype(F), K) @ pose[:3, :3].T
    start = pose[:3, 3] - CENTRE
    a, b, c = (ray**2).sum(-1), ray @ start, start @ start - RADIUS**2
    rest = b * b - a * c
    seen = np.zeros(rest.shape, bool)
    for sign in (-1, 1):
        at = pose[:3, 3] + ((-b + sign * np.sqrt(np.maximum(rest, 0))) / a)[..., None] * ray
        seen |= (rest > 0) & (((at - CENTRE) * at).sum(-1) < 0)
    assert (drawn != seen).mean() < 0.004
    assert around(drawn) < 1.1 * around(seen)


def around(mask):
    return (mask[1:] != mask[:-1]).sum() + (mask[:, 1:] != mask[:, :-1]).sum()


def test_only_footprints_of_size_1_have_rims(renderer):
    """A size that differs for one far pixel leaves strips at the outline: the sizes are the caller's."""
    frame, pose = ball(CAMERA), ps.orbit_pose(None, CENTRE, 40, 5)
    one, other = (renderer.render(frame, pose=pose, point_size=size) for size in (1.0, 1.001))
    assert around(one[..., 3] > 0) < around(other[..., 3] > 0)


@pytest.mark.parametrize("method", ["star", "adaptive", "triangles-8", "central", "one-sided", "plane-fit-5", "given"])
def test_all_estimators_mark_the_same_rims(renderer, method):
    frame = ball(CAMERA)
    given = renderer.estimate_normals(frame, "star") if method == "given" else method
    pose = ps.orbit_pose(None, CENTRE, 40, 5)
    drawn = renderer.render(frame, pose=pose, normals=given)[..., 3] > 0
    star = renderer.render(frame, pose=pose, normals="star")[..., 3] > 0
    assert (drawn != star).mean() < 0.004


def test_a_picture_upside_down_has_the_same_rims():
    """Negative fy, as in ICL-NUIM."""
    camera = ps.Camera(60.0, -60.0, CAMERA.cx, CAMERA.height - 1 - CAMERA.cy, CAMERA.width, CAMERA.height)
    frame = ball(CAMERA)
    surface, other = surface_of(frame), surface_of(ps.Frame(None, frame.depth[::-1].copy(), camera))
    pixel = rim_pixels(surface)
    mirrored = np.stack([pixel[:, 0], CAMERA.height - 1 - pixel[:, 1]], -1)
    assert (texel(other, mirrored)[:, 3] == texel(surface, pixel)[:, 3]).all()
    rim = rims.estimate_rim(surface, pixel, np.array(CAMERA.intrinsics, F))
    same = rims.estimate_rim(other, mirrored, np.array(camera.intrinsics, F))
    np.testing.assert_allclose(same.outward * [1, -1], rim.outward, atol=1e-4)
    np.testing.assert_allclose(same.width, rim.width, atol=1e-4)
    np.testing.assert_allclose(same.drop, rim.drop, rtol=1e-3)


def test_a_frame_with_more_rims_than_the_list_has_room_for_is_drawn_with_all_of_them(renderer):
    """Every other pixel stands out: both rasterisers show the same of it."""
    depth = np.where(np.indices((60, 80)).sum(0) % 2, 1.0, 2.0)
    frame = ps.Frame(None, depth, ps.Camera(100, 100, 39.5, 29.5, 80, 60))
    images = []
    for rasterizer in ("auto", "points"):
        with ps.Renderer(rasterizer=rasterizer) as own:
            images.append(own.render(frame, yaw=10, normals="star"))
    covered = [image[..., 3] > 0 for image in images]
    assert (covered[0] != covered[1]).mean() < 0.01
    assert covered[0].mean() > 0.5


PLATE, RED, BLUE = (0, 0, 1.5), (0.6, 0.1, 0.1), (0.1, 0.2, 0.6)


def plate_before_wall():
    """At 3 degrees' turn, 2 pixels of the wall come out from behind the plate."""
    plate = patch(PLATE, (0.4, 0, 0), (0, 0.3, 0), lambda points: np.broadcast_to(RED, points.shape))
    return [plate, plane((0.1, 0.05, -1), (0, 0, 2.0), lambda points: np.broadcast_to(BLUE, points.shape))]


def grown(mask, by=1):
    padded = np.pad(mask, by)
    return np.lib.stride_tricks.sliding_window_view(padded, (2 * by + 1, 2 * by + 1)).any((2, 3))


@pytest.mark.parametrize("kind", ["compute", "points"])
@pytest.mark.parametrize("turn", [(3, 0), (-3, 0), (0, 3), (0, -3), (0, 0)])
def test_a_wall_goes_on_behind_a_plate(kind, turn, renderer):
    """Beside the plate nothing is empty and the wall has its own colour; no wall is seen within the plate."""
    if kind == "compute":
        need_compute(renderer)
    frame, pose = as_frame(trace(plate_before_wall(), frames.CAMERA), frames.CAMERA), ps.orbit_pose(None, PLATE, *turn)
    red, blue = (np.round(encode(np.array(color))) for color in (RED, BLUE))
    with ps.Renderer(rasterizer=kind) as made:
        for size in (0.7, 0.993, 1, 1.1, 1.37):
            camera = frames.CAMERA.resized(round(160 * size), round(120 * size))
            image = made.render(frame, camera=camera, pose=pose, shading="none")
            is_plate = trace(plate_before_wall(), camera, pose).surface == 0
            inside, around_it = ~grown(~is_plate), grown(is_plate, 4) & ~grown(is_plate)
            assert (image[inside] == (*red, 255)).all() and (image[around_it] == (*blue, 255)).all()
            assert (image[grown(is_plate, 4), 3] == 255).all()


@cache
def turned_box(share, yaw, turn, camera):
    """A frame of a box, a pose from which its crease is its outline, and where a camera sees the box from there."""
    spot = (share * 1.1 / frames.CAMERA.fx, 0, 1.5)
    things, pose = [moved_surface(box((0.3, 0.3, 0.3)), pose_at(spot, yaw))], ps.orbit_pose(None, spot, turn, 0)
    return as_frame(trace(things, frames.CAMERA), frames.CAMERA), pose, trace(things, camera, pose).surface == 0


@pytest.mark.parametrize(
    ("kind", "yaw", "turn"),
    [
        *(("compute", 25, 30), ("points", 25, 30), ("points", -25, -30), ("compute", 35, 30), ("points", 45, -30)),
        *(
            pytest.param(*values, marks=pytest.mark.system)
            for values in (("compute", -25, -30), ("points", 35, 30), ("compute", 45, -30))
        ),
    ],
)
def test_nothing_stands_out_beyond_a_crease(kind, yaw, turn, renderer):
    """The side of a box turns away until its crease is its outline: there it ends, to a quarter of a source pixel.

    Wherever the crease lies in its pixel.
    """
    if kind == "compute":
        need_compute(renderer)
    camera = frames.CAMERA.resized(640, 480)
    with ps.Renderer(rasterizer=kind) as made:
        for share in (0, 0.375, 0.625, 0.875):
            frame, pose, there = turned_box(share, yaw, turn, camera)
            drawn = made.render(frame, camera=camera, pose=pose)[..., 3] > 0
            rows = np.flatnonzero(there.sum(1) > there.sum(1).max() / 2)[20:-20]  # its corners apart
            one, other = (np.argmax(mask[rows][:, :: np.sign(turn)], 1) for mask in (drawn, there))
            assert np.abs(one - other).max() <= 1


def test_a_tilt_that_no_neighbour_bears_out_is_not_drawn():
    """A sliver of one pixel beside nothing, with the normal of a grazing face: turned, it makes no spike."""
    surface, k = np.zeros((48, 64, 4), F), np.array(CAMERA.intrinsics, F)
    surface[10:38, 32] = (*(np.array((-0.995, 0, -0.1)) / np.hypot(0.995, 0.1)), -1.2)
    pixel = rim_pixels(surface)
    around_it = rims.look_around(surface, pixel, k)
    assert (around_it.tilt[:, 0] == 0).all()
    index = pixel[:, 1] * CAMERA.width + pixel[:, 0]
    for yaw in (-30, 30):
        view = np.linalg.inv(ps.orbit_pose(None, (0, 0, 1.2), yaw, 0)).astype(F)
        pairs = rim_pairs(surface, index, CAMERA, CAMERA, view, 0.01)
        assert len(np.unique(pairs.q[:, 0])) == 1 and len(pairs.q) >= 28


class TestKeptRims:
    """What the second view of the same points estimates of their rims is drawn again in later views."""

    VIEWS = ({"yaw": 20}, {"yaw": -15, "pitch": 8}, {"yaw": 20}, {"yaw": -15, "pitch": 8}, {"dolly": 0.8})

    @staticmethod
    def turned(frame, views):
        with ps.Renderer() as own:
            return [own.render(frame, light=ps.Light(position=(1, -1, 0), shadow=True), **view) for view in views]

    @pytest.mark.parametrize("name", ["sphere_before_wall", "holes", "step"])
    def test_pictures_are_the_same_in_whatever_order_they_are_drawn(self, renderer, name):
        frame = getattr(frames, name)()
        for picture, view in zip(self.turned(frame, self.VIEWS), self.VIEWS, strict=True):
            assert (picture == self.turned(frame, [view])[0]).all()

    def test_another_frame_is_drawn_with_rims_of_its_own(self, renderer):
        near, far = frames.sphere_before_wall(), frames.sphere()
        light = ps.Light(position=(1, -1, 0))
        with ps.Renderer() as own:
            for frame in (near, near, near, far, near, far, far):
                picture = own.render(frame, light, yaw=20)
                with ps.Renderer() as other:
                    assert (picture == other.render(frame, light, yaw=20)).all()

    def test_they_are_kept_the_second_time_on_software_drivers(self, renderer, monkeypatch):
        need_compute(renderer)
        if not renderer.context.is_software:
            pytest.skip("GPUs estimate rims in each view")
        kept = []
        keep = PointSurface.keep_rims
        monkeypatch.setattr(PointSurface, "keep_rims", lambda *given: (kept.append(given[1]), keep(*given)))
        self.turned(frames.sphere_before_wall(), [{"yaw": yaw} for yaw in (20, 10, 0, -10)])
        assert len(kept) == 1 and kept[0] > 50
