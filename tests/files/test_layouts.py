"""Other people's files: every layout gives the right camera, depth, colour and poses, typed as a newcomer types it.

Where a layout does not hold what is needed, the first command may end in an error that names the option, or guess with
a note; with that option the result must be right.
"""

from __future__ import annotations

import re
import threading
from functools import cache

import numpy as np
import pytest
from PIL import Image

import pointshade_gl as ps

from ..support.layouts import MAKERS
from ..support.layouts.room import Expected, Room

pytestmark = pytest.mark.data


@pytest.fixture(scope="module")
def room(shared_data):
    return Room(shared_data / "icl_livingroom_23views")


@pytest.fixture(scope="module")
def written(room, tmp_path_factory):
    """written(maker): what must come out of a layout, which is written once for all tests."""
    top = tmp_path_factory.mktemp("layouts")

    @cache
    def write(maker):
        folder = top / f"of {maker.__name__}"
        folder.mkdir()
        return maker(folder, room)

    return write


@pytest.mark.parametrize("maker", MAKERS, ids=lambda maker: maker.__name__)
def test_a_layout_gives_the_right_camera_depth_colour_and_poses(maker, written):
    expected = written(maker)
    frames, notes = load_or_ask(expected)
    if frames is None:
        return  # refused by a sentence that names what is missing
    assert len(frames) == len(expected.views)
    check_cameras(frames, expected)
    check_depths(frames, expected)
    if expected.color:
        check_colors(frames, expected)
    if expected.poses and not (expected.or_notes and said(expected.or_notes, notes)):
        check_poses(frames, expected)
        check_overlap(frames)


def test_a_video_ends_with_the_sequence_that_reads_it(written):
    from ..support.layouts.capture_apps import stray_scanner_video

    source, before = written(stray_scanner_video).source, set(threading.enumerate())
    frames = ps.open_source(source, notes=lambda _: None)
    assert frames[0].color is not None
    (reader,) = set(threading.enumerate()) - before
    del frames
    assert not reader.is_alive()


def test_the_views_of_the_room_overlap_by_themselves(room):
    """What check_overlap asks of a reader, the room's own views give."""
    from ..support.layouts.room import SMALL

    camera = ps.Camera(SMALL.fx, SMALL.fy, SMALL.cx, SMALL.cy, SMALL.width, SMALL.height)
    check_overlap([ps.Frame(view.color, view.depth, camera, view.pose) for view in room.through(SMALL)])


README = (
    "tum_freiburg3", "icl_nuim_tum", "bonn", "eth3d_slam", "redwood_sample", "seven_scenes",
    "threedmatch_sequence", "sun3d", "scannet", "replica", "arkitscenes", "nerfstudio", "instant_ngp",
    "colmap_text", "polycam", "stray_scanner_video", "scanner_app", "record3d", "bop", "ycb_video", "graspnet",
    "virtual_kitti_2", "middlebury", "kitti_2015", "nyu_labeled", "diode", "tartanair", "sun_rgbd",
    "midas", "depth_pro", "moge", "vggt", "monst3r", "realsense_json", "opencv_yaml", "k_npy", "ours",
)  # fmt: skip

SMOOTH = "tum_freiburg3", "depth_pro", "ours"  # drawn with as many samples as usual, which takes longer


ORDINARY = (  # of each kind of reader one; the others are drawn in the run of the system
    "tum_freiburg3", "scannet", "arkitscenes", "nerfstudio", "colmap_text", "record3d", "bop", "middlebury",
    "kitti_2015", "midas", "moge", "realsense_json", "ours",
)  # fmt: skip


@pytest.mark.usefixtures("renderer")
@pytest.mark.parametrize(
    "name", [name if name in ORDINARY else pytest.param(name, marks=pytest.mark.system) for name in README]
)
def test_what_the_readme_names_is_drawn_as_photographed_by_the_command_line(typed, name, written):
    expected = written(next(maker for maker in MAKERS if maker.__name__ == name))
    options = " ".join(f"--{key.replace('_', '-')} {value}" for key, value in expected.options.items())
    if name not in SMOOTH:
        options += " --samples 1 --background transparent"
    code, _, errors = typed(f"render '{expected.source}' {options} -o out.png --shading none --picture-size depth")
    assert code == 0, errors
    with Image.open("out.png") as drawn:
        picture = np.asarray(drawn)
    view = expected.views[0]
    seen = (picture[..., 3] > 0) & (view.depth > 0)
    assert seen.sum() > 0.5 * (view.depth > 0).sum()
    if expected.color:
        assert np.abs(picture[seen][:, :3].astype(float) - view.color[seen]).mean() < 12


def load(expected: Expected, **more: object) -> tuple[list[ps.Frame], list[str]]:
    notes: list[str] = []
    source = ps.open_source(expected.source, notes=notes.append, **{**expected.options, **more})
    return ([source] if isinstance(source, ps.Frame) else list(source)), notes


def load_or_ask(expected: Expected) -> tuple[list[ps.Frame] | None, list[str]]:
    """The frames of the first command, or of the second where the first asks for an option or guesses aloud.

    None where the layout may be refused and is.
    """
    if expected.or_says is None:
        return load(expected)
    try:
        frames, notes = load(expected)
    except (ValueError, OSError) as error:
        assert re.search(expected.or_says, str(error)), f"does not ask for {expected.or_says}: {error}"
        if not expected.then:
            return None, []
    else:
        if not said(expected.or_says, notes):
            return frames, notes
    return load(expected, **expected.then)


def said(pattern: str, notes: list[str]) -> bool:
    return any(re.search(pattern, note) for note in notes)


def check_cameras(frames: list[ps.Frame], expected: Expected) -> None:
    want = expected.camera
    for frame in frames:
        camera = frame.camera
        assert (camera.width, camera.height) == (want.width, want.height)
        if expected.or_notes:
            camera = ps.Camera(camera.fx, abs(camera.fy), camera.cx, camera.cy, camera.width, camera.height)
        assert camera.intrinsics == pytest.approx((want.fx, want.fy, want.cx, want.cy), abs=expected.pixels)


def check_depths(frames: list[ps.Frame], expected: Expected) -> None:
    for frame, view in zip(frames, expected.views, strict=True):
        both = (frame.depth > 0) & (view.depth > 0)
        assert both.any()
        if expected.metric:
            wrong = np.abs(frame.depth[both] / view.depth[both] - 1)
            assert np.median(wrong) < 0.003 and np.quantile(wrong, 0.99) < 0.02
        else:
            got, want = np.argsort(np.argsort(frame.depth[both])), np.argsort(np.argsort(view.depth[both]))
            assert np.corrcoef(got, want)[0, 1] > 0.95, "near and far are exchanged or mixed"
            continue
        assert not ((frame.depth > 0) & (view.depth == 0)).mean() > 0.001, "depth where there is none"
        if not expected.sparse:
            assert ((frame.depth == 0) & (view.depth > 0)).mean() < 0.001, "depth is lost"


def check_colors(frames: list[ps.Frame], expected: Expected) -> None:
    for frame, view in zip(frames, expected.views, strict=True):
        assert frame.color is not None, "no colour"
        height, width = view.depth.shape
        color = np.asarray(Image.fromarray(frame.color[..., :3]).resize((width, height), Image.Resampling.BOX))
        off = np.abs(color.astype(np.int16) - view.color)
        assert off[view.depth > 0].mean() < 8, "another picture"


def check_poses(frames: list[ps.Frame], expected: Expected) -> None:
    """Each frame from the first, since a reader may choose its world."""
    for frame, view in zip(frames, expected.views, strict=True):
        got = np.linalg.inv(frames[0].pose) @ frame.pose
        want = np.linalg.inv(expected.views[0].pose) @ view.pose
        if frame.camera.fy < 0:  # y points up
            want = np.diag([1, -1, 1, 1]) @ want @ np.diag([1, -1, 1, 1])
        np.testing.assert_allclose(got[:3, :3], want[:3, :3], atol=1e-3)
        np.testing.assert_allclose(got[:3, 3], want[:3, 3], atol=expected.metres)


def check_overlap(frames: list[ps.Frame]) -> None:
    """Points of the first frame, seen from each other one, lie at that one's depth."""
    first = frames[0]
    v, u = np.nonzero(first.depth)
    z = first.depth[v, u].astype(float)
    camera = first.camera
    points = np.stack([(u - camera.cx) / camera.fx * z, (v - camera.cy) / camera.fy * z, z, np.ones_like(z)])
    for other in frames[1:]:
        x, y, far, _ = np.linalg.inv(other.pose) @ first.pose @ points
        camera = other.camera
        ahead = far > 0
        at_u = np.rint(camera.fx * x[ahead] / far[ahead] + camera.cx).astype(int)
        at_v = np.rint(camera.fy * y[ahead] / far[ahead] + camera.cy).astype(int)
        inside = (at_u >= 0) & (at_u < camera.width) & (at_v >= 0) & (at_v < camera.height)
        depth, far = other.depth[at_v[inside], at_u[inside]], far[ahead][inside]
        both = depth > 0
        assert both.sum() > 0.2 * z.size, "the views do not meet"
        assert np.median(np.abs(far[both] / depth[both] - 1)) < 0.02, "the views disagree"
