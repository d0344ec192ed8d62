"""`pointshade bench --views`: cameras stand where they should, measures measure, files are complete."""

import json

import numpy as np
import pytest
from PIL import Image

import pointshade_gl as ps
from pointshade_gl.bench.command import research
from pointshade_gl.bench.measure import generator
from pointshade_gl.scene.appearance import NORMALS_AT

views = research("views", "several_views")
TINY = views.ViewsPlan((64, 48), (1, 2, 3), 3, 1)


@pytest.fixture(scope="module")
def stage():
    return views.BenchStage(TINY)


def test_any_first_few_cameras_look_from_all_sides():
    for count in (3, 8, 30):
        sides = np.array([views.pose_of(k)[0, 3] for k in range(count)])
        gaps = np.diff(np.sort(sides))
        assert gaps.max() < 3.2 * np.ptp(sides) / (count - 1)
    assert [views.halton(k, 2) for k in (1, 2, 3, 4)] == [0.5, 0.25, 0.75, 0.125]


@pytest.mark.parametrize("error", views.POSE_ERRORS.values())
def test_a_pose_is_off_by_as_much_as_it_says_and_the_noise_stays(stage, error):
    hits, pose = stage.seen[0], stage.poses[0]
    frame = views.taken(hits, stage.camera, pose, error, generator(1, "view"))
    assert np.linalg.norm(frame.pose[:3, 3] - pose[:3, 3]) == pytest.approx(error, abs=1e-9)
    turn = np.arccos(np.clip((np.trace(frame.pose[:3, :3].T @ pose[:3, :3]) - 1) / 2, -1, 1))
    assert turn == pytest.approx(error / 2, rel=0.01, abs=1e-6)
    assert (frame.depth == views.taken(hits, stage.camera, pose, 0.0, generator(1, "view")).depth).all()
    assert 0.001 < np.abs(frame.depth - hits.depth).mean() < 0.02


class TestFlicker:
    def pictures(self, stage):
        return [np.full((*stage.seen[0].depth.shape, 4), 255, np.uint8) for _ in stage.path]

    def test_an_error_that_stays_on_the_surface_does_not_flicker(self, stage):
        errors = [30 * hits.albedo for hits in stage.truths]
        assert views.flicker(stage, errors, self.pictures(stage)) < 0.5

    def test_an_error_that_comes_and_goes_flickers_by_as_much(self, stage):
        errors = [np.full((*hits.depth.shape, 3), 3.0 * (k % 2)) for k, hits in enumerate(stage.truths)]
        assert views.flicker(stage, errors, self.pictures(stage)) == pytest.approx(3)


def test_straight_lines_are_found_and_what_is_off_them():
    rows = [
        {"count": k, "pairs": k * (k - 1), "gpu_mb": 9.0 + 2 * k, "normals": 5.0 * k, "votes": 1.0 + 3 * k * (k - 1)}
        | {"source": 2.0 + 7 * k, "target": 100.0 if k == 4 else 0.0}
        for k in (1, 2, 4, 8)
    ]
    found = views.fits(rows)
    for name, start, slope in (("gpu_mb", 9, 2), ("normals", 0, 5), ("votes", 1, 3), ("source", 2, 7)):
        assert found[name] == {"start": pytest.approx(start), "slope": pytest.approx(slope), "off": pytest.approx(0)}
    assert found["target"]["off"] > 0.3


def test_the_images_of_a_renderer_are_counted_until_they_are_released():
    with ps.Renderer() as renderer:
        before = views.gpu_bytes(renderer)
        with renderer.context.gl as gl:
            texture, buffer = gl.texture((10, 20), 4, dtype="f4"), gl.buffer(reserve=100)
            assert views.gpu_bytes(renderer) - before == 10 * 20 * 4 * 4 + 100
            texture.release()
            buffer.release()
        assert views.gpu_bytes(renderer) == before
        with ps.Renderer() as other:
            other.render(ps.load_frame("vase"))
            assert views.gpu_bytes(renderer) == before < views.gpu_bytes(other)


@pytest.mark.system
def test_the_command_writes_what_it_measured(renderer, tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(views, "QUICK_VIEWS", TINY)
    said = views.bench_views(tmp_path / "out", quick=True, seed=3, device=0)
    assert "up to 3 views" in said and renderer.context.renderer in said
    assert {path.name for path in (tmp_path / "out").iterdir()} == {"chart.png", "results.json"}
    results = json.loads((tmp_path / "out" / "results.json").read_text())
    assert list(results["quality"]) == list(views.POSE_ERRORS) and results["counts"] == [1, 2, 3]
    for rows in results["quality"].values():
        assert rows["source"][0] == rows["target"][0]  # of one view there is no other way
        assert rows["source"][2] != rows["target"][2]
        assert all(0 < cell["normals"] < 45 and cell["psnr"] > 15 for place in NORMALS_AT for cell in rows[place])
    assert [row["pairs"] for row in results["cost"]] == [0, 2, 6]
    assert results["fits"]["gpu_mb"]["off"] < 1e-6  # every view holds as much
    assert "ms a pair" in capsys.readouterr().out
    with Image.open(tmp_path / "out" / "chart.png") as image:
        assert image.width == 1800 and np.asarray(image.convert("L")).std() > 5
    assert views.views_chart(results)[:4] == b"\x89PNG"  # a kept file is drawn again
