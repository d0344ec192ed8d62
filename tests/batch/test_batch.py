"""`pointshade batch` as it is typed, with real signals: nothing is lost, half-written, or drawn twice."""

from __future__ import annotations

import os
import shutil
import signal
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import pointshade_gl as ps

from ..support.batches import (
    SMALL,
    but_for_its_command,
    check_whole,
    hidden_in,
    lines_of,
    names_in,
    running,
    write_sequence,
)

pytestmark = pytest.mark.gl


@pytest.fixture
def start(tmp_path):
    """start("INPUT -o out ..."): a running `pointshade batch` in the test's folder. It ends with the test."""
    with running(tmp_path) as start_one:
        yield start_one


@pytest.fixture
def views(shared_data, tmp_path):
    """The 23 views of the living room, of which number 7 is no picture."""
    shutil.copytree(shared_data / "icl_livingroom_23views", tmp_path / "views", copy_function=shutil.copyfile)
    (tmp_path / "views/depth/007.png").write_bytes(b"not a picture")
    return tmp_path / "views"


@pytest.mark.data
@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="reads /proc")
@pytest.mark.system
def test_a_batch_survives_an_unreadable_frame_a_killed_worker_and_an_interruption(start, views, tmp_path, renderer):
    line = "views -o out --workers 2 --samples 2 --yaw 10"
    batch = start(line)
    batch.wait_for(2)
    os.kill(batch.workers()[0], signal.SIGKILL)
    batch.wait_for(10)
    batch.interrupt()
    code, _, err = batch.end()
    assert code == 130 and "--resume goes on" in err and "Traceback" not in err, err
    before = check_whole(tmp_path / "out")
    assert {line["output"] for line in lines_of(batch.manifest)} <= before and len(before) < 22

    code, out, err = start(f"{line} --resume").end()
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
            same = renderer.render(alone, yaw=10, samples=2, exposure="sensor", missing="complete")
            assert np.array_equal(np.asarray(image), same), k


def resident(process: int) -> float:
    """Megabytes of memory that a process uses."""
    pages = int(Path(f"/proc/{process}/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 1e6


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="reads /proc")
@pytest.mark.system
def test_a_thousand_frames_take_no_more_memory_and_are_done_once(start, tmp_path):
    write_sequence(tmp_path / "many", 1000)  # those after the 500th take seconds: time to look at the processes
    batch = start("many -o out --workers 2 --samples 1")
    batch.wait_for(150)
    watched = [batch.process.pid, *batch.workers()]
    before = [resident(process) for process in watched]
    batch.wait_for(500)
    after = [resident(process) for process in watched]
    assert len(watched) == 3 and max(np.subtract(after, before)) < 10, (before, after)
    code, out, _ = batch.end()
    assert code == 0 and "1000 written" in out
    expected = {f"many/{k:04d}.png" for k in range(1000)}
    assert check_whole(tmp_path / "out") == {line["output"] for line in lines_of(batch.manifest)} == expected

    written = batch.manifest.stat().st_mtime_ns
    for again in ("", "--resume"):
        code, out, err = start(f"many -o out --workers 2 --samples 1 {again}").end()
        assert code == 0 and "1000 there" in out and "written" not in out and err == ""
    assert batch.manifest.stat().st_mtime_ns == written


@pytest.mark.system
def test_a_job_that_kills_its_worker_twice_is_a_failure(start, tmp_path):
    write_sequence(tmp_path / "slow", 2)
    batch = start("slow -o out --workers 1 --shard 1/2 --samples 4096 --picture-size 1200x900")
    for _ in range(2):
        until = time.monotonic() + 60
        while not (tmp_path / "out/slow").exists():  # the worker makes it when it begins with the job
            assert batch.process.poll() is None and time.monotonic() < until
            time.sleep(0.02)
        (tmp_path / "out/slow").rmdir()
        os.kill(batch.workers()[0], signal.SIGKILL)
    code, out, err = batch.end()
    assert code == 3 and "failed: slow/0000.png: its worker process died 2 times: signal 9" in err, err
    assert "1 failed" in out and hidden_in(tmp_path / "out") == []


@pytest.mark.system
def test_a_terminated_batch_ends_its_workers_and_leaves_whole_files(start, tmp_path):
    write_sequence(tmp_path / "slow", 8)
    batch = start("slow -o out --workers 2 --samples 64 --picture-size 640x480")
    batch.wait_for(1)
    workers = batch.workers()
    batch.process.terminate()
    code, _, err = batch.end()
    assert code == 130 and "--resume" in err and "Traceback" not in err
    assert not any(Path(f"/proc/{worker}").exists() for worker in workers)
    check_whole(tmp_path / "out")


@pytest.fixture
def batch(typed):
    """batch("INPUT -o out ...") within this process: exit code, stdout, stderr. It still spawns its workers."""
    return lambda line: typed(f"batch {line}")


def test_folders_of_folders_are_mirrored_and_inputs_of_one_name_are_told_apart(batch, tmp_path):
    for name in ("set/kitchen", "set/more/garden", "other/set/kitchen"):
        write_sequence(tmp_path / name, 2)
    write_sequence(tmp_path / "set/single", 1)
    (tmp_path / "set/notes").mkdir()
    (tmp_path / "set/notes/todo.txt").write_text("no frame is here")
    code, out, err = batch(f"'{tmp_path}/set' '{tmp_path}/other/set' vase -o out {SMALL}")
    assert code == 0 and "8 written" in out, err
    above = tmp_path.name
    assert names_in(tmp_path / "out") == sorted(
        [
            "manifest.jsonl",
            "vase.png",
            f"{above}/set/single.png",
            *(f"{above}/set/{name}/000{k}.png" for name in ("kitchen", "more/garden") for k in (0, 1)),
            *(f"other/set/kitchen/000{k}.png" for k in (0, 1)),
        ]
    )


@pytest.mark.parametrize("where", ["elsewhere", "inside"])
def test_outputs_are_no_inputs_of_the_next_run(batch, tmp_path, where):
    write_sequence(tmp_path / "here/a", 2)
    write_sequence(tmp_path / "here/b", 2)
    output = tmp_path / ("out" if where == "elsewhere" else "here/images")
    for expected in ("4 written", "4 there"):
        code, out, err = batch(f"here -o '{output}' --to normals.npy --workers 1")
        assert code == 0 and expected in out, err


@pytest.mark.system
def test_each_kind_of_output_is_what_its_own_command_makes(batch, typed, tmp_path):
    write_sequence(tmp_path / "seq", 3)
    for kind in ("jpg", "normals.png", "normals.npy", "gif"):
        code, _, err = batch(f"seq -o out --to {kind} --workers 1")
        assert code == 0, err
    for line in ("render seq -o film.gif", "normals seq -o n%04d.npy", "normals seq -o n%04d.png"):
        assert typed(line)[0] == 0
    assert (tmp_path / "out/seq.gif").read_bytes() == (tmp_path / "film.gif").read_bytes()
    assert (tmp_path / "out/seq/0001.normals.png").read_bytes() == (tmp_path / "n0001.png").read_bytes()
    assert (tmp_path / "out/seq/0001.normals.npy").read_bytes() == (tmp_path / "n0001.npy").read_bytes()
    assert len(list((tmp_path / "out/seq").glob("*.jpg"))) == 3


@pytest.mark.system
def test_a_scene_and_a_single_frame_become_the_pictures_of_render(batch, typed, tmp_path):
    options = "--light position=-.5,-.7,.2 --samples 2 --picture-size 64x48 --background white --shading flat"
    assert batch(f"demo vase -o out --workers 1 {options}")[0] == 0
    for name in ("demo", "vase"):
        assert typed(f"render {name} -o {name}.png {options}")[0] == 0
        assert (tmp_path / f"out/{name}.png").read_bytes() == (tmp_path / f"{name}.png").read_bytes()


def test_a_page_is_the_one_of_render(batch, typed, tmp_path):
    assert batch("vase -o out --to html --workers 1 --picture-size 64x48 --samples 1")[0] == 0
    assert typed("render vase/front -o vase.html --title vase --picture-size 64x48 --samples 1")[0] == 0
    assert but_for_its_command(tmp_path / "out/vase.html") == but_for_its_command(tmp_path / "vase.html")


@pytest.mark.system
def test_what_was_made_otherwise_is_never_mixed_in_silence(batch, tmp_path):
    write_sequence(tmp_path / "seq", 2)
    assert batch(f"seq -o out {SMALL}")[0] == 0
    picture = tmp_path / "out/seq/0000.png"
    before = picture.read_bytes()
    code, _, err = batch(f"seq -o out {SMALL} --yaw 20")
    assert (
        code == 2
        and "2 outputs in out were made with other options" in err
        and "--resume" in err
        and "--overwrite" in err
    )
    assert picture.read_bytes() == before
    code, out, _ = batch(f"seq -o out {SMALL} --yaw 20 --resume")
    assert code == 0 and "2 written" in out and picture.read_bytes() != before
    code, out, _ = batch(f"seq -o out {SMALL} --overwrite")
    assert code == 0 and "2 written" in out and picture.read_bytes() == before


@pytest.mark.system
def test_resume_trusts_a_line_only_for_the_same_bytes_and_the_same_input(batch, tmp_path):
    write_sequence(tmp_path / "seq", 4)
    assert batch(f"seq -o out {SMALL}")[0] == 0
    pictures = [tmp_path / f"out/seq/{k:04d}.png" for k in range(4)]
    good = [path.read_bytes() for path in pictures]
    pictures[0].write_bytes(good[0][:-20])  # torn
    spoilt = bytearray(good[1])
    spoilt[len(spoilt) // 2] ^= 1
    pictures[1].write_bytes(spoilt)
    os.utime(tmp_path / "seq/depth/0002.png", ns=(1, 1))
    code, out, _ = batch(f"seq -o out {SMALL} --resume")
    assert code == 0 and "3 written, 1 there" in out
    assert [path.read_bytes() for path in pictures] == good
    (tmp_path / "seq/intrinsics.json").write_text((tmp_path / "seq/intrinsics.json").read_text() + " ")
    assert "4 written" in batch(f"seq -o out {SMALL} --resume")[1]


def test_without_resume_what_is_not_whole_is_made_again(batch, tmp_path):
    write_sequence(tmp_path / "seq", 3)
    assert batch(f"seq -o out {SMALL}")[0] == 0
    torn = tmp_path / "out/seq/0001.png"
    whole = torn.read_bytes()
    torn.write_bytes(whole[:-20])
    (tmp_path / "out/manifest.jsonl").unlink()  # what is whole is told by its end
    assert "1 written, 2 there" in batch(f"seq -o out {SMALL}")[1]
    assert torn.read_bytes() == whole


def test_a_torn_last_line_of_the_manifest_costs_one_output(batch, tmp_path):
    write_sequence(tmp_path / "seq", 3)
    assert batch(f"seq -o out {SMALL}")[0] == 0
    manifest = tmp_path / "out/manifest.jsonl"
    manifest.write_bytes(manifest.read_bytes()[:-30])
    assert "1 written, 2 there" in batch(f"seq -o out {SMALL} --resume")[1]
    assert "3 there" in batch(f"seq -o out {SMALL} --resume")[1]


@pytest.mark.system
def test_shards_share_the_work_and_write_to_one_folder_at_once(start, tmp_path):
    write_sequence(tmp_path / "seq", 7)
    shards = [start(f"seq -o out --shard {k}/3 {SMALL}") for k in (1, 2, 3)]
    assert [shard.end()[0] for shard in shards] == [0, 0, 0]
    counts = [len(lines_of(tmp_path / f"out/manifest.{k}-of-3.jsonl")) for k in (1, 2, 3)]
    assert counts == [2, 2, 3] and len(check_whole(tmp_path / "out")) == 7
    code, out, _ = start(f"seq -o out {SMALL} --resume").end()
    assert code == 0 and "7 there" in out  # one process knows what the shards have done


def test_a_frame_whose_pose_was_lost_is_left_out_as_render_leaves_it_out(batch, tmp_path):
    write_sequence(tmp_path / "seq", 3)
    (tmp_path / "seq/pose").mkdir()
    for k, text in enumerate(
        ("1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n", "-inf -inf -inf -inf\n" * 4, "1 0 0 .1\n0 1 0 0\n0 0 1 0\n0 0 0 1\n")
    ):
        (tmp_path / f"seq/pose/{k:04d}.txt").write_text(text)
    code, out, err = batch(f"seq -o out {SMALL}")
    assert code == 0 and "2 written, 1 left out" in out, err


@pytest.mark.parametrize(
    ("line", "told"),
    [
        ("nothing -o out", "there is no folder"),
        ("vase", "-o is missing"),
        (f"vase -o '{__file__}'", "is a file, expected a folder"),
        ("vase -o out --shard 0/8", "--shard is a part from 1"),
        ("vase -o out --shard 9/8", "1/8 to 8/8"),
        ("vase -o out --to bmp", "unknown --to 'bmp'"),
        ("vase -o out --turntable light", "--to mp4"),
        ("vase -o out --temporal", "each picture is drawn alone"),
        ("vase -o out --align", "corrects the poses of several frames of one thing, and each picture is drawn alone"),
        ("vase -o out --resume --overwrite", "not both"),
        ("vase -o out --axes opengl", "--to normals.png"),
        ("vase -o out --to normals.npy --ground", "leave out --ground"),
        ("demo -o out --noise .01", "leave out --noise"),
        ("vase -o out --frame 1", "there is no option --frame"),
        ("vase -o out --workers 0", "--workers must be 1 or more, got 0"),
        ("vase -o out --to mp4 --fps 0", "--fps must be pictures per second"),
        ("vase -o out --quality small", "*.png is no page: leave out --quality"),
        ("vase -o out --to html --quality tiny", "unknown --quality 'tiny'"),
        ("vase -o out --to jpg --background transparent", "out/*.jpg cannot be transparent"),
        ("'' -o out", "is a variable of the shell not set?"),
    ],
)
def test_what_cannot_be_is_told_before_anything_is_drawn(batch, tmp_path, line, told):
    code, _, err = batch(line)
    assert code == 2 and told in err and len(err.splitlines()) == 1, err
    assert names_in(tmp_path) == []
