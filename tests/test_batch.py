"""`pointshade batch` as it is typed, with real signals: nothing is lost, nothing is half-written, nothing is drawn twice."""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import pointshade_gl as ps

from . import frames

pytestmark = pytest.mark.gl
SMALL = "--size 64x48 --samples 1"


class Batch:
    """A running `pointshade batch`, in a group of processes of its own, as a shell starts it."""

    def __init__(self, line: str, folder: Path):
        command = [sys.executable, "-m", "pointshade_gl", "batch", *line.split()]
        self.manifest = folder / "out/manifest.jsonl"
        self.process = subprocess.Popen(
            command, cwd=folder, text=True, stdout=subprocess.PIPE, stderr=subprocess.PIPE, start_new_session=True
        )

    def wait_for(self, lines: int) -> None:
        """Until so many outputs are in the manifest."""
        until = time.monotonic() + 120
        while len(lines_of(self.manifest)) < lines:
            assert self.process.poll() is None, self.process.communicate()
            assert time.monotonic() < until, "no progress"
            time.sleep(0.02)

    def workers(self) -> list[int]:
        """Numbers of its worker processes."""
        children = Path(f"/proc/{self.process.pid}/task/{self.process.pid}/children").read_text().split()
        return [int(child) for child in children if b"spawn_main" in Path(f"/proc/{child}/cmdline").read_bytes()]

    def interrupt(self) -> None:
        """Ctrl+C in a terminal: every process gets it."""
        os.killpg(self.process.pid, signal.SIGINT)

    def end(self) -> tuple[int, str, str]:
        """Exit code, stdout and stderr."""
        out, err = self.process.communicate(timeout=120)
        return self.process.returncode, out, err


def lines_of(manifest: Path) -> list[dict]:
    return [json.loads(line) for line in manifest.read_text().splitlines()] if manifest.exists() else []


def hidden_in(folder: Path) -> list[Path]:
    return list(folder.rglob(".*"))


def check_whole(folder: Path) -> set[str]:
    """All pictures can be read to their end, and nothing else is there. Returns their names."""
    assert hidden_in(folder) == []
    names = set()
    for path in folder.rglob("*.png"):
        with Image.open(path) as image:
            image.load()
        names.add(path.relative_to(folder).as_posix())
    return names


def write_sequence(folder: Path, count: int = 3, size: tuple[int, int] = (16, 12)) -> Path:
    """Frames of a wavy wall, each a little further away."""
    for name in ("depth", "color"):
        (folder / name).mkdir(parents=True)
    width, height = size
    v, u = np.mgrid[:height, :width]
    for k in range(count):
        depth = 1000 + 2 * k + 30 * np.sin(u / 3) + 20 * np.cos(v / 2)
        Image.fromarray(depth.astype(np.uint16)).save(folder / f"depth/{k:04d}.png")
        color = np.stack([u * 255 // width, v * 255 // height, np.full_like(u, k % 256)], -1)
        Image.fromarray(color.astype(np.uint8)).save(folder / f"color/{k:04d}.png")
    camera = {"width": width, "height": height, "fx": width, "fy": width, "cx": width / 2, "cy": height / 2}
    (folder / "intrinsics.json").write_text(json.dumps(camera | {"depth_scale": 1000}))
    return folder


@pytest.fixture
def views(shared_data, tmp_path):
    """The 23 views of the living room, of which number 7 is no picture."""
    shutil.copytree(shared_data / "icl_livingroom_23views", tmp_path / "views", copy_function=shutil.copyfile)
    (tmp_path / "views/depth/007.png").write_bytes(b"not a picture")
    return tmp_path / "views"


@pytest.mark.data
@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="reads /proc")
def test_a_batch_survives_an_unreadable_frame_a_killed_worker_and_an_interruption(views, tmp_path, renderer):
    line = "views -o out --workers 2 --samples 2 --yaw 10"
    batch = Batch(line, tmp_path)
    batch.wait_for(2)
    os.kill(batch.workers()[0], signal.SIGKILL)
    batch.wait_for(10)
    batch.interrupt()
    code, _, err = batch.end()
    assert code == 130 and "--resume goes on" in err and "Traceback" not in err, err
    before = check_whole(tmp_path / "out")
    assert {line["output"] for line in lines_of(batch.manifest)} <= before and len(before) < 22

    code, out, err = Batch(f"{line} --resume", tmp_path).end()
    assert code == 3 and "1 failed" in out and "failed: views/0007.png: frame 7: " in err, err
    expected = {f"views/{k:04d}.png" for k in range(23) if k != 7}
    assert check_whole(tmp_path / "out") == expected
    lines = lines_of(batch.manifest)
    assert sorted(line["output"] for line in lines) == sorted(expected)  # none is done twice
    sequence = ps.open_source(views, notes=lambda _: None)
    for k in (0, 8, 15, 22):
        frame = sequence[k]
        alone = ps.Frame(frame.color, frame.depth, frame.camera, frame.pose)
        with Image.open(tmp_path / f"out/views/{k:04d}.png") as image:
            assert np.array_equal(np.asarray(image), renderer.render(alone, yaw=10, samples=2)), k


def resident(process: int) -> float:
    """Megabytes of memory that a process uses."""
    pages = int(Path(f"/proc/{process}/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 1e6


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="reads /proc")
def test_a_thousand_frames_take_no_more_memory_and_are_done_once(tmp_path):
    write_sequence(tmp_path / "many", 1000)
    batch = Batch("many -o out --workers 2 --samples 1", tmp_path)
    batch.wait_for(200)
    watched = [batch.process.pid, *batch.workers()]
    before = [resident(process) for process in watched]
    batch.wait_for(900)
    after = [resident(process) for process in watched]
    assert len(watched) == 3 and max(np.subtract(after, before)) < 20, (before, after)
    code, out, _ = batch.end()
    assert code == 0 and "1000 written" in out
    expected = {f"many/{k:04d}.png" for k in range(1000)}
    assert check_whole(tmp_path / "out") == {line["output"] for line in lines_of(batch.manifest)} == expected

    written = batch.manifest.stat().st_mtime_ns
    for again in ("", "--resume"):
        code, out, err = Batch(f"many -o out --workers 2 --samples 1 {again}", tmp_path).end()
        assert code == 0 and "1000 there" in out and "written" not in out and err == ""
    assert batch.manifest.stat().st_mtime_ns == written
