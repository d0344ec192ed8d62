"""A file is the same frame however its path is typed: relative, from the root, with dots, through links."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import pointshade_gl as ps
from pointshade_gl.files.finding import folder_frames as best_group
from pointshade_gl.files.frames.assembly import choose_camera
from pointshade_gl.files.frames.frame_parts import FrameParts, ReadOptions, is_path
from pointshade_gl.files.frames.sequences import FrameSequence, open_frames

from ..support.layouts import MAKERS
from ..support.layouts.room import Room


@pytest.fixture(scope="module")
def room(shared_data):
    return Room(shared_data / "icl_livingroom_23views")


@pytest.mark.data
@pytest.mark.parametrize("maker", MAKERS, ids=lambda maker: maker.__name__)
def test_each_file_of_a_layout_is_the_same_frame_however_it_is_typed(maker, room, tmp_path, monkeypatch):
    top = tmp_path / "here" / "set"
    top.mkdir(parents=True)
    expected = maker(top, room)
    options = ReadOptions(**expected.options | expected.then)
    monkeypatch.setattr(FrameSequence, "settle", lambda *_, **__: None)  # it decodes pictures, and asks for no names
    monkeypatch.setattr(best_group, "read_levels", remembered(best_group.read_levels))
    parts = opened(expected.source, options)
    files = {Path(one.name) for one in (parts[0], parts[-1]) if top in Path(one.name).parents} if parts else set()
    for file in {expected.source, *files}:
        plain = what_is_read(file, options)
        for folder, typed in ways_to(file, top):
            monkeypatch.chdir(folder)
            assert what_is_read(typed, options) == plain, f"{typed} in {folder}"


def remembered(read: Callable) -> Callable:
    """The same for a picture's values as at first: they are read again however a file is typed."""
    known: dict[bytes, object] = {}

    def of(image: np.ndarray) -> object:
        key = hashlib.sha1(f"{image.shape}{image.dtype}".encode() + image.tobytes()).digest()
        if key not in known:
            known[key] = read(image)
        return known[key]

    return of


def opened(path: Path, options: ReadOptions) -> list[FrameParts]:
    """None where the folder is refused."""
    try:
        return list(open_frames(path, False, options, lambda _: None).parts)
    except (ValueError, OSError):
        return []


def what_is_read(path: Path, options: ReadOptions) -> tuple | None:
    """The files and numbers that the first frame is made of."""
    if not (parts := opened(path, options)):
        return None
    first, camera = parts[0], choose_camera(parts[0], options, lambda _: None)
    files = [hash(Path(one).read_bytes()) if is_path(one) else one for one in (first.depth, first.color, first.valid)]
    said = camera and (camera.numbers, camera.size, camera.depth_scale, camera.depth_kind, camera.baseline)
    return len(parts), *files, said, None if first.pose is None else first.pose.tobytes()


def ways_to(file: Path, top: Path) -> Iterator[tuple[Path, Path]]:
    """The folder in which one types, and what one types, for a file or folder in `top`."""
    inside, here = file.relative_to(top), top.parent
    alone = here / f"beside {file.name}"
    link(here / "whole", top)
    link(here / "folder", file.parent)
    link(alone / file.name, file)
    yield here, file.relative_to(here)
    yield file.parent, Path(file.name)
    yield file.parent, Path("..", file.parent.name, file.name)
    yield here, Path("whole") / inside
    yield here, Path("folder", file.name)
    yield here, Path("folder", "..", file.parent.name, file.name)  # above what the link leads to
    yield here, Path(alone.name, file.name)
    yield alone, Path(file.name)
    if file.is_dir():
        yield file, Path()
    else:
        yield here, set_of_links(here, top) / inside


def link(path: Path, target: Path) -> None:
    path.parent.mkdir(exist_ok=True)
    path.unlink(missing_ok=True)
    path.symlink_to(target)


def set_of_links(here: Path, top: Path) -> Path:
    """The folders of a data set with links in place of files, as git-annex and DVC have them."""
    links, objects = here / "links", here / "objects"
    if not links.exists():
        objects.mkdir()
        for folder, _, names in os.walk(top):
            below = links / Path(folder).relative_to(top)
            below.mkdir()
            for name in names:
                kept = objects / hashlib.sha1(f"{folder}/{name}".encode()).hexdigest()
                kept.hardlink_to(Path(folder, name))
                (below / name).symlink_to(kept)
    return Path("links")


def write(folder: Path, color: int | None, name: str = "color.png", depth: str = "depth.png") -> None:
    folder.mkdir(parents=True)
    if color is not None:
        Image.fromarray(np.full((12, 16, 3), color, np.uint8)).save(folder / name)
    Image.fromarray(np.full((12, 16), 1000, np.uint16) + np.arange(16, dtype=np.uint16)).save(folder / depth)


def color_of(path: str | Path, **options) -> int | None:
    color = ps.load_frame(path, fov=60, **options).color
    return None if color is None else int(color[0, 0, 0])


@pytest.mark.parametrize("name", ["color.png", "IMG_2031.png", "rgb/0.png"])
def test_a_folder_that_is_called_depth_has_its_own_colours_before_its_neighbours(tmp_path, monkeypatch, name):
    (tmp_path / "my_depth_scan" / "rgb").mkdir(parents=True)
    write(tmp_path / "my_depth_scan" / "0", 200)
    (tmp_path / "my_depth_scan/0/color.png").rename(tmp_path / "my_depth_scan" / name)
    (tmp_path / "my_depth_scan/0/depth.png").rename(tmp_path / "my_depth_scan/depth.png")
    write(tmp_path / "a_scan", 10)
    Image.fromarray(np.full((12, 16, 3), 50, np.uint8)).save(tmp_path / "color.png")
    monkeypatch.chdir(tmp_path)
    for typed in ("my_depth_scan/depth.png", tmp_path / "my_depth_scan/depth.png", "my_depth_scan"):
        assert color_of(typed) == 200
    assert color_of("my_depth_scan", depth=tmp_path / "my_depth_scan/depth.png") == 200


def test_another_frames_colour_is_not_taken(tmp_path, monkeypatch):
    write(tmp_path / "my_depth_scan", None)
    write(tmp_path / "a_scan", 10)
    monkeypatch.chdir(tmp_path)
    assert color_of("my_depth_scan/depth.png") is None and color_of("my_depth_scan") is None


def test_colours_beside_a_link_come_before_those_beside_what_it_leads_to(tmp_path):
    write(tmp_path / "kept", 10)
    (tmp_path / "set").mkdir()
    (tmp_path / "set/depth.png").symlink_to("../kept/depth.png")
    assert color_of(tmp_path / "set/depth.png") == 10
    Image.fromarray(np.full((12, 16, 3), 200, np.uint8)).save(tmp_path / "set/color.png")
    assert color_of(tmp_path / "set/depth.png") == 200


def test_a_camera_and_a_depth_of_one_folder_may_be_typed_differently(tmp_path, monkeypatch):
    write(tmp_path / "scan", 10)
    (tmp_path / "scan/camera.txt").write_text("18 0 7.5\n0 18 5.5\n0 0 1\n")
    monkeypatch.chdir(tmp_path)
    frame = ps.load_frame("scan", depth=tmp_path / "scan/depth.png", notes=lambda _: None)
    assert frame.camera.intrinsics == (18, 18, 7.5, 5.5)


def test_messages_name_files_as_they_are_typed(tmp_path, monkeypatch):
    write(tmp_path / "depth", None, depth="0.png")
    monkeypatch.chdir(tmp_path)
    (tmp_path / "depth/calib.txt").write_text("18 0 7.5\n0 18 5.5\n0 0 1\n")
    notes: list[str] = []
    ps.load_frame("depth", notes=notes.append)
    assert "the camera is read from depth/calib.txt" in notes
    assert "depth has no colour picture (color.*, rgb.*, image.*): the surface is light grey" in notes


def test_a_loop_of_links_is_one_sentence(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("a").symlink_to("b")
    Path("b").symlink_to("a")
    with pytest.raises(OSError, match="a"):
        ps.load_frame("a/../depth.png", fov=60)


@pytest.mark.skipif(not Path("/proc/kmsg").exists(), reason="files of Linux")
@pytest.mark.parametrize("path", ["/proc/kmsg", "/proc/self/mounts", "/proc", "/sys/kernel", "/proc/self/fd"])
def test_what_linux_shows_as_files_is_refused_without_being_read(path):
    """Some never end: /proc/kmsg waits for the kernel's next message."""
    for read in (ps.load_frame, ps.open_source, ps.load_cloud):
        with pytest.raises((OSError, ValueError), match=r"is empty|shows its own state|is a folder|Permission denied"):
            read(path)


def test_the_working_folder_may_be_named_through_proc(tmp_path, monkeypatch):
    Image.fromarray(np.full((6, 8), 1500, np.uint16)).save(tmp_path / "depth.png")
    monkeypatch.chdir(tmp_path)
    if Path("/proc/self/cwd").exists():
        assert ps.load_frame("/proc/self/cwd", fov=50).depth[0, 0] == 1.5


def test_names_that_are_no_text_are_written_and_refused_in_words(tmp_path):
    frame = ps.Frame(np.zeros((6, 8, 3), np.uint8), np.ones((6, 8), np.float32), ps.Camera(10, 10, 3.5, 2.5, 8, 6))
    cloud = ps.PointCloud(np.eye(3, dtype=np.float32))
    scene = ps.Scene((ps.Node(ps.PointObject(frame), name="n\udcff"), ps.Node(cloud)))
    ps.save_scene(tmp_path / "scene.gltf", scene)
    assert ps.load_scene(tmp_path / "scene.gltf").nodes[0].name == "n\udcff"
    text = (tmp_path / "scene.gltf").read_text(encoding="utf-8").replace('"scene.bin"', '"\\ud800"')
    (tmp_path / "scene.gltf").write_text(text, encoding="utf-8")
    with pytest.raises(ValueError, match="it is no text") as refused:
        ps.load_scene(tmp_path / "scene.gltf")
    assert type(refused.value) is ValueError


@pytest.mark.skipif(os.name == "nt", reason="modes of Unix")
def test_a_file_that_is_replaced_keeps_who_may_read_it(tmp_path):
    path = tmp_path / "a.png"
    for _ in range(2):
        ps.save_image(path, np.zeros((4, 4, 3), np.uint8))
        path.chmod(0o600)
        ps.save_image(path, np.zeros((4, 4, 3), np.uint8))
        assert path.stat().st_mode & 0o777 == 0o600
