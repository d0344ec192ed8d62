"""The stage of Ray Data, called with batches as Ray Data makes them."""

import pickle
import threading

import numpy as np
import pytest

import pointshade_gl as ps

from ..support import frames

pytest.importorskip("ray")
C = frames.CAMERA
NUMBERS = [C.fx, C.fy, C.cx, C.cy]


def batch(**columns):
    sphere = frames.sphere()
    return {"color": sphere.color[None], "depth": sphere.depth[None]} | columns


def test_a_row_has_its_own_intrinsics_and_pose_or_the_stages_camera(renderer):
    sphere, pose = frames.sphere(), np.eye(4)
    pose[0, 3] = 0.5
    stage = ps.batch.Stage(ps.Appearance(shading="flat"), ps.View([ps.Light((1, -2, 0))]), C)
    posed = batch(intrinsics=np.array([NUMBERS]) * 0.9, pose=pose[None])
    camera = ps.Camera(*(0.9 * np.array(NUMBERS)), C.width, C.height)
    for given, frame in (
        (batch(), sphere),
        (posed, ps.Frame(sphere.color, sphere.depth, camera, pose)),
        ({"depth": sphere.depth[None].astype(np.float64), "color": np.array([None])}, ps.Frame(None, sphere.depth, C)),
    ):
        made = pickle.loads(pickle.dumps(stage))(given)
        assert made["depth"] is given["depth"]
        assert np.array_equal(made["picture"][0], renderer.render(frame, ps.Light((1, -2, 0)), shading="flat"))


def test_pictures_of_several_sizes_are_a_column_of_arrays():
    small = frames.sphere().depth[:60]
    depths = np.empty(2, object)
    depths[:] = [frames.sphere().depth, small]
    made = ps.batch.Stage()({"depth": depths, "intrinsics": np.array([NUMBERS, NUMBERS])})
    assert [picture.shape for picture in made["picture"]] == [(120, 160, 4), (60, 160, 4)]
    assert ps.batch.Stage()({"path": np.array(["vase"])})["picture"].shape == (1, 480, 640, 4)


@pytest.mark.parametrize(
    ("columns", "message"),
    [
        ({"path": ["vase", "nowhere"]}, r"^row 1 of a batch: .*nowhere"),
        (batch(), r"^row 0 of a batch: it has no intrinsics: add a column \(fx, fy, cx, cy\), or pass camera"),
        ({"image": [1]}, r"^row 0 of a batch: it has image: expected path or depth$"),
        (batch(intrinsics=[[1, 2, 3]]), r"^row 0 of a batch: intrinsics must be four numbers .*, got 3 numbers: "),
        (batch(intrinsics=["wide"]), r"^row 0 of a batch: intrinsics must be four numbers \(fx, fy, cx, cy\)"),
        (batch(intrinsics=[NUMBERS], depth=[np.zeros(5)]), r"^row 0 of a batch: depth must have shape \(h, w\), got"),
    ],
)
def test_an_error_names_the_row(columns, message):
    with pytest.raises(ValueError, match=message):
        ps.batch.Stage()(columns)


def test_each_thread_draws_with_a_renderer_of_its_own_and_frees_it(renderer):
    stage, made = ps.batch.Stage(camera=C), []
    expected = renderer.render(frames.sphere())
    for _ in range(3):
        thread = threading.Thread(target=lambda: made.append(stage(batch())["picture"][0]))
        thread.start()
        thread.join()
    assert len(made) == 3 and all(np.array_equal(picture, expected) for picture in made)
