"""What columns of numbers are, where no format says so; and what is left out of a cloud, or turned into metres."""

import numpy as np
import pytest

import pointshade_gl as ps

from ..support import cloud_files as made

POINTS, NORMALS, COLORS = made.bumpy()
LABEL = (np.arange(len(POINTS)) % 4)[:, None]


def load(folder, name, *tables, header="", **options):
    """A text of that name, as a cloud, and what was told."""
    told = []
    rows = np.concatenate([np.asarray(one, float).reshape(len(POINTS), -1) for one in tables], 1)
    np.savetxt(folder / name, rows, fmt="%.9g", header=header, comments="")
    return ps.load_cloud(folder / name, notes=told.append, **options), told


def same(array, expected):
    return array is not None and np.abs(array.astype(float) - expected).max() < 1e-5


class TestContent:
    @pytest.mark.parametrize(
        ("beside", "colors", "normals", "taken"),
        [
            ([COLORS, np.full(400, 255)], COLORS, None, "red,green,blue,alpha"),
            ([COLORS, LABEL], COLORS, None, "red,green,blue,label"),
            ([COLORS / 255, LABEL], COLORS, None, "red,green,blue,label"),
            ([NORMALS, np.full(400, 12)], None, NORMALS, "nx,ny,nz,label"),
            ([COLORS, NORMALS, LABEL], COLORS, NORMALS, "red,green,blue,nx,ny,nz,label"),
            ([LABEL], None, None, "label"),
            ([COLORS, np.linspace(0, 4000, 400)], COLORS, None, "red,green,blue,intensity"),
        ],
    )
    def test_colours_normals_and_labels_are_told_by_their_numbers(self, tmp_path, beside, colors, normals, taken):
        cloud, told = load(tmp_path, "a.xyz", POINTS, *beside)
        assert colors is None or same(cloud.colors, colors)
        assert normals is None or same(cloud.normals, normals)
        assert any(f"taken as x,y,z,{taken}; pass columns='x,y,z,...' if they are not" in one for one in told)

    def test_colour_is_the_three_columns_that_go_together(self, tmp_path):
        """Light, red, green, blue or red, green, blue, light: all whole numbers from 0 to 255."""
        light = np.random.default_rng(1).integers(0, 256, 400)
        grey = np.clip(np.linspace(20, 230, 400)[:, None] + np.random.default_rng(2).normal(0, 15, (400, 3)), 0, 255)
        for tables in ([light, grey.round()], [grey.round(), light]):
            cloud, _ = load(tmp_path, "a.xyz", POINTS, *tables)
            assert same(cloud.colors, grey.round())

    def test_the_caller_knows_better(self, tmp_path):
        cloud, _ = load(tmp_path, "a.xyz", LABEL, COLORS, POINTS, columns="label,r,g,b,x,y,z", color_by="label")
        assert same(cloud.positions, POINTS) and len(np.unique(cloud.colors, axis=0)) == 4
        with pytest.raises(ValueError, match="columns names 4 columns, and it has 7"):
            load(tmp_path, "a.xyz", LABEL, COLORS, POINTS, columns="x,y,z,label")
        with pytest.raises(ValueError, match="columns must name x, y and z"):
            load(tmp_path, "a.xyz", POINTS, columns="a,b,c")

    def test_columns_of_files_with_names_are_called_otherwise(self, tmp_path):
        columns = {"a": POINTS[:, 0], "b": POINTS[:, 1], "c": POINTS[:, 2]}
        (tmp_path / "a.ply").write_bytes(made.ply_text(columns))
        assert same(ps.load_cloud(tmp_path / "a.ply", columns="x,z,y", up="z").positions, POINTS[:, [0, 2, 1]])


class TestHeads:
    @pytest.mark.parametrize(
        "head",
        [
            "//X Y Z R G B\n400", "# x y z red green blue", '"Points:0","Points:1","Points:2","RGB:0","RGB:1","RGB:2"',
            "Points_0 Points_1 Points_2 rgb_0 rgb_1 rgb_2",
            '"Points_m_XYZ:0","Points_m_XYZ:1","Points_m_XYZ:2","R","G","B"', "Easting;Northing;Elevation;R;G;B",
            "X [m],Y [m],Z [m],R,G,B",            "400\n//X Y Z R G B",
        ],
    )  # fmt: skip
    def test_names_and_counts_in_either_order(self, tmp_path, head):
        cloud, _ = load(tmp_path, "a.txt", POINTS, COLORS, header=head)
        assert len(cloud) == 400 and same(cloud.colors, COLORS)

    def test_names_with_blanks_between_commas(self, tmp_path):
        rows = np.concatenate([POINTS, COLORS, LABEL], 1)
        np.savetxt(tmp_path / "a.csv", rows, "%.9g", ",", header="X,Y,Z,R,G,B,My field", comments="")
        cloud = ps.load_cloud(tmp_path / "a.csv", color_by="my FIELD", notes=lambda _: None)
        assert len(np.unique(cloud.colors, axis=0)) == 4

    @pytest.mark.parametrize(("between", "point"), [("\t", ","), (" ", ","), ("|", "."), (";", ",")])
    def test_decimal_commas_and_bars(self, tmp_path, between, point):
        text = "\n".join(between.join(f"{one:.6f}" for one in row) for row in POINTS)
        (tmp_path / "a.xyz").write_text(text.replace(".", point))
        assert same(ps.load_cloud(tmp_path / "a.xyz", up="z").positions, POINTS)

    def test_a_text_of_two_bytes_a_letter(self, tmp_path):
        text = "\r\n".join(" ".join(f"{one:.6f}" for one in row) for row in POINTS)
        (tmp_path / "a.xyz").write_text(text, encoding="utf-16")
        assert same(ps.load_cloud(tmp_path / "a.xyz", up="z").positions, POINTS)

    def test_a_count_before_each_of_several_scans(self, tmp_path):
        text = [" ".join(map(repr, map(float, row))) for row in POINTS]
        (tmp_path / "a.pts").write_text("\n".join(["100", *text[:100], "300", *text[100:]]))
        told = []
        assert len(ps.load_cloud(tmp_path / "a.pts", notes=told.append)) == 400


class TestPtx:
    def test_each_scan_stands_at_its_place(self, tmp_path):
        lines, turn = [], np.array([[0, 1, 0], [-1, 0, 0], [0, 0, 1]])
        for place in ((10, 20, 5), (0, 0, 1)):
            rows = np.concatenate([turn, [place]])
            lines += ["20", "20", " ".join(map(str, place)), "1 0 0", "0 1 0", "0 0 1"]
            lines += [" ".join(map(str, [*row, int(k == 3)])) for k, row in enumerate(rows)]
            points = [*POINTS[:399].tolist(), [0, 0, 0]]
            lines += [" ".join(map(str, [*at, 0.5, *color])) for at, color in zip(points, COLORS, strict=True)]
        (tmp_path / "a.ptx").write_text("\n".join(lines) + "\n")
        told = []
        cloud = ps.load_cloud(tmp_path / "a.ptx", notes=told.append)
        moved = POINTS[:399] @ turn
        assert same(cloud.positions, np.concatenate([moved + np.array([10, 20, 5]), moved + np.array([0, 0, 1])]))
        assert np.unique(cloud.seen_from, axis=0).tolist() == [[0, 0, 1], [10, 20, 5]]
        assert same(cloud.colors[:399], COLORS[:399]) and "2 points of 800 are returns that never came" in told[0]

    def test_one_that_ends_early(self, tmp_path):
        lines = ["20", "20", *["0 0 0"] * 4, "1 0 0 0", "0 1 0 0", "0 0 1 0", "0 0 0 1", "1 2 3 .5"]
        (tmp_path / "a.ptx").write_text("\n".join(lines))
        with pytest.raises(
            ValueError, match=r"a\.ptx is a broken PTX file: it does not hold the points that its scan 0 counts"
        ):
            ps.load_cloud(tmp_path / "a.ptx")


class TestNormals:
    def test_a_field_that_holds_none_is_left_out_with_a_note(self, tmp_path):
        junk = np.random.default_rng(5).uniform(-1, 90, (400, 3))
        cloud, told = load(tmp_path, "a.txt", POINTS, junk, header="x y z nx ny nz")
        assert cloud.normals is None and any(
            "fields called normals hold none, their lengths go from" in t for t in told
        )

    def test_none_of_no_points(self, tmp_path):
        columns = {name: np.zeros(0, np.float32) for name in ("x", "y", "z", "nx", "ny", "nz")}
        (tmp_path / "a.ply").write_bytes(made.ply_text(columns))
        assert len(ps.load_cloud(tmp_path / "a.ply", notes=lambda _: None)) == 0

    def test_normals_of_another_length_are_kept(self, tmp_path):
        cloud, _ = load(tmp_path, "a.txt", POINTS, np.rint(NORMALS * 127), header="x y z nx ny nz")
        assert (cloud.normals * NORMALS).sum(1).min() > 0.999


class TestPlaces:
    @pytest.mark.parametrize("name", ["a.pcd", "a.ply", "a.xyz"])
    def test_a_map_in_a_text_keeps_its_millimetres(self, tmp_path, name):
        on_map = made.on_map()
        columns = {axis: on_map[:, k] for k, axis in enumerate("xyz")}
        if name == "a.xyz":
            np.savetxt(tmp_path / name, on_map, "%.3f")
        elif name == "a.ply":
            (tmp_path / name).write_bytes(made.ply_text(columns).replace(b"double", b"float"))
        else:
            (tmp_path / name).write_bytes(made.pcd(columns, "ascii").replace(b"SIZE 8 8 8", b"SIZE 4 4 4"))
        cloud = ps.load_cloud(tmp_path / name, up="z")
        assert np.abs(cloud.positions + cloud.origin - on_map).max() < 5e-4

    def test_what_float32_has_lost_is_told(self, tmp_path):
        told = []
        np.save(tmp_path / "a.npy", made.on_map().astype(np.float32))
        ps.load_cloud(tmp_path / "a.npy", notes=told.append)
        assert any("its coordinates are float32 and lie so far from 0 that they are 0.57 apart" in one for one in told)
        np.save(tmp_path / "b.npy", made.on_map())
        told.clear()
        ps.load_cloud(tmp_path / "b.npy", notes=told.append)
        assert not any("coordinates are float32" in one for one in told)

    @pytest.mark.parametrize("head", ["", "lon lat alt", "Latitude Longitude Height"])
    def test_degrees_become_metres(self, tmp_path, head):
        rng = np.random.default_rng(3)
        table = np.c_[11.5 + 0.002 * rng.random(400), 48.1 + 0.002 * rng.random(400), 250 + 10 * rng.random(400)]
        cloud, told = load(tmp_path, "a.txt", table[:, [1, 0, 2]] if head.startswith("Lat") else table, header=head)
        sides = np.ptp(cloud.positions, 0)
        assert sides == pytest.approx([0.002 * 111320 * np.cos(np.radians(48.1)), 0.002 * 111200, 10], rel=0.02)
        assert cloud.up == "z" and any("x and y are degrees, longitude and latitude" in one for one in told)

    def test_latitude_first_and_without_heights(self, tmp_path):
        rng = np.random.default_rng(3)
        table = np.c_[37.7 + 0.002 * rng.random(400), -122.4 + 0.002 * rng.random(400), 30 * rng.random(400)]
        cloud, told = load(tmp_path, "a.txt", table)
        assert np.ptp(cloud.positions[:, 0]) == pytest.approx(0.002 * 111320 * np.cos(np.radians(37.7)), rel=0.02)
        assert any("degrees, latitude and longitude" in one for one in told)
        flat, told = load(tmp_path, "a.txt", table * (1, 1, 0))
        assert np.ptp(flat.positions[:, 0]) < 0.01 and any("may be degrees" in one for one in told)

    def test_unless_the_caller_calls_them_x_and_y(self, tmp_path):
        table = np.c_[11.5 + 0.002 * np.random.default_rng(3).random((400, 2)), np.linspace(250, 260, 400)]
        cloud, told = load(tmp_path, "a.txt", table, columns="x,y,z")
        assert np.ptp(cloud.positions[:, 0]) < 0.01 and not any("degrees" in one for one in told)

    def test_a_pole_in_metres_is_no_place_in_degrees(self, tmp_path):
        pole = np.c_[POINTS[:, :2] * 0.05 + (3, 2), np.linspace(0, 8, 400)]
        _, told = load(tmp_path, "a.txt", pole)
        assert not any("degrees" in one for one in told)


class TestLeftOut:
    def test_returns_that_never_came(self, tmp_path):
        at = POINTS + np.float32([10, 0, 0])
        at[::2] = 0
        cloud, told = load(tmp_path, "a.xyz", at)
        assert len(cloud) == 200 and any("200 of 400 points lie at (0, 0, 0)" in one for one in told)
        assert len(load(tmp_path, "a.xyz", at, all_points=True)[0]) == 400

    def test_a_single_point_at_the_origin_stays(self, tmp_path):
        assert len(load(tmp_path, "a.xyz", np.r_[POINTS[:-1], np.zeros((1, 3))])[0]) == 400

    def test_noise_and_withheld_points_of_las(self, tmp_path):
        classes, withheld = np.full(300, 2, np.uint8), np.zeros(300, np.uint8)
        classes[:10], classes[10:15], withheld[12:20] = 7, 18, 1
        made.las(tmp_path / "a.las", made.on_map(), classification=classes, withheld=withheld)
        told = []
        assert len(ps.load_cloud(tmp_path / "a.las", notes=told.append)) == 280
        assert (
            "20 points of 300 are left out, 15 of class 7 or 18 (noise) and 8 withheld: all_points=True keeps"
            in told[0]
        )
        assert len(ps.load_cloud(tmp_path / "a.las", all_points=True)) == 300


class TestOtherFiles:
    def test_records_in_an_archive(self, tmp_path):
        rows = np.zeros(400, [("x", "f4"), ("y", "f4"), ("z", "f4"), ("label", "i4")])
        rows["x"], rows["y"], rows["z"] = POINTS.T
        np.savez(tmp_path / "a.npz", points=rows)
        whole = np.zeros(400, [("xyz", "f4", (3,)), ("rgb", "u1", (3,))])
        whole["xyz"], whole["rgb"] = POINTS, COLORS
        np.savez(tmp_path / "b.npz", cloud=whole)
        np.savez(tmp_path / "c.npz", x=POINTS[:, 0], y=POINTS[:, 1], z=POINTS[:, 2])
        for name in "abc":
            cloud = ps.load_cloud(tmp_path / f"{name}.npz", up="z")
            assert same(cloud.positions, POINTS) and (name != "b" or same(cloud.colors, COLORS))

    def test_pcd_with_small_letters(self, tmp_path):
        columns = {axis: POINTS[:, k] for k, axis in enumerate("xyz")}
        (tmp_path / "a.pcd").write_bytes(made.pcd(columns, "ascii").replace(b"TYPE F F F", b"TYPE f f f"))
        assert same(ps.load_cloud(tmp_path / "a.pcd").positions, POINTS)

    def test_vertices_of_obj(self, tmp_path):
        rows = zip(POINTS.tolist(), (COLORS / 255).tolist(), strict=True)
        lines = (f"v {' '.join(map(repr, [*at, *color]))}\n" for at, color in rows)
        (tmp_path / "a.obj").write_text("".join(["# made by hand\no thing\n", *lines]))
        cloud = ps.load_cloud(tmp_path / "a.obj", notes=lambda _: None)
        assert same(cloud.positions, POINTS) and same(cloud.colors, COLORS) and cloud.up == "y"

    def test_normals_of_e57(self, tmp_path):
        made.e57_with_normals(tmp_path / "a.e57", POINTS, NORMALS)
        cloud = ps.load_cloud(tmp_path / "a.e57", notes=lambda _: None)
        assert same(cloud.positions, POINTS) and same(cloud.normals, NORMALS)
