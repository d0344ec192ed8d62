"""Batches for tests: small sequences, running commands, and what they have written."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
from PIL import Image

from .children import end

SMALL = "--picture-size 64x48 --samples 1 --workers 1"


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
        while not self.manifest.exists() or self.manifest.read_bytes().count(b"\n") < lines:  # the last may be torn
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


@contextmanager
def running(folder: Path) -> Iterator[Callable[[str], Batch]]:
    """Give a function that starts a Batch in the folder. Those that still run at the end are killed."""
    started: list[Batch] = []

    def start(line: str) -> Batch:
        started.append(Batch(line, folder))
        return started[-1]

    try:
        yield start
    finally:
        for batch in started:
            end(batch.process)


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


def names_in(folder: Path) -> list[str]:
    return sorted(path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file())


def but_for_its_command(page):
    """A page of a batch hands out no command line."""
    return re.sub(rb'"command":(null|{[^{}]*})', b"", page.read_bytes())
