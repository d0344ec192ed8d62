"""Batches of point clouds: a folder of them is found by the names of its files, and drawn as `render` draws each."""

import numpy as np
import pytest
from PIL import Image

import pointshade_gl as ps

from ..support.batches import SMALL, lines_of
from ..support.cloud_ball import ball, write_ball
from ..support.cloud_files import bumpy, pcd

pytestmark = pytest.mark.usefixtures("renderer")


@pytest.fixture
def clouds(tmp_path):
    """A folder: a.ply, b.ply, a.pcd, broken.ply, a text that is no cloud, and deep/c.ply."""
    folder = tmp_path / "clouds"
    (folder / "deep").mkdir(parents=True)
    for name in ("a", "b", "deep/c"):
        write_ball(folder / f"{name}.ply", count=500)
    positions, _, _ = bumpy()
    (folder / "a.pcd").write_bytes(pcd({name: positions[:, k] for k, name in enumerate("xyz")}))
    (folder / "broken.ply").write_bytes((folder / "a.ply").read_bytes()[:600])
    (folder / "readme.txt").write_text("clouds of balls")
    return folder


def pictures(folder):
    return sorted(str(path.relative_to(folder)) for path in folder.rglob("*.png"))


def test_a_folder_of_clouds_becomes_pictures_and_a_broken_one_is_one_line(typed, clouds, tmp_path):
    code, out, errors = typed(f"batch clouds -o out {SMALL} --shading edl --splat ball")
    assert code == 3 and "4 written, 1 failed" in out
    (failed,) = [line for line in errors.splitlines() if line.startswith("failed: ")]
    assert failed.startswith("failed: clouds/broken.png: ") and "is a broken PLY file" in failed
    names = ["a.pcd.png", "a.ply.png", "b.png", "deep/c.png"]
    assert pictures(tmp_path / "out") == [f"clouds/{name}" for name in names]
    assert (
        typed(f"render clouds/b.ply -o one.png {SMALL.replace('--workers 1', '')} --shading edl --splat ball")[0] == 0
    )
    one, many = (np.asarray(Image.open(tmp_path / name)) for name in ("one.png", "out/clouds/b.png"))
    assert np.array_equal(one, many)


@pytest.mark.system
def test_what_is_there_is_left_and_a_changed_cloud_is_done_again(typed, clouds, tmp_path):
    (clouds / "broken.ply").unlink()
    assert typed(f"batch clouds -o out {SMALL}")[0] == 0
    code, out, _ = typed(f"batch clouds -o out {SMALL}")
    assert code == 0 and "4 there" in out
    write_ball(clouds / "b.ply", count=800)
    code, out, _ = typed(f"batch clouds -o out {SMALL} --resume")
    assert code == 0 and "1 written, 3 there" in out
    assert len(lines_of(tmp_path / "out/manifest.jsonl")) == 5


def test_options_of_clouds_go_to_clouds_only(typed, clouds, tmp_path):
    line = f"batch clouds/b.ply vase -o out {SMALL} --up x --most 200"
    assert typed(line)[0] == 0 and len(pictures(tmp_path / "out")) == 2
    code, _, errors = typed(f"batch vase -o other {SMALL} --up x")
    assert code == 2 and "no INPUT is a point cloud: leave out --up" in errors
    code, _, errors = typed(f"batch clouds -o other {SMALL} --normals star")
    assert code == 2 and "--normals is for frames, and this is a point cloud: leave it out" in errors


def test_normals_of_clouds_are_numbers(typed, clouds, tmp_path):
    code, _, errors = typed("batch clouds/b.ply -o out --workers 1 --to normals.npy")
    assert code == 0, errors
    assert (np.load(tmp_path / "out/b.normals.npy") * ball(500).positions).sum(1).min() > 0.95
    code, _, errors = typed("batch clouds/b.ply -o out --workers 1 --to normals.png")
    assert code == 3 and "whose normals no picture holds: use --to normals.npy" in errors


def test_a_film_needs_a_turntable(typed, clouds, tmp_path):
    line = "batch clouds/b.ply -o out --workers 1 --to gif --picture-size 64x48 --frames 3"
    assert typed(f"{line} --turntable camera")[0] == 0 and (tmp_path / "out/b.gif").exists()
    code, _, errors = typed(f"{line} --overwrite")
    assert code == 3 and "pass --turntable light or camera" in errors


@pytest.mark.system
def test_map_draws_clouds_as_render_does(clouds):
    view, look = ps.View(picture_size=(64, 48)), ps.Appearance(shading="edl")
    made = list(ps.batch.map([ball(500), str(clouds / "b.ply")], look, view, workers=1))
    scene_size = ps.render(ball(500), shading="edl")
    assert made[0].shape == (48, 64, 4) and np.array_equal(made[0], made[1]) and scene_size.shape == (480, 640, 4)
    (one,) = ps.batch.map(str(clouds / "b.ply"), look, view, workers=1)
    assert np.array_equal(one, made[0])
    with pytest.raises(ValueError, match="normals is for frames, and this is a point cloud"):
        next(ps.batch.map([ball(500)], ps.Appearance(normals="star"), view, workers=1))
