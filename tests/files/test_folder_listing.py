"""What lies in folders: files by level, in natural order, each folder looked at once."""

import os
from collections import Counter
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import pointshade_gl as ps
from pointshade_gl.batch.inputs import find_sources
from pointshade_gl.batch.source_files import parts_of
from pointshade_gl.files.access import folder_listing as listing
from pointshade_gl.files.access.folder_listing import Listing


@pytest.fixture
def looked_at(monkeypatch):
    """How often each folder was looked at."""
    count, scandir = Counter(), os.scandir

    def counting(folder):
        count[Path(folder)] += 1
        return scandir(folder)

    monkeypatch.setattr(listing.os, "scandir", counting)
    return count


def write_frames(folder: Path, count: int) -> None:
    for name in ("color", "depth"):
        (folder / name).mkdir(parents=True)
    for k in range(count):
        Image.fromarray(np.zeros((4, 6, 3), np.uint8)).save(folder / "color" / f"{k}.png")
        Image.fromarray(np.full((4, 6), 1000 + k, np.uint16)).save(folder / "depth" / f"{k}.png")
    (folder / "intrinsics.json").write_text('{"fx": 6, "fy": 6, "cx": 2.5, "cy": 1.5, "width": 6, "height": 4}')


def test_files_by_level_in_natural_order(tmp_path):
    (tmp_path / "b" / "c").mkdir(parents=True)
    for name in ("10.PNG", "2.png", ".2.png", "b/3.txt", "b/c/1.png"):
        (tmp_path / name).touch()
    looks = Listing()
    assert [item.name for item in looks.files(tmp_path, 0)] == ["2.png", "10.png"]
    assert [item.name for item in looks.files(tmp_path, 2)] == ["b/c/1.png", "2.png", "b/3.txt", "10.png"]
    assert [item.name for item in looks.files(tmp_path, 2, {".txt"})] == ["b/3.txt"]
    assert looks.folders(tmp_path) == [tmp_path / "b"]


def test_what_changes_afterwards_is_not_seen(tmp_path):
    looks = Listing()
    assert looks.files(tmp_path, 0) == []
    (tmp_path / "new.png").touch()
    assert looks.files(tmp_path, 0) == [] and len(Listing().files(tmp_path, 0)) == 1


def test_a_sequence_is_opened_with_one_look_at_each_folder(tmp_path, looked_at):
    write_frames(tmp_path, 3)
    assert len(ps.open_source(tmp_path)) == 3
    assert {tmp_path, tmp_path / "color", tmp_path / "depth"} <= looked_at.keys() and set(looked_at.values()) == {1}


def test_a_batch_is_planned_with_one_look_at_each_folder(tmp_path, looked_at):
    for k in range(4):
        write_frames(tmp_path / "in" / f"{k}", 2)
    looks = Listing()
    sources = find_sources([str(tmp_path / "in")], tmp_path / "out", looks)
    parts = [parts_of(source, {}, tmp_path / "out", looks) for source in sources]
    assert [len(one) for one in parts] == [2] * 4
    assert len(looked_at) == 1 + 4 * 3 and set(looked_at.values()) == {1}
