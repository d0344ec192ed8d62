"""`render(..., out=array)`: the picture is read into the caller's memory, which is checked before anything is drawn."""

import re
import tracemalloc

import numpy as np
import pytest

import pointshade_gl as ps
from pointshade_gl.checks.arguments import as_given

from ..support import frames
from ..support.foreign import WAYS, Copies

FRAME = frames.sphere()
SHAPE = (*FRAME.depth.shape, 4)
EXPECTED = f"out must be an array of shape {SHAPE}, uint8 and in C order, that can be written to"


def untouched():
    return np.full(SHAPE, 77, np.uint8)


def test_the_array_is_filled_and_returned(renderer):
    out = untouched()
    assert renderer.render(FRAME, out=out) is out
    assert np.array_equal(out, renderer.render(FRAME))
    assert ps.render(FRAME, samples=2, out=out) is out
    assert np.array_equal(out, renderer.render(FRAME, samples=2))


@pytest.mark.parametrize("way", WAYS)
def test_the_memory_of_tensors_and_buffers_is_filled(renderer, way):
    held = untouched()
    if not as_given(WAYS[way](held), "out").flags.writeable:
        pytest.skip("NumPy before 2.1 takes what has DLPack alone as read-only")
    picture = renderer.render(FRAME, out=WAYS[way](held))
    assert np.shares_memory(picture, held) and np.array_equal(held, renderer.render(FRAME))


def test_a_part_of_a_larger_array_is_filled_alone(renderer):
    """Such as one picture of a batch for a network, or a block of shared memory."""
    batch = np.stack([untouched()] * 3)
    renderer.render(FRAME, out=batch[1])
    assert np.array_equal(batch[1], renderer.render(FRAME)) and (batch[[0, 2]] == 77).all()


def test_there_is_no_second_copy(renderer):
    size = ps.Camera.from_fov(40, 1024, 1024)
    out = np.zeros((1024, 1024, 4), np.uint8)
    renderer.render(FRAME, camera=size)  # what it keeps is there
    tracemalloc.start()
    renderer.render(FRAME, ps.Light((1, 0, 0)), camera=size, out=out)
    most = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert out.any() and most < out.nbytes / 2


def test_scenes_clouds_and_other_cameras_have_their_size(renderer):
    camera = FRAME.camera.resized(50, 40)
    cloud = ps.PointCloud([(0, 0, 1), (0.1, 0, 1)])
    scene = ps.Scene((ps.Node(ps.PointObject(FRAME)),), FRAME.camera)
    for source, options in ((FRAME, {"camera": camera}), (scene, {}), (cloud, {"camera": camera}), ("vase", {})):
        picture = renderer.render(source, **options)
        out = np.zeros_like(picture)
        assert np.array_equal(renderer.render(source, **options, out=out), picture)


WRONG = {
    "too small": (lambda: untouched()[1:], ValueError, f"got shape {(SHAPE[0] - 1, *SHAPE[1:])}"),
    "without alpha": (lambda: np.zeros((*SHAPE[:2], 3), np.uint8), ValueError, f"got shape {(*SHAPE[:2], 3)}"),
    "planes first": (lambda: np.zeros((4, *SHAPE[:2]), np.uint8), ValueError, f"got shape {(4, *SHAPE[:2])}"),
    "floats": (lambda: np.zeros(SHAPE, np.float32), TypeError, "got float32"),
    "Fortran order": (
        lambda: np.asfortranarray(untouched()),
        ValueError,
        f"got one in another order, with strides (1, {SHAPE[0]}, {SHAPE[0] * SHAPE[1]})",
    ),
    "every second": (
        lambda: np.zeros((2 * SHAPE[0], *SHAPE[1:]), np.uint8)[::2],
        ValueError,
        f"got one in another order, with strides ({8 * SHAPE[1]}, 4, 1)",
    ),
    "read-only": (
        lambda: np.frombuffer(bytes(untouched()), np.uint8).reshape(SHAPE),
        ValueError,
        "got a read-only one",
    ),
    "a list": (lambda: untouched().tolist(), TypeError, "got a list, of which NumPy has a copy only"),
    "a copy": (lambda: Copies(untouched()), TypeError, "got a Copies, of which NumPy has a copy only"),
    "a number": (lambda: 3, TypeError, "got 3"),
}


@pytest.mark.parametrize("name", WRONG)
def test_what_no_picture_can_be_read_into_is_refused_before_drawing(name):
    make, kind, reason = WRONG[name]
    with ps.Renderer() as renderer:
        with pytest.raises(kind, match=f"{re.escape(EXPECTED)}, {re.escape(reason)}$"):
            renderer.render(FRAME, out=make())
        assert not renderer.steps.counts


def test_what_ends_with_an_error_leaves_the_array_alone(renderer):
    out = untouched()
    with pytest.raises(ps.Cancelled):
        renderer.render(FRAME, samples=3, out=out, progress=lambda done, all: False)
    assert (out == 77).all()


def test_a_pool_fills_arrays_too():
    outs = [untouched() for _ in range(3)]
    with ps.RendererPool(2) as pool:
        futures = [pool.submit(FRAME, yaw=5.0 * k, out=out) for k, out in enumerate(outs)]
        assert all(future.result() is out for future, out in zip(futures, outs, strict=True))
        expected = [pool.render(FRAME, yaw=5.0 * k) for k in range(3)]
    assert np.array_equal(outs, expected)


def test_it_is_an_option_of_the_call_alone(renderer):
    with pytest.raises(TypeError, match=r"draw\(\) got an unexpected keyword argument 'out'"):
        renderer.draw(FRAME, out=untouched())
