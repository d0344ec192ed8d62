"""PyTorch on the CPU: tensors go in wherever arrays do, and pictures come out in their memory."""

import operator
import os
import re

import numpy as np
import pytest

import pointshade_gl as ps
from pointshade_gl.checks.arguments import as_given

from ..support import frames
from ..support.places import ROOT

pytestmark = pytest.mark.clients
if os.environ.get("POINTSHADE_REQUIRE_CLIENTS") == "1":
    import torch
else:
    torch = pytest.importorskip("torch")

FRAME = frames.sphere()
CAMERA = FRAME.camera


def tensor(array):
    return torch.from_numpy(np.array(array))


@pytest.fixture
def frame():
    return ps.Frame(tensor(FRAME.color), tensor(FRAME.depth), CAMERA, torch.eye(4))


def test_a_frame_of_tensors_is_that_of_arrays(frame):
    assert np.array_equal(frame.color, FRAME.color) and np.array_equal(frame.depth, FRAME.depth)
    assert np.array_equal(frame.pose, np.eye(4))


def test_a_frame_does_not_change_with_its_tensors():
    color, depth = tensor(FRAME.color), tensor(FRAME.depth)
    frame = ps.Frame(color, depth, CAMERA)
    color[:], depth[:] = 0, 0
    assert np.array_equal(frame.color, FRAME.color) and np.array_equal(frame.depth, FRAME.depth)


def test_tensors_are_read_in_place():
    held = torch.ones(3, 4)
    for value in (held, held.clone().requires_grad_(), held.T, held[::2], torch.nn.Parameter(held)):
        array = as_given(value, "depth")
        assert array.ctypes.data == value.data_ptr() and array.shape == value.shape


def test_gradients_signs_and_half_precision_do_not_matter():
    depth = tensor(np.round(FRAME.depth, 2))
    expected = ps.Frame(None, depth.half().float(), CAMERA).depth
    imaginary = torch.complex(torch.zeros_like(depth), -depth).conj().imag  # its sign is not applied yet
    assert imaginary.is_neg()
    for value in (depth.half(), depth.half().double().requires_grad_(), torch.nn.Parameter(depth.half())):
        assert np.array_equal(ps.Frame(None, value, CAMERA).depth, expected)
    assert np.array_equal(ps.Frame(None, imaginary, CAMERA).depth, ps.Frame(None, depth, CAMERA).depth)


def test_numbers_that_are_learned_move_lights_and_cameras(renderer):
    """As in a loop that fits a light; it is not differentiated, and nothing warns."""
    place, strength, yaw = (torch.tensor(one, requires_grad=True) for one in ([0.5, -0.5, 0.2], 2.0, 15.0))
    light = ps.Light(position=place, intensity=strength)
    assert light.position == pytest.approx((0.5, -0.5, 0.2)) and light.intensity == 2
    assert ps.Light(position=[place[0], place[1], 0.2]).position == pytest.approx((0.5, -0.5, 0.2))
    picture = renderer.render(FRAME, light, yaw=yaw)
    assert np.array_equal(picture, renderer.render(FRAME, ps.Light((*light.position,), intensity=2), yaw=15))


def test_options_for_each_pixel_and_objects_are_made_of_tensors(renderer):
    normals, sizes = tensor(renderer.estimate_normals(FRAME)), torch.full(FRAME.depth.shape, 1.5)
    picture = renderer.render(FRAME, normals=normals, point_size=sizes, environment=torch.ones(8, 16, 3))
    same = {"normals": normals.numpy(), "point_size": sizes.numpy(), "environment": np.ones((8, 16, 3))}
    assert np.array_equal(picture, renderer.render(FRAME, **same))
    corners, faces = torch.eye(3), torch.tensor([[0, 1, 2]])
    mesh, cloud = ps.Mesh(corners, faces, corners), ps.PointCloud(corners, colors=torch.zeros(3, 3, dtype=torch.uint8))
    assert np.array_equal(mesh.positions, np.eye(3)) and cloud.positions.dtype == np.float32
    assert renderer.render(ps.Scene((ps.Node(mesh, transform=torch.eye(4)),)), camera=CAMERA).shape[2] == 4


def test_files_are_written_and_read_of_tensors(tmp_path):
    for name, save, array in (
        ("a.png", ps.save_image, FRAME.color),
        ("a.npy", ps.save_depth, FRAME.depth),
        ("n.npy", ps.save_normals, np.ones((4, 5, 3), np.float32)),
    ):
        for kind in (tensor, np.asarray):
            save(tmp_path / f"{kind.__name__}_{name}", kind(array))
        assert (tmp_path / f"tensor_{name}").read_bytes() == (tmp_path / f"asarray_{name}").read_bytes()
    numbers = torch.tensor(CAMERA.intrinsics, dtype=torch.float64)
    millimetres, color = 1000 * tensor(FRAME.depth), tensor(FRAME.color)
    loaded = ps.load_frame(depth=millimetres, color=color, intrinsics=numbers, depth_scale=1000)
    assert np.allclose(loaded.depth, FRAME.depth, rtol=1e-6)


def test_a_picture_is_drawn_into_a_tensor(renderer):
    batch = torch.zeros(2, *FRAME.depth.shape, 4, dtype=torch.uint8)
    for k, out in enumerate(batch):
        picture = renderer.render(FRAME, yaw=10.0 * k, out=out)
        assert picture.ctypes.data == out.data_ptr()
    assert np.array_equal(batch[1].numpy(), renderer.render(FRAME, yaw=10.0))
    assert np.array_equal(batch[0].numpy(), renderer.render(FRAME))
    with pytest.raises(ValueError, match="got one in another order"):
        renderer.render(FRAME, out=torch.zeros(4, *FRAME.depth.shape, dtype=torch.uint8).permute(1, 2, 0))
    with pytest.raises(TypeError, match=r"got float32$"):
        renderer.render(FRAME, out=torch.zeros(*FRAME.depth.shape, 4))


def test_a_picture_becomes_a_tensor_without_a_copy(renderer):
    picture = renderer.render(FRAME)
    made = torch.from_numpy(picture)
    assert made.data_ptr() == picture.ctypes.data and made.shape == picture.shape


IMPOSSIBLE = {
    "bfloat16": (
        lambda one: one.bfloat16(),
        "a Tensor of bfloat16, which NumPy lacks: give it as float32, tensor.float()",
    ),
    "float8": (
        lambda one: one.to(torch.float8_e4m3fn),
        "a Tensor of float8_e4m3fn, which NumPy lacks: give it as float32, tensor.float()",
    ),
    "sparse": (lambda one: one.to_sparse(), "a sparse Tensor: give it as a dense array, tensor.to_dense()"),
    "elsewhere": (lambda one: one.to("meta"), "a Tensor on meta: give it as a CPU array, tensor.cpu()"),
}


@pytest.mark.parametrize("name", IMPOSSIBLE)
def test_what_numpy_cannot_read_says_what_to_give(name):
    change, reason = IMPOSSIBLE[name]
    for call in (
        lambda value: ps.Frame(None, value, CAMERA),
        lambda value: ps.Frame(value, FRAME.depth, CAMERA),
        lambda value: ps.Appearance(normals=value),
        lambda value: ps.Mesh(value, [[0, 1, 2]]),
    ):
        with pytest.raises(TypeError) as caught:
            call(change(torch.ones(4, 5)))
        assert str(caught.value).endswith(f", got {reason}")


@pytest.mark.skipif(not torch.cuda.is_available(), reason="needs a GPU")
def test_tensors_on_a_gpu_are_named():
    with pytest.raises(TypeError, match=r"got a Tensor on cuda:0: give it as a CPU array, tensor.cpu\(\)$"):
        ps.Frame(None, torch.ones(4, 5).cuda(), CAMERA)


def test_what_has_no_numbers_is_refused_as_a_number():
    with pytest.raises(TypeError, match="light intensity must be a number"):
        ps.Light(intensity=torch.ones(()).to("meta"))
    with pytest.raises(TypeError, match="camera fx must be a finite number of pixels"):
        ps.Camera(torch.tensor(True), 1, 1, 1, 2, 2)


def test_planes_and_batches_of_networks_are_told_from_pictures():
    color = tensor(FRAME.color)
    for value, way in ((color.permute(2, 0, 1), "color.permute(1, 2, 0)"), (color[None], "color[0]")):
        with pytest.raises(ValueError) as caught:
            ps.Frame(value, FRAME.depth, CAMERA)
        assert str(caught.value).endswith(f"got {tuple(value.shape)}: give {way}")
    with pytest.raises(TypeError, match="color must be uint8 sRGB, got float32: multiply by 255 and round"):
        ps.Frame(color / 255, FRAME.depth, CAMERA)


@pytest.mark.parametrize("kind", ["float32", "float16", "bfloat16"])
def test_a_network_may_give_tensors_with_gradients_in_half_precision(kind):
    given = torch.nn.Parameter(tensor(FRAME.depth).to(getattr(torch, kind)))
    frame = ps.load_frame(color=np.array(FRAME.color), depth_model=lambda pixels: {"depth": given[None]}, fov=40)
    assert frame.depth.shape == FRAME.depth.shape and frame.points_known


class TestOnAGpu:
    """The code of docs/gpu-tensors.md."""

    CODE = re.findall(r"```python\n(.*?)```", (ROOT / "docs/gpu-tensors.md").read_text(encoding="utf-8"), re.DOTALL)[0]

    def test_the_functions_of_cuda_that_the_page_calls_exist(self):
        runtime = pytest.importorskip("cuda.bindings.runtime")
        names = re.findall(r"(?<![\w.])cuda\.([\w.]+)", self.CODE.partition("import runtime as cuda")[2])
        assert len(names) == 9
        for name in names:
            assert operator.attrgetter(name)(runtime) is not None

    @pytest.mark.skipif(not torch.cuda.is_available(), reason="needs a GPU")
    def test_the_tensor_holds_the_picture(self):
        given = {}
        exec(self.CODE, given)
        assert np.array_equal(given["picture"].cpu().numpy(), ps.render("vase", samples=4))
