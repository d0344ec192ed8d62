"""Point clouds of every format: the right points, with what the file says about them."""

import struct
import sys

import numpy as np
import pytest

import pointshade_gl as ps
from pointshade_gl.files.arrays.compression import unpack_lzf
from pointshade_gl.files.clouds.load_cloud import cloud_facts

from ..support import cloud_files as made

SOME = {"notes": lambda _: None}
POINTS, NORMALS, COLORS = made.bumpy()
XYZ = {name: POINTS[:, k] for k, name in enumerate("xyz")}
ALL = XYZ | {f"n{name}": NORMALS[:, k] for k, name in enumerate("xyz")}
ALL |= {name: COLORS[:, k] for k, name in enumerate(("red", "green", "blue"))}


def load(folder, name, data, **options):
    """A file of that content, as a cloud."""
    (folder / name).write_bytes(data if isinstance(data, bytes) else data.encode())
    return ps.load_cloud(folder / name, **({} if "notes" in options else SOME), **options)


def check(cloud, positions=POINTS, colors=None, normals=None, atol=0.0):
    np.testing.assert_allclose(cloud.positions.astype(float) + cloud.origin, positions, rtol=0, atol=atol)
    for found, expected, off in ((cloud.colors, colors, 0), (cloud.normals, normals, 2e-6)):
        assert (found is None) == (expected is None)
        if expected is not None:
            np.testing.assert_allclose(found.astype(float), expected.astype(float), rtol=0, atol=off)


class TestPly:
    @pytest.mark.parametrize("form", ["ascii", "binary_little_endian", "binary_big_endian"])
    def test_numbers_are_read_and_faces_passed_over(self, tmp_path, form):
        faces = [(0, 1, 2), (3, 4, 5, 6), (1, 2)]
        check(load(tmp_path, "a.ply", made.ply_text(ALL, form=form, faces=faces)), POINTS, COLORS, NORMALS)

    def test_fields_that_lie_apart_in_a_row(self, tmp_path):
        """x, y and z need not follow each other, nor be of one type."""
        columns = {"y": POINTS[:, 1], "red": COLORS[:, 0], "z": POINTS[:, 2].astype(float), "x": POINTS[:, 0]}
        check(load(tmp_path, "a.ply", made.ply_text(columns, form="binary_little_endian")))

    def test_what_comes_after_the_vertices_is_not_read(self, tmp_path):
        whole = made.ply_text(XYZ, form="binary_little_endian", faces=[(0, 1, 2)] * 5)
        check(load(tmp_path, "a.ply", whole[:-7]))

    def test_one_without_vertices(self, tmp_path):
        with pytest.raises(
            ValueError, match=r"a\.ply cannot be read as a point cloud: it has no vertices, only camera"
        ):
            load(tmp_path, "a.ply", "ply\nformat ascii 1.0\nelement camera 1\nproperty float f\nend_header\n1\n")

    def test_as_discs_gaussians_are_those_that_are_opaque(self, tmp_path):
        columns, normals = made.gaussians()
        cloud = load(tmp_path, "a.ply", made.ply_text(columns, form="binary_little_endian")).as_discs
        check(cloud, np.stack([columns[name] for name in "xyz"], -1), cloud.colors, cloud.normals)
        assert np.abs((cloud.normals * normals).sum(-1)).min() > 0.999999  # either side
        np.testing.assert_allclose(cloud.sizes, 2 * 0.03, rtol=1e-5)
        expected = 255 * (0.5 + 0.28209479 * np.stack([columns[f"f_dc_{k}"] for k in range(3)], -1))
        np.testing.assert_allclose(cloud.colors, expected.clip(0, 255), atol=0.51)

    def test_gaussians_that_are_faint_round_or_giants_are_no_discs(self, tmp_path):
        columns, _ = made.gaussians()
        columns["opacity"][:50] = -2
        for k in range(3):
            columns[f"scale_{k}"][50:60] = np.log(0.03)  # balls
            columns[f"scale_{k}"][60] = np.log(100)
        cloud = load(tmp_path, "a.ply", made.ply_text(columns, form="binary_little_endian"))
        assert len(cloud) == 300
        discs = cloud.as_discs
        assert len(discs) == 249 and not discs.normals[:10].any()
        assert np.allclose(np.linalg.norm(discs.normals[10:], axis=1), 1, atol=1e-5)


class TestPcd:
    @pytest.mark.parametrize("coding", ["ascii", "binary", "binary_compressed"])
    @pytest.mark.parametrize("kind", ["<f4", "<u4"])
    def test_each_coding(self, tmp_path, coding, kind):
        columns = XYZ | {"rgb": made.packed_colors(COLORS, kind)}
        columns |= {f"normal_{name}": NORMALS[:, k] for k, name in enumerate("xyz")}
        cloud = load(tmp_path, "a.pcd", made.pcd(columns, coding))
        check(cloud, POINTS, COLORS, NORMALS)
        assert cloud.up == "z"

    @pytest.mark.parametrize("coding", ["ascii", "binary", "binary_compressed"])
    def test_fields_of_several_numbers_are_passed_over(self, tmp_path, coding):
        fpfh = np.random.default_rng(0).random((len(POINTS), 33)).astype(np.float32)
        columns = {"x": XYZ["x"], "fpfh": fpfh, "y": XYZ["y"], "z": XYZ["z"]}
        check(load(tmp_path, "a.pcd", made.pcd(columns, coding)))

    def test_padding_has_the_same_name_again_and_again(self, tmp_path):
        zero = np.zeros(len(POINTS), np.uint8)
        data = made.pcd({"x": XYZ["x"], "p": zero, "y": XYZ["y"], "q": zero, "z": XYZ["z"]})
        check(load(tmp_path, "a.pcd", data.replace(b"FIELDS x p y q z", b"FIELDS x _ y _ z")))

    def test_points_that_are_nan_are_left_out_with_a_note(self, tmp_path):
        holed = {name: column.copy() for name, column in XYZ.items()}
        holed["y"][[3, 9]], holed["x"][9] = np.nan, np.inf
        told = []
        cloud = load(tmp_path, "a.pcd", made.pcd(holed, "ascii"), notes=told.append)
        check(cloud, np.delete(POINTS, [3, 9], 0))
        assert any("2 points of 400 lie nowhere (NaN or infinite): left out" in one for one in told)

    def test_what_a_depth_camera_saw_has_its_axes(self, tmp_path):
        """No PCD file says which axes it has: all points in front of the origin are a camera's, y down."""
        ahead = XYZ | {"z": XYZ["z"] + 3}
        cloud = load(tmp_path, "a.pcd", made.pcd(ahead))
        assert cloud.up == "-y" and cloud.seen_from.tolist() == [0, 0, 0]

    def test_the_viewpoint_is_where_the_scanner_stood(self, tmp_path):
        cloud = load(tmp_path, "a.pcd", made.pcd(XYZ, viewpoint="1 2.5 -3 1 0 0 0"))
        assert cloud.seen_from.tolist() == [1, 2.5, -3]
        assert load(tmp_path, "b.pcd", made.pcd(XYZ)).seen_from is None  # the usual one says nothing

    @pytest.mark.parametrize(
        "data", [b"", b"a", b"ab" * 3000, bytes(9999), b"abcabcabd" * 40 + b"xyz", bytes(range(256)) * 40]
    )
    def test_what_was_packed_is_unpacked(self, data):
        assert unpack_lzf(made.lzf(data), len(data)) == data


class TestText:
    def body(self, columns=3, separator=" "):
        beside = [NORMALS, COLORS, COLORS[:, :1], NORMALS]
        table = {
            3: [], 4: [COLORS[:, :1]], 6: [COLORS], 7: [COLORS[:, :1], COLORS], 9: [COLORS, NORMALS], "n": [NORMALS],
        }[columns]  # fmt: skip
        rows = zip(POINTS.tolist(), *(part.tolist() for part in table), strict=True)
        assert beside
        return "\n".join(separator.join(repr(one) for part in row for one in part) for row in rows) + "\n"

    @pytest.mark.parametrize("name", ["a.xyz", "a.txt", "a.csv", "a.pts", "a.asc"])
    @pytest.mark.parametrize("separator", [" ", ",", ";", "\t", " , "])
    def test_each_separator(self, tmp_path, name, separator):
        check(load(tmp_path, name, self.body(separator=separator)))

    @pytest.mark.parametrize(
        "head", ["# made by hand\n\n", "// X Y Z\n", "x y z\n", '"X","Y","Z"\n', f"{len(POINTS)}\n", "\ufeff"]
    )
    def test_each_head(self, tmp_path, head):
        check(load(tmp_path, "a.txt", head + self.body()))

    def test_remarks_between_and_after_the_points(self, tmp_path):
        lines = self.body().splitlines()
        lines[7] += "  # a remark"
        check(load(tmp_path, "a.xyz", "\r\n".join([*lines[:20], "# half", "", *lines[20:]])))

    def test_colours_normals_and_intensity_by_the_number_of_columns(self, tmp_path):
        grey = load(tmp_path, "4.xyz", self.body(4)).colors
        assert (np.ptp(grey, 1) == 0).all() and np.corrcoef(grey[:, 0], COLORS[:, 0])[0, 1] > 0.97
        check(load(tmp_path, "6.xyz", self.body(6)), colors=COLORS)
        check(load(tmp_path, "n.xyz", self.body("n")), normals=NORMALS)
        check(load(tmp_path, "7.pts", self.body(7)), colors=COLORS)  # the intensity comes first
        check(load(tmp_path, "9.xyz", self.body(9)), colors=COLORS, normals=NORMALS)

    def test_names_decide_what_columns_are(self, tmp_path):
        rows = zip(COLORS.tolist(), POINTS.tolist(), strict=True)
        body = "\n".join(",".join(repr(one) for part in row for one in part) for row in rows)
        check(load(tmp_path, "a.csv", f"R,G,B,X,Y,Z\n{body}\n"), colors=COLORS)
        check(load(tmp_path, "b.txt", f"//R G B X Y Z\n{body}\n"), colors=COLORS)

    def test_decimal_commas_between_semicolons(self, tmp_path):
        check(load(tmp_path, "a.csv", self.body(separator=";").replace(".", ",")))

    @pytest.mark.parametrize(
        ("text", "fact"),
        [
            ("1 2 3\n4 5\n6 7 8\n", "point 1 is '4 5', expected 3 numbers"),
            ("1 2 3\n4 5 6 7\n8 9\n", "point 1 is '4 5 6 7', expected 3 numbers"),
            ("1 2 3\nx y z\n", "point 1 is 'x y z'"),
            ("1 2\n3 4\n", "no line of its beginning holds x, y and z"),
            ("once upon a time\nthere were no points\n", "no line of its beginning"),
        ],
    )
    def test_lines_that_do_not_fit(self, tmp_path, text, fact):
        with pytest.raises(ValueError, match=f"a.xyz cannot be read as a point cloud: {fact}"):
            load(tmp_path, "a.xyz", text)

    def test_a_count_that_does_not_fit_is_told(self, tmp_path):
        told = []
        cloud = load(tmp_path, "a.xyz", "3\n1 2 3\n4 5 6\n", notes=told.append)
        assert len(cloud) == 2 and any("counts 3 points, and it has 2: these are read" in one for one in told)


class TestNumPy:
    @pytest.mark.parametrize("kind", ["<f4", ">f8"])
    def test_arrays_by_their_columns(self, tmp_path, kind):
        for name, table, expected in (
            ("3", [POINTS], {}), ("6", [POINTS, COLORS], {"colors": COLORS}),
            ("n", [POINTS, NORMALS], {"normals": NORMALS}),
            ("9", [POINTS, NORMALS, COLORS], {"colors": COLORS, "normals": NORMALS}),
        ):  # fmt: skip
            np.save(tmp_path / f"{name}.npy", np.concatenate(table, 1).astype(kind))
            check(ps.load_cloud(tmp_path / f"{name}.npy", **SOME), **expected)

    def test_columns_first_and_pictures_of_points(self, tmp_path):
        np.save(tmp_path / "t.npy", POINTS.T)
        np.save(tmp_path / "p.npy", POINTS.reshape(20, 20, 3))
        check(ps.load_cloud(tmp_path / "t.npy", **SOME))
        check(ps.load_cloud(tmp_path / "p.npy", **SOME))

    def test_records(self, tmp_path):
        rows = np.empty(len(POINTS), [(name, column.dtype) for name, column in ALL.items()])
        for name, column in ALL.items():
            rows[name] = column
        np.save(tmp_path / "a.npy", rows)
        check(ps.load_cloud(tmp_path / "a.npy", **SOME), colors=COLORS, normals=NORMALS)

    @pytest.mark.parametrize("name", ["points", "xyz", "positions", "arr_0"])
    def test_archives_by_their_names(self, tmp_path, name):
        np.savez_compressed(tmp_path / "a.npz", **{name: POINTS}, rgb=COLORS / 255, normals=NORMALS)
        check(ps.load_cloud(tmp_path / "a.npz", **SOME), colors=COLORS, normals=NORMALS)

    def test_what_does_not_fit(self, tmp_path):
        np.savez(tmp_path / "a.npz", points=POINTS, colors=COLORS[1:])
        with pytest.raises(ValueError, match=r"its colors have shape \(399, 3\), and there are 400 points"):
            ps.load_cloud(tmp_path / "a.npz", **SOME)
        np.savez(tmp_path / "b.npz", height=POINTS[:, 0], width=POINTS[:, 0])
        with pytest.raises(ValueError, match=r"must hold an array points of shape \(n, 3\), got height \(400,\)"):
            ps.load_cloud(tmp_path / "b.npz", **SOME)
        np.save(tmp_path / "c.npy", np.zeros((9, 2)))
        with pytest.raises(ValueError, match=r"it has shape \(9, 2\), expected \(n, 3\)"):
            ps.load_cloud(tmp_path / "c.npy", **SOME)


class TestLidar:
    def test_kitti(self, tmp_path):
        table = made.kitti(tmp_path / "a.bin")
        cloud = ps.load_cloud(tmp_path / "a.bin", **SOME)
        check(cloud, table[:, :3], cloud.colors)
        assert cloud.up == "z" and np.corrcoef(cloud.colors[:, 0], table[:, 3])[0, 1] > 0.97

    def test_more_columns(self, tmp_path):
        table = made.kitti(tmp_path / "a.bin")
        ring = np.arange(len(table), dtype=np.float32) % 32
        np.concatenate([table[:, :3], 255 * table[:, 3:], ring[:, None]], 1).tofile(tmp_path / "a.pcd.bin")
        colors = np.random.default_rng(0).integers(0, 256, (len(table), 3)).astype(np.float32)
        np.concatenate([table[:, :3], colors], 1).tofile(tmp_path / "b.bin")
        cloud = ps.load_cloud(tmp_path / "a.pcd.bin", **SOME)
        check(cloud, table[:, :3], cloud.colors)
        check(ps.load_cloud(tmp_path / "b.bin", **SOME), table[:, :3], colors)

    def test_other_numbers(self, tmp_path):
        with pytest.raises(ValueError, match=r"a\.bin is no scan of a lidar: expected float32 x, y, z and intensity"):
            load(tmp_path, "a.bin", np.random.default_rng(1).bytes(4000))


class TestLas:
    @pytest.mark.parametrize(
        ("name", "version", "form"), [("a.las", "1.2", 3), ("a.laz", "1.2", 2), ("b.laz", "1.4", 7)]
    )
    def test_points_and_colours_of_16_bits(self, tmp_path, name, version, form):
        points, colors = made.on_map(), np.random.default_rng(5).integers(0, 256, (300, 3))
        sixteen = {key: (257 * colors[:, k]).astype(np.uint16) for k, key in enumerate(("red", "green", "blue"))}
        made.las(tmp_path / name, points, version, form, **sixteen)
        cloud = ps.load_cloud(tmp_path / name, **SOME)
        check(cloud, points, colors, atol=1e-5)
        assert cloud.up == "z" and cloud.positions.dtype == np.float32 and (cloud.origin % 1 == 0).all()

    def test_colours_that_are_written_with_8_bits(self, tmp_path):
        red = np.arange(300, dtype=np.uint16) % 256
        made.las(tmp_path / "a.las", made.on_map(), red=red)
        assert ps.load_cloud(tmp_path / "a.las").colors[:, 0].tolist() == red.tolist()

    def test_intensity_and_classes(self, tmp_path):
        light = np.linspace(100, 4000, 300).astype(np.uint16)
        classes = np.repeat([2, 5, 6], 100).astype(np.uint8)
        made.las(tmp_path / "a.las", made.on_map(), intensity=light, classification=classes)
        grey = ps.load_cloud(tmp_path / "a.las").colors
        assert grey.min() < 90 and grey.max() == 255 and (np.diff(grey[:, 0].astype(int)) >= 0).all()
        of_class = ps.load_cloud(tmp_path / "a.las", color_by="class").colors
        assert len(np.unique(of_class, axis=0)) == 3 and (of_class[:100] == of_class[0]).all()

    @pytest.mark.parametrize("form", [1, 6])
    def test_scan_angles_show_where_the_aircraft_was(self, tmp_path, form):
        """Two lines of flight, one north, one east, 800 and 1500 above the ground."""
        rng, notes = np.random.default_rng(6), []
        ground = np.round(made.MAP + rng.uniform(0, 1, (4000, 3)) * (300, 300, 20), 3)
        path = np.where(np.arange(4000)[:, None] < 2000, (100, np.nan, 800), (np.nan, 400, 1500)) + made.MAP
        path = np.where(np.isnan(path), ground, path)  # straight aside of each point
        aside = (ground - path)[:, :2].sum(1)
        angle = np.degrees(np.arctan2(aside, path[:, 2] - ground[:, 2]))
        named = {"scan_angle": np.rint(angle / 0.006).astype(np.int16)}
        named = named if form == 6 else {"scan_angle_rank": np.rint(angle).astype(np.int8)}
        times = np.repeat([100.0, 900.0], 2000) + np.tile(np.linspace(0, 3, 2000), 2)
        made.las(tmp_path / "a.las", ground, "1.4", form, gps_time=times, **named)
        cloud = ps.load_cloud(tmp_path / "a.las", notes=notes.append)
        found, true = cloud.seen_from - cloud.positions, path - ground
        cosine = (found * true).sum(1) / np.linalg.norm(found, axis=1) / np.linalg.norm(true, axis=1)
        assert np.degrees(np.arccos(cosine.min())) < 2
        assert len(notes) == 1 and "scan angles show an aircraft; seen_from names another place" in notes[0]
        assert 8 < len(cloud_facts(tmp_path / "a.las")["seen_from"]) <= 100

    def test_scan_angles_of_a_car_are_none_of_an_aircraft(self, tmp_path):
        angle = np.random.default_rng(7).integers(-89, 90, 300).astype(np.int8)
        made.las(tmp_path / "a.las", made.on_map(), scan_angle_rank=angle)
        assert ps.load_cloud(tmp_path / "a.las", **SOME).seen_from is None

    def test_no_points(self, tmp_path):
        made.las(tmp_path / "a.las", np.empty((0, 3)))
        assert len(ps.load_cloud(tmp_path / "a.las", **SOME)) == 0

    def test_truncated_ones(self, tmp_path):
        for name in ("a.las", "a.laz"):
            made.las(tmp_path / name, made.on_map())
            data = (tmp_path / name).read_bytes()
            for part in (0.2, 0.6, 0.95):
                with pytest.raises(ValueError, match="is a broken or truncated LAS file"):
                    load(tmp_path, f"cut{name}", data[: int(part * len(data))])


class TestE57:
    def test_each_scan_stands_at_its_pose(self, tmp_path):
        half = np.sqrt(0.5)
        scans = [
            (POINTS, (10, 20, 30), (half, 0, 0, half), COLORS),
            (POINTS[:50], (0, 0, 5), (1, 0, 0, 0), COLORS[:50]),
        ]
        made.e57(tmp_path / "a.e57", scans)
        cloud = ps.load_cloud(tmp_path / "a.e57", **SOME)
        turned = POINTS[:, [1, 0, 2]] * (-1, 1, 1) + (10, 20, 30)  # a quarter round z
        moved = POINTS[:50] + np.array([0, 0, 5])
        check(cloud, np.concatenate([turned, moved]), np.concatenate([COLORS, COLORS[:50]]), atol=1e-5)
        places = cloud.seen_from + cloud.origin
        assert cloud.up == "z" and np.unique(places, axis=0).tolist() == [[0, 0, 5], [10, 20, 30]]
        np.testing.assert_allclose(places[:400], [(10, 20, 30)] * 400)

    def test_one_scanner_is_one_place(self, tmp_path):
        made.e57(tmp_path / "a.e57", [(POINTS, (4_800_000, 500_000, 30), (1, 0, 0, 0), None)])
        told = []
        cloud = ps.load_cloud(tmp_path / "a.e57", notes=told.append)
        assert (cloud.seen_from + cloud.origin).tolist() == [4_800_000, 500_000, 30]
        assert told == [f"{tmp_path / 'a.e57'}: 400 points of 1 scan, seen from 1 place"]

    def test_damaged_ones(self, tmp_path):
        made.e57(tmp_path / "a.e57", [(POINTS, (0, 0, 0), (1, 0, 0, 0), None)])
        data = bytearray((tmp_path / "a.e57").read_bytes())
        with pytest.raises(ValueError, match="is a broken or truncated E57 file"):
            load(tmp_path, "b.e57", bytes(data[: len(data) // 2]))
        data[1500] ^= 255
        with pytest.raises(ValueError, match="is a broken or truncated E57 file"):
            load(tmp_path, "b.e57", bytes(data))


@pytest.mark.parametrize(
    ("module", "name", "head", "says"),
    [
        ("laspy", "a.las", b"LASF", r"is a LAS file: pip install '\.\[las\]' in the clone to read it"),
        ("pye57", "a.e57", b"ASTM-E57", r"is an E57 file: pip install '\.\[e57\]' in the clone to read it"),
    ],
)
def test_without_its_extra_a_file_names_it(tmp_path, monkeypatch, module, name, head, says):
    monkeypatch.setitem(sys.modules, module, None)  # makes the import fail
    with pytest.raises(ValueError, match=says):
        load(tmp_path, name, head + bytes(300))


class TestBroken:
    @pytest.mark.parametrize(
        ("name", "data", "fact"),
        [
            ("a.pcd", made.pcd(XYZ)[:-5], "is a broken PCD file: it ends before the last of 400 points"),
            ("a.pcd", made.pcd(XYZ, "ascii") + b" 7", "it has 1201 numbers, expected 3 for each of 400 points"),
            ("a.pcd", made.pcd(XYZ, width=99), "its header counts 400 points of 99 x 1"),
            ("a.pcd", made.pcd(XYZ, "binary_compressed")[:-9], r"packed bytes of 4800, expected 4800, and has"),
            ("a.pcd", made.pcd(XYZ).replace(b"TYPE F F F", b"TYPE F F Q"), "its field 'z' has the type 'Q 4 1'"),
            ("a.pcd", made.pcd(XYZ).replace(b"SIZE 4 4 4", b"SIZE 4 4"), "SIZE, TYPE and COUNT of different length"),
            ("a.pcd", b"# .PCD v0.7\nFIELDS x y z\n", "its header has no end"),
            ("a.pcd", made.pcd({"u": POINTS[:, 0]}), "it has no x, y and z, only u"),
            ("a.ply", b"", "is empty"),
            ("a.ply", made.ply_text(XYZ)[:-90], "it ends before the last of 400 rows"),
            ("a.xyz", b"", "is empty"),
            ("a.npy", b"\x93NUMPY\x01\0", "is a broken NumPy file"),
            ("a.npz", b"PK\3\4", "is a broken or truncated zip archive"),
        ],
    )
    def test_in_one_sentence(self, tmp_path, name, data, fact):
        with pytest.raises(ValueError, match=fact) as caught:
            load(tmp_path, name, data)
        assert str(caught.value).startswith(str(tmp_path / name)) and "\n" not in str(caught.value)

    @pytest.mark.parametrize(
        ("packed", "size", "fact"),
        [
            (b"\x20\0", 3, "from before its beginning"),
            (b"\x05ab", 6, "another number of bytes"),
            (b"\x00a\xe0", 9, "in the middle of a copy"),
            (b"\x00a\xe0\xff\x00" * 3, 100, "another number of bytes than 100"),
            (b"\x00a", 10**9, "2 packed bytes cannot give 1000000000"),
        ],
    )
    def test_packed_bytes_that_are_damaged(self, packed, size, fact):
        with pytest.raises(ValueError, match=fact):
            unpack_lzf(packed, size)

    def test_a_packed_size_that_promises_too_much(self, tmp_path):
        data = made.pcd(XYZ, "binary_compressed")
        at = data.index(b"binary_compressed\n") + 22
        with pytest.raises(ValueError, match="packed bytes of 2000000000, expected 4800"):
            load(tmp_path, "a.pcd", data[:at] + struct.pack("<I", 2_000_000_000) + data[at + 4 :])
