"""A photograph alone: a network, in an .onnx file or a function, makes its depth."""

import json

import numpy as np
import pytest
from onnx import TensorProto, helper
from PIL import Image

import pointshade_gl as ps
from pointshade_gl.files.networks import onnx_network
from pointshade_gl.files.writing.film import Film

from ..support.networks import MEAN, node, save_constant, save_linear, save_mean, save_network

H, W = 48, 64
RAYS = np.mgrid[:H, :W].astype(np.float64)


@pytest.fixture
def photo(tmp_path):
    """A photograph of bands from dark to bright, left to right."""
    ramp = np.repeat(np.linspace(20, 220, W).astype(np.uint8)[None, :, None], H, axis=0).repeat(3, axis=2)
    Image.fromarray(ramp).save(tmp_path / "photo.png")
    return tmp_path / "photo.png"


@pytest.fixture
def notes():
    return []


def read(photo, model, notes=None, **options):
    return ps.load_frame(photo, depth=model, notes=(notes if notes is not None else []).append, **options)


def values(photo):
    return np.asarray(Image.open(photo))[..., 0] / 255


class TestFamilies:
    def test_depth_anything_is_inverse_and_imagenets(self, photo, notes):
        frame = read(photo, save_mean(photo.parent / "depth_anything_v2_vits.onnx"), notes)
        assert frame.depth.shape == (H, W)
        assert frame.depth[:, 0].mean() > 9 and frame.depth[:, -1].mean() < 1.05, "bright is near"
        said = "is taken as Depth Anything, by its names: input 686x518 with imagenet pixels, output inverse depth"
        assert said in notes[0] and "model_size='WxH', model_pixels='imagenet' or 'symmetric'" in notes[0]
        assert any("field of view of 60 degrees" in one for one in notes)

    @pytest.mark.parametrize(
        ("name", "expected"),
        [
            ("model.onnx", lambda v: (v - 0.449) / 0.226),  # nothing known: ImageNet's
            ("zoedepth_nk.onnx", lambda v: (v - 0.5) / 0.5),
            ("depth_pro.onnx", lambda v: (v - 0.5) / 0.5),
            ("depth_anything_metric_indoor.onnx", lambda v: (v - 0.449) / 0.226),
            ("unidepth.onnx", lambda v: (v - 0.449) / 0.226),
        ],
    )
    def test_pixels_are_normalised_as_a_family_was_trained(self, photo, name, expected):
        model = save_linear(photo.parent / name, 1, 5, "metric_depth")
        frame = read(photo, model, model_size=f"{W}x{H}", depth_kind="z", depth_scale=1)
        assert np.abs(frame.depth - 5 - expected(values(photo))).max() < 0.02

    @pytest.mark.parametrize(("pixels", "most"), [("unit", 1), ("bytes", 255), ("symmetric", None)])
    def test_pixels_can_be_said(self, photo, pixels, most):
        model = save_linear(photo.parent / "model.onnx", 1, 300)
        frame = read(photo, model, model_size=f"{W}x{H}", model_pixels=pixels, depth_kind="z", depth_scale=1)
        expected = values(photo) * most if most else values(photo) * 2 - 1
        assert np.abs(frame.depth - 300 - expected).max() < 1e-2

    def test_a_folder_names_a_family_too(self, photo, notes):
        read(photo, save_mean(photo.parent / "dpt-hybrid-midas" / "onnx" / "model.onnx"), notes)
        assert "as DPT, by its names: input 512x384 with symmetric pixels, output inverse depth" in notes[0]

    def test_metric3d_counts_in_a_focal_length_of_1000_pixels(self, photo):
        model = save_linear(photo.parent / "metric3d_vit.onnx", 0.01, 1, "predicted_depth", shape=(1, 3, 56, 112))
        focal = 500 * 56 / H  # of 500 pixels in the photograph, which is 56 rows high in the input
        frame = read(photo, model, intrinsics=(500, 500, 31.5, 23.5))
        expected = (values(photo) * 2.55 + 1) * focal / 1000
        assert frame.depth.shape == (H, W)
        assert np.abs(frame.depth - expected)[:, 2:-2].max() < 0.02, "the border of the input is cut off"

    def test_depth_pro_gives_its_focal_length(self, photo, notes):
        z = 2 + RAYS[1] / W
        outputs = {"predicted_depth": z[None], "focallength_px": [2 * W]}
        model = save_constant(photo.parent / "pro.onnx", outputs, (1, 3, 2 * H, 2 * W))
        frame = read(photo, model, notes)
        assert frame.camera.fx == frame.camera.fy == W and "is taken as Depth Pro" in notes[0]
        assert np.allclose(frame.depth, z, rtol=1e-6), "metres are as they are"
        assert not any("field of view" in one for one in notes)

    def test_depth_pro_of_transformers_gives_an_angle_and_inverse_depth(self, photo):
        z = 2 + RAYS[1] / W
        angle = 2 * np.degrees(np.arctan(0.5 * W / 80))
        outputs = {"predicted_depth": (80 / W / z)[None], "field_of_view": [angle]}
        frame = read(photo, save_constant(photo.parent / "depth-pro.onnx", outputs, (1, 3, H, W)))
        assert frame.camera.fx == pytest.approx(80, rel=1e-6)
        assert np.allclose(frame.depth, z, rtol=1e-5)

    @pytest.mark.parametrize("known", [True, False])
    def test_moges_points_get_their_shift_unit_and_focal_length(self, photo, known):
        z = 2 + 0.5 * np.sin(RAYS[1] / 7) + RAYS[0] / 100
        points = np.stack([(RAYS[1] - 31.5) * z / 70, (RAYS[0] - 23.5) * z / 70, z], axis=2)
        points[..., 2] -= 0.7
        mask = np.ones((H, W))
        mask[:5] = 0
        outputs = {"points": (points / 3)[None], "mask": mask[None], "metric_scale": [3.0]}
        tokens = helper.make_tensor_value_info("num_tokens", TensorProto.INT64, [])
        model = save_constant(photo.parent / "net.onnx", outputs, (1, 3, H, W), more=[tokens])
        frame = read(photo, model, **({"intrinsics": (70, 70, 31.5, 23.5)} if known else {}))
        assert frame.camera.fx == pytest.approx(70, rel=1e-4)
        assert not frame.depth[:5].any() and np.allclose(frame.depth[5:], z[5:], rtol=1e-4)

    def test_unidepths_points_come_with_a_camera_of_the_input(self, photo):
        z = np.full((2 * H, 2 * W), 3.0)
        z[:, W:] = 4
        v, u = np.mgrid[: 2 * H, : 2 * W]
        points = np.stack([(u - 63.5) * z / 100, (v - 47.5) * z / 100, z])
        matrix = np.array([[100, 0, 63.5], [0, 100, 47.5], [0, 0, 1]])
        outputs = {"pts_3d": points[None], "intrinsics": matrix[None], "confidence": z[None]}
        frame = read(photo, save_constant(photo.parent / "net.onnx", outputs, (1, 3, 2 * H, 2 * W)))
        assert frame.camera.fx == pytest.approx(50) and frame.camera.cx == pytest.approx(31.5)
        assert np.allclose(frame.depth[:, :31], 3) and np.allclose(frame.depth[:, 33:], 4)


class TestWhatTheFileSays:
    def test_metadata_go_before_names(self, photo, notes):
        said = {"mean": "0,0,0", "std": "1,1,1", "size": "[48, 64]", "depth_kind": "metric"}
        model = save_linear(photo.parent / "midas.onnx", 1, 5, **said)
        frame = read(photo, model, notes)
        assert np.abs(frame.depth - 5 - values(photo)).max() < 0.02
        assert "and its metadata" in notes[0] and "unit or byte pixels, output metres" in notes[0]

    def test_so_does_the_configuration_beside_it(self, photo, notes):
        folder = photo.parent / "depth-anything-v2" / "onnx"
        model = save_linear(folder / "model.onnx", 1, 5)
        (folder.parent / "config.json").write_text(json.dumps({"depth_estimation_type": "metric", "model_type": "x"}))
        settings = {"image_mean": [0.5] * 3, "image_std": [0.5] * 3, "size": {"height": 64, "width": 64}}
        (folder.parent / "preprocessor_config.json").write_text(json.dumps({**settings, "ensure_multiple_of": 16}))
        frame = read(photo, model, notes)
        assert "input 80x64 with symmetric pixels, output metres" in notes[0]
        assert np.abs(frame.depth - 5 - (values(photo) * 2 - 1)).max() < 0.05

    @pytest.mark.parametrize("text", ["[]", "{", '{"size": "large", "image_mean": [1], "image_std": 0}', "\xff"])
    def test_a_configuration_that_makes_no_sense_is_passed_over(self, photo, text):
        model = save_mean(photo.parent / "depth_anything.onnx")
        (photo.parent / "preprocessor_config.json").write_text(text, encoding="latin1")
        assert read(photo, model).depth.shape == (H, W)

    @pytest.mark.parametrize("size", ["32x16", (32, 16), 14])
    def test_the_size_can_be_said(self, photo, size, notes):
        read(photo, save_mean(photo.parent / "depth_anything.onnx"), notes, model_size=size)
        assert f"input {'32x16' if size != 14 else '14x14'} " in notes[0]

    def test_a_fixed_size_is_kept_and_the_picture_has_the_photographs_shape(self, photo):
        frame = read(photo, save_mean(photo.parent / "depth_anything.onnx", (1, 3, 32, 32)))
        assert frame.depth.shape == (32, 43) and frame.camera.fx == pytest.approx(frame.camera.fy, rel=0.01)

    def test_an_output_of_another_size_than_the_input(self, photo):
        half = {"depth": np.linspace(1, 2, 12 * 16).reshape(1, 1, 12, 16)}
        frame = read(photo, save_constant(photo.parent / "depth_anything.onnx", half, (1, 3, H, W)))
        assert frame.depth.shape == (12, 16) and frame.picture_camera.width == W

    def test_colours_last_and_bytes_are_found_from_the_input(self, photo):
        nodes = [
            node("Cast", "image", "numbers", to=TensorProto.FLOAT),
            node("ReduceMean", "numbers", "mean", axes=[3], keepdims=0),
            node("Add", "mean one", "depth"),
        ]
        held = {"one": np.float32(1)}
        shape = (1, H, W, 3)
        path = photo.parent / "metric_net.onnx"
        save_network(path, nodes, [("depth", (1, H, W))], shape, held, kind=TensorProto.UINT8)
        assert np.allclose(read(photo, path, depth_kind="z", depth_scale=1).depth, np.rint(values(photo) * 255) + 1)

    def test_an_output_of_any_name_is_depth_if_it_is_the_only_picture(self, photo):
        model = save_linear(photo.parent / "midas_v21.onnx", 1, 5, "797")
        assert read(photo, model).depth.min() == pytest.approx(1)


def broken(path):
    save_mean(path)
    path.write_bytes(path.read_bytes()[:40])


def nan(path):
    save_constant(path, {"depth": np.full((1, H, W), np.nan)}, (1, 3, H, W))


def rays(path):
    save_network(path, [MEAN], ["depth"], more=[helper.make_tensor_value_info("rays", TensorProto.FLOAT, (1, 3, H, W))])


def named_rays(path):
    more = [helper.make_tensor_value_info("focal", TensorProto.FLOAT, (1,))]
    save_network(path, [MEAN], ["depth"], more=more)


def two_pictures(path):
    save_constant(path, {"a": np.eye(H), "b": np.eye(H)}, (1, 3, H, W))


def many(path):
    save_constant(path, {"depth": np.ones((2, H, W)) * [[[1]], [[2]]]}, (1, 3, H, W))


def picky(path):
    save_network(path, [MEAN, node("Add", "depth held", "out")], ["out"], held={"held": np.ones((7, 9), np.float32)})


WRONG = [
    (broken, "is no network that ONNX Runtime can read"),
    (lambda path: path.write_bytes(b""), "is no network|is empty"),
    (lambda path: path.write_text("# a text"), "is no network that ONNX Runtime can read"),
    (nan, "gave no number that is finite for this photograph"),
    (lambda path: save_constant(path, {"depth": np.ones((1, H, W))}, (1, 3, H, W)), "gave 1 everywhere for this photo"),
    (rays, r"has the inputs image .*rays .*: expected one picture, \(1, 3, h, w\)"),
    (named_rays, "wants focal beside the picture .*take an export of the network with a picture as its only input"),
    (two_pictures, r"gave a \(48, 48\), b \(48, 48\): expected one output with a number a pixel"),
    (many, "gave 2 pictures of depth for one photograph"),
    (picky, "cannot take an input of .*: pass model_size='WxH'"),
    (lambda path: save_network(path, [MEAN], ["depth"], (1, 4, H, W)), r"expected one picture, \(1, 3, h, w\)"),
]


@pytest.mark.parametrize(("make", "says"), WRONG, ids=[says[:30] for _, says in WRONG])
def test_what_is_no_network_of_depth_is_one_sentence(photo, make, says):
    path = photo.parent / "depth_anything.onnx"
    make(path)
    with pytest.raises(ValueError, match=says) as caught:
        read(photo, path)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("options", "says"),
    [
        ({"depth": "no.onnx"}, "no.onnx"),
        ({"depth": "{model}", "model_size": "big"}, "model_size must be WIDTHxHEIGHT in pixels"),
        ({"depth": "{model}", "model_size": (0, 4)}, "model_size must be WIDTHxHEIGHT"),
        ({"depth": "{model}", "model_pixels": "rgb"}, "unknown model_pixels 'rgb': known are imagenet"),
        ({"model_pixels": "unit"}, "model_pixels is about a network: pass it as depth_model=FILE"),
        ({"depth_model": "depth.npy"}, "depth_model must be an .onnx file"),
        ({"depth_model": "{model}", "depth": "depth.png"}, "pass depth or depth_model, not both"),
        ({"depth_model": "{model}", "color": "x.png"}, "pass the photograph as color or as the input, not both"),
    ],
)
def test_options_that_make_no_sense_are_one_sentence(photo, options, says):
    model = save_mean(photo.parent / "depth_anything.onnx")
    given = {key: value.format(model=model) if isinstance(value, str) else value for key, value in options.items()}
    with pytest.raises((ValueError, TypeError, OSError), match=says):
        ps.load_frame(photo, notes=[].append, **given)


def test_a_photograph_that_is_none(photo):
    model = save_mean(photo.parent / "depth_anything.onnx")
    for name, content in (("a.jpg", b""), ("b.png", b"\x89PNG\r\n\x1a\n broken"), ("c.jpg", b"text")):
        (photo.parent / name).write_bytes(content)
        with pytest.raises((ValueError, OSError), match=name):
            read(photo.parent / name, model)


def test_without_the_extra_its_name_is_said(photo, monkeypatch):
    model = save_mean(photo.parent / "depth_anything.onnx")
    monkeypatch.setitem(__import__("sys").modules, "onnxruntime", None)
    with pytest.raises(ValueError, match=r"is a network: pip install '\.\[onnx\]' in the clone to read it"):
        read(photo, model)


class Tensor:
    """What a caller's framework gives: numbers on a device, with their gradient."""

    def __init__(self, array):
        self._array, self._steps = array, []

    def detach(self):
        self._steps.append("detach")
        return self

    def cpu(self):
        self._steps.append("cpu")
        return self

    def __array__(self, dtype=None, copy=None):
        assert self._steps == ["detach", "cpu"]
        return self._array


class TestFunctions:
    def test_it_gets_the_photograph_and_gives_depth(self, photo):
        seen = []

        def model(rgb):
            seen.append((rgb.shape, rgb.dtype))
            return 2 + RAYS[1] / W

        frame = read(photo, model)
        assert seen == [((H, W, 3), np.uint8)] and np.allclose(frame.depth, 2 + RAYS[1] / W)
        assert frame.color.shape == (H, W, 3)

    def test_a_mapping_may_have_mask_and_intrinsics(self, photo):
        mask = RAYS[0] > 9
        matrix = np.array([[80, 0, 31], [0, 81, 23], [0, 0, 1.0]])
        frame = read(photo, lambda rgb: {"depth": 2 + RAYS[1] / W, "mask": mask, "intrinsics": matrix})
        assert frame.camera == ps.Camera(80, 81, 31, 23, W, H) and np.array_equal(frame.depth > 0, mask)

    def test_intrinsics_may_be_the_photographs_or_those_of_a_smaller_depth(self, photo):
        half = 2 + RAYS[1][::2, ::2] / W
        for focal, middle in ((80, 31.5), (40, 15.5)):
            matrix = [[focal, 0, middle], [0, focal, middle * 0.75], [0, 0, 1]]
            frame = read(photo, lambda rgb, matrix=matrix: {"depth": half, "intrinsics": matrix})
            assert frame.camera.fx == pytest.approx(40)

    def test_a_pipeline_of_transformers_gives_tensors_beside_a_picture(self, photo):
        inverse = 1 / (1 + RAYS[1] / W)
        given = {"predicted_depth": Tensor(inverse[None]), "depth": Image.new("L", (W, H))}
        frame = read(photo, lambda rgb: given, depth_kind="inverse")
        assert frame.depth[0, 0] == pytest.approx(1) and frame.depth[0, -1] == pytest.approx(10)

    def test_inverse_depth_by_name(self, photo):
        frame = read(photo, lambda rgb: {"inverse_depth": 1 + RAYS[1]})
        assert frame.depth[0, 0] == pytest.approx(10) and frame.depth[0, -1] == pytest.approx(1)

    @pytest.mark.parametrize(
        ("given", "says"),
        [
            (None, r"gave None: expected depth of shape \(h, w\)"),
            ("depth.png", "gave 'depth.png': expected depth"),
            ({}, "gave {}: expected depth"),
            ({"values": np.eye(4)}, "expected depth of shape"),
            (np.ones(5), "model"),
            (np.full((H, W), np.inf), "gave no number that is finite"),
        ],
        ids=["nothing", "text", "empty", "unnamed", "a row", "infinite"],
    )
    def test_what_is_no_depth_is_one_sentence(self, photo, given, says):
        def model(rgb):
            return given

        with pytest.raises((ValueError, TypeError), match=says):
            read(photo, model)

    def test_a_function_that_fails_is_named(self, photo):
        def net(rgb):
            raise RuntimeError("out of memory on device 0")

        with pytest.raises(ValueError, match=r"the function net failed: .*out of memory on device 0"):
            read(photo, net)

    def test_a_photograph_in_memory(self, photo):
        rgb = np.asarray(Image.open(photo))
        frame = ps.load_frame(color=rgb, depth=lambda seen: 1 + seen[..., 0] / 255, notes=[].append)
        assert np.allclose(frame.depth, 1 + rgb[..., 0] / 255)


class TestCamera:
    def with_exif(self, path):
        image, exif = Image.new("RGB", (W, H), "red"), Image.Exif()
        exif.get_ifd(0x8769)[0xA405] = 50
        image.save(path, exif=exif)
        return path

    def test_the_lens_goes_before_the_network(self, photo, notes):
        photo = self.with_exif(photo.parent / "lens.jpg")
        outputs = {"predicted_depth": (2 + RAYS[1] / W)[None], "focallength_px": [20]}
        frame = read(photo, save_constant(photo.parent / "pro.onnx", outputs, (1, 3, H, W)), notes)
        assert frame.camera.fx == pytest.approx(50 / np.hypot(36, 24) * np.hypot(W, H), rel=1e-3)
        assert any("the lens of lens.jpg is taken (EXIF)" in one for one in notes)

    def test_the_caller_goes_before_both(self, photo):
        outputs = {"predicted_depth": (2 + RAYS[1] / W)[None], "focallength_px": [20]}
        model = save_constant(photo.parent / "pro.onnx", outputs, (1, 3, H, W))
        assert read(photo, model, intrinsics=(77, 77, 31.5, 23.5)).camera.fx == 77

    def test_a_folders_camera_holds_for_its_photographs_but_not_its_depth_scale(self, photo):
        camera = {"width": W, "height": H, "fx": 60, "fy": 60, "cx": 31.5, "cy": 23.5, "depth_scale": 1000}
        (photo.parent / "intrinsics.json").write_text(json.dumps(camera))
        frame = read(photo.parent, lambda rgb: 2 + RAYS[1] / W)
        assert frame.camera.fx == 60 and np.allclose(frame.depth, 2 + RAYS[1] / W)


class TestCache:
    @pytest.fixture
    def runs(self, monkeypatch):
        """How often a network was run."""
        found, run = [], onnx_network.Network.run

        def counted(*arguments):
            found.append(1)
            return run(*arguments)

        monkeypatch.setattr(onnx_network.Network, "run", counted)
        return found

    def test_a_kept_depth_is_the_same_and_the_network_rests(self, photo, runs):
        outputs = {"predicted_depth": (2 + RAYS[1] / W)[None], "focallength_px": [70]}
        model = save_constant(photo.parent / "pro.onnx", outputs, (1, 3, H, W))
        first, second = (read(photo, model, cache=True) for _ in range(2))
        assert len(runs) == 1 and np.array_equal(first.depth, second.depth) and first.camera == second.camera
        assert [path.suffix for path in (photo.parent / ".pointshade").iterdir()] == [".npz"]

    def test_another_photograph_network_or_option_is_another_depth(self, photo, runs):
        model = save_mean(photo.parent / "depth_anything.onnx")
        read(photo, model, cache=True)
        read(photo, model, cache=True, model_size=28)
        save_linear(model, 2, 1)
        read(photo, model, cache=True)
        Image.open(photo).transpose(Image.Transpose.FLIP_LEFT_RIGHT).save(photo)
        read(photo, model, cache=True)
        assert len(runs) == 4

    @pytest.mark.parametrize("damage", [b"", b"PK broken", None])
    def test_a_damaged_file_is_made_again(self, photo, runs, damage):
        model = save_mean(photo.parent / "depth_anything.onnx")
        whole = read(photo, model, cache=True).depth
        (path,) = (photo.parent / ".pointshade").iterdir()
        path.write_bytes(path.read_bytes()[:-200] if damage is None else damage)
        assert np.array_equal(read(photo, model, cache=True).depth, whole) and len(runs) == 2
        assert np.array_equal(read(photo, model, cache=True).depth, whole) and len(runs) == 2

    def test_where_nothing_can_be_kept_a_note_says_so(self, photo, notes):
        model = save_mean(photo.parent / "depth_anything.onnx")
        (photo.parent / ".pointshade").write_text("a file")
        assert read(photo, model, notes, cache=True).depth.shape == (H, W)
        assert any("depth is not kept beside the photograph" in one for one in notes)

    def test_without_the_option_nothing_is_written(self, photo):
        read(photo, save_mean(photo.parent / "depth_anything.onnx"))
        assert not (photo.parent / ".pointshade").exists()


class TestSequences:
    @pytest.fixture
    def folder(self, tmp_path):
        """Photographs of names that have nothing in common, each brighter than the one before."""
        place = tmp_path / "photos"
        place.mkdir()
        for level, name in ((50, "attic"), (100, "kitchen2"), (150, "kitchen10"), (200, "yard")):
            Image.new("RGB", (W, H), (level, level, level)).save(place / f"{name}.png")
        return place

    def test_each_photograph_is_shown_once_and_only_when_asked_for(self, folder):
        seen = []

        def model(rgb):
            seen.append(int(rgb[0, 0, 0]))
            return 2 + RAYS[1] / W

        frames = ps.open_source(folder, depth=model, notes=[].append)
        assert len(frames) == 4 and seen == [50]
        assert frames[2].color[0, 0, 0] == 150 and frames[2].depth[0, 0] == pytest.approx(2)
        assert frames[2].depth.shape == (H, W) and sorted(seen) == [50, 100, 150], "and those before it, for its scale"

    def test_a_film_has_one_camera(self, folder):
        def model(rgb):
            focal = 60.0 + rgb[0, 0, 0]
            return {"depth": 2 + RAYS[1] / W, "intrinsics": [[focal, 0, 31.5], [0, focal, 23.5], [0, 0, 1]]}

        frames = ps.open_source(folder, depth=model, notes=[].append)
        assert [frames[k].camera.fx for k in (3, 1, 0)] == [110] * 3

    def test_a_video(self, folder):
        film = folder / "film.mp4"
        pictures = [np.full((H, W, 3), level, np.uint8) for level in (40, 120, 200)]
        with Film(film) as written:
            for picture in pictures:
                written.add(picture)
        frames = ps.open_source(film, depth=lambda rgb: 1 + RAYS[1] / W + rgb.mean() / 255, notes=[].append)
        assert len(frames) == 3
        assert [round(float(frames[k].depth[0, 0]), 1) for k in (2, 0)] == [1.8, 1.2]

    def test_depth_pictures_of_a_folder_are_left_alone(self, folder):
        for path in list(folder.iterdir()):
            Image.fromarray(np.full((H, W), 5000, np.uint16)).save(folder / f"{path.stem}_depth.png")
        frames = ps.open_source(folder, depth=lambda rgb: 2 + RAYS[1] / W, notes=[].append)
        assert len(frames) == 4 and frames[1].depth.max() < 3

    def test_a_folder_without_photographs(self, tmp_path):
        with pytest.raises(FileNotFoundError, match=r"has no photographs .* of which depth_model could make depth"):
            ps.open_source(tmp_path, depth=lambda rgb: rgb[..., 0])
