"""The suffixes that errors, the help and the documentation list are those that work, and no others."""

import inspect
import re

import numpy as np
import pytest

import pointshade_gl as ps
from pointshade_gl.files.access import known_names as known
from pointshade_gl.files.frame_sources import is_scene

from ..support import frames

SUFFIX = re.compile(r"(?<![\w%])\.[a-z]\w{1,4}\b")
COMMANDS = {  # what each command takes after -o
    "render": known.RENDERED,
    "normals": known.NORMALS,
    "depth": known.DEPTH_MAPS,
    "info": known.IMAGES,
}
LIBRARY = {
    "save_image": (known.IMAGES, lambda path: ps.save_image(path, np.zeros((8, 8, 3), np.uint8))),
    "save_depth": (known.DEPTH_MAPS, lambda path: ps.save_depth(path, np.ones((8, 8), np.float32))),
    "save_normals": (known.NORMALS, lambda path: ps.save_normals(path, np.ones((8, 8, 3), np.float32))),
    "save_points": (known.POINTS, lambda path: ps.save_points(path, ps.render_points(frames.sphere()))),
    "save_poses": (known.POSE_LISTS, lambda path: ps.save_poses(path, [frames.sphere()])),
    "save_page": (known.PAGES, lambda path: ps.save_page(path, frames.sphere())),
    "save_scene": (
        known.SCENE_SUFFIXES,
        lambda path: ps.save_scene(path, scene()),
    ),
    "Film": (known.FILMS, lambda path: film(path)),
}
EVERY = sorted({suffix for suffixes, _ in LIBRARY.values() for suffix in suffixes})


def scene():
    return ps.Scene((ps.Node(ps.PointObject(frames.sphere())),))


def film(path):
    with ps.Film(path) as made:
        made.add(np.zeros((8, 8, 3), np.uint8))


@pytest.mark.usefixtures("renderer")
@pytest.mark.parametrize("name", LIBRARY)
def test_a_function_writes_what_its_error_and_its_help_list(tmp_path, name):
    suffixes, write = LIBRARY[name]
    with pytest.raises(ValueError) as info:
        write(tmp_path / "out.xyz")
    assert sorted(SUFFIX.findall(str(info.value).partition(".xyz: ")[2])) == sorted(suffixes)
    about = inspect.getdoc(getattr(ps, name)).partition("Raises\n")[0]
    assert set(SUFFIX.findall(about)) >= set(suffixes)
    for suffix in EVERY:
        if suffix in suffixes:
            write(tmp_path / f"out{suffix}")
            assert (tmp_path / f"out{suffix}").stat().st_size
        else:
            with pytest.raises(ValueError, match="cannot write"):
                write(tmp_path / f"other{suffix}")


@pytest.mark.usefixtures("renderer")
@pytest.mark.parametrize("command", COMMANDS)
def test_a_command_lists_what_it_writes_in_its_error_and_its_help(typed, monkeypatch, command):
    monkeypatch.setenv("COLUMNS", "400")
    suffixes = COMMANDS[command]
    (line,) = re.findall(r"--output .*(?:\n {10}.*)*", typed(f"{command} --help").stdout)
    of_clouds = known.POINTS if command == "normals" else ()
    assert sorted(SUFFIX.findall(line)) == sorted((*suffixes, *of_clouds))
    code, _, errors = typed(f"{command} vase -o out.xyz")
    assert code == 2 and sorted(SUFFIX.findall(errors.partition(".xyz: ")[2])) == sorted(suffixes)


@pytest.mark.usefixtures("renderer")
@pytest.mark.parametrize("suffix", EVERY)
@pytest.mark.parametrize("command", COMMANDS)
def test_a_command_writes_what_it_lists(typed, tmp_path, command, suffix):
    turn = " --turntable light --frames 2" if suffix in known.FILMS and command == "render" else ""
    small = " --picture-size 8x6 --samples 2" if command == "render" and suffix not in known.POINTS else ""
    code, _, errors = typed(f"{command} vase/front -o out{suffix}{turn}{small}")
    is_listed = suffix in COMMANDS[command]
    assert (code == 0) == is_listed, errors
    assert (tmp_path / f"out{suffix}").exists() == is_listed


@pytest.mark.usefixtures("renderer")
def test_the_error_lists_numbered_files(typed):
    code, _, errors = typed("render vase --turntable light -o %04d.xyz")
    assert code == 2 and sorted(SUFFIX.findall(errors.partition(".xyz: ")[2])) == sorted(known.NUMBERED)


@pytest.mark.usefixtures("renderer")
@pytest.mark.parametrize("suffix", sorted(known.NUMBERED))
def test_numbered_files_are_written_as_the_error_lists(typed, tmp_path, suffix):
    size = "" if suffix in known.POINTS else " --picture-size 8x6 --samples 2"
    code, _, errors = typed(f"render vase --turntable light --frames 2{size} -o %d{suffix}")
    assert code == 0 and (tmp_path / f"1{suffix}").exists(), errors


@pytest.mark.usefixtures("renderer")
def test_a_batch_lists_its_kinds_alike(typed, monkeypatch):
    monkeypatch.setenv("COLUMNS", "400")
    listed = ", ".join(known.BATCH)
    assert listed in " ".join(typed("batch --help").stdout.split())
    code, _, errors = typed("batch vase -o out --to xyz")
    assert code == 2 and listed in errors


def test_scenes_are_read_as_they_are_written():
    assert all(is_scene(f"room{suffix}") for suffix in known.SCENE_SUFFIXES)
