"""Damaged files: whatever happened to their bytes, reading ends in a result or in one sentence, soon, in little memory.

A long run: `POINTSHADE_DAMAGES=50 pytest tests/system/test_damaged_files.py --timeout 0` damages each file of every
layout 50 times, where a usual run takes a few of each kind. The damage is the same in each run.
"""

import os
import shutil
import zlib
from pathlib import PurePath

import numpy as np
import pytest

from ..support.damage import damaged
from ..support.hostile_child import outcomes
from ..support.whole_files import item, layouts, small_files
from .test_hostile_inputs import check_opened

COUNT = int(os.environ.get("POINTSHADE_DAMAGES", "0"))  # of each file; 0 is a usual run
KINDS = "ValueError", "NotAPictureError", "OSError", "FileNotFoundError", "IsADirectoryError", "MemoryError"

pytestmark = [
    pytest.mark.system,
    pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="the child measures itself by signals"),
]


def jobs_of(items, count):
    """`count` jobs for each damaged file, of many files of one kind for two."""
    jobs = []
    for one in items:
        seen = []
        for name in one["files"]:
            seen.append((PurePath(name).parent, PurePath(name).suffix))
            for k in range(count if seen.count(seen[-1]) <= 2 else 0):
                title = f"{PurePath(one['folder']).name}: {name}, damage {k}"
                call = "info" if one["call"] == "source" and k % 8 == 7 else one["call"]
                jobs.append(one | {"name": title, "damaged": name, "seed": zlib.crc32(title.encode()), "call": call})
    return jobs


def check(found):
    """All ended as they should. The message names the job; its file can be damaged again by the seed."""
    faults = []
    for name, one in found.items():
        if why := fault(one):
            faults.append(f"{name}: {why}: {one['kind']}: {one['sentence'][:300]} ({one['where']})")
    assert not faults, "\n".join(faults)


def fault(one):
    if one["kind"] and not (one["kind"] in KINDS and one["is_told"] and one["sentence"]):
        return "not told"
    if "\n" in one["sentence"] or len(one["sentence"]) > 700:
        return "more than a sentence"
    if one["seconds"] > 4:
        return f"took {one['seconds']:.1f} s"
    check_opened(one, secret=False)
    return ""


def test_small_files_of_every_format(tmp_path):
    items = list(small_files(tmp_path / "files"))
    check(outcomes(jobs_of(items, COUNT or 10), tmp_path))


@pytest.mark.data
def test_layouts_of_data_sets(tmp_path, shared_data):
    items = list(layouts(tmp_path / "files", shared_data, every=bool(COUNT)))
    check(outcomes(jobs_of(items, COUNT or 1), tmp_path))


@pytest.mark.data
def test_frames_of_sensors(tmp_path, shared_data):
    items = []
    for folder in sorted(shared_data.iterdir()):
        if (folder / "intrinsics.json").is_file() and not (folder / "transforms.json").is_file():
            place = tmp_path / "files" / folder.name
            shutil.copytree(folder, place, copy_function=shutil.copyfile)  # which may be damaged
            items.append(item(place, "source", "."))
    check(outcomes(jobs_of(items, COUNT or 1), tmp_path))


def test_whole_files_are_read_without_damage(tmp_path):
    """Otherwise nothing is told by the others."""
    jobs = [one | {"name": str(k)} for k, one in enumerate(small_files(tmp_path / "files"))]
    found = outcomes(jobs, tmp_path)
    assert [one for one in found.values() if one["kind"]] == []


def test_damage_is_the_same_each_time_and_mostly_there():
    data = bytes(range(256)) * 9
    changed = [damaged(data, np.random.default_rng(seed)) for seed in range(200)]
    assert changed == [damaged(data, np.random.default_rng(seed)) for seed in range(200)]
    assert sum(one != data for one in changed) > 180
