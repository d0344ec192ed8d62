"""Whole captures: trees that are split by what their files hold, and recordings whose metadata know the poses."""

import json

import numpy as np
import pytest
from PIL import Image
from scipy.spatial.transform import Rotation

import pointshade_gl as ps

from ..support.layouts.writing import as_json, exr, pfm, picture
from ..support.painted_room import CAMERA, FOCAL, HEIGHT, WIDTH, millimetres, seen

VIEWS = [seen(0.2 * k) for k in range(3)]
POSES = [np.eye(4) for _ in VIEWS]
for k, pose in enumerate(POSES):
    pose[:3, 3] = (
        np.array([0.98, 0, 0.2]) * 0.2 * k / (0.98**2 + 0.2**2)
    )  # along the far wall, which is seen at a slant
RIGHT = FOCAL, FOCAL, CAMERA["cx"], CAMERA["cy"]
K = f"{FOCAL} 0 {CAMERA['cx']}\n0 {FOCAL} {CAMERA['cy']}\n0 0 1\n"


def opened(source):
    notes = []
    found = ps.open_source(source, notes=notes.append)
    frames = [found] if isinstance(found, ps.Frame) else list(found)
    return frames, notes, getattr(found, "posed", 0)


def check(frames, views, atol=0.00051):
    assert len(frames) == len(views)
    for frame, (color, depth) in zip(frames, views, strict=True):
        np.testing.assert_allclose(frame.depth, depth, atol=atol)
        assert np.corrcoef(frame.color.ravel(), color.ravel())[0, 1] > 0.98
        assert frame.camera.intrinsics == pytest.approx(RIGHT, abs=0.01)


def cityscapes(folder):
    """leftImg8bit/, disparity/, camera/ and gtFine/ at the top, then split and city."""
    baseline, outer = 0.21, {"baseline": 0.21, "pitch": 0.03, "x": 1.7}
    inner = {"fx": FOCAL, "fy": FOCAL, "u0": CAMERA["cx"], "v0": CAMERA["cy"]}
    for k, (color, depth) in enumerate(VIEWS):
        stem = f"train/aachen/aachen_{k:06d}_000019"
        picture(folder / f"leftImg8bit/{stem}_leftImg8bit.png", color)
        picture(folder / f"gtFine/{stem}_gtFine_color.png", 255 - color)
        pixels = np.rint(baseline * FOCAL / depth * 256 + 1).astype(np.uint16)
        picture(folder / f"disparity/{stem}_disparity.png", pixels)
        as_json(folder / f"camera/{stem}_camera.json", {"extrinsic": outer, "intrinsic": inner})


@pytest.mark.parametrize("inside", ["", "disparity", "disparity/train", "disparity/train/aachen"])
def test_cityscapes_from_its_top_down(tmp_path, inside):
    cityscapes(tmp_path)
    frames, notes, _ = opened(tmp_path / inside)
    check(frames, VIEWS, atol=0.005)
    assert not any("no colour" in one for one in notes)


def test_a_file_of_cityscapes_has_the_camera_and_the_colours_of_its_name(tmp_path):
    cityscapes(tmp_path)
    as_json(
        tmp_path / "camera/train/aachen/aachen_000000_000019_camera.json",
        {"extrinsic": {"baseline": 0.4}, "intrinsic": {"fx": 99, "fy": 99, "u0": 160, "v0": 120}},
    )
    frames, _, _ = opened(tmp_path / "disparity/train/aachen/aachen_000002_000019_disparity.png")
    check(frames, VIEWS[2:], atol=0.005)


@pytest.mark.parametrize("inside", ["disparity/TRAIN/A/0000", "disparity/TRAIN/A/0000/left"])
def test_deep_trees_of_clean_pictures(tmp_path, inside):
    """SceneFlow: the colours are called by no word for colours, and the camera lies in a file of its place."""
    for k, (color, depth) in enumerate(VIEWS):
        picture(tmp_path / f"frames_cleanpass/TRAIN/A/0000/left/{k:04d}.png", color)
        pfm(tmp_path / f"disparity/TRAIN/A/0000/left/{k:04d}.pfm", 0.1 * FOCAL / depth)
    (tmp_path / "camera_data/TRAIN/A/0000").mkdir(parents=True)
    (tmp_path / "camera_data/TRAIN/A/0000/intrinsics.txt").write_text(K)
    frames, _, _ = opened(tmp_path / inside)
    assert len(frames) == 3 and all(frame.color is not None for frame in frames)
    assert frames[0].camera.intrinsics == pytest.approx(RIGHT)


def test_what_lies_too_deep_is_not_called_empty(tmp_path):
    pfm(tmp_path / "disparity/TRAIN/A/0000/left/0000.pfm", VIEWS[0][1])
    with pytest.raises(FileNotFoundError, match="look into its folders, more than 3 deep"):
        ps.open_source(tmp_path)


def test_folders_that_are_called_for_depth_twice(tmp_path):
    """Virtual KITTI 2: vkitti_depth/Scene01/clone/frames/depth/Camera_0 beside vkitti_rgb/.../rgb/Camera_0."""
    for k, (color, depth) in enumerate(VIEWS):
        picture(tmp_path / f"vkitti_rgb/Scene01/clone/frames/rgb/Camera_0/rgb_{k:05d}.jpg", color)
        centimetres = np.rint(depth * 100).astype(np.uint16)
        picture(tmp_path / f"vkitti_depth/Scene01/clone/frames/depth/Camera_0/depth_{k:05d}.png", centimetres)
    (tmp_path / "vkitti_textgt/Scene01/clone").mkdir(parents=True)
    rows = [f"{k} 0 {FOCAL} {FOCAL} {CAMERA['cx']} {CAMERA['cy']}" for k in range(3)]
    text = "\n".join(["frame cameraID K[0,0] K[1,1] K[0,2] K[1,2]", *rows])
    (tmp_path / "vkitti_textgt/Scene01/clone/intrinsic.txt").write_text(text)
    frames, _, _ = opened(tmp_path / "vkitti_depth/Scene01/clone/frames/depth/Camera_0")
    check(frames, VIEWS, atol=0.0051)


@pytest.mark.parametrize("inside", ["", "depth/kitchen", "depth/kitchen/0.png"])
def test_scenes_in_trees_of_colours_depth_cameras_and_poses(tmp_path, inside):
    for name in ("intrinsics", "poses"):
        (tmp_path / name).mkdir()
    for place, views in (("kitchen", VIEWS), ("office", VIEWS[::-1])):
        for k, (color, depth) in enumerate(views):
            picture(tmp_path / f"rgb/{place}/{k}.jpg", color)
            picture(tmp_path / f"depth/{place}/{k}.png", millimetres(depth))
        (tmp_path / f"intrinsics/{place}.txt").write_text(K if place == "kitchen" else K.replace("250", "300"))
        np.savetxt(tmp_path / f"poses/{place}.txt", [one.ravel() for one in POSES[:: 1 if place == "kitchen" else -1]])
    frames, _, posed = opened(tmp_path / inside)
    check(frames, VIEWS[: len(frames)])
    if not inside.endswith("png"):
        assert len(frames) == posed == 3
        np.testing.assert_allclose(frames[2].pose, POSES[2], atol=1e-6)


def record3d(folder, form):
    """An export: colours and depth by number, and metadata with poses of ARKit's axes and K by columns."""
    turned = [pose @ np.diag([1.0, -1, -1, 1]) for pose in POSES]
    poses = [[*Rotation.from_matrix(one[:3, :3]).as_quat(), *one[:3, 3]] for one in turned]
    matrix = [FOCAL, 0, 0, 0, FOCAL, 0, CAMERA["cx"] + 0.5, CAMERA["cy"] + 0.5, 1]
    about = {"w": WIDTH, "h": HEIGHT, "dw": WIDTH, "dh": HEIGHT, "fps": 60, "K": matrix, "poses": poses}
    for k, (color, depth) in enumerate(VIEWS):
        picture(folder / f"rgb/{k}.jpg", color)
        if form == "exr":
            exr(folder / f"depth/{k}.exr", R=depth.astype(np.float32))
        else:
            picture(folder / f"depth/{k}.png", millimetres(depth))
    (folder / ("metadata" if form == "png" else "metadata.json")).write_text(json.dumps(about))


@pytest.mark.parametrize("form", ["exr", "png"])
def test_poses_in_the_metadata_of_record3d(tmp_path, form):
    record3d(tmp_path, form)
    frames, notes, posed = opened(tmp_path)
    assert posed == len(frames) == 3 and not any("no colour" in one for one in notes)
    for frame, (color, depth), pose in zip(frames, VIEWS, POSES, strict=True):
        np.testing.assert_allclose(frame.depth, depth, atol=0.00051)
        assert np.corrcoef(frame.color.ravel(), color.ravel())[0, 1] > 0.98
        assert frame.camera.intrinsics == pytest.approx(RIGHT, abs=0.01 if form == "exr" else 0.51)
        np.testing.assert_allclose(frames[0].pose[:3, :3].T @ frame.pose[:3, :3], pose[:3, :3], atol=1e-6)
        np.testing.assert_allclose(
            np.linalg.norm(frame.pose[:3, 3] - frames[0].pose[:3, 3]), np.linalg.norm(pose[:3, 3])
        )


def test_metadata_of_others_hold_no_poses(tmp_path):
    for k, (color, depth) in enumerate(VIEWS):
        picture(tmp_path / f"rgb/{k}.jpg", color)
        picture(tmp_path / f"depth/{k}.png", millimetres(depth))
    as_json(tmp_path / "metadata.json", {"fps": 30, "title": "my kitchen"})
    assert len(opened(tmp_path)[0]) == 3


@pytest.mark.parametrize("source", ["", "frame.npz"])
def test_colours_in_the_same_file_are_not_missed(tmp_path, source):
    color, depth = VIEWS[0]
    np.savez(tmp_path / "frame.npz", depth=depth, image=color, intrinsics=np.array(K.split(), float).reshape(3, 3))
    frames, notes, _ = opened(tmp_path / source)
    check(frames, VIEWS[:1], atol=1e-6)
    assert not any("no colour" in one for one in notes)


@pytest.mark.parametrize("source", ["", "frame.npz"])
def test_a_container_without_colours_says_so(tmp_path, source):
    np.savez(tmp_path / "frame.npz", depth=VIEWS[0][1], intrinsics=np.array(K.split(), float).reshape(3, 3))
    _, notes, _ = opened(tmp_path / source)
    assert any("holds no colours, and none lie beside it" in one for one in notes)
    Image.fromarray(VIEWS[0][0]).save(tmp_path / "frame.png")
    frames, notes, _ = opened(tmp_path / source)
    assert np.array_equal(frames[0].color, VIEWS[0][0]) and not any("no colour" in one for one in notes)


@pytest.mark.parametrize("suffix", [".jp2", ".tif", ".webp"])
def test_colours_of_rarer_formats_are_not_missed(tmp_path, suffix):
    color, depth = VIEWS[0]
    picture(tmp_path / "depth.png", millimetres(depth))
    Image.fromarray(color).save(tmp_path / f"photo{suffix}")
    (tmp_path / "K.txt").write_text(K)
    check(opened(tmp_path)[0], VIEWS[:1])
