"""`pointshade batch` with odd input: damaged manifests, full disks, strange names, folders in each other."""

from __future__ import annotations

import errno
import json
import os
import shutil
from contextlib import suppress
from pathlib import Path

import pytest

from pointshade_gl.batch import manifest as plan
from pointshade_gl.batch import processes as workers
from pointshade_gl.batch.jobs import Done, Job
from pointshade_gl.batch.manifest import Manifest
from pointshade_gl.files.access.atomic_write import is_case_sensitive

from ..support.batches import SMALL, but_for_its_command, check_whole, lines_of, running, write_sequence

pytestmark = pytest.mark.gl


@pytest.fixture
def start(tmp_path):
    """start("INPUT -o out ..."): a running `pointshade batch` in the test's folder. It ends with the test."""
    with running(tmp_path) as start_one:
        yield start_one


@pytest.fixture
def batch(typed):
    """batch("INPUT -o out ...") within this process: exit code, stdout, stderr. It still spawns its workers."""
    return lambda line: typed(f"batch {line}")


def test_outputs_are_never_taken_for_colours_of_their_own_input(batch, tmp_path):
    shutil.rmtree(write_sequence(tmp_path / "seq") / "color")
    with suppress(OSError):  # Windows lets only some users make links
        (tmp_path / "loop").symlink_to("loop")
        assert batch(f"seq -o loop {SMALL}")[0] == 2
    for kind in ("jpg", "gif"):
        code, _, err = batch(f"seq -o seq/out --to {kind} --samples 1")
        assert code == 2 and f"would take each {kind} there for its own colours: pass another -o DIR" in err
    for expected in ("3 written", "3 there"):
        assert expected in batch(f"seq -o seq {SMALL} --resume")[1]


def test_pages_have_the_quality_and_the_title_that_were_asked_for(batch, typed, tmp_path):
    asked = "--quality small --title Lit --picture-size 64x48 --samples 1"
    assert batch(f"vase -o out --to html --workers 1 {asked}")[0] == 0
    assert typed(f"render vase/front -o vase.html {asked}")[0] == 0
    assert but_for_its_command(tmp_path / "out/vase.html") == but_for_its_command(tmp_path / "vase.html")
    code, _, err = batch("vase -o out --to html --samples 1 --picture-size 64x48")
    assert code == 2 and "with other options" in err


def test_a_damaged_manifest_costs_no_more_than_its_lines(batch, tmp_path):
    write_sequence(tmp_path / "seq", 1)
    assert batch(f"seq -o out {SMALL}")[0] == 0
    manifest = tmp_path / "out/manifest.jsonl"
    good = json.loads(manifest.read_text())
    spoilt = [good | {name: value} for name in good for value in (None, [], {}, -1, "x" * 100_000)]
    lines = [b"[" * 100_000, b"\xff\x00\xfe", *(json.dumps(line).encode() for line in spoilt)]
    manifest.write_bytes(b"\n".join([*lines, json.dumps(good).encode()]) + b"\n")
    (tmp_path / "out/manifest.2-of-3.jsonl").mkdir()
    assert "1 there" in batch(f"seq -o out {SMALL} --resume")[1]
    manifest.write_bytes(b"\n".join(lines[:2]))
    assert "1 written" in batch(f"seq -o out {SMALL} --resume")[1]
    assert "1 there" in batch(f"seq -o out {SMALL} --resume")[1]


def test_the_last_line_about_an_output_counts_even_if_the_clock_was_set_back(batch, tmp_path):
    write_sequence(tmp_path / "seq", 1)
    manifest = tmp_path / "out/manifest.jsonl"
    for line in (f"seq -o out {SMALL} --yaw 9", f"seq -o out {SMALL} --overwrite"):
        assert batch(line)[0] == 0
    first, last = lines_of(manifest)
    manifest.write_text(f"{json.dumps(first | {'time': '2999-01-01T00:00:00Z'})}\n{json.dumps(last)}\n")
    assert "1 there" in batch(f"seq -o out {SMALL} --resume")[1]


def test_a_full_disk_ends_a_batch_and_what_was_written_stays(tmp_path):
    resource = pytest.importorskip("resource", reason="limits of a process are those of POSIX")
    write_sequence(tmp_path / "seq", 3)
    Manifest(tmp_path).add(Done(tmp_path / "a.png", 1.0, 2, "", "", ()), {})
    before = (tmp_path / "manifest.jsonl").read_bytes()
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    try:
        resource.setrlimit(resource.RLIMIT_FSIZE, (len(before) + 9, limits[1]))
        with pytest.raises(OSError, match="make room, then the same command with resume=True goes on"):
            Manifest(tmp_path).add(Done(tmp_path / "b.png", 1.0, 2, "", "", ()), {})
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    Manifest(tmp_path).add(Done(tmp_path / "c.png", 1.0, 2, "", "", ()), {})
    assert set(Manifest(tmp_path).entries) == {"a.png", "c.png"}


def test_a_job_without_room_on_the_disk_ends_the_others(monkeypatch, tmp_path):
    def full(*_):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(workers, "run", full)
    outcome = workers.outcome_of(Job("vase", tmp_path / "a.png"))
    with pytest.raises(OSError, match=r"cannot write .*a\.png: No space left on device: .* --resume goes on"):
        workers.checked(outcome)


@pytest.mark.system
def test_two_runs_in_one_folder_at_once_leave_it_whole(start, tmp_path):
    write_sequence(tmp_path / "seq", 4)
    runs = [start(f"seq -o out {SMALL}") for _ in range(2)]
    assert [run.end()[0] for run in runs] == [0, 0]
    assert len(check_whole(tmp_path / "out")) == 4
    code, out, _ = start(f"seq -o out {SMALL} --resume").end()
    assert code == 0 and "4 there" in out


def test_names_may_have_spaces_lines_and_letters_of_any_script(batch, tmp_path):
    names = ["a b é", "-dash", "日本", *(["new\nline"] if os.name == "posix" else [])]
    for name in names:
        write_sequence(tmp_path / "set" / name, 2)
    (tmp_path / "set/-dash/depth/0001.png").write_bytes(b"no picture")
    for path in ("set/loop", "set/-dash/depth/loop.png"):
        with suppress(OSError):  # Windows lets only some users make links
            (tmp_path / path).symlink_to(Path(path).name)
    code, out, err = batch(f"set -o out {SMALL}")
    assert code == 3 and f"{2 * len(names) - 1} written, 1 failed" in out and "failed: set/-dash/0001.png: " in err
    assert all((tmp_path / "out/set" / name / "0000.png").exists() for name in names)


def test_names_that_differ_by_case_are_refused_only_where_they_are_one_file(batch, tmp_path, monkeypatch):
    for name in ("Kitchen", "kitchen"):
        write_sequence(tmp_path / name, 1)
    line = f"kitchen Kitchen -o out {SMALL}"
    assert is_case_sensitive(tmp_path)
    monkeypatch.setattr(plan, "is_case_sensitive", lambda _: False)  # as on Windows and macOS
    code, _, err = batch(line)
    assert code == 2 and "would both become" in err and not list((tmp_path / "out").iterdir())
    monkeypatch.undo()
    monkeypatch.chdir(tmp_path)
    code, out, err = batch(line)
    assert code == 0 and "2 written" in out, err
