"""Files of networks: depth, camera, pose, mask and colour come out as the network meant them."""

import struct
import sys
import zipfile
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from PIL import Image

from pointshade_gl.files.containers.opening import open_container

from ..support.known_arrays import CAMERA, H, W, colors, matrix, points_of, pose, wavy


@pytest.fixture
def load(tmp_path):
    """load(name=array, ...): the frames of an .npz file of these arrays, and the notes."""

    def call(packed=True, **arrays):
        path = tmp_path / "output.npz"
        (np.savez_compressed if packed else np.savez)(path, **arrays)
        notes = []
        return open_container(path, notes.append), notes

    return call


class TestNetworks:
    def test_vggt(self, load):
        """Several frames, world-to-camera of 3x4, floats of (n, 3, h, w), confidence from 1."""
        depth, poses, seen = np.stack([wavy(), wavy(shift=1)]), [pose(), pose(-0.4)], colors(2)
        conf = np.full((2, H, W), 9.0, np.float32)
        conf[1, :6] = 1.0
        frames, notes = load(
            depth=depth[..., None],
            depth_conf=conf,
            extrinsic=np.stack([np.linalg.inv(p)[:3] for p in poses]),
            intrinsic=np.stack([matrix(), matrix((60, 60, 31, 23))]),
            images=(seen / 255).transpose(0, 3, 1, 2).astype(np.float32),
            world_points=np.zeros((2, H, W, 3), np.float32),
            pose_enc=np.zeros((2, 9)),
        )
        assert len(frames) == 2 and notes == []
        for k, frame in enumerate(frames):
            np.testing.assert_array_equal(frame.depth, depth[k])
            np.testing.assert_allclose(frame.pose, poses[k], atol=1e-12)
            np.testing.assert_array_equal(frame.color, seen[k])
        assert frames[0].intrinsics.numbers == CAMERA and frames[1].intrinsics.numbers == (60, 60, 31, 23)
        assert frames[0].intrinsics.size == (W, H)
        assert frames[0].valid.all() and not frames[1].valid[:6].any() and frames[1].valid[6:].all()
        assert len(notes) == 1 and notes[0].endswith("output.npz: 12% of the depth is of low confidence and left out")

    @pytest.mark.parametrize("packed", [True, False])
    def test_depth_anything_3(self, load, packed):
        depth, seen = np.stack([wavy(), wavy(), wavy(shift=1)]), colors(3)
        frames, _ = load(
            packed,
            depth=depth,
            conf=np.full((3, H, W), 1.5),
            extrinsics=np.stack([np.linalg.inv(pose(k / 5))[:3] for k in range(3)]),
            intrinsics=np.stack([matrix()] * 3),
            image=seen,
        )
        for k in (2, 0, 1):  # forwards and back in the packed stream
            np.testing.assert_array_equal(frames[k].depth, depth[k])
            np.testing.assert_allclose(frames[k].pose, pose(k / 5), atol=1e-12)
            np.testing.assert_array_equal(frames[k].color, seen[k])
        assert len(frames[:2]) == 2 and frames[-1].depth[0, 0] == depth[2, 0, 0]

    def test_moge(self, load):
        """Normalised intrinsics, infinite depth outside the mask, normals with OpenCV's axes."""
        depth, mask = wavy(), np.ones((H, W), bool)
        mask[:5] = False
        fx, fy, cx, cy = CAMERA
        normalised = np.array([[fx / W, 0, (cx + 0.5) / W], [0, fy / H, (cy + 0.5) / H], [0, 0, 1]], np.float32)
        normal = np.zeros((H, W, 3), np.float32)
        normal[..., 2] = -1
        frames, notes = load(
            points=points_of(depth),
            depth=np.where(mask, depth, np.inf),
            mask=mask,
            intrinsics=normalised,
            normal=normal,
        )
        (frame,) = frames
        np.testing.assert_array_equal(frame.depth[5:], depth[5:])
        np.testing.assert_array_equal(frame.valid, mask)
        np.testing.assert_allclose(frame.intrinsics.numbers, CAMERA, rtol=1e-6)
        np.testing.assert_array_equal(frame.normals, normal)
        assert notes == []

    def test_normals_in_other_axes_are_turned_and_said(self, load):
        depth = wavy()
        right, down = np.diff(points_of(depth), axis=1)[:-1], np.diff(points_of(depth), axis=0)[:, :-1]
        truth = np.cross(down, right)
        truth /= np.linalg.norm(truth, axis=2, keepdims=True)
        truth = np.pad(truth, ((0, 1), (0, 1), (0, 0)), mode="edge").astype(np.float32)
        assert (truth[..., 2] < 0).all()  # towards the camera
        for axes, said in (
            ((1, -1, -1), "with OpenGL's axes"),
            ((-1, -1, -1), "away from the camera"),
            ((1, 1, 1), ""),
        ):
            frames, notes = load(depth=depth, intrinsics=matrix(), normals=truth * np.array(axes, np.float32))
            np.testing.assert_allclose(frames[0].normals, truth, atol=1e-6)
            assert len(notes) == bool(said) and all(said in note for note in notes)

    def test_depth_pro_has_its_principal_point_in_the_middle(self, load):
        frames, _ = load(depth=wavy(), focallength_px=np.float32(55))
        assert frames[0].intrinsics.numbers == (55, 55, (W - 1) / 2, (H - 1) / 2)
        assert frames[0].intrinsics.size == (W, H) and frames[0].color is None and frames[0].valid is None

    def test_unidepth(self, load):
        """Axes of length 1 before, channels first."""
        depth = wavy()
        frames, _ = load(
            depth=depth[None, None],
            points=points_of(depth).transpose(2, 0, 1)[None],
            intrinsics=matrix()[None],
            rgb=colors(1).transpose(0, 3, 1, 2),
        )
        np.testing.assert_array_equal(frames[0].depth, depth)
        np.testing.assert_array_equal(frames[0].color, colors(1)[0])
        assert frames[0].intrinsics.numbers == CAMERA

    def test_dust3r_has_points_in_the_world(self, load):
        depth, poses = np.stack([wavy(), wavy(shift=1)]), np.stack([pose(), pose(-0.4, (0, 0, 1))])
        world = [points_of(d) @ p[:3, :3].T + p[:3, 3] for d, p in zip(depth, poses, strict=True)]
        frames, _ = load(
            pts3d=np.stack(world).astype(np.float32), poses=poses, imgs=colors(2) / 255.0, conf=np.full((2, H, W), 3.0)
        )
        for k in range(2):
            np.testing.assert_allclose(frames[k].depth, depth[k], rtol=1e-5)
            np.testing.assert_allclose(frames[k].intrinsics.numbers, CAMERA, rtol=1e-4)
            np.testing.assert_array_equal(frames[k].pose, poses[k])

    def test_dust3r_with_depth_focals_and_principal_points(self, load):
        depth = np.stack([wavy(), wavy()])
        centers = np.array([[31, 23], [32, 24.0]])
        frames, _ = load(depth=depth, focals=np.array([[50], [60.0]]), pp=centers, poses=np.stack([np.eye(4), pose()]))
        assert frames[1].intrinsics.numbers == (60, 60, 32, 24) and frames[0].intrinsics.numbers == (50, 50, 31, 23)

    def test_points_alone_give_the_camera(self, load, tmp_path):
        np.save(tmp_path / "points.npy", points_of(wavy()))
        frame = open_container(tmp_path / "points.npy", print)[0]
        np.testing.assert_allclose(frame.intrinsics.numbers, CAMERA, rtol=1e-4)
        np.testing.assert_array_equal(frame.depth, wavy())

    def test_plain_arrays_of_ones_own(self, load):
        frames, notes = load(depth=(wavy() * 1000).astype(np.uint16), rgb=colors(1)[0], K=matrix(), depth_scale=1000)
        assert frames[0].depth.dtype == np.uint16 and frames[0].intrinsics.depth_scale == 1000
        assert frames[0].intrinsics.numbers == CAMERA and notes == []

    def test_a_camera_of_the_larger_colour_is_not_called_the_depths(self, load):
        frames, _ = load(depth=wavy(), rgb=colors(1, 2 * H, 2 * W)[0], K=matrix((100, 100, 63.5, 47.5)))
        assert frames[0].intrinsics.size is None

    def test_disparity_is_inverse_depth(self, load):
        for arrays in ({"image": colors(1)[0]}, {}):
            frames, _ = load(disparity=1 / wavy(), **arrays)
            assert frames[0].depth_kind == "inverse" and frames[0].intrinsics is None

    def test_what_may_be_inverse_is_said(self, load):
        _, notes = load(predicted_depth=wavy()[None], image=colors(1)[0])
        assert "predicted_depth is read as distances; pass depth_kind='inverse'" in notes[0]

    @pytest.mark.parametrize(
        ("scale", "shift"), [(1 / 255, 0), (2 / 255, -1), (1, 0), (257, 0)], ids=["0..1", "-1..1", "0..255", "16 bits"]
    )
    def test_colours_of_any_range(self, load, scale, shift):
        seen = colors(1)[0].astype(np.float64) * scale + shift
        frames, _ = load(depth=wavy(), image=seen.astype(np.uint16) if scale == 257 else seen.astype(np.float32))
        np.testing.assert_array_equal(frames[0].color, colors(1)[0])

    def test_what_does_not_fit_is_said_and_left_out(self, load):
        frames, notes = load(depth=np.stack([wavy()] * 3), poses=np.stack([np.eye(4)] * 2), mask=np.ones((3, 9, 9)))
        assert frames[0].pose is None and frames[0].valid is None
        assert "poses (2, 4, 4) does not fit the depth and is not used" in notes[0]
        assert "mask (3, 9, 9) does not fit the depth and is not used" in notes[1]

    def test_a_video_without_a_camera_may_be_inverse(self, load):
        assert "pass depth_kind='inverse'" in load(depths=np.stack([wavy()] * 3))[1][0]
        assert load(depths=np.stack([wavy()] * 3), K=matrix())[1] == []

    def test_unidepths_confidence_is_an_error_and_not_used_but_levels_are(self, load):
        frames, notes = load(depth=wavy(), confidence=np.linspace(0, 1, H * W).reshape(H, W), K=matrix())
        assert frames[0].valid is None and "confidence is not used" in notes[0]
        levels = np.tile(np.arange(W) % 3, (H, 1)).astype(np.uint8)
        frames, _ = load(depth=wavy(), confidence=levels, K=matrix())
        np.testing.assert_array_equal(frames[0].valid, levels > 0)

    def test_metres_for_each_raw_value_are_turned_round(self, load):
        assert load(depth=wavy(), depth_scale=0.001, K=matrix())[0][0].intrinsics.depth_scale == pytest.approx(1000)

    def test_logits_and_the_sky_are_left_out(self, load):
        conf = np.full((H, W), 2.0)
        conf[0] = -6
        sky = np.zeros((H, W), bool)
        sky[1] = True
        frames, _ = load(depth=wavy(), conf=conf, sky=sky)
        assert not frames[0].valid[:2].any() and frames[0].valid[2:].all()


class TestPlainDepth:
    def test_a_single_picture_is_no_container(self, load, tmp_path):
        assert load(arr_0=wavy())[0] is None and load(anything=wavy()[None, :, :, None])[0] is None
        for name, array in (("a.npy", wavy()), ("b.npy", np.repeat(wavy()[..., None], 3, 2)), ("c.npy", colors(1)[0])):
            np.save(tmp_path / name, array)
            assert open_container(tmp_path / name, print) is None
        Image.fromarray(colors(1)[0]).save(tmp_path / "color.png")
        assert open_container(tmp_path / "color.png", print) is None and open_container(tmp_path, print) is None

    def test_several_pictures_in_one_array_are(self, tmp_path):
        np.save(tmp_path / "all.npy", np.stack([wavy(), wavy(shift=2)]))
        frames = open_container(tmp_path / "all.npy", print)
        np.testing.assert_array_equal(frames[1].depth, wavy(shift=2))


class TestBadFiles:
    @pytest.mark.parametrize(
        ("arrays", "sentence"),
        [
            (
                {"a": np.ones(3), "b": np.ones((4, 5))},
                r"has no array called depth or points, only a \(3,\), b \(4, 5\): ",
            ),
            ({"depth": np.ones(3), "b": np.ones((4, 5))}, r"has no array called depth or points, only depth \(3,\)"),
            ({"depth": np.array([[None]]), "b": np.ones(3)}, "is a broken NumPy file, or one with Python objects"),
            ({"depth": np.ones((99, 80, 5)), "K": matrix()}, r"depth \(99, 80, 5\) must have the shape \(h, w\) or"),
            ({"points": np.random.default_rng(1).random((9, 9, 3)) + 1}, "no pinhole camera sees its points"),
            ({"depth": wavy(), "extrinsics": np.zeros((3, 4))}, "its pose cannot be inverted"),
        ],
    )
    def test_what_cannot_be_used_is_one_sentence(self, load, arrays, sentence):
        with pytest.raises(ValueError, match=sentence):
            list(load(**arrays)[0])

    def test_objects_beside_the_depth_are_not_opened(self, load):
        frames, _ = load(depth=wavy(), K=matrix(), extra=np.array({"a": print}), names=np.array(["a"]))
        assert frames[0].intrinsics.numbers == CAMERA

    def test_an_array_that_claims_to_be_huge_is_refused_before_it_is_read(self, tmp_path):
        header = b"{'descr': '<f4', 'fortran_order': False, 'shape': (60000, 60000), }\n"
        with zipfile.ZipFile(tmp_path / "a.npz", "w") as archive:
            archive.writestr("depth.npy", b"\x93NUMPY\x01\x00" + struct.pack("<H", len(header)) + header)
            archive.writestr("K.npy", b"")
        with pytest.raises(ValueError, match="broken"):
            open_container(tmp_path / "a.npz", print)
        with zipfile.ZipFile(tmp_path / "b.npz", "w") as archive:
            for name in ("depth", "conf"):
                archive.writestr(f"{name}.npy", b"\x93NUMPY\x01\x00" + struct.pack("<H", len(header)) + header)
        with pytest.raises(ValueError, match=r"60000x60000 pixels, the limit is 134217728: pass max_pixels"):
            open_container(tmp_path / "b.npz", print)

    def test_a_cut_file(self, tmp_path):
        np.savez(tmp_path / "a.npz", depth=wavy(), K=matrix())
        data = (tmp_path / "a.npz").read_bytes()
        (tmp_path / "a.npz").write_bytes(data[: len(data) // 2])
        with pytest.raises(ValueError, match="is a broken or truncated zip archive"):
            open_container(tmp_path / "a.npz", print)
        np.save(tmp_path / "b.npy", np.stack([wavy()] * 2))
        (tmp_path / "b.npy").write_bytes((tmp_path / "b.npy").read_bytes()[:-9])
        with pytest.raises(ValueError, match="is a broken NumPy file"):
            open_container(tmp_path / "b.npy", print)

    def test_damaged_bytes_inside(self, tmp_path):
        np.savez(tmp_path / "a.npz", depth=np.stack([wavy()] * 2), K=matrix())
        data = bytearray((tmp_path / "a.npz").read_bytes())
        data[6000:6100] = bytes(100)
        (tmp_path / "a.npz").write_bytes(data)
        with pytest.raises(ValueError, match=r"a\.npz/depth\.npy is a broken NumPy file"):
            list(open_container(tmp_path / "a.npz", print))


@pytest.mark.parametrize(
    ("module", "extra", "name", "data"),
    [
        ("h5py", "hdf5", "a.h5", b"\x89HDF\r\n\x1a\n" + bytes(99)),
        ("h5py", "hdf5", "a.mat", b"MATLAB 7.3 MAT-file" + bytes(999)),
        ("pillow_heif", "heic", "a.heic", b"\0\0\0\x18ftypheic" + bytes(99)),
        ("liblzfse", "record3d", "a.r3d", None),
    ],
)
def test_a_missing_extra_is_named(tmp_path, monkeypatch, module, extra, name, data):
    monkeypatch.setitem(sys.modules, module, None)
    if data:
        (tmp_path / name).write_bytes(data)
    else:
        with zipfile.ZipFile(tmp_path / name, "w") as archive:
            archive.writestr("metadata", '{"w": 8, "h": 8, "dw": 2, "dh": 2}')
            archive.writestr("rgbd/0.depth", b"bvx$")
    with pytest.raises(ValueError, match=rf"{name}.*pip install '\.\[{extra}\]' in the clone to read it"):
        list(open_container(tmp_path / name, print))


def test_frames_are_read_from_several_threads(load):
    depth = np.stack([wavy(shift=k) for k in range(12)])
    frames, _ = load(depth=depth, K=matrix(), rgb=colors(12))
    with ThreadPoolExecutor(4) as pool:
        for _ in range(5):
            order = [11, 3, 0, 7, 5, 1, 10, 2]
            for k, frame in zip(order, pool.map(frames.__getitem__, order), strict=True):
                np.testing.assert_array_equal(frame.depth, depth[k])
                np.testing.assert_array_equal(frame.color, colors(12)[k])


@pytest.mark.data
def test_two_views_of_a_room_meet_in_the_world(shared_data, load):
    """As VGGT would write two frames of ICL-NUIM: the points of one fall onto the surface of the other."""
    folder = shared_data / "icl_livingroom_23views"
    numbers = (folder / "trajectory.log").read_text().split()
    poses = np.array(numbers, np.float64).reshape(-1, 19)[:, 3:].reshape(-1, 4, 4)
    names = ("000", "002")
    depth = np.stack([np.asarray(Image.open(folder / "depth" / f"{name}.png")) / 1000 for name in names])
    seen = np.stack([np.asarray(Image.open(folder / "color" / f"{name}.jpg")) for name in names])
    frames, notes = load(
        depth=depth[..., None].astype(np.float32),
        extrinsic=np.linalg.inv(poses[[0, 2]])[:, :3],
        intrinsic=np.stack([matrix((525, 525, 319.5, 239.5))] * 2),
        images=seen.transpose(0, 3, 1, 2).astype(np.float32) / 255,
    )
    a, b = frames
    assert notes == [] and a.intrinsics.numbers == (525, 525, 319.5, 239.5)
    points = points_of(a.depth, a.intrinsics.numbers)[a.depth > 0].astype(np.float64)
    moved = points @ a.pose[:3, :3].T + a.pose[:3, 3]
    moved = (moved - b.pose[:3, 3]) @ b.pose[:3, :3]
    u, v = (np.rint(moved[:, i] / moved[:, 2] * 525 + c).astype(int) for i, c in ((0, 319.5), (1, 239.5)))
    inside = (moved[:, 2] > 0) & (u >= 0) & (u < 640) & (v >= 0) & (v < 480)
    apart = np.abs(moved[inside, 2] - b.depth[v[inside], u[inside]])
    assert inside.mean() > 0.5 and np.median(apart) < 0.015
