"""What all formats of point clouds share: where positions count from, what is up, colours, samples, writing."""

import numpy as np
import pytest

import pointshade_gl as ps
from pointshade_gl.files.clouds.placing import spacing_of
from pointshade_gl.scene.cloud import UPS

from ..support import cloud_files as made

SOME = {"notes": lambda _: None}
POINTS, NORMALS, COLORS = made.bumpy()


def saved(folder, positions, **options):
    """A cloud of an .npy file with these rows."""
    np.save(folder / "a.npy", positions)
    return ps.load_cloud(folder / "a.npy", **({} if "notes" in options else SOME), **options)


def world(cloud):
    return cloud.positions.astype(np.float64) + cloud.origin


class TestOrigin:
    def test_on_a_map_points_keep_their_millimetres(self, tmp_path):
        points = made.on_map()
        cloud = saved(tmp_path, points)
        assert cloud.positions.dtype == np.float32 and (cloud.origin % 1 == 0).all() and cloud.origin.any()
        np.testing.assert_allclose(world(cloud), points, rtol=0, atol=1e-5)
        assert np.abs(points.astype(np.float32) - points).max() > 0.1  # what casting first would do

    @pytest.mark.parametrize("middle", [0, 0.3, 1, 1000])
    def test_near_zero_there_is_none(self, tmp_path, middle):
        points = POINTS.astype(np.float64) + middle
        cloud = saved(tmp_path, points)
        assert not cloud.origin.any() and cloud.positions.dtype == np.float32
        np.testing.assert_allclose(cloud.positions, points, rtol=1e-7)

    def test_float32_that_is_there_already_loses_nothing(self, tmp_path):
        points = (POINTS + 100_000).astype(np.float32)
        cloud = saved(tmp_path, points)
        assert cloud.origin.any() and (world(cloud) == points).all()

    def test_a_far_outlier_decides_nothing(self, tmp_path):
        points = made.on_map(4000)
        points[17] = 1e9
        cloud = saved(tmp_path, points)
        rest = np.delete(np.arange(4000), 17)
        np.testing.assert_allclose(world(cloud)[rest], points[rest], rtol=0, atol=1e-5)
        np.testing.assert_allclose(world(cloud)[17], 1e9, rtol=1e-6)

    def test_coordinates_of_a_thousand_million(self, tmp_path):
        points = np.round(1e9 + np.random.default_rng(0).random((500, 3)), 4)
        np.testing.assert_allclose(world(saved(tmp_path, points)), points, rtol=0, atol=2e-7)

    def test_what_no_float32_tells_apart_stays_float64(self, tmp_path):
        """Two dense halves, far from each other: no origin is near to both."""
        points = np.concatenate([POINTS, POINTS + np.array([1e6, 0, 0])]).astype(np.float64)
        cloud = saved(tmp_path, points)
        assert cloud.positions.dtype == np.float64 and not cloud.origin.any() and (cloud.positions == points).all()

    @pytest.mark.parametrize("points", [np.zeros((0, 3)), np.zeros((1, 3)), [[4.8e6, 1, 2]], [[1, 2, 3], [1, 2, 3.0]]])
    def test_hardly_any_points(self, tmp_path, points):
        cloud = saved(tmp_path, np.array(points, float))
        assert len(cloud) == len(points) and (world(cloud) == points).all()


class TestUp:
    @pytest.mark.parametrize("given", UPS)
    def test_what_is_given_wins(self, tmp_path, given):
        told = []
        assert saved(tmp_path, made.on_map(), up=given, notes=told.append).up == given and not told

    def test_a_terrain_is_least_high_upwards(self, tmp_path):
        told = []
        flat = np.random.default_rng(3).random((4000, 3)) * (40, 30, 2)
        assert saved(tmp_path, flat, notes=told.append).up == "z"
        assert told == [f"{tmp_path / 'a.npy'}: up is taken as z (it is least high there); pass up='y' if it is not"]
        assert saved(tmp_path, flat[:, [0, 2, 1]]).up in ("y", "-y")

    def test_a_room_stands_on_its_floor(self, tmp_path):
        """Floor and ceiling are wider than the walls; boxes on the floor make most of its points low."""
        rng = np.random.default_rng(4)
        floor, ceiling = (np.append(rng.random((9000, 2)) * (6, 5), np.full((9000, 1), at), 1) for at in (0, 2.6))
        walls = [np.insert(rng.random((2500, 2)) * (5, 2.6), 0, at, 1) for at in (0, 6)]
        box = rng.random((4000, 3)) * (1, 1, 0.8) + (2, 2, 0)
        room = np.concatenate([floor, ceiling[:4000], *walls, box])
        assert saved(tmp_path, room).up == "z"
        assert saved(tmp_path, room[:, [0, 2, 1]] * (1, 1, -1)).up == "y"
        assert saved(tmp_path, room[:, [0, 2, 1]] * (1, -1, 1)).up == "-y"

    def test_else_it_is_y_with_a_note(self, tmp_path):
        told = []
        assert saved(tmp_path, POINTS, notes=told.append).up == "y"
        assert told == [f"{tmp_path / 'a.npy'}: up is taken as y (nothing shows it); pass up='z' if it is not"]

    def test_maps_have_their_height_in_z(self, tmp_path):
        steep = np.random.default_rng(3).random((4000, 3)) * (40, 30, 90) + made.MAP
        assert saved(tmp_path, steep).up == "z"


class TestColors:
    def table(self, *columns):
        return np.concatenate([POINTS, *columns], 1).astype(np.float64)

    @pytest.mark.parametrize("scale", [1 / 255, 1, 257])
    def test_scales(self, tmp_path, scale):
        assert (saved(tmp_path, self.table(COLORS.astype(int) * scale)).colors == COLORS).all()

    def test_grey_by_intensity_spans_what_most_points_have(self, tmp_path):
        light = np.linspace(10, 20, len(POINTS))[:, None]
        light[-1] = 9000  # a mirror
        grey = saved(tmp_path, self.table(light)).colors[:, 0]
        assert grey[0] == grey.min() < 90 < grey[100] < grey[200] < grey[-9] == 255

    def test_intensity_that_says_nothing_gives_no_colours(self, tmp_path):
        assert saved(tmp_path, self.table(np.full((len(POINTS), 1), 0.5))).colors is None

    def test_by_height(self, tmp_path):
        cloud = saved(tmp_path, POINTS, color_by="height", up="z")
        low, high = cloud.colors[POINTS[:, 2].argmin()], cloud.colors[POINTS[:, 2].argmax()]
        assert low[2] > low[0] and high[0] > 200 > 100 > high[2]  # dark blue to yellow
        down = saved(tmp_path, POINTS, color_by="height", up="-z")
        assert (down.colors[POINTS[:, 2].argmin()] == high).all()

    def test_a_choice_that_the_file_does_not_have(self, tmp_path):
        with pytest.raises(ValueError, match=r"a\.npy has no class for color_by, only rgb, height"):
            saved(tmp_path, self.table(COLORS), color_by="class")
        with pytest.raises(ValueError, match="has no hight for color_by, only height"):
            saved(tmp_path, POINTS, color_by="hight")

    def test_labels_have_colours_of_their_own(self, tmp_path):
        told = []
        labels = (np.arange(len(POINTS)) % 5)[:, None]
        cloud = saved(tmp_path, self.table(labels), color_by="label", notes=told.append)
        each = [np.unique(cloud.colors[labels[:, 0] == k], axis=0) for k in range(5)]
        assert all(len(one) == 1 for one in each) and len(np.unique(cloud.colors, axis=0)) == 5
        assert any("coloured by label, 5 labels: 0, 1, 2, 3, 4" in one for one in told)

    def test_numbers_go_from_blue_to_yellow_between_ends_that_can_be_set(self, tmp_path):
        rows = np.rec.fromarrays([*POINTS.T, np.linspace(0, 90, len(POINTS))], names="x,y,z,scalar_Quality")
        np.save(tmp_path / "a.npy", rows)
        told = []
        cloud = ps.load_cloud(tmp_path / "a.npy", color_by="quality", notes=told.append)
        blue, yellow = cloud.colors[0], cloud.colors[-1]
        assert blue[2] > blue[0] and yellow[0] > 200 > 100 > yellow[2]
        assert any("by scalar_Quality, 1.8 dark blue to 88.2 yellow; color_range sets these" in t for t in told)
        wide = ps.load_cloud(tmp_path / "a.npy", color_by="quality", color_range=(0, 900), notes=told.append)
        assert (wide.colors[-1] != yellow).any() and wide.colors[-1][2] > wide.colors[-1][0]

    def test_a_range_of_what_has_none(self, tmp_path):
        for given, fact in (({}, "needs color_by"), ({"color_by": "rgb"}, "is of numbers")):
            with pytest.raises(ValueError, match=fact):
                saved(tmp_path, self.table(COLORS), color_range=(0, 1), **given)
        with pytest.raises(ValueError, match=r"two numbers, the lower first, got \(1, 0\)"):
            saved(tmp_path, POINTS, color_by="height", color_range=(1, 0))


class TestMost:
    def test_an_even_sample_that_is_told(self, tmp_path):
        told = []
        rows = np.stack([np.arange(1000.0), np.zeros(1000), np.zeros(1000)], -1)
        cloud = saved(tmp_path, rows, most=300, up="z", notes=told.append)
        x = cloud.positions[:, 0]
        assert len(cloud) == 300 and (np.diff(x) > 0).all() and np.diff(x).max() <= 8
        assert told == [f"{tmp_path / 'a.npy'}: 300 of its 1 000 points are read, an even sample"]
        assert (saved(tmp_path, rows, most=300, up="z").positions == cloud.positions).all()  # the same each time

    def test_all_columns_keep_together(self, tmp_path):
        cloud = saved(tmp_path, np.concatenate([POINTS, COLORS], 1), most=77)
        place = [int(np.flatnonzero((one == POINTS).all(1))[0]) for one in cloud.positions]
        assert (cloud.colors == COLORS[place]).all()

    @pytest.mark.parametrize("most", [400, 10**6])
    def test_enough_for_all(self, tmp_path, most):
        assert len(saved(tmp_path, POINTS, most=most)) == 400

    @pytest.mark.parametrize(("most", "error"), [(0, ValueError), (1.5, ValueError), ("many", TypeError)])
    def test_numbers_that_are_none(self, tmp_path, most, error):
        with pytest.raises(error, match="most must be a whole number from 1"):
            saved(tmp_path, POINTS, most=most)


class TestCropAndClean:
    def test_points_in_the_box_are_kept_with_all_they_have(self, tmp_path):
        told, table = [], np.concatenate([POINTS, COLORS], 1)
        low, high = np.quantile(POINTS, (0.2, 0.8), axis=0)
        inside = ((low <= POINTS) & (high >= POINTS)).all(1)
        for box in ((*low, *high), (high, low)):
            cloud = saved(tmp_path, table, crop=box, up="z", notes=told.append)
            np.testing.assert_allclose(world(cloud), POINTS[inside], atol=1e-6)
            assert (cloud.colors == COLORS[inside]).all()
        assert told[0] == f"{tmp_path / 'a.npy'}: {inside.sum()} of its 400 points lie in the box of crop"

    def test_the_box_is_in_the_coordinates_of_the_file(self, tmp_path):
        on_map = made.on_map()
        middle = np.median(on_map, axis=0)
        cloud = saved(tmp_path, on_map, crop=(middle - 20, middle + 20))
        assert 5 < len(cloud) < 100 and (np.abs(world(cloud) - middle) <= 20.001).all()

    @pytest.mark.parametrize("box", [(0, 0, 0, 1, 1), (0, 0, 0, 1, 1, np.nan), "123456", [[0, 1], [0, 1], [0, 1]]])
    def test_what_is_no_box(self, tmp_path, box):
        with pytest.raises((ValueError, TypeError), match="crop must be two opposite corners of a box"):
            saved(tmp_path, POINTS, crop=box)

    def test_an_empty_box_is_refused_with_where_points_are(self, tmp_path):
        with pytest.raises(ValueError, match="has no point in the box of crop: its points lie from"):
            saved(tmp_path, POINTS, crop=(50, 50, 50, 60, 60, 60))

    def test_stray_points_are_left_out_and_told(self, tmp_path):
        told, way = [], made.write_with_strays(tmp_path / "a.ply", 30)
        cloud = ps.load_cloud(tmp_path / "a.ply", clean=True, up="z", notes=told.append)
        np.testing.assert_allclose(cloud.positions, way[:2000], atol=1e-5)
        assert told == [f"{tmp_path / 'a.ply'}: 30 of its 2 030 points lie far from all others: left out"]
        del told[:]
        assert len(ps.load_cloud(tmp_path / "a.ply", up="z", notes=told.append)) == 2030
        assert (
            len(told) == 1 and "30 points lie far from all others: pictures are framed without, clean=True" in told[0]
        )

    def test_stray_points_of_a_map_cost_no_millimetres(self, tmp_path):
        on_map = np.concatenate([made.on_map(3000), np.ones((30, 3))])
        cloud = saved(tmp_path, on_map)
        assert np.abs(world(cloud) - on_map)[:3000].max() < 1e-4

    def test_nothing_is_left_out_of_what_has_none(self, tmp_path):
        assert len(saved(tmp_path, POINTS, clean=True)) == 400
        with pytest.raises(TypeError, match="clean must be True or False"):
            saved(tmp_path, POINTS, clean="yes")


class TestSeenFrom:
    def test_a_place_is_in_the_coordinates_of_the_file(self, tmp_path):
        on_map = made.on_map()
        cloud = saved(tmp_path, on_map, seen_from=on_map[0])
        assert cloud.seen_from.shape == (3,) and (cloud.seen_from + cloud.origin == on_map[0]).all()

    @pytest.mark.parametrize("mixed", [False, True])
    def test_of_several_places_each_point_takes_one_that_sees_it(self, tmp_path, mixed):
        """A wall between two scanners hides each side of it from the other."""
        aside = np.stack(np.meshgrid(np.linspace(-1, 1, 90), np.linspace(-1, 1, 90)), -1).reshape(-1, 2)
        walls = [  # as wide as they hide those behind
            np.c_[np.full(8100, x), (1.5 if x < 0 else 1) * abs(x - eye) * aside]
            for x, eye in ((-0.1, -2), (0.1, 3), (-6, -2), (6, 3))
        ]
        at = np.concatenate(walls)
        at = np.random.default_rng(7).permutation(at) if mixed else at
        cloud = saved(tmp_path, at, seen_from=[(-2, 0, 0), (3, 0, 0)])
        expected = np.where(at[:, :1] < 0, (-2, 0, 0), (3, 0, 0))
        assert (cloud.seen_from == expected).all(1).mean() > 0.99

    def test_points_of_one_scan_after_the_other_keep_together(self, tmp_path):
        places, rng = np.array([(0, 0, 30.0), (10, 0, 30.0)]), np.random.default_rng(8)
        scans = [np.c_[rng.normal(place[:2], 6, (4000, 2)), np.zeros(4000)] for place in places]
        cloud = saved(tmp_path, np.concatenate(scans), seen_from=places)
        assert (cloud.seen_from == np.repeat(places, 4000, 0)).all(1).mean() > 0.97

    @pytest.mark.parametrize("places", [(0, 0), [], [[0, 0, np.inf]], "here", np.zeros((101, 3))])
    def test_what_is_no_place(self, tmp_path, places):
        with pytest.raises((ValueError, TypeError), match="seen_from must be a place"):
            saved(tmp_path, POINTS, seen_from=places)


class TestLimits:
    def test_more_points_than_allowed(self, tmp_path, monkeypatch):
        np.save(tmp_path / "a.npy", POINTS)
        with pytest.raises(
            ValueError, match=r"a\.npy has 400 points, the limit is 399: pass max_pixels=400 to allow it"
        ):
            monkeypatch.setattr("pointshade_gl.files.access.content.MAX_PIXELS", 1)
            ps.load_cloud(tmp_path / "a.npy", max_pixels=399, **SOME)

    def test_what_is_no_number(self, tmp_path):
        table = POINTS.astype(np.float64)
        table[[1, 5, 9]] = np.nan, np.inf, 1e19
        told = []
        cloud = saved(tmp_path, table, notes=told.append)
        assert (cloud.positions == np.delete(POINTS, [1, 5, 9], 0)).all() and "3 points of 400" in told[0]
        assert len(saved(tmp_path, np.full((5, 3), np.nan))) == 0

    def test_normals_that_are_unknown_or_of_any_length(self, tmp_path):
        normals = NORMALS * np.linspace(0.99, 1.01, 400)[:, None]
        normals[3], normals[4] = 0, np.nan
        cloud = saved(tmp_path, np.concatenate([POINTS, normals], 1))
        assert not cloud.normals[3:5].any()
        np.testing.assert_allclose(np.delete(cloud.normals, [3, 4], 0), np.delete(NORMALS, [3, 4], 0), atol=1e-6)


CLOUDS = {
    "points alone": ps.PointCloud(POINTS),
    "all": ps.PointCloud(
        POINTS, NORMALS, COLORS, np.linspace(0, 1, 400), np.linspace(1, 0, 400), made.MAP, "z", (1.5, 2, -0.25)
    ),
    "several scanners": ps.PointCloud(POINTS, seen_from=NORMALS.astype(np.float64) * 3, up="y"),
    "no points": ps.PointCloud(np.zeros((0, 3), np.float32), up="x"),
}


class TestWriting:
    @pytest.mark.parametrize("name", CLOUDS)
    def test_what_is_written_is_the_same_when_it_is_opened(self, tmp_path, name):
        told = []
        ps.save_points(tmp_path / "a.ply", CLOUDS[name])
        again = ps.load_cloud(tmp_path / "a.ply", notes=told.append)
        assert not told
        for key in ("positions", "normals", "colors", "sizes", "confidence", "origin", "up", "seen_from"):
            found, expected = getattr(again, key), getattr(CLOUDS[name], key)
            assert (found is None) == (expected is None), key
            if expected is not None and not isinstance(expected, str):
                np.testing.assert_allclose(found, expected, rtol=0, atol=1e-9 if key == "positions" else 3e-7)
            else:
                assert found == expected, key

    def test_a_second_time_it_is_byte_for_byte_the_same(self, tmp_path):
        ps.save_points(tmp_path / "a.ply", CLOUDS["all"])
        ps.save_points(tmp_path / "b.ply", ps.load_cloud(tmp_path / "a.ply"))
        ps.save_points(tmp_path / "c.ply", ps.load_cloud(tmp_path / "b.ply"))
        assert (tmp_path / "b.ply").read_bytes() == (tmp_path / "c.ply").read_bytes()

    def test_other_programs_find_the_world_s_coordinates(self, tmp_path):
        ps.save_points(tmp_path / "a.ply", CLOUDS["all"])
        data = (tmp_path / "a.ply").read_bytes()
        head, _, body = data.partition(b"end_header\n")
        assert b"property double x" in head and b"comment origin 4800000.0 500000.0 300.0" in head
        x = np.frombuffer(body, "<f8", 1)[0]
        assert x == 4_800_000 + float(POINTS[0, 0])


def test_the_spacing_of_a_random_surface():
    rng = np.random.default_rng(8)
    for count in (900, 50_000):
        sheet = np.append(rng.random((count, 2)) * (3, 2), np.zeros((count, 1)), 1)
        assert spacing_of(sheet) == pytest.approx(np.sqrt(6 / count), rel=0.08)
    assert spacing_of(np.zeros((1, 3))) == spacing_of(np.ones((5, 3))) == 0
