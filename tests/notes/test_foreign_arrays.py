"""What other libraries keep numbers in is taken wherever arrays are: in place, or with a sentence that says why not."""

import re
import tracemalloc

import numpy as np
import pytest
from PIL import Image

import pointshade_gl as ps
from pointshade_gl.checks.arguments import as_given

from ..support import frames
from ..support.foreign import WAYS, Copies, HasDLPack, Tensor, as_buffer

FRAME = frames.sphere()
CORNERS, FACES = np.array([(0, 0, 1), (1, 0, 1), (0, 1, 1)], np.float32), np.array([(0, 1, 2)])
COLORS, EYE = np.array(FRAME.color), np.eye(4)
ENVIRONMENT = np.ones((4, 8, 3), np.float32)
NORMALS = np.full((*FRAME.depth.shape, 3), (0, 0, -1), np.float32)


def saved(save, suffix):
    def write(value, folder):
        save(folder / f"a{suffix}", value)
        return (folder / f"a{suffix}").read_bytes()

    return write


DOORS = {  # each: a value, and what is made of it, by numbers
    "depth": (np.array(FRAME.depth), lambda value, _: ps.Frame(None, value, FRAME.camera).depth),
    "color": (COLORS, lambda value, _: ps.Frame(value, FRAME.depth, FRAME.camera).color),
    "pose": (EYE, lambda value, _: ps.Frame(None, FRAME.depth, FRAME.camera, value).pose),
    "loaded depth": (
        np.array(FRAME.depth),
        lambda value, _: ps.load_frame(depth=value, intrinsics=FRAME.camera, depth_scale=1, depth_kind="z").depth,
    ),
    "loaded color": (
        COLORS,
        lambda value, _: ps.load_frame(depth=FRAME.depth, color=value, intrinsics=FRAME.camera, depth_scale=1).color,
    ),
    "intrinsics": (
        np.array(FRAME.camera.intrinsics),
        lambda value, _: ps.load_frame(depth=FRAME.depth, intrinsics=value, depth_scale=1).camera.intrinsics,
    ),
    "look's normals": (NORMALS, lambda value, _: ps.Appearance(normals=value).for_frame(FRAME.depth).normals),
    "point size": (
        np.array(FRAME.depth),
        lambda value, _: ps.Appearance(point_size=value).for_frame(FRAME.depth).point_size,
    ),
    "noise": (np.array(FRAME.depth) + 1, lambda value, _: ps.Appearance(noise=value).for_frame(FRAME.depth).noise),
    "positions": (CORNERS, lambda value, _: ps.Mesh(value, FACES).positions),
    "faces": (FACES, lambda value, _: ps.Mesh(CORNERS, value).faces),
    "texture": (COLORS, lambda value, _: ps.Mesh(CORNERS, FACES, uv=CORNERS[:, :2], texture=value).texture),
    "points": (CORNERS, lambda value, _: ps.PointCloud(value).positions),
    "points' colors": (FACES.astype(np.uint8), lambda value, _: ps.PointCloud(CORNERS[:1], colors=value).colors),
    "points' eye": (CORNERS[0], lambda value, _: ps.PointCloud(CORNERS, seen_from=value).seen_from),
    "light's place": (CORNERS[0], lambda value, _: ps.Light(position=value).position),
    "background": (CORNERS[0], lambda value, _: ps.OutputSettings(background=value).background),
    "rotation": (EYE[:3, :3], lambda value, _: ps.OutputSettings(environment_rotation=value).environment_rotation),
    "environment": (ENVIRONMENT, lambda value, _: ps.Environment(value).picture),
    "transform": (EYE, lambda value, _: ps.Node(transform=value).transform),
    "view's pose": (EYE, lambda value, _: ps.View(pose=value).pose),
    "projected": (CORNERS, lambda value, _: FRAME.camera.project(value)),
    "saved image": (COLORS, saved(ps.save_image, ".png")),
    "saved jpeg": (COLORS, saved(ps.save_image, ".jpg")),
    "saved depth": (np.array(FRAME.depth), saved(ps.save_depth, ".png")),
    "saved normals": (NORMALS, saved(ps.save_normals, ".png")),
    "film": (COLORS, saved(lambda path, value: add_to_film(path, value), ".gif")),
}


def add_to_film(path, value):
    with ps.Film(path) as film:
        film.add(value)


@pytest.mark.parametrize("door", DOORS)
def test_each_door_takes_what_others_hold_numbers_in(door, tmp_path):
    value, made = DOORS[door]
    expected = made(value, tmp_path)
    for way in WAYS:
        np.testing.assert_equal(made(WAYS[way](value), tmp_path), expected, err_msg=way)


def test_rows_of_numbers_may_be_buffers(tmp_path):
    for door in ("light's place", "background", "intrinsics", "points' eye"):
        value, made = DOORS[door]
        np.testing.assert_equal(made(as_buffer(value), tmp_path), made(value, tmp_path), err_msg=door)


@pytest.mark.parametrize("way", WAYS)
def test_numbers_are_read_in_place(way):
    held = np.ones((3, 4), np.float32)
    assert np.shares_memory(as_given(WAYS[way](held), "depth"), held)


@pytest.mark.parametrize("way", WAYS)
def test_a_frame_copies_what_may_change_later_but_once(way):
    depth, color = np.ones((1000, 1000), np.float32), np.zeros((1000, 1000, 3), np.uint8)
    given = WAYS[way](color), WAYS[way](depth), ps.Camera.from_fov(60, 1000, 1000)
    tracemalloc.start()
    frame = ps.Frame(*given)
    most = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert most < 1.25 * (depth.nbytes + color.nbytes)
    color[:], depth[:] = 9, 9
    assert not frame.color.any() and (frame.depth == 1).all()


def test_a_frame_keeps_frozen_arrays_themselves():
    depth, color = np.ones((4, 5), np.float32), np.zeros((4, 5, 3), np.uint8)
    for array in (depth, color):
        array.flags.writeable = False
    frame = ps.Frame(color, depth, ps.Camera.from_fov(60, 5, 4))
    assert frame.color is color and frame.depth is depth


@pytest.mark.parametrize(("dtype", "step"), [("f2", 1), (">f4", 1), ("f8", 1), ("f4", -1), (">f2", 2)])
def test_other_types_and_strides_of_depth_give_the_same_frame(dtype, step):
    depth = np.repeat(np.round(FRAME.depth, 2), abs(step), 0).astype("f2").astype(dtype)[::step]
    frame = ps.Frame(None, depth, FRAME.camera)
    np.testing.assert_array_equal(frame.depth, np.array(depth, np.float32))


def test_lists_may_hold_tensors_and_numbers_may_be_such():
    numbers = [Tensor(np.array(k, np.float32)).with_gradient() for k in (1, 2)]
    assert ps.Light(position=[*numbers, 3]).position == (1.0, 2.0, 3.0)
    assert np.array_equal(as_given([HasDLPack(np.arange(3)), [3, 4, 5]], "rows"), [[0, 1, 2], [3, 4, 5]])
    assert ps.Appearance(point_size=numbers[1]).point_size == 2 and ps.OutputSettings(exposure=numbers[0]).exposure == 1
    with pytest.raises(TypeError, match="camera fx must be a finite number of pixels"):
        ps.Camera(Tensor(np.array(True), "bool"), 1, 1, 1, 2, 2)


IMPOSSIBLE = {
    "on a GPU": (Tensor(COLORS, "uint8", "cuda:0"), "a Tensor on cuda:0: give it as a CPU array, tensor.cpu()"),
    "on a GPU, with a gradient": (
        Tensor(COLORS, "uint8", "cuda:1").with_gradient(),
        "a Tensor on cuda:1: give it as a CPU array, tensor.cpu()",
    ),
    "bfloat16": (
        Tensor(COLORS, "bfloat16"),
        "a Tensor of bfloat16, which NumPy lacks: give it as float32, tensor.float()",
    ),
    "float8": (
        Tensor(COLORS, "float8_e4m3fn"),
        "a Tensor of float8_e4m3fn, which NumPy lacks: give it as float32, tensor.float()",
    ),
    "sparse": (
        Tensor(COLORS, layout="torch.sparse_coo"),
        "a sparse Tensor: give it as a dense array, tensor.to_dense()",
    ),
    "a palette": (Image.new("P", (5, 4)), "a picture of mode P: give image.convert('RGB')"),
    "inks": (Image.new("CMYK", (5, 4)), "a picture of mode CMYK: give image.convert('RGB')"),
    "grey with alpha": (Image.new("LA", (5, 4)), "a picture of mode LA: give image.convert('RGBA')"),
}
TAKING = {
    "color": (lambda value, _: ps.Frame(value, FRAME.depth, FRAME.camera), "color must have shape"),
    "depth": (lambda value, _: ps.Frame(None, value, FRAME.camera), "depth must have shape"),
    "point size": (lambda value, _: ps.Appearance(point_size=value), "point_size is the splats' size"),
    "normals": (lambda value, _: ps.Appearance(normals=value), "normals must"),
    "positions": (lambda value, _: ps.Mesh(value, FACES), "mesh positions must"),
    "image": (lambda value, folder: ps.save_image(folder / "a.png", value), "image must have shape"),
    "environment": (lambda value, _: ps.Environment(value), "environment must be a picture"),
}


@pytest.mark.parametrize("door", TAKING)
def test_what_cannot_be_read_says_so_and_what_to_do(door, tmp_path):
    call, subject = TAKING[door]
    for value, reason in IMPOSSIBLE.values():
        with pytest.raises(TypeError) as caught:
            call(value, tmp_path)
        message = str(caught.value)
        assert message.endswith(f", got {reason}") and "\n" not in message
        assert message.startswith(subject)


def test_arrays_of_cupy_are_named_with_their_own_way_to_the_cpu():
    class ndarray(HasDLPack):
        def __array__(self, dtype=None, copy=None):
            raise TypeError("Implicit conversion to a NumPy array is not allowed.")

        def __dlpack_device__(self):
            return 2, 1

        def get(self): ...

    with pytest.raises(TypeError, match=r"got a ndarray on cuda:1: give it as a CPU array, ndarray.get\(\)$"):
        ps.Frame(None, ndarray(np.array(FRAME.depth)), FRAME.camera)


def test_an_array_whose_own_code_fails_is_named_with_its_reason():
    class Broken:
        def __array__(self, dtype=None, copy=None):
            raise OSError("the file is\n gone")

    with pytest.raises(TypeError, match=r"got a Broken that NumPy cannot read \(the file is gone\)$"):
        ps.Frame(None, Broken(), FRAME.camera)


def test_types_that_others_add_to_numpy_are_named():
    ml_dtypes = pytest.importorskip("ml_dtypes")
    depth = np.ones((2, 2), ml_dtypes.bfloat16)
    reason = "got bfloat16 numbers, which NumPy lacks: give array.astype('float32')"
    with pytest.raises(TypeError, match=re.escape(reason)):
        ps.Frame(None, depth, ps.Camera.from_fov(60, 2, 2))
    assert ps.Frame(None, depth.astype("float32"), ps.Camera.from_fov(60, 2, 2)).points_known == 4


HINTS = [  # shape, of a tensor: the end of the message
    ("color", (3, 120, 160), True, "color.permute(1, 2, 0)"),
    ("color", (3, 120, 160), False, "np.moveaxis(color, 0, 2)"),
    ("color", (1, 120, 160, 3), True, "color[0]"),
    ("color", (1, 4, 120, 160), True, "color[0].permute(1, 2, 0)"),
    ("color", (120, 160), False, "np.stack([color] * 3, -1)"),
    ("depth", (1, 120, 160), True, "depth[0]"),
    ("depth", (1, 1, 120, 160), False, "depth[0, 0]"),
    ("depth", (120, 160, 1), False, "depth[..., 0]"),
    ("color", (2, 120, 160, 3), True, ""),
    ("color", (120, 160, 5), True, ""),
    ("depth", (3, 120, 160), True, ""),
]


class Planes(np.ndarray):
    """An array with PyTorch's name for what moves axes."""

    def __new__(cls, array):
        return array.view(cls)

    def permute(self, *axes):
        return self.transpose(axes)


@pytest.mark.parametrize(("name", "shape", "is_tensor", "way"), HINTS)
def test_the_shape_of_a_batch_or_of_planes_of_color_names_the_way_to_a_picture(name, shape, is_tensor, way):
    array = np.zeros(shape, np.uint8 if name == "color" else np.float32)
    value = Tensor(array) if is_tensor else array
    with pytest.raises(ValueError) as caught:
        ps.Frame(value, FRAME.depth, FRAME.camera) if name == "color" else ps.Frame(None, value, FRAME.camera)
    assert str(caught.value).endswith(f", got {shape}: give {way}" if way else f", got {shape}")
    if way:  # and it works
        found = as_given(eval(way, {name: Planes(array), "np": np}), name)
        assert found.shape[:2] == (120, 160) and found.ndim == (3 if name == "color" else 2)


def test_pictures_of_pillow_are_taken_as_what_they_show():
    picture, grey = Image.fromarray(COLORS), Image.new("L", (160, 120))
    assert np.array_equal(ps.Frame(picture, FRAME.depth, FRAME.camera).color, COLORS)
    with pytest.raises(ValueError, match=re.escape("got (120, 160): give image.convert('RGB')")):
        ps.Frame(grey, FRAME.depth, FRAME.camera)
    metres = Image.fromarray(np.array(FRAME.depth))
    assert metres.mode == "F" and np.array_equal(ps.Frame(None, metres, FRAME.camera).depth, FRAME.depth)
    millimetres = Image.fromarray(np.rint(1000 * FRAME.depth).astype(np.uint16))
    assert millimetres.mode == "I;16"
    loaded = ps.load_frame(depth=millimetres, color=picture, intrinsics=FRAME.camera, depth_scale=1000)
    assert np.abs(loaded.depth - FRAME.depth).max() <= 5.1e-4


def test_what_is_no_array_stays_an_error_of_one_sentence():
    for value in (object(), np.array([object()]), {"a": 1}, [object()]):
        for call, _ in TAKING.values():
            with pytest.raises((TypeError, ValueError)) as caught:
                call(value, None)
            assert "\n" not in str(caught.value)


def test_a_copy_is_fine_where_only_numbers_are_read():
    assert np.array_equal(ps.Frame(None, Copies(np.array(FRAME.depth)), FRAME.camera).depth, FRAME.depth)
