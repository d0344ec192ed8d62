"""The ground below an object and what lies behind it: where it is, what it shows, and what of it is transparent."""

import numpy as np
import pytest

import pointshade_gl as ps
from pointshade_gl.bench.tracing import decode
from pointshade_gl.estimation.ground import ground_under, seen_ground, up_and_floor
from pointshade_gl.scene.camera import Eye
from pointshade_gl.scene.settings import OutputSettings

from ..gpu.test_shader_functions import TARGET, light_views, occluders, turned
from ..reference import camera, ground
from ..reference.render import render as mirror_render
from ..support import frames

SUN = ps.Light(direction=(0.5, 1, 0.4), shadow=True)
ABOVE = ps.orbit_pose(None, (0.05, 0.02, 1.5), 0, 25)


def cube(low, high, **options):
    """Two opposite faces of a box."""
    x, y, z = np.stack([low, high], -1)
    top, bottom = ([(x[0], h, z[0]), (x[1], h, z[0]), (x[1], h, z[1]), (x[0], h, z[1])] for h in y)
    return ps.Mesh([*top, *bottom], [(0, 1, 2), (0, 2, 3), (4, 5, 6), (4, 6, 7)], **options)


class TestPlace:
    def test_it_lies_under_a_frame_by_the_frames_own_up(self):
        pose = ps.orbit_pose(None, (0.3, 0.2, 1), 50, -30)
        made = frames.sphere()
        frame = ps.Frame(made.color, made.depth, made.camera, pose)
        up = up_and_floor(frame)[0]
        np.testing.assert_allclose(up, -pose[:3, 1], atol=1e-12)
        plane = ground_under(ps.Scene((ps.Node(ps.PointObject(frame)),)), tuple(up))
        assert seen_ground(plane, pose) == pytest.approx((0, -1, 0, 0.02 + 0.4), abs=0.001)  # the sphere's lowest point

    def test_a_picture_whose_rows_run_upwards_has_its_up_there(self):
        camera = ps.Camera(131, -131, 79.5, 59.5, 160, 120)
        assert up_and_floor(ps.Frame(None, frames.sphere().depth, camera))[0].tolist() == [0, 1, 0]

    def test_it_lies_under_a_cloud_far_from_the_origin(self):
        points = np.random.default_rng(0).uniform(-1, 1, (2000, 3))
        found = [
            ground_under(ps.Scene((ps.Node(ps.PointCloud(points + np.array((0, high, 0)))),)), (0, 1, 0))[3]
            for high in (0, 5e6)
        ]
        assert found[0] == pytest.approx(1, abs=0.01) and found[1] == pytest.approx(1 - 5e6, abs=0.01)

    @pytest.mark.parametrize("up", [1, -1])
    def test_in_a_scene_up_is_the_worlds_y_on_the_side_that_is_up_in_its_picture(self, up):
        """Looking down by 40 degrees changes nothing."""
        standing = np.diag([1.0, -up, -up, 1.0])
        pose = ps.orbit_pose(standing, standing[:3, 2], 0, 40)
        scene = ps.Scene((ps.Node(cube((0, -2, 0), (1, 3, 1))),), frames.CAMERA, pose)
        assert up_and_floor(scene)[0].tolist() == [0, up, 0]
        assert ground_under(scene, (0, 5.0 * up, 0)).tolist() == [0, up, 0, 2 if up == 1 else 3]

    def test_noise_and_stray_points_do_not_sink_it(self):
        made, rng = frames.sphere(), np.random.default_rng(3)
        depth = np.where(rng.random(made.depth.shape) < 0.0002, 9, made.depth)
        heights = []
        for z in (made.depth, depth):
            scene = ps.Scene((ps.Node(ps.PointObject(ps.Frame(None, z, made.camera))),))
            heights.append(ground_under(scene, (0, -1, 0))[3])
        assert heights == pytest.approx([0.42, 0.42], abs=0.001)


def test_ground_functions_are_those_of_the_mirror(gpu):
    rng = np.random.default_rng(4)
    ray = camera.pixel_ray(rng.uniform(0, 400, (500, 2)).astype(np.float32), TARGET)
    for plane in ((0, -1, 0, 0.5), (0.36, -0.48, -0.8, 1.5), (0, -1, 0, -0.5)):
        plane = np.array(plane, np.float32)
        answer = gpu("ground.glsl", "ground_depth(r, p), 0, 0, 0", r=ray, p=plane[None])[:, 0]
        np.testing.assert_allclose(answer, ground.ground_depth(ray, plane), rtol=1e-4)
        assert (answer > 0).any() == (plane[3] > 0)
    views, depth = light_views([turned((5, 0, 0)), turned((5, 15, 0))]), occluders(2)
    rows = np.zeros((2, 5, 4), np.float32)
    rows[:, 2, 0], rows[:, 3, 3], rows[:, 4, 2] = 1, (0, 1), 1
    rows[0, :2], rows[1, :2] = ((0, 1, 2, 0), (0.2, 0.2, 0.4, 0)), ((-1, -1, 0, 1), (3, 0.9, 0.8, 0))
    n = np.broadcast_to(np.array([0, -0.8, -0.6], np.float32), ray.shape)
    point, m, a = ray * rng.uniform(0.5, 3, (500, 1)).astype(np.float32), [0.1, 0.9, 0.3, 32], [0.5, 0.7, 0.9]
    m, a = np.array(m, np.float32), np.array(a, np.float32)
    call = "shadow_alpha(p, n, m, a, 0.6 * a, rows_map, 2, shadow_map, views_map, mat3(1.0)), 0, 0"
    inputs = {"m": m[None], "a": a[None], "rows_map": rows, "shadow_map": depth, "views_map": views}
    answer = gpu("ground.glsl", call, p=point, n=n, **inputs)[:, :2]
    mirror = ground.shadow_alpha(
        point, n, m, a, np.float32(0.6) * a, rows, 2, depth, views, np.eye(3, dtype=np.float32)
    )
    np.testing.assert_allclose(answer, mirror, atol=3e-5)
    both = answer.sum(1)
    assert (both > 0.3).mean() > 0.2 and both.min() > 0.05 and both.max() < 1


class TestFormula:
    """Two suns, one of which casts a shadow: what that takes of the light of the ground is its alpha."""

    BOX = (-0.4, -0.2, 1.2), (0.1, 0.1, 1.7)
    FIRST, SECOND = (1.2, 1, 0.4), (-0.3, 1, 0.1)

    def picture(self, renderer, strength, **options):
        node = ps.Node(cube(*self.BOX, material=ps.Material(0, 1, 0)))
        first, second = (s * np.linalg.norm(d) for s, d in ((strength, self.FIRST), (1 - strength, self.SECOND)))
        suns = [ps.Light(direction=self.FIRST, intensity=first, shadow=True)]
        suns += [ps.Light(direction=self.SECOND, intensity=second)]
        return renderer.render(ps.Scene((node,), frames.CAMERA, ABOVE), suns, **options) / 255.0

    def shadowed(self, u, v, level=BOX[1][1]):
        """Whether the sun's way to the ground that a pixel shows, at y = level, passes through a face of the box."""
        c, (low, high) = frames.CAMERA, np.array(self.BOX)
        ray = np.stack([(u - c.cx) / c.fx, (v - c.cy) / c.fy, np.ones_like(u)], -1) @ ABOVE[:3, :3].T
        eye = ABOVE[:3, 3]
        ground, shadow = eye + ray * ((level - eye[1]) / ray[..., 1:2]), np.zeros(u.shape, bool)
        for y in (low[1], high[1]):
            met = (ground - (level - y) * np.array(self.FIRST))[..., [0, 2]]
            shadow |= (ray[..., 1] > 0) & ((met > low[[0, 2]]) & (met < high[[0, 2]])).all(-1)
        return shadow

    @pytest.mark.parametrize("samples", [1, 16])
    @pytest.mark.parametrize("strength", [0.1, 0.3, 0.49, 0.51, 0.7, 0.9])
    def test_the_alpha_is_the_share_that_shadows_take(self, renderer, strength, samples):
        v, u = np.indices((120, 160)).astype(float)
        around = np.stack([self.shadowed(u + dx, v + dy) for dx in (-2, 0, 2) for dy in (-2, 0, 2)])
        inside, outside = around.all(0), ~around.any(0)
        covered = self.picture(renderer, strength, samples=samples)[..., 3]
        clear = self.picture(renderer, strength, samples=samples, ground=(0, -1, 0))
        white = self.picture(renderer, strength, samples=samples, ground=(0, -1, 0), background="white")
        assert np.abs(clear[..., 3] - covered)[outside].max() <= 0.02
        assert np.abs(clear[..., 3] - (covered + (1 - covered) * strength))[inside].max() <= 0.02
        bare = inside & (covered == 0)
        assert bare.sum() > 300 and np.abs(decode(white[bare][:, :3] * 255) - (1 - strength)).max() <= 0.02
        if samples > 1:
            assert (inside & (covered > 0) & (covered < 1)).sum() > 20  # the outline of the box before its shadow

    @pytest.mark.parametrize("level", [0.1, 0.2, 0.35])
    def test_it_lies_as_high_as_it_is_told(self, renderer, level):
        v, u = np.indices((120, 160)).astype(float)
        around = np.stack([self.shadowed(u + dx, v + dy, level) for dx in (-2, 0, 2) for dy in (-2, 0, 2)])
        bare = self.picture(renderer, 0.7)[..., 3] == 0
        alpha = self.picture(renderer, 0.7, ground=(0, -2, 0), ground_height=-level)[..., 3]
        inside, outside = bare & around.all(0), bare & ~around.any(0)
        assert inside.sum() > 300 and np.abs(alpha[inside] - 0.7).max() <= 0.02 and not alpha[outside].any()


@pytest.mark.parametrize("background", [None, "white"])
def test_the_figure_of_a_paper_is_that_of_the_mirror(rasterizer, golden, background):
    frame, up = frames.sphere(), (0.0, -1.0, 0.0)
    actual = rasterizer.render(frame, SUN, pose=ABOVE, normals="triangles-8", background=background, ground=True)
    normals = np.nan_to_num(rasterizer.estimate_normals(frame, "triangles-8"))
    eye, finish = Eye.at_distance(frame.camera, ABOVE, frame.scale), OutputSettings(1, background, up)
    mirror = mirror_render(frame, normals, [SUN], ps.Appearance(), eye, rasterizer.name, finish=finish)
    golden(f"ground {background}", actual, mirror, stored=False)
    assert (
        rasterizer.render(frame, SUN, pose=ABOVE, normals="triangles-8", background=background, ground=up) == actual
    ).all()


def test_at_another_height_it_is_another_picture(renderer):
    frame, small = frames.sphere(), ps.Camera(30, 30, 19.5, 14.5, 40, 30)

    def draw(by, height):
        return by.render(frame, SUN, camera=small, samples=2, ground=True, ground_height=height)

    first, second = draw(renderer, -0.45), draw(renderer, -0.6)
    with ps.Renderer() as other:
        assert (first != second).any() and (draw(other, -0.6) == second).all()


class TestPicture:
    def test_it_shows_the_shadow_and_nothing_else(self, renderer):
        plain = renderer.render(frames.sphere(), SUN, pose=ABOVE)
        image = renderer.render(frames.sphere(), SUN, pose=ABOVE, ground=True)
        seen, shadow = plain[..., 3] > 0, (plain[..., 3] == 0) & (image[..., 3] > 0)
        assert np.abs(image[seen].astype(int) - plain[seen]).max() <= 1
        assert 0.03 < shadow.mean() < 0.3 and not image[shadow][:, :3].any()
        assert (
            np.nonzero(shadow)[1].mean() > np.nonzero(seen)[1].mean()
        )  # on the side that the light does not come from
        assert not image[:5, :, 3].any()  # no horizon

    def test_over_white_it_is_the_transparent_picture_on_white_paper(self, renderer):
        options = {"light": SUN, "pose": ABOVE, "ground": True, "samples": 4}
        clear = renderer.render(frames.sphere(), **options).astype(float)
        white = renderer.render(frames.sphere(), background="white", **options).astype(float)
        alpha = clear[..., 3:] / 255
        over = decode(clear[..., :3]) * alpha + 1 - alpha
        assert (white[..., 3] == 255).all()
        np.testing.assert_allclose(decode(white[..., :3]), over, atol=0.015)

    def test_more_samples_of_the_same_are_added_and_another_ground_is_another_picture(self, renderer):
        frame, options = frames.sphere(), {"light": SUN, "pose": ABOVE, "ground": True}
        renderer.render(frame, samples=2, **options)
        added = renderer.render(frame, samples=6, **options)
        renderer.render(frame, samples=6, **options | {"ground": (0.1, -1, 0)})
        assert (renderer.render(frame, samples=6, **options) == added).all()
        assert (renderer.render(frame, SUN, pose=ABOVE, samples=6)[..., 3] <= added[..., 3]).all()

    def test_without_a_light_there_is_one_that_casts_a_soft_shadow(self, renderer):
        image = renderer.render(frames.sphere(), pose=ABOVE, ground=True, samples=8)
        plain = renderer.render(frames.sphere(), pose=ABOVE, samples=8)
        shadow = image[..., 3][plain[..., 3] == 0]
        assert (shadow > 100).any() and len(np.unique(shadow)) > 8

    @pytest.mark.parametrize(("samples", "most"), [(1, 1.5), (4, 0.8), (16, 0.7)])
    def test_it_is_smooth_under_a_sky_without_a_weave_of_the_directions_that_pixels_look_along(
        self, renderer, samples, most
    ):
        """What is left of its 8-bit levels without their low frequencies, in the shadow before the sphere."""
        camera, options = frames.CAMERA.resized(480, 360), {"environment": "sky", "ground": True, "background": "white"}
        image = renderer.render(frames.sphere(), pose=ABOVE, camera=camera, samples=samples, **options)
        before = image[305:345, 180:320].astype(float).mean(-1)
        v, u = np.indices(before.shape) / 60 - 0.5
        waves = np.stack([v**a * u**b for a in range(5) for b in range(5)], -1).reshape(-1, 25)
        rest = before.reshape(-1) - waves @ np.linalg.lstsq(waves, before.reshape(-1), rcond=None)[0]
        assert before.min() < 200 and rest.std() < most

    def test_from_below_and_without_shadows_there_is_none(self, renderer):
        below, frame = ps.orbit_pose(None, (0.05, 0.02, 1.5), 0, -40), frames.sphere()
        for light, pose in ((SUN, below), (ps.Light(direction=(0.5, 1, 0.4)), ABOVE), ([], ABOVE)):
            plain = renderer.render(frame, light, pose=pose)
            found = renderer.render(frame, light, pose=pose, ground=True, ambient_occlusion=False)
            assert (found[..., 3] == plain[..., 3]).all()

    def test_meshes_and_merged_views_stand_on_it_too(self, renderer):
        frame, box = frames.sphere(), cube((-0.5, -0.1, 1), (-0.3, 0.2, 1.4))
        scene = ps.Scene((ps.Node(ps.PointObject([frame, frame])), ps.Node(box)), frame.camera, ABOVE)
        plain, image = renderer.render(scene, SUN), renderer.render(scene, SUN, ground=(0, -1, 0))
        shadow = (plain[..., 3] == 0) & (image[..., 3] > 0)
        assert 0.05 < shadow.mean() < 0.5

    @pytest.mark.parametrize(
        "values", [{"background": "whit"}, {"background": (1, 1)}, {"ground": (0, 0, 0)}, {"ground_height": 1.0}]
    )
    def test_impossible_ones_are_named(self, renderer, values):
        with pytest.raises(ValueError, match=next(iter(values))):
            renderer.render(frames.sphere(), **values)


@pytest.mark.parametrize(
    ("line", "finish"),
    [
        ("", {"samples": 16}),
        ("--shading none", {}),
        ("--shading none --yaw 4", {"samples": 16, "yaw": 4}),
        ("--samples 3 --background '#102030'", {"samples": 3, "background": "#102030"}),
        ("--samples 2 --background transparent", {"samples": 2}),
        ("--ground --samples 2", {"samples": 2, "ground": True}),
        ("--ground --ground-height=-0.4 --samples 2", {"samples": 2, "ground": True, "ground_height": -0.4}),
        ("--ground --light '0,-1,.5' --samples 2", {"samples": 2, "ground": True, "light": (0, -1, 0.5)}),
    ],
)
def test_the_command_line_finishes_pictures_as_python_does(typed, renderer, line, finish):
    from PIL import Image

    assert typed(f"render vase --picture-size 160x120 {line} -o out.png")[0] == 0
    frame, light = ps.load_frame("vase"), finish.pop("light", None)
    options = {"shading": "none" if "none" in line else "phong", "camera": frame.camera.fitted(160, 120)}
    light = light and ps.Light(light, shadow=True)
    expected = renderer.render(frame, light, **options, **({"samples": 16} | finish))
    with Image.open("out.png") as written:
        assert (np.asarray(written) == expected).all()


def test_a_photograph_seen_as_it_was_taken_and_what_has_no_alpha(typed, renderer):
    from PIL import Image

    assert typed("render vase --shading none -o own.png")[0] == 0
    with Image.open("own.png") as written:
        assert (np.asarray(written) == renderer.render("vase", shading="none")).all()
    assert typed("render vase --picture-size 80x60 --samples 2 -o own.jpg")[0] == 0
    with Image.open("own.jpg") as written:
        assert np.asarray(written)[:5, :5].max() < 20
    for line, says in (
        ("--background transparent -o a.jpg", "a.jpg cannot be transparent"),
        ("--samples 2 -o a.ply", "a.ply is no picture: leave out --samples"),
        ("--samples 0 -o a.png", "--samples must be a whole number from 1"),
        ("--ground-height 0 -o a.png", "--ground-height is that of a ground: pass --ground, too"),
        ("--ground --ground-height 0 -o a.ply", "a.ply is no picture: leave out --ground, --ground-height"),
        ("--background whit -o a.png", "--background: color 'whit' is unknown (did you mean white?)"),
    ):
        code, _, errors = typed(f"render vase {line}")
        assert code == 2 and says in errors
