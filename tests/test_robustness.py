"""Pictures of extreme sizes and a GPU without memory: the right answer or a clear error, and the Renderer lives on."""

import moderngl
import numpy as np
import pytest

import pointshade_gl as ps

from . import frames


@pytest.fixture(params=["compute", "points"])
def rasterizer(request, renderer):
    if request.param == "compute" and renderer.context.gl.version_code < 430:
        pytest.skip("the compute rasteriser needs OpenGL 4.3")
    with ps.Renderer(rasterizer=request.param) as made:
        made.expected = made.render(frames.sphere())
        yield made
        assert (made.render(frames.sphere()) == made.expected).all()


@pytest.mark.parametrize("shading", ["none", "flat", "gouraud", "phong"])
def test_a_frame_of_one_pixel(rasterizer, shading):
    frame = ps.Frame(np.full((1, 1, 3), 90, np.uint8), np.ones((1, 1)), ps.Camera(100, 100, 0, 0, 1, 1))
    image = rasterizer.render(frame, light=ps.Light(direction=(0, 0, 1)), shading=shading)
    assert image.shape == (1, 1, 4) and image[0, 0, 3] == 255
    if shading == "none":
        assert image[0, 0, 0] == 90


@pytest.mark.parametrize("shading", ["none", "flat", "gouraud", "phong"])
def test_a_frame_without_a_point_is_an_empty_picture(rasterizer, shading):
    empty = ps.Frame(None, np.zeros((12, 16)), ps.Camera(20, 20, 7.5, 5.5, 16, 12))
    for pose in (None, ps.orbit_pose(None, (0, 0, 1), 20)):
        for light in (ps.Light(), ps.Light(position=(1, 0, 0))):
            assert not rasterizer.render(empty, light, pose=pose, shading=shading).any()


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
def test_a_gpu_without_memory(rasterizer, monkeypatch, nth):
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
            rasterizer.render(frame, shading="phong")
        except MemoryError as error:
            assert "no memory left" in str(error)
            break
    else:
        pytest.fail("memory ran out and nobody said so")
    assert rasterizer.render(frame).shape == (150, 200, 4)
