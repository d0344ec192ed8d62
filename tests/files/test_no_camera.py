"""Folders as public sets have them, without a camera: the first command gives a picture, and says what it assumed."""

import numpy as np
import pytest
from PIL import Image

import pointshade_gl as ps

RNG = np.random.default_rng(41)


def depth_of(width, height):
    v, u = np.mgrid[:height, :width]
    return 1.5 + 0.5 * u / width + 0.3 * np.sin(v / height * 6)


def picture(path, array):
    path.parent.mkdir(parents=True, exist_ok=True)
    Image.fromarray(array).save(path)


def colors(path, width, height):
    picture(path, RNG.integers(0, 255, (height // 8, width // 8, 3), np.uint8).repeat(8, 0).repeat(8, 1))


# name: how colour and depth are called, their size, how depth is stored, and the focal length that is assumed
KINDS = {
    "rgb_and_depth": ("rgb/0000.png", "depth/0000.png", (640, 480), "mm", 525),
    "rgb_0_and_depth_0": ("rgb_0.png", "depth_0.png", (640, 480), "mm", 525),
    "color_jpg": ("color/1.jpg", "depth/1.png", (640, 480), "mm", 525),
    "image_and_depthmap": ("image.png", "depthmap.png", (512, 424), "mm", 365.5),
    "kinect_2": ("rgb.png", "depth.png", (512, 424), "mm", 365.5),
    "azure": ("color.png", "depth.png", (640, 576), "mm", 504),
    "realsense": ("color.png", "depth.png", (848, 480), "mm", 425),
    "realsense_hd": ("rgb/a_0001.png", "depth/a_0001.png", (1280, 720), "mm", 640),
    "iphone": ("rgb.jpg", "depth.png", (256, 192), "mm", 212),
    "numpy_metres": ("img_0.png", "depth_0.npy", (640, 480), "npy", 525),
    "numpy_of_a_renderer": ("rgb_0001.png", "depth_0001.npy", (512, 512), "npy", 443.41),
    "floats_in_tiff": ("image_01.png", "depth_01.tiff", (320, 320), "tiff", 277.13),
    "exr": ("Image0001.png", "Depth0001.exr", (400, 304), "exr", 346.41),
    "crop_pairs": ("000001-color.png", "000001-depth.png", (176, 144), "mm", 152.42),
    "dotted": ("frame-000001.color.png", "frame-000001.depth.png", (320, 240), "mm", 277.13),
    "of_linemod": ("data/rgb/0000.jpg", "data/depth/0000.png", (640, 480), "mm", 525),
    "capitals": ("RGB/I_1.png", "Depth/z0_1.png", (640, 480), "mm", 525),
    "left_image": ("left_rgb.png", "left_depth.png", (720, 480), "mm", 623.54),
    "hd_colour": ("rgb/0.jpg", "depth/0.png", (1920, 1080), "mm", 1662.77),
    "depth_alone": (None, "depth.png", (640, 480), "mm", 525),
}


@pytest.mark.parametrize("name", KINDS)
def test_a_folder_without_a_camera_gets_the_usual_one(tmp_path, name):
    color, depth, (width, height), form, focal = KINDS[name]
    z = depth_of(width, height)
    path = tmp_path / depth
    path.parent.mkdir(parents=True, exist_ok=True)
    if form == "mm":
        picture(path, np.rint(z * 1000).astype(np.uint16))
    elif form == "npy":
        np.save(path, z.astype(np.float32))
    elif form == "tiff":
        picture(path, z.astype(np.float32))
    else:
        import OpenEXR

        header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
        with OpenEXR.File(header, {"Z": z.astype(np.float32)}) as file:
            file.write(str(path))
    if color:
        colors(tmp_path / color, width, height)
    notes = []
    frame = ps.load_frame(tmp_path, notes=notes.append)
    assert np.abs(frame.depth - z).max() < 0.001, "metres are never scaled by what is assumed"
    assert frame.camera.fx == pytest.approx(focal, rel=1e-3)
    assert frame.color is None if color is None else frame.color.shape == (height, width, 3)
    (told,) = (note for note in notes if note.startswith("no camera is known"))
    assert "pass intrinsics (fx,fy,cx,cy or a file) or fov (vertical degrees)" in told


def test_a_camera_file_that_is_not_understood_is_named(tmp_path):
    picture(tmp_path / "depth.png", np.rint(depth_of(640, 480) * 1000).astype(np.uint16))
    (tmp_path / "camera.txt").write_text("a lens of glass\n")
    notes = []
    assert ps.load_frame(tmp_path, notes=notes.append).camera.fx == 525
    assert any("no camera is known (not understood: camera.txt" in note and "Kinect v1" in note for note in notes)


def test_what_the_caller_says_needs_no_guess(tmp_path):
    picture(tmp_path / "depth.png", np.rint(depth_of(640, 480) * 1000).astype(np.uint16))
    notes = []
    frame = ps.load_frame(tmp_path, intrinsics="600,600,319.5,239.5", depth_scale=1000, notes=notes.append)
    assert frame.camera.fx == 600 and not any("camera is known" in note for note in notes)


def test_arrays_get_a_camera_and_a_note_too():
    notes = []
    frame = ps.load_frame(depth=depth_of(100, 50), notes=notes.append)
    assert frame.camera.fx == pytest.approx(50 / np.tan(np.radians(30))) and len(notes) == 1


@pytest.mark.usefixtures("renderer")
def test_the_first_command_draws_it_and_its_note_leads_to_the_next(typed, tmp_path):
    picture(tmp_path / "set/depth/0.png", np.rint(depth_of(640, 480) * 1000).astype(np.uint16))
    colors(tmp_path / "set/rgb/0.png", 640, 480)
    code, _, errors = typed("render set -o out.png")
    assert code == 0 and (tmp_path / "out.png").is_file()
    assert "(525,525,319.5,239.5); pass --intrinsics (fx,fy,cx,cy or a file) or --fov (vertical degrees)" in errors
    code, _, errors = typed("render set -o out.png --intrinsics 600,600,319.5,239.5")
    assert code == 0 and "no camera" not in errors
