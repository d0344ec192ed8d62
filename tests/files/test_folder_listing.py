"""What lies in folders: files by level, in natural order, each folder looked at once."""

import cProfile
import errno
import os
from collections import Counter
from pathlib import Path
from pstats import Stats

import numpy as np
import pytest
from PIL import Image

import pointshade_gl as ps
from pointshade_gl.batch.batch_inputs import find_sources, parts_of
from pointshade_gl.batch.jobs import Job
from pointshade_gl.batch.manifest import plan
from pointshade_gl.files.access import folders as listing
from pointshade_gl.files.access.folders import Listing

VIEW = ps.View()


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


@pytest.fixture
def locked(monkeypatch):
    """locked(folder, number=EACCES): from now on looking into this folder fails so, also for root."""
    scandir = os.scandir

    def lock(folder, number=errno.EACCES):
        def scan(path):
            if Path(path) == folder:
                raise OSError(number, os.strerror(number), str(path))
            return scandir(path)

        monkeypatch.setattr(listing.os, "scandir", scan)

    return lock


def test_a_folder_that_cannot_be_read_is_noted_in_a_sequence(tmp_path, locked):
    write_frames(tmp_path, 3)
    (tmp_path / "poses").mkdir()
    locked(tmp_path / "poses")
    notes: list[str] = []
    assert len(ps.open_source(tmp_path, notes=notes.append)) == 3
    assert f"{tmp_path / 'poses'} cannot be read (Permission denied): what is in it is left out" in notes


def test_a_folder_whose_depth_cannot_be_read_is_not_called_empty(tmp_path, locked):
    write_frames(tmp_path, 3)
    locked(tmp_path / "depth")
    with pytest.raises(OSError, match=r"has no depth picture, but .*depth cannot be read \(Permission denied\)"):
        ps.load_frame(tmp_path)


def test_folders_around_a_sequence_that_cannot_be_read_are_none_of_it(tmp_path, locked):
    write_frames(tmp_path / "seq", 2)
    (tmp_path / "seq/intrinsics.json").unlink()
    locked(tmp_path)
    notes: list[str] = []
    assert len(ps.open_source(tmp_path / "seq", fov=60, notes=notes.append)) == 2
    assert not any("cannot be read" in note for note in notes)


def test_a_folder_with_too_many_files_is_said_to_be_cut(tmp_path, monkeypatch):
    write_frames(tmp_path, 3)
    monkeypatch.setattr(listing, "FOLDER_FILES", 3)
    notes: list[str] = []
    assert len(ps.open_source(tmp_path, notes=notes.append)) == 3 and not any("more than" in note for note in notes)
    (tmp_path / "depth/more.txt").touch()
    ps.open_source(tmp_path, notes=notes.append)
    assert any(f"{tmp_path / 'depth'} has more than 3 files: the others are left out" in note for note in notes)


@pytest.mark.gl
def test_a_batch_lists_what_cannot_be_read_and_what_vanishes_as_failures(tmp_path, locked, typed):
    for name in ("a", "b", "c"):
        write_frames(tmp_path / "in" / name, 1)
    for number, why in ((errno.EACCES, "Permission denied"), (errno.ENOENT, "No such file or directory")):
        locked(tmp_path / "in/b", number)
        code, out, err = typed(f"batch in -o {number} --to normals.npy --workers 1")
        assert code == 3 and "2 written, 1 failed" in out
        assert f"failed: in: {tmp_path}/in/b cannot be read ({why}): what is in it is left out" in err
    assert len(list((tmp_path / f"{errno.EACCES}").rglob("*.npy"))) == 2


def test_a_folder_that_vanishes_during_the_scan_does_not_end_the_batch(tmp_path, monkeypatch):
    for name in ("a", "b", "c"):
        write_frames(tmp_path / "in" / name, 1)
    scandir = os.scandir

    def scan(path):
        if Path(path).name == "b":
            Path(path).rename(tmp_path / "elsewhere")
        return scandir(path)

    monkeypatch.setattr(listing.os, "scandir", scan)
    looks = Listing()
    sources = find_sources([str(tmp_path / "in")], tmp_path / "out", looks)
    assert [Path(one.path).name for one in sources] == ["a", "c"]
    assert len(looks.not_whole(tmp_path / "in")) == 1


def test_a_folder_of_a_batch_is_planned_in_few_calls(tmp_path):
    """Calls are counted in place of seconds, which depend on the machine: 10 000 folders are a usual batch."""
    for name, count in (("first", 1), ("in", 50)):  # the first of a process imports modules
        (tmp_path / name).mkdir()
        for k in range(count):
            write_frames(tmp_path / name / f"{k}", 1)
        with cProfile.Profile() as calls:
            looks = Listing()
            sources = find_sources([str(tmp_path / name)], tmp_path / "out", looks)
            planned, _ = plan(sources, lambda one: Job(one.path, tmp_path, view=VIEW), tmp_path / "out", looks)
        assert len(planned) == count
    assert Stats(calls).total_calls < 1400 * 50
