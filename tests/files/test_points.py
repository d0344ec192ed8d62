"""Points of frames in the world, and .ply files as another library reads them."""

import numpy as np
import pytest
import trimesh
from scipy.spatial import cKDTree

import pointshade_gl as ps
from pointshade_gl.files.arrays.ply_and_pcd import read_ply

from ..support import frames
from ..support.posed_views import corner, disturbed, views

CAMERA = ps.Camera(80, 80, 39.5, 29.5, 80, 60)
LIGHT = ps.Light(position=(-0.8, -0.9, 0.2))


def read(path):
    """Positions, normals and colours of a .ply."""
    cloud = trimesh.load(path)
    raw = cloud.metadata["_ply_raw"]["vertex"]["data"]
    return np.asarray(cloud.vertices), np.stack([raw[name] for name in ("nx", "ny", "nz")], -1), cloud.colors[:, :3]


def pose_back(z):
    """Looks along z from where z = 0 is so far ahead."""
    return np.array([[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, -z], [0, 0, 0, 1.0]])


def moved(frame):
    """The frame with a pose that shifts and turns it."""
    return ps.Frame(frame.color, frame.depth, frame.camera, ps.orbit_pose(None, (0.3, 0, -2), 40, 10))


class TestPoints:
    def test_they_lie_where_camera_and_pose_put_them(self, renderer):
        frame = moved(frames.sphere())
        cloud = renderer.render_points(frame)
        v, u = np.nonzero(frame.depth)
        z, c = frame.depth[v, u].astype(float), frame.camera
        seen = np.stack([(u - c.cx) / c.fx * z, (v - c.cy) / c.fy * z, z, np.ones_like(z)], -1)
        assert len(cloud) == frame.points_known and cloud.positions.dtype == np.float64
        np.testing.assert_allclose(cloud.positions, (seen @ frame.pose.T)[:, :3], atol=1e-9)

    def test_rows_that_run_upwards_are_put_right(self, renderer):
        up = frames.tilted_plane()
        c = up.camera
        down = ps.Frame(
            up.color[::-1], up.depth[::-1], ps.Camera(c.fx, -c.fy, c.cx, c.height - 1 - c.cy, c.width, c.height)
        )
        expected, found = renderer.render_points(up), renderer.render_points(down)
        order = np.arange(len(expected)).reshape(up.depth.shape)[::-1].ravel()
        np.testing.assert_allclose(found.positions, expected.positions[order], atol=1e-9)
        np.testing.assert_allclose(found.normals, expected.normals[order], atol=1e-3)

    def test_normals_are_those_of_the_frame_in_world_axes(self, renderer):
        frame = moved(frames.sphere())
        cloud = renderer.render_points(frame, normals="triangles-8")
        expected = renderer.estimate_normals(frame, "triangles-8")[frame.depth > 0] @ frame.pose[:3, :3].T
        np.testing.assert_allclose(cloud.normals, expected, atol=1e-6)
        away = cloud.positions - frame.pose[:3, 3]
        assert ((cloud.normals * away).sum(-1) < 0).all()

    @pytest.mark.parametrize("shading", ["flat", "phong", "none"])
    def test_colours_are_those_of_the_picture(self, renderer, shading):
        """At the frame's own camera each pixel shows its own point."""
        frame = moved(frames.sphere_before_wall())
        light = ps.Light(position=tuple(frame.pivot + np.array([0.5, -1, -1])))
        cloud = renderer.render_points(frame, light, shading=shading)
        picture = renderer.render(frame, light, shading="none" if shading == "none" else "flat")
        difference = np.abs(picture[frame.depth > 0][:, :3].astype(int) - cloud.colors)
        assert difference.max() <= (0 if shading == "none" else 1)

    def test_unlit_colours_of_another_size_are_sampled_as_the_picture_samples_them(self, renderer):
        frame = frames.sphere_before_wall()
        frame = ps.Frame(frame.color.repeat(2, 0).repeat(2, 1)[:, 1:], frame.depth, frame.camera)
        cloud = renderer.render_points(frame, shading="none")
        picture = renderer.render(frame, shading="none", camera=frame.camera, upsample="none")
        assert np.abs(picture[frame.depth > 0][:, :3].astype(int) - cloud.colors).max() <= 1

    def test_highlights_follow_who_looks(self, renderer):
        frame = frames.sphere()
        material = ps.Material(specular=1)
        own = renderer.render_points(frame, LIGHT, material)
        turned = renderer.render_points(frame, LIGHT, material, pose=ps.orbit_pose(None, frame.pivot, yaw=50))
        np.testing.assert_array_equal(own.positions, turned.positions)
        assert np.abs(own.colors.astype(int) - turned.colors).max() > 50

    def test_a_shadow_falls_on_points(self, renderer):
        frame = frames.sphere_before_wall()
        lamp = ps.Light(position=(-0.9, -1.1, 0.1))
        plain = renderer.render_points(frame, lamp)
        shaded = renderer.render_points(frame, ps.Light(position=lamp.position, shadow=True))
        darker = shaded.colors.sum(-1, dtype=int) < plain.colors.sum(-1, dtype=int) - 60
        wall = frame.depth[frame.depth > 0] > 1.8
        assert 0.05 < darker[wall].mean() < 0.3 and darker[~wall].mean() < 0.02

    def test_noisy_depth_gives_the_smoothed_points_that_are_drawn(self, renderer):
        clean, noisy = frames.sphere_before_wall(), frames.noisy()
        smoothed = renderer.render_points(noisy).positions[:, 2] - clean.depth[clean.depth > 0]
        raw = (noisy.depth - clean.depth)[clean.depth > 0]
        assert np.abs(smoothed).mean() < 0.5 * np.abs(raw).mean()

    def test_a_frame_without_points_has_an_empty_cloud(self, renderer, tmp_path):
        cloud = renderer.render_points(frames.all_missing())
        assert len(cloud) == 0 and repr(cloud) == "PointCloud(0 points)"
        ps.save_points(tmp_path / "a.ply", cloud)
        assert b"element vertex 0\n" in (tmp_path / "a.ply").read_bytes()

    def test_pictures_before_and_after_stay_the_same(self, renderer):
        frame = frames.sphere()
        before = renderer.render(frame, LIGHT)
        renderer.render_points(frame, LIGHT, shading="none")
        np.testing.assert_array_equal(renderer.render(frame, LIGHT), before)

    def test_wrong_arguments_are_refused(self, renderer):
        with pytest.raises(TypeError, match="frame must be a Frame, got a Scene"):
            renderer.render_points(ps.Scene((ps.Node(ps.PointObject(frames.sphere())),)))
        with pytest.raises(ValueError, match="unknown shading 'toon'"):
            renderer.render_points(frames.sphere(), shading="toon")


class TestSeveralFrames:
    VIEWS = views(corner(), 3)

    def test_each_place_is_there_once_and_nothing_is_lost(self, renderer):
        every = [renderer.render_points(frame, shading="none") for frame in self.VIEWS]
        merged = renderer.render_points(self.VIEWS, shading="none")
        assert len(merged) < 0.6 * sum(map(len, every))
        found = cKDTree(merged.positions)
        spacing = np.median(cKDTree(every[0].positions).query(every[0].positions, 2)[0][:, 1])
        away = np.concatenate([found.query(one.positions)[0] for one in every])
        assert (away < 3 * spacing).mean() > 0.995
        pairs = cKDTree(np.concatenate([one.positions for one in every])).count_neighbors(found, 0.3 * spacing)
        own = found.count_neighbors(found, 0.3 * spacing) - len(merged)
        assert own < 0.02 * len(merged) < pairs

    def test_who_sees_a_place_most_densely_has_it(self, renderer):
        near, far = (ps.Frame(None, np.full((60, 80), z, np.float32), CAMERA, pose_back(z)) for z in (1, 2))
        merged = renderer.render_points([far, near], shading="none")
        middle = np.abs(merged.positions[:, :2]).max(1) < 0.2
        assert abs(len(merged) - 1.75 * 60 * 80) < 100  # a quarter of what the far one sees is the near one's
        found, alone = cKDTree(merged.positions[middle, :2]), renderer.render_points(near, shading="none")
        own = alone.positions[np.abs(alone.positions[:, :2]).max(1) < 0.19]
        assert found.query(own[:, :2])[0].max() < 1e-6

    def test_what_other_views_see_through_is_left_out(self, renderer):
        depth = np.array(self.VIEWS[0].depth)
        depth[55:65, 75:85] = 1.5  # hangs in the air
        first = ps.Frame(self.VIEWS[0].color, depth, self.VIEWS[0].camera, self.VIEWS[0].pose)
        clean = renderer.render_points(self.VIEWS, shading="none")
        merged = renderer.render_points([first, *self.VIEWS[1:]], shading="none")
        assert cKDTree(clean.positions).query(merged.positions)[0].max() < 0.1

    def test_they_are_lit_as_each_frame_is_but_in_one_exposure(self, renderer):
        dark = ps.Frame(self.VIEWS[1].color // 2, self.VIEWS[1].depth, self.VIEWS[1].camera, self.VIEWS[1].pose)
        plain, mixed = (renderer.render_points([self.VIEWS[0], one], LIGHT) for one in (self.VIEWS[1], dark))
        ratio = mixed.colors.mean() / plain.colors.mean()
        assert 0.6 < ratio < 1 and np.ptp([part.mean() for part in np.array_split(mixed.colors, 2)]) < 25

    def test_poses_are_corrected_before(self, renderer):
        wrong = disturbed(self.VIEWS, 0.02, 0.5)
        true = cKDTree(np.concatenate([renderer.render_points(one).positions for one in self.VIEWS]))
        aligned, given = (renderer.render_points(wrong, align=align).positions for align in (True, False))
        assert np.median(true.query(aligned)[0]) < 0.5 * np.median(true.query(given)[0])


def test_a_glb_stands_upright_shows_the_colours_as_they_are_and_opens_as_the_ply_does(renderer, tmp_path):
    cloud = renderer.render_points(moved(frames.sphere()), LIGHT)
    pictures = []
    for suffix in (".ply", ".glb"):
        ps.save_points(tmp_path / f"a{suffix}", cloud)
        shading = {"shading": "none"} if suffix == ".ply" else {}
        pictures.append(renderer.render(tmp_path / f"a{suffix}", **shading).astype(int))
    assert pictures[0][..., 3].any() and (np.abs(pictures[0] - pictures[1]).max(-1) > 2).mean() < 1e-3
    mesh = next(iter(trimesh.load(tmp_path / "a.glb").dump()))
    np.testing.assert_allclose(mesh.vertices * (1, -1, -1), cloud.positions, atol=1e-6)


class TestPly:
    def test_another_library_reads_what_is_in_memory(self, renderer, tmp_path):
        cloud = renderer.render_points(moved(frames.sphere()), LIGHT)
        ps.save_points(tmp_path / "a.ply", cloud)
        positions, normals, colors = read(tmp_path / "a.ply")
        np.testing.assert_array_equal(positions, cloud.positions.astype(np.float32) * np.float32((1, -1, -1)))
        np.testing.assert_array_equal(normals, cloud.normals * np.float32((1, -1, -1)))
        np.testing.assert_array_equal(colors, cloud.colors)
        vertices = read_ply(tmp_path / "a.ply").elements["vertex"]
        np.testing.assert_array_equal(np.stack([vertices[name] for name in "xyz"], -1), positions)

    def test_the_header_has_the_names_that_other_programs_know(self, tmp_path):
        ps.save_points(tmp_path / "a.ply", ps.PointCloud(np.eye(3), np.eye(3), np.zeros((3, 3), np.uint8)))
        header = (tmp_path / "a.ply").read_bytes().partition(b"end_header\n")[0].decode().splitlines()
        properties = [f"property float {name}" for name in ("x", "y", "z", "nx", "ny", "nz")]
        properties += [f"property uchar {name}" for name in ("red", "green", "blue")]
        assert header == ["ply", "format binary_little_endian 1.0", "comment up -y", "element vertex 3", *properties]

    def test_points_of_a_frame_stand_upright_and_the_header_says_so(self, renderer, tmp_path):
        cloud = renderer.render_points(frames.sphere())
        ps.save_points(tmp_path / "a.ply", cloud)
        header = (tmp_path / "a.ply").read_bytes().partition(b"end_header\n")[0].decode().splitlines()
        assert header[2:4] == ["comment up y", "comment x right, y up, z towards the viewer"]
        back = ps.load_cloud(tmp_path / "a.ply")
        assert (back.up, back.front) == ("y", "z")
        np.testing.assert_array_equal(back.positions, (cloud.positions * (1, -1, -1)).astype(np.float32))

    @pytest.mark.parametrize("axes", ["opencv", "opengl", "blender"])
    def test_our_own_file_is_seen_from_where_the_camera_stood_in_any_axes(self, renderer, tmp_path, axes):
        cloud = renderer.render_points(frames.sphere_before_wall())
        ps.save_points(tmp_path / "a.ply", cloud, axes)
        expected, picture = (renderer.render(one, shading="none").astype(int) for one in (cloud, tmp_path / "a.ply"))
        assert expected[..., 3].any() and (np.abs(picture - expected).max(-1) > 8).mean() < 2e-3

    def test_a_file_whose_header_says_only_that_y_is_down_is_seen_as_before(self, renderer, tmp_path):
        cloud = renderer.render_points(frames.sphere_before_wall())
        ps.save_points(tmp_path / "a.ply", cloud, "opencv")
        data = (tmp_path / "a.ply").read_bytes()
        (tmp_path / "old.ply").write_bytes(data.replace(b"comment x right, y down, z away from the viewer\n", b""))
        old, new = (ps.load_cloud(tmp_path / name) for name in ("old.ply", "a.ply"))
        assert (old.up, old.front) == ("-y", None) and new.front == "-z"
        np.testing.assert_array_equal(renderer.render(old), renderer.render(new))

    def test_words_that_contradict_the_headers_up_are_passed_over(self, tmp_path):
        ps.save_points(tmp_path / "a.ply", ps.PointCloud(np.eye(3), front="-z"))
        data = (tmp_path / "a.ply").read_bytes()
        (tmp_path / "a.ply").write_bytes(data.replace(b"z towards the viewer", b"y towards the viewer"))
        cloud = ps.load_cloud(tmp_path / "a.ply")
        assert (cloud.up, cloud.front) == ("y", None)

    def test_another_up_than_the_headers_takes_its_front_away(self, tmp_path):
        ps.save_points(tmp_path / "a.ply", ps.PointCloud(np.eye(3), front="-z"))
        other = ps.load_cloud(tmp_path / "a.ply", up="z")
        assert (other.up, other.front) == ("z", None)

    def test_far_from_the_worlds_origin_points_keep_their_places(self, tmp_path):
        """In map coordinates of 5000 km floats would move points by half a metre."""
        positions = np.array([5e6, 4e5, 30]) + np.random.default_rng(1).random((20, 3))
        ps.save_points(tmp_path / "a.ply", ps.PointCloud(positions, np.eye(3)[[2] * 20], np.zeros((20, 3), np.uint8)))
        np.testing.assert_array_equal(read(tmp_path / "a.ply")[0], positions)

    @pytest.mark.parametrize(
        ("name", "error", "sentence"),
        [
            ("a.obj", ValueError, r"a\.obj: the suffix of a point cloud must be one of \.ply"),
            ("no/a.ply", FileNotFoundError, "create it first"),
            ("folder.ply", IsADirectoryError, "it is a folder"),
        ],
    )
    def test_places_where_no_points_can_lie(self, tmp_path, name, error, sentence):
        (tmp_path / "folder.ply").mkdir()
        with pytest.raises(error, match=sentence):
            ps.save_points(tmp_path / name, ps.PointCloud(np.eye(3), np.eye(3), np.zeros((3, 3), np.uint8)))

    def test_an_error_leaves_nothing(self, tmp_path, monkeypatch):
        def end(*_):
            raise KeyboardInterrupt

        monkeypatch.setattr("pointshade_gl.files.writing.maps_and_points.write_ply", end)
        with pytest.raises(KeyboardInterrupt):
            ps.save_points(tmp_path / "a.ply", ps.PointCloud(np.eye(3), np.eye(3), np.zeros((3, 3), np.uint8)))
        assert not list(tmp_path.iterdir())

    @pytest.mark.parametrize(
        ("arrays", "error", "sentence"),
        [
            ((np.zeros((3, 2)), np.zeros((3, 3)), np.zeros((3, 3), np.uint8)), ValueError, "positions must have shape"),
            ((np.zeros((3, 3)), np.zeros((2, 3)), np.zeros((3, 3), np.uint8)), ValueError, r"normals .* got \(2, 3\)"),
            ((np.zeros((3, 3)), np.zeros((3, 3)), np.zeros((3, 4), np.uint8)), ValueError, r"colors .* got \(3, 4\)"),
            (
                (np.zeros((3, 3)), np.zeros((3, 3)), np.zeros((3, 3))),
                TypeError,
                "colors must be uint8 sRGB, got float64",
            ),
            ((1.0, np.zeros((3, 3)), np.zeros((3, 3), np.uint8)), ValueError, "positions must have shape"),
            ("xyz", TypeError, "positions must be numbers"),
        ],
    )
    def test_what_is_no_cloud_is_refused(self, arrays, error, sentence):
        with pytest.raises(error, match=sentence):
            ps.PointCloud(*arrays)

    def test_axes_that_a_file_cannot_have(self, tmp_path):
        with pytest.raises(ValueError, match="unknown axes 'directx': known are opencv, opengl, blender"):
            ps.save_points(tmp_path / "a.ply", ps.PointCloud(np.eye(3)), "directx")
        with pytest.raises(ValueError, match=r"a\.glb has the axes of glTF, y up: leave out axes"):
            ps.save_points(tmp_path / "a.glb", ps.PointCloud(np.eye(3)), "blender")

    def test_a_frame_is_no_cloud(self, tmp_path):
        with pytest.raises(TypeError, match="cloud must be a PointCloud, got a Frame"):
            ps.save_points(tmp_path / "a.ply", frames.sphere())
