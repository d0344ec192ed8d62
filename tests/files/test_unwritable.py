"""What cannot be written is said alike for every kind of file: which one, and why. The old file stays as it was."""

import errno
import os

import numpy as np
import pytest

import pointshade_gl as ps
from pointshade_gl.files.access import atomic_write
from pointshade_gl.files.access.atomic_write import error_of, naming_written
from pointshade_gl.viewer.background import save_new

from ..support import frames

NOT_OURS = "its folder is read-only, or belongs to somebody else"
RNG = np.random.default_rng(3)
IMAGE = RNG.integers(0, 256, (64, 64, 4), np.uint8)
DEPTH = RNG.uniform(1, 2, (64, 64)).astype(np.float32)
NORMALS = RNG.uniform(-1, 1, (64, 64, 3)).astype(np.float32)


def save_film(path):
    with ps.Film(path) as film:
        for _ in range(3):
            film.add(IMAGE)


def cloud():
    return ps.PointCloud(*RNG.uniform(0, 1, (2, 4096, 3)).astype(np.float32), RNG.integers(0, 256, (4096, 3), np.uint8))


WRITERS = {
    **{f"i{suffix}": lambda path: ps.save_image(path, IMAGE) for suffix in (".png", ".jpg", ".webp", ".tif", ".npy")},
    "small.png": lambda path: ps.save_image(path, IMAGE, small=True),
    **{f"d{suffix}": lambda path: ps.save_depth(path, DEPTH) for suffix in (".png", ".exr", ".tif", ".npy")},
    **{f"n{suffix}": lambda path: ps.save_normals(path, NORMALS) for suffix in (".png", ".exr", ".npy")},
    "a.ply": lambda path: ps.save_points(path, cloud()),
    "a.txt": lambda path: ps.save_poses(path, [frames.sphere()] * 99),
    "a.html": lambda path: ps.save_page(path, frames.sphere()),
    "a.glb": lambda path: ps.save_scene(path, ps.Scene((ps.Node(ps.PointObject(frames.sphere())),))),
    "a.gltf": lambda path: ps.save_scene(path, ps.Scene((ps.Node(ps.PointObject(frames.sphere())),))),
    "a.gif": save_film,
}


def needs_extra(name):
    for suffix, module in ((".exr", "OpenEXR"), (".mp4", "imageio_ffmpeg")):
        if name.endswith(suffix):
            pytest.importorskip(module)


@pytest.fixture
def no_room():
    """Files may have 1000 bytes: as on a full disk, writing ends in the middle, with another reason (EFBIG)."""
    resource = pytest.importorskip("resource")
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (1000, before[1]))
    yield os.strerror(errno.EFBIG)
    resource.setrlimit(resource.RLIMIT_FSIZE, before)


@pytest.mark.usefixtures("renderer")
@pytest.mark.parametrize("name", WRITERS)
def test_without_room_the_file_and_the_reason_are_named(tmp_path, request, name):
    needs_extra(name)
    ps.render(frames.sphere())  # drivers may keep compiled shaders in files
    path = tmp_path / name
    path.write_bytes(b"the old one")
    reason = request.getfixturevalue("no_room")
    with pytest.raises(OSError) as info:
        WRITERS[name](path)
    assert str(info.value) == f"cannot write {path}: {reason}" and info.value.errno == errno.EFBIG
    assert [(one.name, one.read_bytes()) for one in tmp_path.iterdir()] == [(name, b"the old one")]


@pytest.mark.usefixtures("renderer")
@pytest.mark.parametrize("name", [*WRITERS, "a.mp4"])
def test_a_read_only_folder_is_named_before_anything_is_done(monkeypatch, tmp_path, name):
    needs_extra(name)
    monkeypatch.setattr(atomic_write.os, "access", lambda _, mode: not mode & os.W_OK)
    monkeypatch.setattr("pathlib.Path.open", None)
    with pytest.raises(PermissionError) as info:
        WRITERS.get(name, save_film)(tmp_path / name)
    assert str(info.value) == f"cannot write {tmp_path / name}: {NOT_OURS}"


@pytest.mark.parametrize("code", [errno.EACCES, errno.EPERM, errno.EROFS])
def test_a_folder_that_is_read_only_all_the_same_is_named_alike(code):
    """On Windows nobody can ask, and a mount may change."""
    with pytest.raises(OSError, match=f"cannot write a.png: {NOT_OURS}") as info, naming_written("a.png"):
        raise OSError(code, os.strerror(code), ".hidden.part")
    assert info.value.errno == code


@pytest.mark.parametrize(
    "said",
    [
        "ffmpeg ended with [out#0/mp4] Could not write header (incorrect codec parameters ?): No space left on device",
        'Failed to write pixel data to image file "/x/.0.part". No space left on device.',
    ],
)
def test_what_other_programs_say_of_a_full_disk_is_understood(said):
    with pytest.raises(OSError) as info, naming_written("a.mp4"):
        raise error_of(said)
    assert str(info.value) == f"cannot write a.mp4: {os.strerror(errno.ENOSPC)}" and info.value.errno == errno.ENOSPC
    with pytest.raises(OSError, match=r"cannot write a\.mp4: something else"), naming_written("a.mp4"):
        raise error_of("something else")


@pytest.mark.parametrize(
    "line",
    [
        "render vase -o out.png", "render vase -o out.ply", "render vase -o out.html", "render vase -o %04d.png",
        "render vase --turntable light -o out.mp4", "normals vase -o out.exr", "depth vase -o out.png",
        "info vase -o out.png", "batch vase -o .", "bench --quick -o .", "view vase --record out.gif",
    ],
)  # fmt: skip
@pytest.mark.parametrize("is_there", [True, False])
def test_commands_tell_it_before_they_draw(typed, monkeypatch, line, is_there):
    def no_renderer(*_, **__):
        raise AssertionError("it draws")

    monkeypatch.setattr("pointshade_gl.cli.output.Renderer", no_renderer)
    monkeypatch.setattr("pointshade_gl.cli.commands.batch_command._outcomes", no_renderer)
    monkeypatch.setattr("pointshade_gl.viewer.viewer.Window", no_renderer)
    if is_there:
        monkeypatch.setattr(atomic_write.os, "access", lambda _, mode: not mode & os.W_OK)
    else:
        name = line.split()[-1]
        line = line.replace(f"-o {name}", f"-o no/{name}").replace(f"--record {name}", f"--record no/{name}")
        if line.startswith(("batch", "bench")):
            monkeypatch.setattr("pathlib.Path.mkdir", lambda *_, **__: (_ for _ in ()).throw(OSError(30, "Read-only")))
    code, _, errors = typed(line)
    expected = NOT_OURS if is_there or line.startswith("bench") else "create it first"
    expected = "cannot make the folder" if not is_there and line.startswith("batch") else expected
    assert code == 2 and expected in errors and "cannot " in errors.splitlines()[-1]


def test_the_window_says_why_a_picture_is_not_saved(monkeypatch, tmp_path, no_room):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(OSError, match=f"^cannot write pointshade_0001.png: {no_room}$"):
        save_new(IMAGE)
    assert not list(tmp_path.iterdir())
