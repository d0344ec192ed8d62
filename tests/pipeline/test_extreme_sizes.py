"""Pictures of extreme sizes and a GPU without memory: a right answer or a clear error, and the Renderer still works."""

import moderngl
import numpy as np
import pytest

import pointshade_gl as ps
from pointshade_gl.scene import shadow_cameras

from ..support import frames
from ..support.drivers import need_compute


@pytest.fixture(scope="module", params=["compute", "points"])
def shared(request, renderer):
    """A Renderer for each rasteriser, and its picture of a sphere."""
    if request.param == "compute":
        need_compute(renderer)
    with ps.Renderer(rasterizer=request.param) as made:
        made.kind, made.expected = request.param, made.render(frames.sphere())
        yield made


@pytest.fixture
def rasterizer(shared):
    yield shared
    assert (shared.render(frames.sphere()) == shared.expected).all()


@pytest.fixture
def fresh(shared):
    """One that has drawn nothing larger than a sphere's frame."""
    with ps.Renderer(rasterizer=shared.kind) as made:
        made.render(frames.sphere())
        yield made
        assert (made.render(frames.sphere()) == shared.expected).all()


@pytest.mark.parametrize("shading", ["none", "flat", "gouraud", "phong", "edl"])
def test_a_frame_of_one_pixel(rasterizer, shading):
    frame = ps.Frame(np.full((1, 1, 3), 90, np.uint8), np.ones((1, 1)), ps.Camera(100, 100, 0, 0, 1, 1))
    image = rasterizer.render(frame, light=ps.Light(direction=(0, 0, 1)), shading=shading)
    assert image.shape == (1, 1, 4) and image[0, 0, 3] == 255
    if shading == "none":
        assert image[0, 0, 0] == 90


@pytest.mark.parametrize("shading", ["none", "flat", "gouraud", "phong", "edl"])
def test_a_frame_without_a_point_is_an_empty_picture(rasterizer, shading):
    empty = ps.Frame(None, np.zeros((12, 16)), ps.Camera(20, 20, 7.5, 5.5, 16, 12))
    for pose in (None, ps.orbit_pose(None, (0, 0, 1), 20)):
        for light in (ps.Light(), ps.Light(position=(1, 0, 0))):
            assert not rasterizer.render(empty, light, pose=pose, shading=shading).any()


def part_of(frame, rows, columns):
    """Some rows and columns of the frame; and the same part in a frame whose box is the whole picture."""
    depth = np.zeros_like(frame.depth)
    depth[rows, columns] = frame.depth[rows, columns]
    part, whole = (ps.Frame(frame.color, depth, frame.camera) for _ in range(2))
    whole.__dict__["box"] = 0, 0, depth.shape[1], depth.shape[0]
    return part, whole


@pytest.mark.parametrize("shading", ["none", "flat", "gouraud", "phong", "edl"])
def test_where_a_frame_has_no_points_nothing_is_drawn_nor_left_from_the_frame_before(rasterizer, shading):
    parts = [
        part_of(frames.sphere_before_wall(), slice(None), slice(None)),
        part_of(frames.sphere_before_wall(), slice(30, 61), slice(17, 100)),
        part_of(frames.noisy(), slice(5, 90), slice(50, 159)),
        part_of(frames.tilted_plane(), slice(90, 120), slice(0, 3)),
        part_of(frames.step(), slice(59, 60), slice(20, 21)),
    ]
    side = ps.orbit_pose(None, (0, 0, 1.5), yaw=15)
    for option in ({}, {"pose": side}, {"point_size": 2.5, "splat": "round"}, {"splat": "mesh"}):
        drawn = [rasterizer.render(part, shading=shading, **option) for part, _ in parts]
        expected = [rasterizer.render(whole, shading=shading, **option) for _, whole in parts]
        assert all((own == other).all() for own, other in zip(drawn, expected, strict=True))


@pytest.mark.parametrize("shading", ["none", "flat", "gouraud", "phong", "edl"])
def test_a_scene_of_parts_looks_the_same_after_other_scenes(rasterizer, monkeypatch, shading):
    monkeypatch.setattr(shadow_cameras, "SHADOW_SIDE", 128)

    def scene(rows, columns):
        part, _ = part_of(frames.sphere_before_wall(), rows, columns)
        mesh = ps.Mesh(np.array([[-0.5, -0.5, 1.2], [0.5, -0.5, 1.2], [0, 0.5, 1.2]]), np.array([[0, 1, 2]]))
        nodes = ps.Node(ps.PointObject(part, shading=shading)), ps.Node(mesh)
        return ps.Scene(nodes, camera=frames.CAMERA)

    parts = [(slice(30, 61), slice(17, 100)), (slice(0, 120), slice(80, 90)), (slice(None), slice(None))]
    light = ps.Light(direction=(1, 1, 2), shadow=True)
    drawn = [rasterizer.render(scene(*part), light) for part in parts]
    assert len({image.tobytes() for image in drawn}) == 3
    with ps.Renderer(rasterizer=rasterizer.kind) as other:
        other.render(frames.sphere_before_wall(), shading=shading)
        for part, image in reversed([*zip(parts, drawn, strict=True)]):
            assert (other.render(scene(*part), light) == image).all()


@pytest.mark.parametrize("method", ["star", "star-borrow", "adaptive", "triangles-8", "plane-fit-5"])
def test_normals_of_a_part_are_those_it_has_in_a_whole_frame(renderer, method):
    for rows, columns in ((slice(30, 61), slice(17, 100)), (slice(0, 120), slice(80, 90)), (slice(7, 8), slice(9, 10))):
        part, whole = part_of(frames.noisy(), rows, columns)
        own = renderer.estimate_normals(part, method)
        np.testing.assert_array_equal(own, renderer.estimate_normals(whole, method))


def test_a_picture_of_one_pixel(rasterizer):
    assert rasterizer.render(frames.tilted_plane(), camera=frames.CAMERA.fitted(1, 1)).shape == (1, 1, 4)


def test_sizes_that_no_block_divides(rasterizer):
    frame = ps.Frame(None, np.ones((7, 131)), ps.Camera(100, 100, 65, 3, 131, 7))
    assert rasterizer.render(frame)[..., 3].all()


def test_a_picture_beyond_the_textures_of_the_driver(rasterizer):
    with pytest.raises(ValueError, match="larger than this GPU's textures"):
        rasterizer.render(frames.sphere(), camera=ps.Camera(9, 9, 9, 9, 10**6, 4))
    long = ps.Frame(None, np.ones((1, 40_000)), ps.Camera(9, 9, 9, 0, 40_000, 1))
    with pytest.raises(ValueError, match="larger than this GPU's textures"):
        rasterizer.render(long)


@pytest.mark.parametrize("nth", range(1, 6))
def test_a_gpu_without_memory(fresh, monkeypatch, nth):
    """GL only notes that memory ran out; here it does so for one of the textures and buffers of a larger picture."""
    asked = []

    def no_memory(context):
        asked.append(1)
        return "GL_OUT_OF_MEMORY" if len(asked) == nth else "GL_NO_ERROR"

    monkeypatch.setattr(moderngl.Context, "error", property(no_memory))
    larger = frames.CAMERA.resized(200, 150)
    frame = ps.Frame(None, np.ones((150, 200)), larger)
    for _ in range(2):
        try:
            fresh.render(frame, shading="phong")
        except MemoryError as error:
            assert "no memory left" in str(error)
            break
    else:
        pytest.fail("memory ran out and nobody said so")
    assert fresh.render(frame).shape == (150, 200, 4)
