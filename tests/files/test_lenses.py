"""Lenses that are no pinholes: the formulas, the files that state them, and the frames that come of them."""

import re

import numpy as np
import pytest
from PIL import Image

import pointshade_gl as ps
from pointshade_gl.files.cameras.camera_files import read_intrinsics
from pointshade_gl.files.cameras.lens_names import COLMAP, find_lens
from pointshade_gl.files.cameras.lenses import Lens, fisheye, pinhole_of, places_of_rays

from ..support import bent_rooms

K = ps.Camera(500, 510, 320, 240, 640, 480)
NARROW = np.array([[0, 0, 1], [0.3, -0.2, 1], [-0.7, 0.4, 1], [0.55, 0.55, 1], [-0.1, -0.6, 1]])
WIDE = np.array([[0, 0, 1], [0.3, -0.2, 1], [-0.7, 0.4, 1], [4, 3, 1], [-1, -6, 1]])
# Where OpenCV 5.0 projects these rays: cv2.projectPoints and cv2.fisheye.projectPoints.
RADTAN = [-0.28, 0.07, 0.0012, -0.0008, 0.011]
RATIONAL = [0.4, 0.1, 0.0005, -0.001, 0.02, 0.7, 0.15, 0.03]
PRISM = [-0.1, 0.02, 0.001, 0.002, 0.003, 0.01, -0.02, 0.004, 0.002, -0.001, 0.003, 0.0015]
FISHEYE = [0.05, -0.012, 0.003, -0.0004]
BY_OPENCV = {
    "plumb_bob": (RADTAN, NARROW, [(320, 240), (464.525075, 141.767149), (21.303444, 414.343678),
                                   (556.009853, 481.34715), (274.588991, -36.783176)]),
    "rational_polynomial": (RATIONAL, NARROW, [(320, 240), (464.346784, 141.833137), (19.224646, 415.285385),
                                               (557.137122, 482.342689), (274.454301, -37.513129)]),
    "brown with a prism": (PRISM, NARROW, [(320, 240), (468.329603, 139.585053), (-8.988763, 434.037249),
                                           (582.593098, 508.311642), (272.513231, -53.869384)]),
    "equidistant": (FISHEYE, WIDE, [(320, 240), (464.802157, 141.534533), (19.324899, 415.25063),
                                    (905.995288, 688.286395), (196.273053, -517.208915)]),
}  # fmt: skip


def refuse(text):
    raise AssertionError(f"an unexpected note: {text}")


def pixels(lens, rays, camera=K):
    x, y, z = np.moveaxis(np.asarray(rays, float), -1, 0)
    return np.stack(camera.pixel_at(*lens.bent(x, y, z), 1), -1)


@pytest.mark.parametrize("model", BY_OPENCV)
def test_a_ray_lands_where_opencv_projects_it(model):
    numbers, rays, want = BY_OPENCV[model]
    found = find_lens({"d": numbers}, {"distortionmodel": model})
    np.testing.assert_allclose(pixels(found, rays), want, atol=1e-5)


@pytest.mark.parametrize("model", ["plumb_bob", "rational_polynomial", "equidistant"])
def test_a_thousand_rays_land_where_opencv_projects_them(model):
    cv2 = pytest.importorskip("cv2")
    numbers, matrix = np.array(BY_OPENCV[model][0]), np.array([[500.0, 0, 320], [0, 510, 240], [0, 0, 1]])
    rays = np.random.default_rng(0).uniform((-0.7, -0.5, 1), (0.7, 0.5, 1.000001), (1000, 3))
    project = cv2.fisheye.projectPoints if model == "equidistant" else cv2.projectPoints
    want = project(rays.reshape(-1, 1, 3), np.zeros(3), np.zeros(3), matrix, numbers)[0].reshape(-1, 2)
    found = find_lens({"d": numbers.tolist()}, {"distortionmodel": model})
    np.testing.assert_allclose(pixels(found, rays), want, atol=1e-6)


CURVES = {
    "brown": Lens("", radial=(-0.28, 0.07, 0.011), tangential=(0.0012, -0.0008)),
    "rational": Lens("", radial=(0.4, 0.1, 0.02), divisor=(0.7, 0.15, 0.03)),
    "prism": Lens("", prism=(0.002, -0.001, 0.003, 0.0015)),
    "fisheye": fisheye(FISHEYE),
    "thin prism fisheye": Lens("", "equidistant", (), (0.01,), (), (0.001, 0.002), (0.003, 0, 0.001, 0)),
    "aria": Lens("", "equidistant", (), (0.01, -0.002), (), (0.001, 0.002), (0.003, 0.001, 0.001, 0), "after"),
    "between": Lens("", radial=(-0.1, 0.02), tangential=(0.001, 0.002), order="between"),
    "inverse": Lens("", radial=(-0.06, 0.07, -0.02), tangential=(0.001, -0.0005), order="inverse"),
    "fov": Lens("", "fov", (0.9,)),
    "division": Lens("", "division", (-0.2,)),
    "sphere": Lens("", "sphere", (1.2,), (-0.1, 0.02)),
    "eucm": Lens("", "eucm", (0.6, 1.1)),
    "double sphere": Lens("", "double sphere", (-0.2, 0.6)),
}


@pytest.mark.parametrize("name", CURVES)
def test_the_ray_of_a_place_is_that_which_lands_there(name):
    lens, random = CURVES[name], np.random.default_rng(1)
    rays = random.uniform((-0.7, -0.5, 1), (0.7, 0.5, 1.000001), (500, 3))
    rays /= np.linalg.norm(rays, axis=1, keepdims=True)
    back = np.stack(lens.ray_of(*lens.bent(*rays.T)), -1)
    np.testing.assert_allclose(back, rays, atol=0.01 / 500 / 10)  # a tenth of a hundredth of a pixel


def test_the_inverse_model_leads_from_the_picture_to_the_ray():
    """RealSense: ux = x f + 2 p1 x y + p2 (r2 + 2 x x) of a place x in the picture is the ray."""
    k1, k2, p1, p2, k3 = -0.06, 0.07, 0.001, -0.0005, -0.02
    lens = find_lens({"coeffs": [k1, k2, p1, p2, k3]}, {"model": "distortion.inverse_brown_conrady"})
    x, y = 0.4, -0.3
    r2 = x * x + y * y
    f = 1 + k1 * r2 + k2 * r2**2 + k3 * r2**3
    ray = x * f + 2 * p1 * x * y + p2 * (r2 + 2 * x * x), y * f + 2 * p2 * x * y + p1 * (r2 + 2 * y * y), 1.0
    np.testing.assert_allclose(lens.bent(*ray), (x, y), atol=1e-8)


@pytest.mark.parametrize("clockwise", [True, False])
def test_the_lens_of_a_turned_picture_is_turned(clockwise):
    lens = Lens("", radial=(0.1,), tangential=(0.01, 0.02), prism=(0.001, 0.002, 0.003, 0.004))
    x, y = lens.bent(0.3, -0.2, 1.0)
    turned = lens.turned(clockwise).bent(*((0.2, 0.3, 1.0) if clockwise else (-0.2, -0.3, 1.0)))
    np.testing.assert_allclose(turned, (-y, x) if clockwise else (y, -x), atol=1e-12)


def test_beyond_where_a_polynomial_folds_nothing_is_shown():
    lens = Lens("", radial=(-0.5,))  # r (1 - r^2 / 2) rises up to r^2 = 2/3
    assert np.tan(lens.reach) == pytest.approx((2 / 3) ** 0.5, abs=1e-3)
    assert np.isnan(lens.bent(1.2, 0.0, 1.0)).all()


# --- what files state -------------------------------------------------------------------------------------------------

SIX = [[0, 0, 1], [0.3, -0.2, 1], [-0.5, 0.4, 1], [0.45, 0.45, 1], [-0.1, -0.5, 1], [0.6, 0, 1]]
BROWN = find_lens({"d": RADTAN}, {})
KB = fisheye(FISHEYE)
NAMED = dict(zip(("k1", "k2", "p1", "p2", "k3"), RADTAN, strict=True))
FOUR = dict(zip(("k1", "k2", "k3", "k4"), FISHEYE, strict=True))
PLAIN = {"fx": 500, "fy": 510, "cx": 320, "cy": 240, "width": 640, "height": 480}
CORNER = {"fl_x": 500, "fl_y": 510, "cx": 320.5, "cy": 240.5, "w": 640, "h": 480}
MATRIX = "[500.0, 0.0, 320.0, 0.0, 510.0, 240.0, 0.0, 0.0, 1.0]"


def ros(model, numbers):
    return (
        "image_width: 640\nimage_height: 480\ncamera_name: left\n"
        f"camera_matrix:\n  rows: 3\n  cols: 3\n  data: {MATRIX}\n"
        f"distortion_model: {model}\ndistortion_coefficients:\n  rows: 1\n  cols: {len(numbers)}\n  data: {numbers}\n"
    )


def kalibr(camera, model, numbers, intrinsics=(500, 510, 320, 240)):
    return (
        f"cam0:\n  cam_overlaps: [1]\n  camera_model: {camera}\n  distortion_coeffs: {list(numbers)}\n"
        f"  distortion_model: {model}\n  intrinsics: {list(intrinsics)}\n  resolution: [640, 480]\n"
    )


def realsense(model, numbers):
    own = {"width": 640, "height": 480, "fx": 500, "fy": 510, "ppx": 320, "ppy": 240}
    return {"color": {"intrinsics": {**own, "model": model, "coeffs": [*numbers, 0, 0][:5]}}}


PINHOLE = "projection_parameters:\n   fx: 500\n   fy: 510\n   cx: 320\n   cy: 240\n"
FILES = {
    "ros 1": ("camera.yaml", ros("plumb_bob", RADTAN), BROWN),
    "ros fisheye": ("camera.yaml", ros("equidistant", FISHEYE), KB),
    "ros rational": ("camera.yaml", ros("rational_polynomial", RATIONAL), find_lens({"d": RATIONAL}, {})),
    "ros 2": (
        "camera_info.yaml",
        "height: 480\nwidth: 640\ndistortion_model: plumb_bob\nd:\n"
        + "".join(f"- {one}\n" for one in RADTAN)
        + "k:\n- 500.0\n- 0.0\n- 320.0\n- 0.0\n- 510.0\n- 240.0\n- 0.0\n- 0.0\n- 1.0\n",
        BROWN,
    ),
    "opencv": (
        "calibration.yml",
        "%YAML:1.0\n---\nimage_width: 640\nimage_height: 480\n"
        f"camera_matrix: !!opencv-matrix\n   rows: 3\n   cols: 3\n   dt: d\n   data: {MATRIX}\n"
        "distortion_coefficients: !!opencv-matrix\n   rows: 5\n   cols: 1\n   dt: d\n   data: [ -2.8e-01, 7.0e-02,\n"
        "       1.2e-03, -8.0e-04, 1.1e-02 ]\n",
        BROWN,
    ),
    "opencv fisheye": (
        "calibration.yml",
        f"%YAML:1.0\n---\nfisheye_model: 1\ncamera_matrix: !!opencv-matrix\n   rows: 3\n   cols: 3\n   data: {MATRIX}\n"
        f"distortion_coefficients: !!opencv-matrix\n   rows: 4\n   cols: 1\n   data: {FISHEYE}\n",
        KB,
    ),
    "orb-slam": (
        "TUM1.yaml",
        'Camera.type: "PinHole"\nCamera.fx: 500\nCamera.fy: 510\nCamera.cx: 320\nCamera.cy: 240\n'
        + "".join(f"Camera.{name}: {value}\n" for name, value in NAMED.items()),
        BROWN,
    ),
    "orb-slam 3": (
        "TUM_512.yaml",
        'Camera.type: "KannalaBrandt8"\nCamera1.fx: 500\nCamera1.fy: 510\nCamera1.cx: 320\nCamera1.cy: 240\n'
        + "".join(f"Camera1.{name}: {value}\n" for name, value in FOUR.items()),
        KB,
    ),
    "camodocal": (
        "cam0.yaml",
        "model_type: PINHOLE\nimage_width: 640\nimage_height: 480\ndistortion_parameters:\n"
        + "".join(f"   {name}: {value}\n" for name, value in NAMED.items())
        + PINHOLE,
        BROWN,
    ),
    "camodocal fisheye": (
        "cam0.yaml",
        "model_type: KANNALA_BRANDT\nimage_width: 640\nimage_height: 480\nprojection_parameters:\n"
        + "".join(f"   k{k + 2}: {value}\n" for k, value in enumerate(FISHEYE))
        + "   mu: 500\n   mv: 510\n   u0: 320\n   v0: 240\n",
        KB,
    ),
    "kitti-360": (
        "image_02.yaml",
        "model_type: MEI\nimage_width: 640\nimage_height: 480\nmirror_parameters:\n   xi: 1.2\ndistortion_parameters:\n"
        "   k1: -0.1\n   k2: 0.02\n   p1: 0\n   p2: 0\nprojection_parameters:\n   gamma1: 500\n   gamma2: 510\n"
        "   u0: 320\n   v0: 240\n",
        CURVES["sphere"],
    ),
    "kalibr": ("camchain.yaml", kalibr("pinhole", "radtan", RADTAN[:4]), find_lens({"d": RADTAN[:4]}, {})),
    "kalibr fisheye": ("camchain.yaml", kalibr("pinhole", "equidistant", FISHEYE), KB),
    "kalibr fov": ("camchain.yaml", kalibr("pinhole", "fov", [0.9]), CURVES["fov"]),
    "kalibr omni": (
        "camchain.yaml", kalibr("omni", "radtan", [-0.1, 0.02, 0, 0], (1.2, 500, 510, 320, 240)), CURVES["sphere"],
    ),
    "kalibr ds": ("camchain.yaml", kalibr("ds", "none", [], (-0.2, 0.6, 500, 510, 320, 240)), CURVES["double sphere"]),
    "kalibr eucm": ("camchain.yaml", kalibr("eucm", "none", [], (0.6, 1.1, 500, 510, 320, 240)), CURVES["eucm"]),
    "realsense": ("camera.json", realsense("distortion.brown_conrady", RADTAN), BROWN),
    "realsense fisheye": ("camera.json", realsense("distortion.kannala_brandt4", FISHEYE), KB),
    "realsense modified": (
        "camera.json", realsense("Modified Brown Conrady", [-0.1, 0.02, 0.001, 0.002]), CURVES["between"],
    ),
    "realsense inverse": (
        "camera.json", realsense("distortion.inverse_brown_conrady", [-0.06, 0.07, 0.001, -0.0005, -0.02]),
        CURVES["inverse"],
    ),
    "pyrealsense": (
        "camera.txt", "[ 640x480  p[320 240]  f[500 510]  Brown Conrady [-0.28 0.07 0.0012 -0.0008 0.011] ]", BROWN,
    ),
    "json": ("camera.json", PLAIN | {"model": "Brown Conrady", "coeffs": RADTAN}, BROWN),
    "json names": ("camera.json", PLAIN | NAMED, BROWN),
    "json nested": ("camera.json", {"camera": PLAIN | {"distortion": NAMED}}, BROWN),
    "json fisheye": ("camera.json", PLAIN | {"camera_model": "fisheye", "D": [[one] for one in FISHEYE]}, KB),
    "nerfies": (
        "camera.json",
        {"focal_length": 500, "pixel_aspect_ratio": 1.02, "principal_point": [320.5, 240.5], "image_size": [640, 480],
         "radial_distortion": [-0.28, 0.07, 0.011], "tangential_distortion": [0.0012, -0.0008]},
        BROWN,
    ),
    "transforms.json": ("transforms.json", CORNER | NAMED | {"camera_model": "OPENCV"}, BROWN),
    "transforms.json fisheye": ("transforms.json", CORNER | FOUR | {"camera_model": "OPENCV_FISHEYE"}, KB),
    "instant-ngp fisheye": ("transforms.json", CORNER | FOUR | {"is_fisheye": True}, KB),
    "matterport": ("intrinsics.txt", f"640 480 500 510 320 240 {' '.join(map(str, RADTAN))}", BROWN),
}  # fmt: skip


def colmap_numbers(order):
    """Numbers for a model's parameters, which no two share."""
    given = {"fx": 500, "fy": 510, "f": 500, "cx": 320.5, "cy": 240.5, "w": 640, "h": 480, "omega": 0.9}
    own = {"alpha": 0.6, "beta": 1.1, "p1": 0.001, "p2": 0.002, "p0": 0.003, "k1": -0.02, "k2": 0.003, "k3": 0.001}
    return [given.get(name, own.get(name, 0.0005)) for name in order]


@pytest.mark.parametrize("name", FILES)
def test_a_file_states_the_lens_by_its_programs_names(tmp_path, name):
    file, content, lens = FILES[name]
    folder = bent_rooms.put(tmp_path, np.ones((2, 2)))
    (folder / file).write_text(content if isinstance(content, str) else bent_rooms.json.dumps(content))
    found = read_intrinsics(folder / file, refuse)
    assert found.numbers == pytest.approx((500, 510, 320, 240))
    np.testing.assert_allclose(pixels(found.lens, SIX), pixels(lens, SIX), atol=1e-6)


@pytest.mark.parametrize("model", range(17), ids=lambda k: COLMAP[k][0])
def test_colmaps_text_and_binary_state_each_model_alike(tmp_path, model):
    name, order = COLMAP[model]
    numbers = colmap_numbers(order)
    (tmp_path / "cameras.txt").write_text(f"# cameras\n1 {name} 640 480 {' '.join(map(str, numbers))}\n")
    (tmp_path / "cameras.bin").write_bytes(bent_rooms.colmap_binary(model, numbers, (640, 480)))
    text, binary = (read_intrinsics(tmp_path / f"cameras.{suffix}", refuse) for suffix in ("txt", "bin"))
    assert text.numbers == binary.numbers == (500, 510 if "fy" in order else 500, 320, 240)
    assert text.lens == binary.lens
    assert (text.lens is None) == (name in ("SIMPLE_PINHOLE", "PINHOLE"))


def test_colmaps_fisheye_with_a_prism_is_as_its_source_says(tmp_path):
    """THIN_PRISM_FISHEYE: (u, v) is the ray by its angle; du = u (k1 r2 + ...) + 2 p1 u v + p2 (r2 + 2 u u) + sx r2."""
    numbers = [500, 510, 320.5, 240.5, 0.01, -0.002, 0.001, 0.002, 0.0003, -0.0001, 0.003, 0.0015]
    (tmp_path / "cameras.txt").write_text(f"1 THIN_PRISM_FISHEYE 640 480 {' '.join(map(str, numbers))}\n")
    lens = read_intrinsics(tmp_path / "cameras.txt", refuse).lens
    k1, k2, p1, p2, k3, k4, sx, sy = numbers[4:]
    x, y = 0.9, -0.7
    u, v = (part * np.arctan(np.hypot(x, y)) / np.hypot(x, y) for part in (x, y))
    r2 = u * u + v * v
    radial = k1 * r2 + k2 * r2**2 + k3 * r2**3 + k4 * r2**4
    want = (
        u + u * radial + 2 * p1 * u * v + p2 * (r2 + 2 * u * u) + sx * r2,
        v + v * radial + 2 * p2 * u * v + p1 * (r2 + 2 * v * v) + sy * r2,
    )
    np.testing.assert_allclose(lens.bent(x, y, 1.0), want, atol=1e-12)


def test_a_frame_of_transforms_json_has_a_lens_of_its_own(tmp_path):
    frames = [
        {"file_path": "color/0.png", "depth_file_path": "depth/0.npy", "transform_matrix": np.eye(4).tolist()} | own
        for own in (CORNER | {"k1": -0.2}, CORNER | {"k1": -0.1})
    ]
    from pointshade_gl.files.cameras.camera_files import read_transforms

    (tmp_path / "transforms.json").write_text(bent_rooms.json.dumps({"camera_model": "OPENCV", "frames": frames}))
    assert [one.camera.lens.radial[0] for one in read_transforms(tmp_path / "transforms.json")] == [-0.2, -0.1]


@pytest.mark.parametrize(
    ("file", "content"),
    [
        ("camera.yaml", ros("plumb_bob", [0.0] * 5)),
        ("camera.json", realsense("distortion.inverse_brown_conrady", [0.0] * 5)),
        ("transforms.json", CORNER | {"camera_model": "OPENCV", "k1": 0.0, "p2": 0.0}),
        ("camchain.yaml", kalibr("pinhole", "none", [])),
        ("camera.json", PLAIN | {"model": "Azure Kinect", "type": "depth"}),
    ],
)
def test_numbers_that_are_all_zero_are_no_lens(tmp_path, file, content):
    (tmp_path / file).write_text(content if isinstance(content, str) else bent_rooms.json.dumps(content))
    assert read_intrinsics(tmp_path / file, refuse).lens is None


# --- frames -----------------------------------------------------------------------------------------------------------

SMALL = ps.Camera(262.5, 262.5, 159.5, 119.5, 320, 240)
ROUND = ps.Camera(154, 154, 255.5, 255.5, 512, 512)  # a fisheye of 190 degrees


def said(camera):
    return dict(zip(("fx", "fy", "cx", "cy"), camera.intrinsics, strict=True)) | {
        "width": camera.width, "height": camera.height,
    }  # fmt: skip


INPUTS = {
    "barrel": (SMALL, {"model": "Brown Conrady", "coeffs": [-0.33, 0.12, 0, 0, 0]}, "z"),
    "pincushion": (SMALL, {"k1": 0.25, "k2": -0.03}, "z"),
    "tangential": (SMALL, {"dist_coeffs": [-0.1, 0.02, 0.004, -0.006]}, "z"),
    "rational": (SMALL, {"D": RATIONAL}, "z"),
    "prism": (SMALL, {"distortion": PRISM}, "z"),
    "rays": (SMALL, {"k1": -0.3, "k2": 0.1, "depth_kind": "ray"}, "ray"),
    "rays that nothing names": (SMALL, {"k1": -0.3, "k2": 0.1}, "ray"),
    "inverse model": (SMALL, {"model": "Inverse Brown Conrady", "coeffs": [0.3, 0.1, 0.002, 0.001, 0]}, "z"),
    "fov": (SMALL, {"distortion_model": "fov", "distortion_coeffs": [0.9]}, "z"),
    "fisheye": (ROUND, {"camera_model": "OPENCV_FISHEYE", "k1": 0.01, "k2": -0.002}, "z"),
    "fisheye with rays": (ROUND, {"camera_model": "OPENCV_FISHEYE", "k1": 0.01, "depth_kind": "ray"}, "ray"),
    "equidistant": (ROUND, {"camera_model": "equidistant"}, "z"),
    "double sphere": (
        ps.Camera(90, 90, 127.5, 127.5, 256, 256), {"camera_type": "ds", "xi": -0.2, "alpha": 0.6}, "z",
    ),
}  # fmt: skip


def made(folder, name, dtype=None):
    camera, lens, kind = INPUTS[name]
    path = folder / "camera.json"
    bent_rooms.put(folder, np.ones((1, 1)), None, camera_json=said(camera) | lens)
    z, distance, color = bent_rooms.seen_by(read_intrinsics(path, refuse).lens, camera)
    depth = z if kind == "z" else distance
    if dtype is not None:
        (folder / "depth.npy").unlink()
        Image.fromarray(np.round(depth * 1000).astype(dtype)).save(folder / "depth.png")
        Image.fromarray(color).save(folder / "color.png")
        return folder
    return bent_rooms.put(folder, depth, color)


@pytest.mark.parametrize("name", INPUTS)
def test_a_bent_frame_becomes_that_of_a_pinhole(tmp_path, name):
    notes = []
    frame = ps.load_frame(made(tmp_path, name), notes=notes.append)
    assert frame.camera != INPUTS[name][0]
    assert (frame.depth > 0).mean() > 0.6
    bent_rooms.check_frame(frame)
    (told,) = [note for note in notes if "has a lens" in note]
    assert re.search(r"pinhole, \d+x\d+, and keep (all )?\d+ x \d+ (of \d+ x \d+ )?degrees; pass projection=", told)


def test_millimetres_of_16_bits_are_as_right(tmp_path):
    bent_rooms.check_frame(ps.load_frame(made(tmp_path, "fisheye with rays", np.uint16), notes=lambda _: None))


def test_a_fisheye_keeps_120_degrees_and_says_so(tmp_path):
    notes = []
    frame = ps.load_frame(made(tmp_path, "equidistant"), notes=notes.append)
    assert any("keep 120 x 120 of 190 x 190 degrees" in note for note in notes)
    assert frame.camera.fx == pytest.approx(154)  # as fine as the fisheye in the middle
    assert frame.camera.width == pytest.approx(2 * 154 * 3**0.5, abs=1)


def test_a_mild_lens_keeps_all(tmp_path):
    notes = []
    ps.load_frame(made(tmp_path, "barrel"), notes=notes.append)
    assert any("keep all 70 x 53 degrees" in note for note in notes)


def test_larger_colours_are_straightened_at_their_own_size(tmp_path):
    folder = made(tmp_path, "barrel")
    lens = read_intrinsics(folder / "camera.json", refuse).lens
    _, _, color = bent_rooms.seen_by(lens, SMALL.resized(640, 480))
    Image.fromarray(color).save(folder / "color.png")
    frame = ps.load_frame(folder, notes=lambda _: None)
    height, width = frame.color.shape[:2]
    assert (width, height) == (2 * frame.camera.width, 2 * frame.camera.height)
    rays = frame.camera.resized(width, height).rays()
    _, want = bent_rooms.trace(rays / np.linalg.norm(rays, axis=-1, keepdims=True))
    seen = frame.color.any(axis=-1)
    assert (abs(frame.color.astype(int) - want)[seen] > 3).mean() < 0.01


def test_edges_are_not_mixed(tmp_path):
    """Depth comes from the nearest pixel: between near and far planes nothing new appears."""
    depth = np.array([1.0, 3.0, 1.5, 2.5])[np.arange(320)[None] // 16 % 4] * np.ones((240, 1))
    folder = bent_rooms.put(tmp_path, depth, None, camera_json=said(SMALL) | {"k1": -0.3, "k2": 0.1})
    frame = ps.load_frame(folder, projection="lens", notes=lambda _: None)
    known = frame.depth[frame.depth > 0]
    assert {round(float(one), 4) for one in known} == {1.0, 1.5, 2.5, 3.0}


def test_what_a_mask_hides_stays_missing(tmp_path):
    folder = made(tmp_path, "barrel")
    depth = np.ma.masked_array(np.load(folder / "depth.npy"))
    depth[100:140, 140:180] = np.ma.masked
    frame = ps.load_frame(depth=depth, intrinsics=folder / "camera.json", notes=lambda _: None)
    assert frame.depth[150, 200] == 0 and frame.depth[150, 100] > 0


def test_pictures_that_are_straight_already_stay_to_the_bit(tmp_path):
    """A file of a lens beside pictures that were undistorted: planes tell it."""
    z, _, color = bent_rooms.seen_by(Lens(""), SMALL)
    folder = bent_rooms.put(tmp_path, z, color, camera_json=said(SMALL) | {"k1": -0.3, "k2": 0.1})
    notes = []
    frame = ps.load_frame(folder, notes=notes.append)
    assert any("planes in the depth are flat only without it" in note and "projection='lens'" in note for note in notes)
    assert np.array_equal(frame.depth, z.astype(np.float32)) and np.array_equal(frame.color, color)
    forced = ps.load_frame(folder, projection="lens", notes=lambda _: None)
    assert forced.depth.shape != z.shape


def test_a_lens_of_zeros_changes_nothing(tmp_path):
    z, _, color = bent_rooms.seen_by(Lens(""), SMALL)
    bent_rooms.put(tmp_path / "a", z, color, camera_json=said(SMALL))
    bent_rooms.put(tmp_path / "b", z, color, camera_json=said(SMALL) | {"model": "Brown Conrady", "coeffs": [0.0] * 5})
    a, b = (ps.load_frame(tmp_path / name, notes=lambda _: None) for name in "ab")
    assert a.camera == b.camera and np.array_equal(a.depth, b.depth) and np.array_equal(a.color, b.color)


def test_frames_of_a_sequence_are_straightened_alike(tmp_path):
    folder = made(tmp_path / "one", "barrel")
    depth, color = np.load(folder / "depth.npy"), np.asarray(Image.open(folder / "color.png"))
    for k in range(3):
        for part in ("depth", "color"):
            (tmp_path / "many" / part).mkdir(parents=True, exist_ok=True)
        np.save(tmp_path / f"many/depth/{k}.npy", depth)
        Image.fromarray(color).save(tmp_path / f"many/color/{k}.png")
    (tmp_path / "many/camera.json").write_text((folder / "camera.json").read_text())
    notes = []
    frames = list(ps.open_source(tmp_path / "many", notes=notes.append))
    assert len({frame.camera for frame in frames}) == 1
    for frame in frames:
        bent_rooms.check_frame(frame)
    assert sum("has a lens" in note for note in notes) == 1


def test_pinhole_takes_the_pictures_as_they_are(tmp_path):
    frame = ps.load_frame(made(tmp_path, "barrel"), projection="pinhole", notes=lambda _: None)
    assert frame.camera == SMALL


def test_fisheye_takes_four_numbers_as_kannala_and_brandts(tmp_path):
    """A bare list of four may be either: OpenCV's D of a fisheye looks like k1 k2 p1 p2."""
    numbers = [0.01, -0.002, 0.0004, -0.0001]
    z, _, color = bent_rooms.seen_by(fisheye(numbers), ROUND)
    folder = bent_rooms.put(tmp_path, z, color, camera_json=said(ROUND) | {"D": numbers})
    bent_rooms.check_frame(ps.load_frame(folder, projection="fisheye", notes=lambda _: None))


def test_the_field_of_view_of_a_fisheye_may_be_over_180_degrees(tmp_path):
    camera = ps.Camera(512 / np.radians(190), 512 / np.radians(190), 255.5, 255.5, 512, 512)
    z, _, color = bent_rooms.seen_by(fisheye(()), camera)
    folder = bent_rooms.put(tmp_path, z, color)
    bent_rooms.check_frame(ps.load_frame(folder, projection="fisheye", fov=190, notes=lambda _: None))


@pytest.mark.parametrize(
    ("lens", "sentence"),
    [
        ({"camera_model": "ocam", "k1": 0.1}, "a camera model that is not known here, ocam: bring the pictures"),
        ({"projection": "Orthographic"}, "a camera model that is not known here, Orthographic"),
        ({"distortion_model": "woolly", "k1": 0.1}, "not known here, woolly"),
        ({"dist_coeffs": [0.1] * 14}, "not known here, a tilted sensor"),
        ({"k1": -1e9}, r"camera\.json: the lens .* shows no part of its picture: are its numbers right\?"),
        ({"camera_model": "equirectangular"}, "its depth is 320x240"),
    ],
)
def test_what_cannot_be_brought_to_a_pinhole_is_refused(tmp_path, lens, sentence):
    folder = bent_rooms.put(tmp_path, np.ones((240, 320)) + np.arange(320) / 99, None, camera_json=said(SMALL) | lens)
    with pytest.raises(ValueError, match=sentence):
        ps.load_frame(folder, notes=lambda _: None)
    assert ps.load_frame(folder, projection="pinhole", notes=lambda _: None).camera == SMALL


def test_a_fisheye_without_a_camera_is_refused(tmp_path):
    folder = bent_rooms.put(tmp_path, np.ones((24, 32)) + np.arange(32))
    with pytest.raises(ValueError, match="a fisheye needs its camera: pass intrinsics=FILE or fov=DEG"):
        ps.load_frame(folder, projection="fisheye", notes=lambda _: None)


def test_the_places_of_rays_are_right_to_a_hundredth_of_a_pixel():
    camera = pinhole_of(KB, ROUND)
    columns, rows = places_of_rays(KB, ROUND, camera)
    rays = camera.rays()
    u, v = np.moveaxis(pixels(KB, rays, ROUND), -1, 0)
    known = np.isfinite(columns)
    assert abs(columns - u)[known].max() < 0.01 and abs(rows - v)[known].max() < 0.01


BENT = Lens("Brown-Conrady", radial=(-0.1, 0.02, 0))
BENT_FILE = {"fx": 262.5, "fy": 262.5, "cx": 159.5, "cy": 119.5, "width": 320, "height": 240, "k1": -0.1, "k2": 0.02}


@pytest.fixture(scope="module")
def bent():
    """z and colours that the lens shows."""
    z, _, color = bent_rooms.seen_by(BENT, ps.Camera(262.5, 262.5, 159.5, 119.5, 320, 240))
    return z, color


def test_a_depth_buffer_of_a_lens_is_read_before_the_lens_is_taken_out(tmp_path, bent):
    z, color = bent
    planes = {"near": 0.1, "far": 100.0}
    folder = bent_rooms.put(tmp_path, 100 / 99.9 * (1 - 0.1 / z), color, camera_json=BENT_FILE | planes)
    for options in ({}, {"depth_kind": "buffer"}):
        bent_rooms.check_frame(ps.load_frame(folder, notes=lambda _: None, **options), 0.01)


def test_mirrored_colours_are_seen_through_a_lens(tmp_path, bent):
    """The edges are compared as the lens shows them: what is straightened need not fit."""
    z, color = bent
    notes = []
    ps.load_frame(bent_rooms.put(tmp_path, z, color[:, ::-1], camera_json=BENT_FILE), notes=notes.append)
    assert any("look mirrored left to right" in note for note in notes)


def test_colours_that_exif_turns_are_taken_as_stored_through_a_lens(tmp_path, bent):
    z, color = bent
    folder, exif, notes = bent_rooms.put(tmp_path, z, camera_json=BENT_FILE), Image.Exif(), []
    exif[0x112] = 3
    Image.fromarray(color).save(folder / "color.jpg", quality=98, subsampling=0, exif=exif)
    frame = ps.load_frame(folder, notes=notes.append)
    bent_rooms.check_frame(frame, 0.01)
    assert any("taken as they are stored" in note for note in notes)
