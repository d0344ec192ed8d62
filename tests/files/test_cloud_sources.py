"""Which files are point clouds, and how the command line reads them: `info`, --up, --color-by, --most."""

import json

import numpy as np
import pytest

import pointshade_gl as ps
from pointshade_gl.files.clouds.load_cloud import is_cloud
from pointshade_gl.files.frame_sources import load_any

from ..support import cloud_files as made
from ..support import frames
from ..support.command import run

SOME = {"notes": lambda _: None}
POINTS, NORMALS, COLORS = made.bumpy()
XYZ = {name: POINTS[:, k] for k, name in enumerate("xyz")}


def text(rows, columns=3):
    return "\n".join(" ".join(map(str, row[:columns])) for row in np.tile(POINTS, 3)[:rows].tolist()).encode()


CLOUDS = {
    "a.ply": made.ply_text(XYZ),
    "a.pcd": made.pcd(XYZ),
    "a.xyz": text(2),
    "a.pts": b"2\n" + text(2),
    "a.txt": text(200),
    "a.csv": b"x,y,z,\n" + text(3).replace(b" ", b","),
    "a.las": b"LASF",
    "a.dat": b"ASTM-E57",
    "a.obj": b"# points\nv 0 0 0\n" * 200,
    "b.txt": b"\n".join(b"%d %d 1 %d %d %d 0 1 0 7" % (k, -k, k % 256, 3 * k % 256, 5 * k % 256) for k in range(300)),
    "a.ptx": b"1\n1\n" + b"0 0 0\n" * 4 + b"1 0 0 0\n" * 4 + b"1 2 3 .5\n",
}
OTHERS = {
    "missing.ply": None,
    "pose.txt": b"1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n",
    "matrix.txt": b"500 0 320\n0 500 240\n0 0 1\n",
    "groundtruth.txt": text(200, 8),
    "list.txt": b"1.0 depth/1.png\n" * 200,
    "a.bin": np.linspace(1, 2, 4000).astype("<f4").tobytes(),  # depth is never below 0
    "cameras.bin": bytes(4000),
    "a.obj": b"v 0 0 0\n" * 200 + b"f 1 2 3\n",
    "mesh.ply": made.ply_text(XYZ, faces=[(0, 1, 2)]),
}


@pytest.mark.parametrize("name", CLOUDS)
def test_these_are_clouds(tmp_path, name):
    (tmp_path / name).write_bytes(CLOUDS[name])
    assert is_cloud(tmp_path / name) and is_cloud(str(tmp_path / name))


@pytest.mark.parametrize("name", OTHERS)
def test_these_are_none(tmp_path, name):
    if OTHERS[name] is not None:
        (tmp_path / name).write_bytes(OTHERS[name])
    assert not is_cloud(tmp_path / name)


def test_nor_are_folders_and_built_in_names(tmp_path):
    assert not any(map(is_cloud, (None, "vase", "demo", tmp_path)))


@pytest.mark.parametrize(
    ("array", "is_one"),
    [
        (POINTS, True), (np.concatenate([POINTS, COLORS], 1), True), (POINTS[:50], False),
        (np.ones((400, 5)), False),
            (np.concatenate([POINTS, COLORS, COLORS[:, :2]], 1), True), (np.ones((480, 640)), False),
            (POINTS.reshape(20, 20, 3), False),
        (np.zeros(400, [("x", "f4"), ("y", "f4"), ("z", "f4")]), True), (np.zeros(400, [("u", "f4")]), False),
    ],
)  # fmt: skip
def test_arrays_of_points_and_of_depth(tmp_path, array, is_one):
    np.save(tmp_path / "a.npy", array)
    assert is_cloud(tmp_path / "a.npy") == is_one


@pytest.mark.parametrize(
    ("arrays", "is_one"),
    [
        ({"points": POINTS}, True), ({"xyz": POINTS, "rgb": COLORS}, True),
        ({"points": POINTS.reshape(20, 20, 3)}, False), ({"depth": np.ones((9, 9)), "points": POINTS}, False),
        ({"depth": np.ones((9, 9))}, False), ({"points": POINTS[:9]}, False),
    ],
)  # fmt: skip
def test_archives_of_points_and_of_depth(tmp_path, arrays, is_one):
    np.savez(tmp_path / "a.npz", **arrays)
    assert is_cloud(tmp_path / "a.npz") == is_one


def test_a_scan_of_a_lidar_is_one_by_its_numbers(tmp_path):
    table = made.kitti(tmp_path / "a.bin")
    assert is_cloud(tmp_path / "a.bin")
    np.abs(table).tofile(tmp_path / "b.bin")
    assert not is_cloud(tmp_path / "b.bin")


class TestOrganised:
    """A PCD file whose points are a picture is a frame; as a cloud it is read when that is asked for."""

    def columns(self, frame, hole=np.nan):
        at = frame.camera.unproject(frame.depth).astype(np.float32)
        at[frame.depth == 0] = hole
        return {name: at[..., k].ravel() for k, name in enumerate("xyz")} | {
            "rgb": made.packed_colors(frame.color.reshape(-1, 3))
        }

    def file(self, folder, frame, **options):
        height, width = frame.depth.shape
        (folder / "a.pcd").write_bytes(made.pcd(self.columns(frame), width=width, height=height, **options))
        return folder / "a.pcd"

    @pytest.mark.parametrize("coding", ["binary", "binary_compressed"])
    def test_it_is_the_frame_of_its_camera(self, tmp_path, coding):
        frame = frames.sphere_before_wall()
        path = self.file(tmp_path, frame, coding=coding)
        assert not is_cloud(path)
        for found in (load_any(path, **SOME), ps.load_frame(path, **SOME)):
            assert isinstance(found, ps.Frame)
            np.testing.assert_allclose(found.depth, frame.depth, rtol=1e-6)
            np.testing.assert_allclose(found.camera.intrinsics, frame.camera.intrinsics, rtol=1e-3)
            assert (found.color[frame.depth > 0] == frame.color[frame.depth > 0]).all()

    def test_as_a_cloud_it_has_the_same_points(self, tmp_path):
        frame = frames.sphere_before_wall()
        cloud = ps.load_cloud(self.file(tmp_path, frame), **SOME)
        assert len(cloud) == frame.points_known and (cloud.colors == frame.color[frame.depth > 0]).all()

    def test_rows_that_no_pinhole_camera_sees_are_a_cloud(self, tmp_path):
        (tmp_path / "a.pcd").write_bytes(made.pcd(XYZ, width=20, height=20))
        assert isinstance(load_any(tmp_path / "a.pcd", **SOME), ps.PointCloud)
        with pytest.raises(ValueError, match="is a point cloud, no depth: `pointshade render` draws it"):
            ps.load_frame(tmp_path / "a.pcd")


class TestOptions:
    def test_those_of_frames_do_not_fit_a_cloud(self, tmp_path):
        (tmp_path / "a.ply").write_bytes(CLOUDS["a.ply"])
        with pytest.raises(ValueError, match=r"a\.ply is a point cloud, and no frame: leave out fov, depth_kind"):
            load_any(tmp_path / "a.ply", fov=50, depth_kind="z")

    @pytest.mark.parametrize("source", ["vase", "demo"])
    def test_those_of_clouds_fit_nothing_else(self, source):
        with pytest.raises(ValueError, match="leave out up, most"):
            load_any(source, up="z", most=9)

    def test_those_of_clouds_are_used(self, tmp_path):
        (tmp_path / "a.ply").write_bytes(CLOUDS["a.ply"])
        cloud = load_any(tmp_path / "a.ply", up="x", most=9, color_by="height", allow_outside=False)
        assert len(cloud) == 9 and cloud.up == "x" and cloud.colors is not None


class TestInfo:
    def run(self, *words):
        done = run("info", *words)
        return done.returncode, done.stdout, done.stderr

    def test_it_says_what_there_is(self, tmp_path):
        made.las(tmp_path / "a.laz", made.on_map(), classification=np.full(300, 2, np.uint8))
        status, out, _ = self.run(tmp_path / "a.laz", "--color-by", "class")
        assert status == 0
        for line in (
            "points    300 points, LAS 1.2, point format 3", "up        z (always so in LAS)",
            "normals   none",
        ):  # fmt: skip
            assert f"{line}\n" in out
        assert "color     yes; --color-by intensity, class, height, " in out and "gps_time" in out
        assert "seen from " in out and "normals that are estimated point to above, as it is flat" in out
        assert "extent    99." in out and "; positions are float32\n" in out

    def test_as_json(self, tmp_path):
        (tmp_path / "a.pcd").write_bytes(made.pcd(XYZ, viewpoint="1 2 3 1 0 0 0"))
        status, out, _ = self.run(tmp_path / "a.pcd", "--json", "--most", "50")
        found = json.loads(out)
        assert status == 0 and found["points"] == 50 and found["seen_from"] == [[1, 2, 3]] and not found["colors"]
        assert found["up"] == {"axis": "z", "why": "usual in PCD files"} and len(found["assumed"]) == 2

    def test_stray_points_are_counted_and_leave_on_demand(self, tmp_path):
        made.write_with_strays(tmp_path / "a.ply", 9)
        status, out, _ = self.run(tmp_path / "a.ply")
        assert status == 0 and "          9 stray points, far from all others; --clean leaves out such\n" in out
        assert "a.ply: 9 points lie far from all others: pictures are framed without, --clean leaves out such" in out
        _, out, _ = self.run(tmp_path / "a.ply", "--clean")
        assert "stray points, far" not in out and "9 of its 2 009 points lie far from all others: left out" in out

    @pytest.mark.parametrize("count", [0, 1, 2])
    def test_hardly_any_points(self, tmp_path, count):
        (tmp_path / "a.ply").write_bytes(made.ply_text({name: column[:count] for name, column in XYZ.items()}))
        assert self.run(tmp_path / "a.ply")[0] == 0

    @pytest.mark.parametrize(
        ("words", "says"),
        [
            ("{cloud} --fov 50", "is a point cloud, and no frame: leave out --fov"),
            ("{cloud} --up q", "unknown --up 'q': known are x, y, z, -x, -y, -z"),
            ("{cloud} --crop 1,2,3", "--crop takes two corners, as in --crop -1,-1,0,1,1,2, got '1,2,3'"),
            ("{cloud} --crop 1,2,3,1,2,3", "has no point in the box of --crop: its points lie from"),
            ("{cloud} --seen-from 1,2", "--seen-from takes X,Y,Z, got '1,2'"),
            ("vase --clean", "vase is no point cloud: leave out --clean"),
            ("{cloud} --color-by class", "has no class for --color-by, only height"),
            ("{cloud} -o out.png", "a contact sheet shows a frame"),
            ("vase --up z", "vase is no point cloud: leave out --up"),
        ],
    )
    def test_what_does_not_fit(self, tmp_path, words, says):
        (tmp_path / "a.ply").write_bytes(CLOUDS["a.ply"])
        status, _, err = self.run(*(word.format(cloud=tmp_path / "a.ply") for word in words.split()))
        assert status and says in err and err.count("\n") == 1

    def test_other_commands_say_what_draws_it(self, tmp_path):
        (tmp_path / "a.ply").write_bytes(CLOUDS["a.ply"])
        done = run("albedo", tmp_path / "a.ply", "-o", tmp_path / "out.png")
        assert "is a point cloud, expected a frame: pass it to `pointshade render` or `view`" in done.stderr
