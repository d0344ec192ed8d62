"""Points, normals and depth as a user writes them: single files, numbered files, and the sentences where it fails."""

import json
import re

import numpy as np
import OpenEXR
import pytest
import trimesh
from PIL import Image
from scipy.spatial import cKDTree

import pointshade_gl as ps

from ..support.command import run
from .test_cli import check_refused

CAMERA = {"width": 8, "height": 6, "fx": 10, "fy": 10, "cx": 3.5, "cy": 2.5, "depth_scale": 1000}


@pytest.fixture
def folder(tmp_path):
    """A wall at 1.5 m, in grey."""
    return make_folder(tmp_path / "frame", {"depth": np.full((6, 8), 1500, np.uint16), "color": grey(120)})


@pytest.fixture
def sequence(tmp_path):
    """Four walls, at 1500 mm, 1501 mm and so on; the camera moves to its right, 1 m a frame. The third is broken."""
    pictures = {f"depth/{k}": np.full((6, 8), 1500 + k, np.uint16) for k in range(4)}
    place = make_folder(tmp_path / "sequence", pictures | {f"color/{k}": grey(100 + 10 * k) for k in range(4)})
    (place / "depth" / "2.png").write_bytes(b"no picture at all")
    (place / "poses_tum.txt").write_text("".join(f"{k} {k} 0 0 0 0 0 1\n" for k in range(4)))
    return place


def grey(value):
    return np.full((6, 8, 3), value, np.uint8)


def make_folder(place, pictures):
    place.mkdir()
    for name, picture in pictures.items():
        (place / name).parent.mkdir(exist_ok=True)
        Image.fromarray(picture).save(place / f"{name}.png")
    (place / "intrinsics.json").write_text(json.dumps(CAMERA))
    return place


def written(tmp_path):
    return sorted(path.name for path in tmp_path.iterdir() if path.is_file())


@pytest.mark.usefixtures("renderer")
class TestFiles:
    def test_points_lit_and_unlit(self, folder, tmp_path):
        done = run("render", folder, "-o", tmp_path / "a.ply")
        assert done.returncode == 0, done.stderr
        assert re.fullmatch(r".+a\.ply: 48 points, .+, \d+ ms\n", done.stdout)
        assert run("render", folder, "-o", tmp_path / "b.PLY", "--shading", "none").returncode == 0
        lit, unlit = trimesh.load(tmp_path / "a.ply"), trimesh.load(tmp_path / "b.PLY", file_type="ply")
        np.testing.assert_allclose(lit.vertices[0], (-0.35 * 1.5, 0.25 * 1.5, -1.5), rtol=1e-6)
        np.testing.assert_array_equal(unlit.colors[:, :3], 120)
        expected = ps.render_points(ps.load_frame(folder))
        np.testing.assert_array_equal(lit.colors[:, :3], expected.colors)
        assert (expected.colors != 120).all()

    def test_a_glb_is_a_textured_surface_and_points_if_asked_for(self, folder, tmp_path):
        done = run("render", folder, "-o", tmp_path / "a.glb", "--shading", "none")
        assert done.returncode == 0, done.stderr
        (mesh,) = trimesh.load_scene(tmp_path / "a.glb").geometry.values()
        assert re.search(rf": {len(mesh.faces)} triangles", done.stdout) and len(mesh.faces) > 2 * 5 * 7
        assert np.asarray(mesh.visual.material.baseColorTexture).shape == (6, 8, 3)
        assert (np.asarray(mesh.visual.material.baseColorTexture) == 120).all()
        for name in ("b.glb", "b.gltf"):
            done = run("render", folder, "-o", tmp_path / name, "--points")
            assert done.returncode == 0 and ": 48 points" in done.stdout, done.stderr
            (cloud,) = trimesh.load_scene(tmp_path / name).geometry.values()
            assert len(cloud.vertices) == 48 and not hasattr(cloud, "faces")

    @pytest.mark.parametrize(
        ("axes", "first"), [("opencv", (-0.35, -0.25, 1)), ("opengl", (-0.35, 0.25, -1)), ("blender", (-0.35, 1, 0.25))]
    )
    def test_axes_of_points(self, folder, tmp_path, axes, first):
        done = run("render", folder, "-o", tmp_path / "a.ply", "--axes", axes)
        assert done.returncode == 0, done.stderr
        np.testing.assert_allclose(trimesh.load(tmp_path / "a.ply").vertices[0], np.multiply(first, 1.5), rtol=1e-6)

    def test_points_of_a_sequence_lie_in_one_world(self, sequence, tmp_path):
        done = run("render", sequence, "-o", tmp_path / "p{:03d}.ply", "--light", "0,0,0")
        assert done.returncode == 0, done.stderr
        assert ": 3 files, the first of 48 points" in done.stdout and "warning: skipped frame 2" in done.stderr
        assert written(tmp_path) == ["p000.ply", "p001.ply", "p003.ply"]
        middles = [trimesh.load(tmp_path / name).vertices.mean(0) for name in written(tmp_path)]
        np.testing.assert_allclose(middles, [(0, 0, -1.5), (1, 0, -1.501), (3, 0, -1.503)], atol=1e-6)

    def test_points_under_a_light_that_turns(self, folder, tmp_path):
        done = run("render", folder, "-o", tmp_path / "##.ply", "--turntable", "light", "--frames", "3")
        assert done.returncode == 0, done.stderr
        first, second, _ = (trimesh.load(tmp_path / name) for name in written(tmp_path))
        np.testing.assert_array_equal(first.vertices, second.vertices)
        assert (first.colors != second.colors).any()

    def test_normals_of_a_sequence_are_numbered_like_its_frames(self, sequence, tmp_path):
        done = run("normals", sequence, "-o", tmp_path / "n%04d.png")
        assert done.returncode == 0, done.stderr
        assert ": 3 files, the first of 48 normals by auto" in done.stdout and "warning: skipped frame 2" in done.stderr
        assert written(tmp_path) == ["n0000.png", "n0001.png", "n0003.png"]
        with Image.open(tmp_path / "n0003.png") as image:
            assert np.asarray(image)[3, 4].tolist() == [128, 128, 255, 255]

    def test_normals_with_more_bits_and_other_axes(self, folder, tmp_path):
        assert run("normals", folder, "-o", tmp_path / "n.png", "--bits", "16", "--axes", "opencv").returncode == 0
        assert (tmp_path / "n.png").read_bytes()[24:26] == bytes([16, 6])  # the header's bits a sample, and RGBA
        assert run("normals", folder, "-o", tmp_path / "n.exr").returncode == 0
        with OpenEXR.File(str(tmp_path / "n.exr")) as file:
            assert file.channels()["RGBA"].pixels[3, 4] == pytest.approx((0, 0, 1, 1), abs=1e-5)

    def test_normals_of_a_view_and_of_a_scene_are_those_of_what_is_drawn(self, folder, tmp_path):
        for source, options, expected in (
            (folder, ["--yaw", "10"], ps.render_normals(ps.load_frame(folder), yaw=10)),
            (folder, [], ps.estimate_normals(ps.load_frame(folder))),
            ("demo", ["--picture-size", "64x48"], None),
        ):
            done = run("normals", source, "-o", tmp_path / "n.npy", *options, "--missing", "keep")
            assert done.returncode == 0, done.stderr
            found = np.load(tmp_path / "n.npy")
            if expected is not None:
                np.testing.assert_array_equal(found, expected)
        assert found.shape == (48, 64, 3) and np.isfinite(found).all(-1).mean() > 0.9

    def test_with_temporal_a_turntable_plays_the_sequence(self, sequence, tmp_path):
        line = "--turntable", "light", "--temporal"
        done = run("render", sequence, "-o", tmp_path / "%d.png", *line)
        assert done.returncode == 0 and written(tmp_path) == ["0.png", "1.png", "3.png"], done.stderr

    def test_each_frame_of_a_sequence_is_explained(self, sequence, tmp_path):
        done = run("normals", sequence, "-o", tmp_path / "%d.npy", "--normals", "central", "--explain")
        assert done.returncode == 0 and done.stdout.count("central") == 4  # three frames, and the last line

    def test_millimetres_in_a_png_are_said_to_look_black_and_metres_are_not(self, folder, sequence, tmp_path):
        words = "holds millimetres, nearly black in picture viewers: 1.5 m is 1500 of 65535"
        assert run("depth", sequence, "-o", tmp_path / "%d.png").stderr.count(words) == 1
        assert words not in run("depth", folder, "-o", tmp_path / "d.npy").stderr

    def test_a_picture_without_a_name_is_called_like_its_input_and_replaces_none(self, folder, tmp_path, monkeypatch):
        monkeypatch.chdir(tmp_path)
        small = "--picture-size", "8x6", "--samples", "1"
        for words in ((folder,), (folder,), (), ("--depth", folder / "depth.png")):
            done = run("render", *words, *small)
            assert done.returncode == 0, done.stderr
        assert written(tmp_path) == ["depth.png", "frame.png", "frame_2.png", "vase.png"]
        monkeypatch.chdir(folder)
        assert run("render", ".", "--turntable", "swing", "--frames", "2", *small).returncode == 0
        assert (folder / "frame.mp4").exists()

    def test_shadings_that_look_alike_are_told_where_they_do(self, folder, tmp_path):
        alike = "flat looks like phong from the frame's own camera: each pixel is a point. Try --yaw 20"
        for words, is_told in (
            (("--shading", "flat"), True),
            (("--shading", "flat", "--yaw", "5"), False),
            (("--shading", "none"), False),
            ((), False),
        ):
            assert (alike in run("render", folder, "-o", tmp_path / "a.png", *words).stderr) == is_told

    def test_zoom_azimuth_and_elevation_are_dolly_yaw_and_pitch(self, folder, tmp_path):
        other = "--zoom", "2", "--azimuth", "20", "--elevation", "10"
        assert run("render", folder, "-o", tmp_path / "a.png", *other).returncode == 0
        words = "--dolly", "0.5", "--yaw", "20", "--pitch", "10"
        assert run("render", folder, "-o", tmp_path / "b.png", *words).returncode == 0
        assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()

    def test_depth_of_a_view(self, folder, tmp_path):
        done = run("depth", folder, "-o", tmp_path / "d.png")
        assert done.returncode == 0, done.stderr
        assert re.fullmatch(r".+d\.png: 8x6 pixels, 48 with depth, .+, \d+ ms\n", done.stdout)
        with Image.open(tmp_path / "d.png") as image:
            assert (np.asarray(image) == 1500).all()
        options = ["--dolly", "0.5", "--picture-size", "16x12", "--normals", "central"]
        assert run("depth", folder, "-o", tmp_path / "d.npy", *options).returncode == 0
        depth = np.load(tmp_path / "d.npy")
        assert depth.shape == (12, 16)
        np.testing.assert_allclose(depth[depth > 0], 0.75, rtol=1e-5)

    def test_depth_of_a_sequence(self, sequence, tmp_path):
        done = run("depth", sequence, "-o", tmp_path / "####.tif")
        assert done.returncode == 0, done.stderr
        assert written(tmp_path) == ["0000.tif", "0001.tif", "0003.tif"]
        with Image.open(tmp_path / "0003.tif") as image:
            np.testing.assert_allclose(np.asarray(image), 1.503, rtol=1e-5)

    def test_depth_that_millimetres_cannot_hold_is_said(self, folder, tmp_path):
        depth = np.arange(7000, 7048, dtype=np.uint16).reshape(6, 8)
        depth[:, :3] -= 6900
        Image.fromarray(depth).save(folder / "depth.png")
        done = run("depth", folder, "-o", tmp_path / "d.png", "--depth-scale", "100")
        assert done.returncode == 0 and "d.png: 30 of 48 depths are outside 1 mm to 65.535 m" in done.stderr

    def test_depth_of_a_scene(self, tmp_path):
        done = run("depth", "demo", "-o", tmp_path / "d.exr", "--picture-size", "64x48")
        assert done.returncode == 0, done.stderr
        with OpenEXR.File(str(tmp_path / "d.exr")) as file:
            np.testing.assert_allclose(
                file.channels()["Z"].pixels,
                ps.render_depth(ps.load_scene("demo"), ps.load_scene("demo").framed().camera.fitted(64, 48)),
            )

    def test_all_passes_in_one_file(self, folder, tmp_path):
        lamps = "--light", "0.2,-0.2,0 shadow", "--light", "direction=1,1,1"
        done = run("render", folder, "-o", tmp_path / "p.exr", "--passes", "all", "--samples", "2", *lamps)
        assert done.returncode == 0, done.stderr
        assert re.match(r".+p\.exr: 8x6 pixels, beauty, ambient, .* light_1, light_2, .* object_id, ", done.stdout)
        with OpenEXR.File(str(tmp_path / "p.exr"), separate_channels=True) as file:
            layers = {name: np.array(one.pixels) for name, one in file.channels().items()}
        assert {"R", "A", "Z", "light_1.R", "light_2.B", "shadow_1.X", "normal.Z", "ao.X"} <= set(layers)
        np.testing.assert_allclose(layers["Z"], 1.5, rtol=1e-5)
        added = sum(layers[f"{name}.G"].astype(float) for name in ("light_1", "light_2", "ambient"))
        np.testing.assert_allclose(added, layers["G"], atol=1e-3)

    def test_an_exr_alone_is_the_picture_in_linear_light(self, folder, tmp_path):
        assert run("render", folder, "-o", tmp_path / "p.exr").returncode == 0
        with OpenEXR.File(str(tmp_path / "p.exr"), separate_channels=True) as file:
            assert sorted(file.channels()) == ["A", "B", "G", "R"]

    def test_passes_of_a_sequence(self, sequence, tmp_path):
        done = run("render", sequence, "-o", tmp_path / "%04d.exr", "--passes", "depth,albedo", "--frames", "2")
        assert done.returncode == 0, done.stderr
        assert written(tmp_path) == ["0000.exr", "0001.exr"]
        with OpenEXR.File(str(tmp_path / "0001.exr"), separate_channels=True) as file:
            assert sorted(file.channels()) == ["Z", "albedo.B", "albedo.G", "albedo.R"]
            np.testing.assert_allclose(file.channels()["Z"].pixels, 1.501, rtol=1e-5)

    def test_depth_of_nothing_in_view_is_said(self, folder, tmp_path):
        np.savetxt(tmp_path / "away.txt", np.diag([1, -1, -1, 1]))
        done = run("depth", folder, "-o", tmp_path / "d.exr", "--pose", tmp_path / "away.txt")
        assert done.returncode == 0 and "note: nothing is in view" in done.stderr


@pytest.mark.parametrize(
    ("arguments", "complaint"),
    [
        (["normals", "-o", "out.xyz"], "suffix must be one of .png"),
        (["normals", "-o", "out%d.xyz"], "suffix must be one of .png"),
        (["normals", "-o", "no/out%d.png"], "create it first"),
        (["normals", "-o", "out%d_##.png"], "must have one place for a number, such as %04d, got %d, ##"),
        (["normals", "-o", "out.png", "--axes", "blender"], "unknown --axes 'blender': known are opencv, opengl"),
        (["normals", "-o", "out.png", "--bits", "12"], "--bits must be 8 or 16, got 12"),
        (["normals", "-o", "out.tif", "--bits", "16"], "--bits 16 needs .png; .exr and .npy hold floats"),
        (["normals", "-o", "out%04d.png"], "is a name for many files, but INPUT is a single frame"),
        (["depth", "-o", "out.jpg"], "the suffix of depth must be one of .png, .exr, .tif, .tiff, .npy"),
        (["depth", "-o", "no/out.png"], "create it first"),
        (["depth", "-o", "out####.png"], "is a name for many files, but INPUT is a single frame"),
        (["depth", "-o", "out.png", "--yaw", "nan"], "--yaw and --pitch must be finite"),
        (["render", "-o", "no/out.ply"], "create it first"),
        (["render", "-o", "no/out.exr"], "create it first"),
        (["render", "-o", "out.exr", "--passes", "nonsense"], "unknown --passes 'nonsense': known are all, beauty,"),
        (["render", "-o", "out.exr", "--passes", "normals"], "'normals' (did you mean normal?): known are all"),
        (["render", "-o", "out.png", "--passes", "all"], "--passes are layers of an .exr, and out.png has none"),
        (["render", "-o", "out.exr", "--tone", "neutral"], "out.exr holds linear light, as strong as the lights are: "),
        (["render", "-o", "out.exr", "--exposure", "1", "--passes", "all"], "leave out --exposure"),
        (["render", "-o", "out.exr", "--frames", "2"], "--frames is for many pictures and out.exr is one: write %04d"),
        (["render", "-o", "out%d.exr"], "is a name for many files, but INPUT is a single frame"),
        (["render", "-o", "out.png", "--zoom", "0"], "--zoom must be above 0, such as 2 for twice as large, got 0"),
        (["render", "-o", "out.png", "--zoom", "2", "--dolly", "0.1"], "pass --zoom or --dolly, not both"),
        (["render", "-o", "out{:04d}.ply"], "is a name for many files, but INPUT is a single frame"),
        (["render", "-o", "out.ply", "--picture-size", "4x4"], "--picture-size is of a picture: leave it out"),
        (["render", "-o", "out.ply", "--turntable", "light"], "need a number in the name, such as %04d.ply"),
        (["render", "-o", "out%d%d.png", "--turntable", "light"], "must have one place for a number"),
    ],
)
def test_what_cannot_be_is_one_sentence(folder, tmp_path, monkeypatch, arguments, complaint):
    monkeypatch.chdir(tmp_path)
    check_refused(run(arguments[0], folder, *arguments[1:]), tmp_path, complaint)


@pytest.mark.parametrize(
    ("arguments", "complaint"),
    [
        (["render", "-o", "out.png", "--points"], "--points is about a .glb or .gltf, out.png is none: leave it out"),
        (["render", "demo", "-o", "out.ply"], "holds the points of frames, demo is a scene: write a picture"),
        (["depth", "demo", "-o", "out.exr", "--normals", "star"], "leave out --normals"),
    ],
)
def test_what_cannot_be_of_a_scene_is_one_sentence(tmp_path, monkeypatch, arguments, complaint):
    monkeypatch.chdir(tmp_path)
    check_refused(run(*arguments), tmp_path, complaint)


@pytest.mark.data
@pytest.mark.usefixtures("renderer")
def test_points_of_neighbouring_views_overlap_in_the_world(shared_data, tmp_path):
    words = "--frames", "2", "--axes", "opencv"  # the world of the poses
    done = run("render", shared_data / "icl_livingroom_23views", "-o", tmp_path / "%d.ply", *words)
    assert done.returncode == 0, done.stderr
    first, second = (np.asarray(trimesh.load(tmp_path / f"{k}.ply").vertices) for k in range(2))
    back = np.linalg.inv(ps.open_source(shared_data / "icl_livingroom_23views")[1].pose)
    in_camera = second @ back[:3, :3].T + back[:3, 3]
    assert median_distance(second[::1000], first) < 0.01
    assert median_distance(in_camera[::1000], first) > 0.03  # without the poses they would not


def median_distance(points, others):
    """From each of the points to the nearest of the others."""
    return np.median(cKDTree(others).query(points)[0])
