"""No command writes over a file that it reads, unless it is told to: the frame of a user may be the only copy."""

import os
import shutil
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import pointshade_gl as ps
from pointshade_gl.files.access.atomic_write import written_whole
from pointshade_gl.files.access.content import check_not_read, noting_reads, read_bytes, read_head
from pointshade_gl.files.access.known_names import existing_files

from ..support.command import run

CAMERA_JSON = '{"width": 8, "height": 6, "fx": 10, "fy": 10, "cx": 3.5, "cy": 2.5, "depth_scale": 1000}'
KEPT = "is read as an input. Pass another output, or --overwrite to replace it"


def _picture(path: Path, value: int, dtype=np.uint8) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    Image.fromarray(np.full((6, 8) if dtype == np.uint16 else (6, 8, 3), value, dtype)).save(path)


@pytest.fixture
def place(tmp_path, monkeypatch):
    """A working directory with a frame, a sequence, a cloud and a scene with two pictures."""
    monkeypatch.chdir(tmp_path)
    _picture(Path("my/depth.png"), 1500, np.uint16)
    _picture(Path("my/color.png"), 120)
    Path("my/intrinsics.json").write_text(CAMERA_JSON)
    for k in range(3):
        _picture(Path(f"seq/depth/{k:04d}.png"), 1500 + k, np.uint16)
        _picture(Path(f"seq/color/{k:04d}.png"), 100 + k)
    Path("seq/intrinsics.json").write_text(CAMERA_JSON)
    points = np.random.default_rng(0).normal(size=(500, 3)).astype(np.float32)
    ps.save_points("c.ply", ps.PointCloud(points))
    np.save("points.npy", points)
    Path("scenes").mkdir()
    ps.save_scene("scenes/s.gltf", ps.Scene((ps.Node(ps.PointObject(ps.load_frame("my"))),)))
    shutil.move("scenes/s_points/color.png", "scenes/s.png")  # as batch calls a picture of the scene
    scene = Path("scenes/s.gltf")
    scene.write_text(scene.read_text().replace("s_points/color.png", "s.png"))
    Path("folder_link").symlink_to("my")
    Path("link.png").symlink_to("my/color.png")
    os.link("my/color.png", "hard.png")
    return tmp_path


def _contents(place: Path) -> dict[Path, bytes]:
    return {path: path.read_bytes() for path in sorted(place.rglob("*")) if path.is_file()}


@pytest.mark.parametrize(
    "line",
    [
        "render my -o my/color.png",
        "depth my -o my/depth.png",
        "normals my -o my/color.png",
        "info my -o my/color.png",
        "render my -o link.png",
        "render my -o hard.png",
        "render my -o folder_link/color.png",
        "render my -o my/../seq/../my/color.png",
        "render --depth my/depth.png --color my/color.png -o my/color.png",
        "render seq -o seq/color/%04d.png",
        "depth seq -o seq/depth/####.png",
        "render seq -o seq/color/0002.png",  # another frame than the one that is drawn
        "render c.ply -o c.ply",
        "normals c.ply -o c.ply",
        "normals points.npy -o points.npy",
        "render scenes/s.gltf -o scenes/s.png",
        "depth scenes/s.gltf -o scenes/s_points/depth.npy",
        "albedo seq -o seq/color/0000.png",
        "align seq my -o my/intrinsics.json",
        "batch my/depth.png -o my",
        "batch scenes/s.gltf -o scenes",
    ],
)
def test_no_command_writes_over_what_it_reads(line, place):
    before = _contents(place)
    done = run(*line.split())
    assert done.returncode == 2 and not done.stdout
    assert KEPT in done.stderr and "cannot write" in done.stderr, done.stderr
    assert _contents(place) == before


@pytest.mark.gl
class TestWithGl:
    def test_poses_are_not_saved_over_those_that_were_read(self, place):
        rows = "".join(f"{k} 0 0 {k / 100} 0 0 0 1\n" for k in range(3))
        Path("seq/poses.txt").write_text(rows)
        line = "render seq --views all --align --save-poses"
        done = run(*line.split(), "seq/poses.txt", "-o", "out.png")
        assert done.returncode == 2 and KEPT in done.stderr, done.stderr
        assert Path("seq/poses.txt").read_text() == rows and not Path("out.png").exists()

    def test_overwrite_allows_it(self, place):
        before = _contents(place)
        for line in ("render my -o my/color.png", "render c.ply -o c.ply", "render seq -o seq/color/%04d.png"):
            done = run(*line.split(), "--overwrite")
            assert done.returncode == 0, done.stderr
        done = run(*["batch", "my/depth.png", "-o", "my", "--overwrite"])
        assert done.returncode == 0, done.stderr
        changed = [path for path, content in _contents(place).items() if before.get(path) != content]
        names = ["my/color.png", "my/depth.png", "c.ply", *(f"seq/color/{k:04d}.png" for k in range(3))]
        assert {place / name for name in names} <= {*changed}

    def test_what_a_command_wrote_itself_is_replaced(self, place):
        """A rendering beside the frame is looked at, to tell what it is, but it is no input."""
        for _ in range(2):
            assert run("render", "my", "-o", "my/out.png").returncode == 0
            assert run("render", "seq", "-o", "seq/%04d.png").returncode == 0
            assert run("render", "c.ply", "-o", "out.ply").returncode == 0

    def test_python_may_replace_what_it_has_read(self, place):
        """It cannot know what its caller wants: documented."""
        frame = ps.load_frame("my")
        ps.save_image("my/color.png", ps.render(frame))


def test_files_are_compared_by_what_they_are(place):
    with noting_reads():
        check_not_read(Path("my/color.png"))
        read_bytes("my/color.png")
        read_head("my/depth.png")  # only looked at
        check_not_read(Path("my/depth.png"), Path("my/new.png"), Path("nowhere/new.png"))
        for name in ("my/color.png", "link.png", "hard.png", "folder_link/color.png"):
            with pytest.raises(ValueError, match="is read as an input"):
                check_not_read(Path(name))
            with pytest.raises(ValueError, match="is read as an input"), written_whole(Path(name)):
                pytest.fail("it was opened")
    check_not_read(Path("my/color.png"))


def test_a_series_is_all_its_files_that_exist(tmp_path):
    for name in ("a0000.png", "a0017.png", "a17.png", "A0018.png", "a.png", "b0001.png"):
        (tmp_path / name).touch()
    found = existing_files(tmp_path / "a%04d.png")
    assert [path.name for path in found] == ["a0000.png", "a0017.png"]
    assert existing_files(tmp_path / "a.png") == [tmp_path / "a.png"]
    assert existing_files(tmp_path / "new.png") == [] == existing_files(tmp_path / "nowhere/%d.png")
