"""Point objects drawn as meshes: against stored pictures and ray-traced truth; where a mesh ends."""

import numpy as np
import pytest

import pointshade_gl as ps
from pointshade_gl.bench.tracing import as_frame, sphere_and_wall, trace

from ..support import frames
from ..support.compare import compare_images
from ..support.drivers import places_of_a_vertex
from .test_truth import CAMERA, score, source  # noqa: F401 - a fixture

LIGHT = ps.Light(position=(-0.8, -0.9, 0.2))
SHADOW = ps.Light(position=(-0.8, -0.9, 0.2), shadow=True)
SPOT = ps.Light(position=(-0.5, -0.7, 0), direction=(0.5, 0.8, 1.6), cone=(15, 30))


def mesh(renderer, frame, light, pose, **options):
    return renderer.render(frame, light, pose=pose, splat="mesh", normals="triangles-8", **options)


def turned(frame, yaw=15.0, pitch=5.0, dolly=0.0):
    return ps.orbit_pose(frame.pose, frame.pivot, yaw, pitch, dolly)


def drawn(image):
    return image[..., 3] > 0


@pytest.mark.parametrize("shading", ["none", "flat", "gouraud", "phong"])
def test_a_closer_look(renderer, golden, shading):
    """One triangle covers several pixels, and the models differ; holes make single triangles."""
    frame = frames.holes()
    golden(f"mesh_{shading}", mesh(renderer, frame, LIGHT, turned(frame, 15, 5, 0.4), shading=shading))


@pytest.mark.parametrize("shading", ["flat", "gouraud", "phong"])
@pytest.mark.parametrize("light", [SHADOW, SPOT], ids=["shadow", "spot"])
def test_shadows_and_spots(renderer, golden, shading, light):
    frame = frames.sphere_before_wall()
    plain, lit = (mesh(renderer, frame, one, turned(frame, 12, 4), shading=shading) for one in (LIGHT, light))
    golden(f"mesh_{shading}_{'spot' if light is SPOT else 'shadow'}", lit)
    assert compare_images(lit, plain)


def test_colours_of_another_size_and_a_frame_pose(renderer, golden):
    made = frames.sphere_before_wall()
    pose = ps.orbit_pose(None, (0.3, 0, -2), 40, 10)
    frame = ps.Frame(made.color.repeat(2, 0).repeat(2, 1)[:, 1:], made.depth, made.camera, pose)
    options = {"max_depth_step": "5%", "upsample": "none"}
    golden("mesh_colours", mesh(renderer, frame, LIGHT, turned(frame, 10, 0, 0.2), **options))


def test_samples_are_averaged(renderer, golden):
    frame = frames.sphere_before_wall()
    golden("mesh_samples", mesh(renderer, frame, SHADOW, turned(frame), samples=3))


@pytest.mark.parametrize("make", [frames.sphere_before_wall, frames.holes])
def test_both_rasterizers_draw_the_same_mesh(renderer, make):
    """Of a smooth thing. A depth buffer has 24 bits, so that pixels at a crack may decide otherwise."""
    frame = make()
    with ps.Renderer(rasterizer="points") as points:
        for shading in ("none", "flat", "gouraud", "phong"):
            options = {"splat": "mesh", "shading": shading}
            assert not compare_images(*(one.render(frame, LIGHT, **options) for one in (points, renderer)))
            one, other = (drawing.render(frame, LIGHT, yaw=20, **options) for drawing in (points, renderer))
            assert (drawn(one) == drawn(other)).mean() > 0.999
            assert (np.abs(one.astype(int) - other).max(-1) > 2).mean() < 0.01


@pytest.mark.parametrize("make", [frames.sphere_before_wall, frames.holes, frames.step, frames.sphere])
@pytest.mark.parametrize("kind", ["auto", "points"])
def test_at_the_own_camera_all_pixels_are_drawn_exactly(make, kind):
    """A mesh reaches to the outer edges of its last pixels, and no farther."""
    frame = make()
    with ps.Renderer(rasterizer=kind) as renderer:
        image, known = renderer.render(frame, shading="none", splat="mesh", max_depth_step=0.2), frame.depth > 0
        assert (drawn(image) == known).all()
        assert (image[known][:, :3] == frame.color[known]).all()
        depth = renderer.render_depth(frame, splat="mesh", max_depth_step=0.2)
        np.testing.assert_array_equal(depth > 0, known)
        np.testing.assert_allclose(depth[known], frame.depth[known], rtol=2e-6)


def small(depth):
    depth = np.asarray(depth, np.float32)
    h, w = depth.shape
    return ps.Frame(np.full((h, w, 3), 200, np.uint8), depth, ps.Camera(10, 10, (w - 1) / 2, (h - 1) / 2, w, h))


def area(renderer, depth, **options):
    """How much of the view the mesh covers, in squares of pixels."""
    frame = small(depth)
    large = frame.camera.resized(64 * frame.camera.width, 64 * frame.camera.height)
    image = renderer.render(
        frame, camera=large, splat="mesh", normals=np.full((*frame.depth.shape, 3), (0, 0, -1.0)), **options
    )
    return drawn(image).sum() / 64**2


@pytest.mark.parametrize(
    "depth",
    [
        [[2, 2], [2, 2]], [[0, 2], [2, 2]], [[2, 2], [2, 0]], [[2, 0], [2, 2]], [[2, 0], [0, 2]], [[2, 2]], [[2]],
        [[0, 0], [0, 0]], np.full((4, 5), 2), [[2, 2, 4, 4], [2, 2, 4, 4]],
    ],
)  # fmt: skip
def test_a_mesh_covers_the_squares_of_its_pixels(renderer, depth):
    """Its pieces overlap by 1/50 of a pixel, which shows only beside missing pixels."""
    assert area(renderer, depth) == pytest.approx(np.count_nonzero(depth), rel=0.06, abs=0)


def test_a_depth_step_decides_where_the_mesh_ends(renderer):
    """Between two pixels that are not joined is no triangle: seen from the side there is a gap."""
    frame = small(np.array([[2, 2.1, 2.2, 2.4, 2.6]] * 3))

    def gaps(step):
        options = {"splat": "mesh", "max_depth_step": step, "normals": np.full((3, 5, 3), (0, 0, -1.0))}
        row = drawn(renderer.render(frame, yaw=40, camera=frame.camera.resized(320, 192), **options))[96]
        return (np.diff(row[row.argmax() : 320 - row[::-1].argmax()].astype(int)) == -1).sum()

    assert [gaps(step) for step in (0.3, 0.15, "4.9%")] == [0, 2, 3]


@pytest.mark.parametrize("size", [0.7, 1, 1.1, 1.37])
@pytest.mark.parametrize("kind", ["auto", "points"])
def test_no_background_shows_inside_a_silhouette(size, kind):
    """A sphere before a wall: at any size the picture is covered, as all rays meet something."""
    with ps.Renderer(rasterizer=kind) as renderer:
        own = CAMERA.resized(320, 240)
        frame = as_frame(trace(sphere_and_wall(), own), own)
        camera = own.resized(round(size * 320), round(size * 240))
        assert drawn(renderer.render(frame, camera=camera, splat="mesh")).all()


@pytest.mark.parametrize("shading", ["gouraud", "phong"])
@pytest.mark.parametrize("yaw", [0, 15])
def test_it_looks_as_traced(renderer, source, shading, yaw):  # noqa: F811
    result = score(renderer, source, yaw, "mesh", shading=shading, normals="star", max_depth_step=None)
    print(result)
    assert result.psnr >= 55
    assert result.holes <= 0.0002 and result.spill <= 0.001


def test_flat_triangles_look_as_traced(renderer, source):  # noqa: F811
    """Each has one colour, so the texture is coarser by half a pixel."""
    result = score(renderer, source, 15, "mesh", shading="flat", normals="star", max_depth_step=None)
    print(result)
    assert result.psnr >= 50


def test_from_another_view_its_depth_is_that_of_the_surface(renderer):
    frame = frames.tilted_plane()
    pose = ps.orbit_pose(None, frame.pivot, yaw=20, pitch=-8, dolly=0.1)
    depth = renderer.render_depth(frame, pose=pose, splat="mesh")
    v, u = np.mgrid[0:120, 0:160]
    c = frame.camera
    rays = np.stack([(u - c.cx) / c.fx, (v - c.cy) / c.fy, np.ones(u.shape)], -1)
    normal, place = pose[:3, :3].T @ (0.5, 0.2, -1), pose[:3, :3].T @ ((0, 0, 1.5) - pose[:3, 3])
    seen = depth > 0
    assert 0.5 < seen.mean() < 1
    rtol = {256: 1e-5, 16: 4e-5}[places_of_a_vertex(renderer)]  # a vertex that is moved takes the plane with it
    np.testing.assert_allclose(depth[seen], (normal @ place / (rays @ normal))[seen], rtol=rtol)


def test_in_a_scene_it_is_the_same_at_any_scale_and_among_others(renderer):
    frame = frames.sphere()
    large = np.diag([2.0, 2, 2, 1])
    for shading in ("flat", "gouraud", "phong"):
        look = ps.Appearance(splat="mesh", shading=shading)
        alone = renderer.render(frame, SHADOW, **look.options)
        twice = ps.Node(ps.PointObject(frame, look=look), transform=large)
        board = ps.Mesh([(1, 1, 3), (2, 1, 3), (1, 2, 3)], [(0, 1, 2)], shading="gouraud")  # out of the light's way
        light = ps.Light(position=tuple(2 * np.array(SHADOW.position)), shadow=True)
        image = renderer.render(ps.Scene((twice, ps.Node(board)), camera=frame.camera), light)
        behind = drawn(alone)
        assert drawn(image)[behind].all()
        assert np.abs(image[behind].astype(int) - alone[behind]).mean() < 0.2


def test_it_casts_the_shadow_of_the_splats(renderer):
    frame = frames.sphere_before_wall()
    mesh, splats = (renderer.render(frame, SHADOW, pose=turned(frame), splat=s) for s in ("mesh", "footprint"))
    common = drawn(mesh) & drawn(splats)
    assert common.mean() > 0.7
    assert (np.abs(mesh.astype(int) - splats)[common].max(-1) > 16).mean() < 0.03


def test_near_and_inside_it_is_cut_at_the_near_plane(renderer):
    frame = frames.step()
    image = renderer.render(frame, splat="mesh", dolly=0.9, yaw=10)
    assert drawn(image).mean() > 0.3
    behind = np.eye(4)
    behind[2, 3] = 3
    assert not renderer.render(frame, splat="mesh", pose=behind).any()


def test_only_what_changed_runs_again(renderer):
    frame = frames.sphere()

    def ran(**options):
        before = renderer.steps.counts.copy()
        renderer.render(frame, splat="mesh", **options)
        return set(renderer.steps.counts - before)

    ran()
    assert ran(light=LIGHT) == {"resolve", "light"}
    assert ran(light=ps.Light(position=(1, 0, 0))) == {"light"}
    assert ran(yaw=5) == {"splats", "resolve"}
    assert ran(yaw=5, max_depth_step=0.1) >= {"triangles", "splats", "resolve"}


def test_on_the_command_line(typed):
    assert typed("render vase --splat mesh --picture-size 64x48 -o out.png")[0] == 0
    code, _, said = typed("render vase --splat meshes -o out.png")
    assert code and "did you mean mesh?" in said


def test_what_a_mesh_does_not_have_is_told(renderer):
    frame = frames.sphere()
    with pytest.raises(ValueError, match="a mesh has none: leave it out, or use splat='footprint' or 'round'"):
        renderer.render(frame, splat="mesh", point_size=2)
    with pytest.raises(ValueError, match="a mesh has none"):
        ps.Appearance(splat="mesh", point_size=np.ones((2, 2)))
    with pytest.raises(ValueError, match="a mesh is that of one frame, got 2: merge them with splat='footprint'"):
        renderer.render([frame, frames.step()], splat="mesh")
    assert ps.Appearance(splat="mesh", point_size=1).splat == "mesh"
