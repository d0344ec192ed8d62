"""Point clouds on the command line, as a user types them."""

import json
import re

import numpy as np
import pytest
from PIL import Image

import pointshade_gl as ps
from pointshade_gl.scene.graph import scene_of

from ..support.cloud_ball import ball, write_ball
from ..support.cloud_files import ply_text
from ..support.command import run
from ..support.painted_room import write


@pytest.fixture
def cloud(tmp_path):
    """A ball of radius 1, coloured, without normals."""
    return write_ball(tmp_path / "ball.ply")


def picture(path):
    with Image.open(path) as image:
        return np.asarray(image.convert("RGBA")).astype(int)


@pytest.mark.usefixtures("renderer")
class TestPictures:
    def test_a_cloud_is_drawn_whole_and_one_line_says_so(self, cloud, tmp_path):
        done = run("render", cloud, "-o", tmp_path / "out.png", "--picture-size", "160x120")
        assert done.returncode == 0, done.stderr
        assert re.fullmatch(r".+out\.png: 160x120 pixels from 3000 points, .+, \d+ ms\n", done.stdout)
        alpha = picture(tmp_path / "out.png")[..., 3]
        rows, columns = np.nonzero(alpha)
        assert rows.min() > 0 and rows.max() < 119 and np.ptp(rows) > 90 and abs(np.ptp(rows) - np.ptp(columns)) < 8

    @pytest.mark.system
    def test_options_of_look_and_place_reach_the_picture(self, cloud, tmp_path):
        plain = ["--picture-size", "80x60", "--samples", "1", "-o", tmp_path / "out.png"]
        drawn = {}
        for words in (
            "", "--shading none", "--shading edl", "--splat ball", "--point-size 0.02", "--point-size 3px",
            "--ambient 1", "--yaw 40", "--pitch 20", "--dolly .3", "--color-by height", "--up x", "--most 500",
            "--ground", "--light 3,0,3",
        ):  # fmt: skip
            done = run("render", cloud, *plain, *words.split())
            assert done.returncode == 0, done.stderr
            drawn[words] = picture(tmp_path / "out.png")
        usual = drawn.pop("")
        same = [words for words, image in drawn.items() if np.array_equal(image, usual)]
        assert not same

    def test_own_colours_are_those_of_the_file(self, cloud, tmp_path):
        done = run("render", cloud, "--shading", "none", "--samples", "1", "-o", tmp_path / "out.png")
        assert done.returncode == 0
        image = picture(tmp_path / "out.png")[240]
        seen = image[np.nonzero(image[:, 3])]
        assert np.abs(seen[5, :3] - (200, 30, 30)).max() <= 2 and np.abs(seen[-5, :3] - (30, 30, 200)).max() <= 2

    def test_several_clouds_are_one_scene(self, tmp_path):
        left, right = (write_ball(tmp_path / f"{x}.ply", radius=0.5, at=(x, 0, 0)) for x in (-1, 1))
        words = ["--shading", "none", "--picture-size", "160x120", "-o", tmp_path / "out.png", "--explain"]
        done = run("render", left, right, *words)
        assert done.returncode == 0 and "from 6000 points" in done.stdout, done.stderr
        assert "-1: cloud: 3 000 points, drawn: all" in done.stdout and "\n1: planes: " in done.stdout
        covered = picture(tmp_path / "out.png")[..., 3].max(0, initial=0)
        begins = np.flatnonzero(np.diff((covered > 0).astype(int)) == 1)
        assert covered[[0, -1]].max() == 0 and len(begins) == 2  # two balls

    def test_a_field_is_a_colour_with_a_legend(self, tmp_path):
        rows = np.concatenate([ball(3000).positions, np.arange(3000)[:, None] // 1000], 1)
        np.savetxt(tmp_path / "a.xyz", rows, header="x y z label", comments="")
        words = ["--picture-size", "160x120", "--shading", "none", "-o", tmp_path / "out.png"]
        done = run("render", tmp_path / "a.xyz", "--color-by", "Label", "--up", "z", *words)
        assert done.returncode == 0 and "coloured by label, 3 labels: 0, 1, 2" in done.stderr, done.stderr
        image = picture(tmp_path / "out.png")
        for color in ((31, 119, 180), (255, 127, 14), (44, 160, 44)):
            rows, columns = np.nonzero((np.abs(image[..., :3] - color) <= 2).all(-1))
            assert (columns > 120).sum() >= 9 and (columns < 100).any()  # in the corner, and on the ball

    def test_clouds_meshes_scenes_and_frames_are_one_scene(self, cloud, tmp_path):
        """Each at its own coordinates: the cloud before the mesh, the frame beside it."""
        wall = ps.Mesh([(-5, -4, 3), (5, -4, 3), (5, 4, 3), (-5, 4, 3)], [(0, 1, 2), (0, 2, 3)], color=(0, 1, 0))
        ps.save_scene(tmp_path / "wall.glb", ps.Scene((ps.Node(wall),)))
        corners = {"x": np.array([2, 3, 3], "f4"), "y": np.array([0, 0, 1], "f4"), "z": np.zeros(3, "f4")}
        corners |= dict.fromkeys(("red", "green"), np.full(3, 0, "u1")) | {"blue": np.full(3, 255, "u1")}
        (tmp_path / "mesh.ply").write_bytes(ply_text(corners, faces=[(0, 1, 2)]))
        camera = {"width": 64, "height": 48, "fx": 24, "fy": 24, "cx": 31.5, "cy": 23.5}
        write(tmp_path / "frame", np.full((48, 64, 3), (255, 0, 255), np.uint8), np.full((48, 64), 2.0), camera)
        words = ["--picture-size", "160x120", "--shading", "none", "--samples", "1", "--up=-y"]
        done = run(
            "render",
            cloud,
            tmp_path / "mesh.ply",
            tmp_path / "wall.glb",
            tmp_path / "frame",
            *words,
            "-o",
            tmp_path / "out.png",
        )
        assert done.returncode == 0, done.stderr
        image = picture(tmp_path / "out.png")
        for color in ((0, 255, 0), (0, 0, 255), (255, 0, 255)):
            assert (np.abs(image[..., :3] - color) <= 2).all(-1).sum() > 20, color
        assert "what points up is not the same in all of them: ball -y, mesh -y, wall y, frame -y" in done.stderr

    def test_a_mesh_has_a_material_and_a_shading(self, tmp_path):
        corners = {
            name: np.array(one, "f4") for name, one in zip("xyz", ((0, 1, 1), (0, 0, 1), (0, 0, 0)), strict=True)
        }
        (tmp_path / "a.ply").write_bytes(ply_text(corners, faces=[(0, 1, 2)]))
        words = ["--picture-size", "80x60", "--samples", "1", "-o", tmp_path / "out.png"]
        seen = []
        for more in ([], ["--shading", "none"], ["--ambient", ".9", "--diffuse", "0", "--specular", "0"]):
            done = run("render", tmp_path / "a.ply", *more, *words)
            assert done.returncode == 0, done.stderr
            seen.append(picture(tmp_path / "out.png"))
        assert (seen[0] != seen[1]).any() and (seen[0] != seen[2]).any()
        wrong = run("render", tmp_path / "a.ply", "--splat", "ball", *words)
        assert wrong.returncode == 2 and "--splat is no option of a mesh" in wrong.stderr
        assert run("info", tmp_path / "a.ply").stdout.startswith("points    3 points, PLY, ascii")

    def test_a_turntable_goes_round_and_the_ball_stays(self, cloud, tmp_path):
        words = ["--turntable", "camera", "--frames", "4", "--picture-size", "80x60", "--shading", "none"]
        done = run("render", cloud, *words, "-o", tmp_path / "%d.png")
        assert done.returncode == 0, done.stderr
        images = [picture(tmp_path / f"{k}.png") for k in range(4)]
        assert all(abs((one[..., 3] > 0).sum() - (images[0][..., 3] > 0).sum()) < 60 for one in images)
        redness = [int((one[..., 0] - one[..., 2])[one[..., 3] > 0].sum()) for one in images]
        assert np.sign(redness[0]) == -np.sign(redness[2]) and not np.array_equal(images[1], images[3])

    @pytest.mark.system
    def test_a_still_has_few_samples_but_soft_shadows_have_many(self, cloud, tmp_path):
        def drawn(*words):
            assert run("render", cloud, "--picture-size", "80x60", *words, "-o", tmp_path / "out.png").returncode == 0
            return picture(tmp_path / "out.png")

        assert np.array_equal(drawn(), drawn("--samples", "4"))
        assert np.array_equal(drawn("--ground"), drawn("--ground", "--samples", "16"))

    def test_depth_is_that_of_the_picture(self, cloud, tmp_path):
        done = run("depth", cloud, "--picture-size", "160x120", "-o", tmp_path / "depth.npy")
        assert done.returncode == 0, done.stderr
        depth = np.load(tmp_path / "depth.npy")
        away = np.linalg.norm(scene_of(ps.load_cloud(cloud)).pose[:3, 3])
        assert depth[60, 80] == pytest.approx(away - 1, abs=0.02) and depth.shape == (120, 160) and depth.max() < away

    def test_explain_tells_what_was_drawn_and_found(self, cloud, tmp_path):
        done = run("render", cloud, "--explain", "-o", tmp_path / "out.png", "--samples", "1")
        spacing = np.sqrt(4 * np.pi / 3000)
        pattern = r"cloud: 3 000 points, drawn: all, about (\S+) apart\nplanes: fitted within (\S+) of"
        ((apart, radius),) = re.findall(pattern, done.stdout)
        assert float(apart) == pytest.approx(spacing, rel=0.1) and float(radius) >= 2.5 * spacing


@pytest.mark.usefixtures("renderer")
class TestWrittenClouds:
    @pytest.mark.parametrize("command", ["normals", "render"])
    def test_a_cloud_is_written_with_normals_that_point_out(self, cloud, tmp_path, command):
        done = run(command, cloud, "-o", tmp_path / "out.ply")
        assert done.returncode == 0 and "out.ply: 3 000 points, 3 000 normals" in done.stdout, done.stderr
        made, given = ps.load_cloud(tmp_path / "out.ply"), ball()
        assert made.normals is not None and made.confidence is not None
        assert made.colors is not None and given.colors is not None
        cosines = (made.normals * given.positions).sum(1)
        assert cosines.min() > 0.99 and made.up == "z" and made.confidence.min() > 0
        assert np.array_equal(made.colors, given.colors) and np.array_equal(made.positions, given.positions)

    def test_normals_alone_are_numbers(self, cloud, tmp_path):
        done = run("normals", cloud, "-o", tmp_path / "out.npy", "--noise", "0.001")
        assert done.returncode == 0, done.stderr
        found = np.load(tmp_path / "out.npy")
        assert found.shape == (3000, 3) and (found * ball().positions).sum(1).min() > 0.99

    @pytest.mark.parametrize("command", ["normals", "render"])
    def test_axes_turn_a_scan_which_keeps_its_own_without(self, cloud, tmp_path, command):
        for axes in ([], ["--axes", "opengl"]):
            assert run(command, cloud, "-o", tmp_path / "out.ply", *axes).returncode == 0
            made, given = ps.load_cloud(tmp_path / "out.ply"), ball()
            expected = given.positions[:, [0, 2, 1]] * np.float32((1, 1, -1)) if axes else given.positions
            np.testing.assert_array_equal(made.positions, expected)
            assert (made.up, made.front) == ("y" if axes else "z", None)
            assert (made.normals * made.positions).sum(1).min() > 0.99

    def test_points_on_no_surface_have_no_normal(self, tmp_path):
        (tmp_path / "two.xyz").write_text("0 0 0\n1 0 0\n")
        done = run("normals", tmp_path / "two.xyz", "-o", tmp_path / "out.npy", "--up", "z")
        assert done.returncode == 0 and "2 points, 0 normals" in done.stdout, done.stderr
        assert np.isnan(np.load(tmp_path / "out.npy")).all()

    def test_info_tells_what_the_file_holds(self, cloud):
        found = json.loads(run("info", cloud, "--json").stdout)
        assert found["points"] == 3000 and found["up"]["axis"] == "z" and found["normals"] == 0


WRONG = [  # typed, and the sentence
    ("normals ball.ply -o out.png", "the suffix of a point cloud's normals must be one of .ply, .glb, .gltf, .npy"),
    ("normals ball.ply -o out.npy --axes opengl", "--axes turns the points of a .ply, out.npy holds normals alone"),
    ("normals ball.ply -o out.ply --axes directx", "unknown --axes 'directx': known are opencv, opengl, blender"),
    ("normals ball.ply -o out.ply --bits 16", "--bits is of pictures, and ball.ply is a point cloud: leave it out"),
    ("render ball.ply -o out.png --axes opengl", "--axes turns the points of a .ply, out.png holds none: leave it out"),
    ("render ball.ply -o out.glb --axes opengl", "out.glb has the axes of glTF, y up: leave out --axes"),
    ("normals ball.ply -o out.npy --normals star", "--normals is for frames: of a point cloud leave it out"),
    ("normals ball.ply -o out.npy --noise kinect", "--noise of a point cloud is one number of world units, got kinect"),
    ("render ball.ply -o out.ply --ambient .3 --yaw 9", "own colours, without light: leave out --ambient, --yaw"),
    ("render ball.ply -o %d.ply", "a point cloud is one file of points: write it to one, such as out.ply"),
    ("render ball.ply -o %d.png", "pass --turntable light or camera"),
    ("render ball.ply -o out.png --normals star", "--normals is for frames, and this is a point cloud: leave it out"),
    ("render ball.ply -o out.png --shading flat", "unknown --shading 'flat': known are none, phong, edl"),
    ("render ball.ply -o out.png --splat round", "unknown --splat 'round': known are disc, ball"),
    ("render ball.ply -o out.png --point-size big", "--point-size must be"),
    ("render ball.ply -o out.png --up sideways", "unknown --up 'sideways': known are x, y, z, -x, -y, -z"),
    ("render ball.ply -o out.png --color-by intensity", "--color-by"),
    ("render ball.ply -o out.png --views 3", "--views is about frames, and ball.ply is a point cloud"),
    ("render ball.ply -o out.png --unlight-all", "--unlight-all is about frames, and ball.ply is a point cloud"),
    ("render ball.ply -o out.png --frame 3", "--frame is one of a sequence, and ball.ply is a point cloud"),
    ("render ball.ply -o out.png --fov 50", "ball.ply is a point cloud, and no frame: leave out --fov"),
    ("render ball.ply bal.ply -o out.png", "bal.ply does not exist (did you mean ball.ply?)"),
    ("render ball.ply frames -o out.png", "frames has no depth picture"),
    ("render ball.ply frames -o out.ply", "ball.ply is a scene: write a picture"),
    (
        "render ball.ply -o out.png --color-range 2,1",
        "--color-range takes two numbers, the lower first",
    ),
    ("render ball.ply -o out.png --columns a,b,c", "--columns must name x, y and z"),
    ("render ball.ply ball.ply -o out.ply", "holds the points of one cloud: pass one INPUT"),
    ("render vase --up z -o out.png", "vase is no point cloud: leave out --up"),
    ("render empty.ply -o out.png", "empty.ply"),
    ("render short.ply -o out.png", "short.ply"),
    ("albedo ball.ply -o out.png", "ball.ply is a point cloud, expected a frame"),
    ("info ball.ply -o sheet.png", "ball.ply is a point cloud: leave out -o sheet.png"),
]


@pytest.mark.parametrize(("words", "sentence"), WRONG)
def test_what_a_cloud_has_not_is_one_sentence(tmp_path, monkeypatch, words, sentence):
    monkeypatch.chdir(tmp_path)
    write_ball(tmp_path / "ball.ply")
    (tmp_path / "short.ply").write_bytes((tmp_path / "ball.ply").read_bytes()[:900])
    (tmp_path / "empty.ply").touch()
    (tmp_path / "frames").mkdir()
    before = sorted(tmp_path.iterdir())
    done = run(*words.split())
    assert done.returncode == 2, done
    (line,) = [line for line in done.stderr.splitlines() if not line.startswith("note: ")]
    assert line.startswith("pointshade: ") and sentence in line and "bug" not in line
    assert sorted(tmp_path.iterdir()) == before
