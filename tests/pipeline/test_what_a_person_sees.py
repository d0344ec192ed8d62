"""What a person would see: pictures beside truth that is not our own mirror.

`python -m tests.truth.contact_sheet sheet.png` shows them all. What fails is drawn to tests/failures, beside its truth.
"""

import json

import numpy as np
import pytest

import pointshade_gl as ps
from pointshade_gl.bench.tracing import as_frame, encode, patch, plane, trace

from ..benchmarks.traced_light import shade
from ..support.places import FAILURES
from ..truth import kept
from ..truth.cases import cases, grey
from ..truth.compare import inside_silhouette
from ..truth.contact_sheet import page_cell, sheet
from ..truth.files import MATTE, Truth, as_light
from ..truth.lamps import Lamp, lambert
from ..truth.measures import decibels, edges, occluder, overlap, seen_by_frame
from ..truth.shell import shaded_by_shell

CAMERA = ps.Camera(220, 220, 99.5, 74.5, 200, 150)
LAMPS = [
    Lamp("sun", 0.9, None, (0.48, 0.36, 0.8)),
    Lamp("point", 0.9, (-0.5, -0.4, 0.2), None, 1.8),
    Lamp("spot", 0.9, (-0.5, -0.4, 0.2), (0.36, 0.48, 0.8), 1.8, (15, 30)),
]


@pytest.fixture(scope="module")
def points():
    with ps.Renderer(rasterizer="points") as made:
        yield made


def complaint(cell):
    """'' if no more is wrong than may be, or than was known of a picture that falls short. Else the reason."""
    if not cell.got_worse:
        return ""
    FAILURES.mkdir(exist_ok=True)
    sheet([cell]).save(FAILURES / f"eyes {cell.name}.png")
    return f"{cell.name}: {cell.share:.3f} % is wrong, {cell.bound} may be; see {FAILURES}"


def is_slow(case):
    """400 lamps are traced for it, and 64 samples drawn."""
    return case.name.startswith("soft")


@pytest.mark.parametrize(
    "case",
    [pytest.param(case, marks=pytest.mark.system) if is_slow(case) else case for case in cases()],
    ids=lambda case: case.name,
)
def test_pictures_look_like_their_truth(renderer, points, case):
    assert complaint(case.draw(points if case.rasterizer == "points" else renderer)) == ""


@pytest.mark.system
@pytest.mark.browser
def test_a_page_looks_like_its_truth(browser, points):
    assert complaint(page_cell(browser, points)) == ""


class TestWhatIsWrong:
    """A grey board in a picture of 60x40, which is also its own truth."""

    @pytest.fixture
    def truth(self):
        fine = np.zeros((120, 180, 4), np.uint8)
        fine[30:90, 30:150] = (120, 120, 120, 255)
        return fine

    @pytest.fixture
    def picture(self, truth):
        return truth[1::3, 1::3].copy()

    def test_nothing_is_wrong_in_the_truth_nor_half_a_pixel_beside_it(self, picture, truth):
        assert not kept.wrong(picture, truth).any()
        assert not kept.wrong(np.ascontiguousarray(truth[::3, ::3]), truth).any()

    def test_a_pixel_of_another_place_a_dot_and_a_wrong_colour_are(self, picture, truth):
        assert 30 <= kept.wrong(np.roll(picture, 2, 1), truth).sum() <= 80
        picture[20, 30] = 0
        picture[20, 40, :3] += kept.WRONG + 1
        picture[20, 20, :3] += kept.WRONG - 1
        assert np.argwhere(kept.wrong(picture, truth)).tolist() == [[20, 30], [20, 40]]

    def test_nothing_is_asked_where_no_picture_saw(self, picture, truth):
        picture[15:20, 20:30] = 0
        truth[40:65, 55:95, 3] = kept.UNASKED
        assert not kept.wrong(picture, truth).any()

    def test_a_sheet_holds_each_picture(self, renderer):
        cells = [case.draw(renderer) for case in list(cases())[:4]]
        assert sheet(cells).size[1] == 2 * sheet(cells[:1]).size[1] and sheet(cells).size[0] == sheet(cells[:1]).size[0]


class TestYardstick:
    """The yardstick itself, against traced boards: a board before a wall."""

    THINGS = (patch((0.05, 0, 1.5), (0.2, 0, 0), (0, 0.15, 0), grey), plane((0.2, -0.1, -1), (0, 0, 2.2), grey))

    @pytest.fixture
    def truth(self, tmp_path):
        """What make_truth.py would write of it."""
        return as_truth(trace(self.THINGS, CAMERA), tmp_path)

    @pytest.mark.parametrize("lamp", LAMPS, ids=lambda lamp: lamp.name)
    def test_a_lamp_is_the_light_of_its_numbers(self, lamp):
        hits = trace(self.THINGS, CAMERA)
        formula = lambert(lamp, hits.points, hits.normals)[..., None] * hits.albedo
        traced = shade(hits, as_light(lamp), MATTE, (0, 0, 0))
        np.testing.assert_allclose(np.clip(formula, 0, 1), traced, atol=1e-6)

    @pytest.mark.parametrize("lamp", LAMPS, ids=lambda lamp: lamp.name)
    def test_the_frames_own_shadow_is_that_of_what_it_saw(self, truth, lamp):
        hits = trace(self.THINGS, CAMERA)
        shaded = occluder(hits, as_light(lamp), self.THINGS)[0][::2, ::2]
        own = shaded_by_shell(truth, lamp, hits.points[::2, ::2].reshape(-1, 3)).reshape(shaded.shape)
        assert shaded.sum() > 500 / 4 and overlap(own, shaded) > 0.96

    def test_a_frame_saw_its_own_pixels_and_nothing_behind_them(self, truth):
        view = truth.view(0)
        assert seen_by_frame(truth, view).all()
        behind = ps.orbit_pose(None, (0, 0, 1.8), 25)
        hits = trace(self.THINGS, CAMERA, behind)
        other = view.__class__(behind, hits.depth, hits.normals, hits.points, view.albedo, view.visible)
        hidden = occluder(hits, ps.Light(position=(0, 0, 0)), self.THINGS)[0]
        seen = seen_by_frame(truth, other)
        inside = (np.abs(hits.points[..., :2]) < hits.points[..., 2:] * (0.4, 0.3)).all(-1) & ~edges(other)
        assert hidden[inside].any() and (seen == ~hidden)[inside].mean() > 0.99

    def test_edges_and_silhouettes_and_decibels(self, truth):
        found = edges(truth.view(0))
        assert 0.005 < found.mean() < 0.05
        assert inside_silhouette(truth, CAMERA.resized(137, 103)).all()
        grey_picture = np.full((150, 200, 4), 100, np.uint8)
        level = ((100 / 255 + 0.055) / 1.055) ** 2.4
        everywhere = np.ones((150, 200), bool)
        assert decibels(grey_picture, np.full((150, 200, 3), level), everywhere) > 50
        assert decibels(grey_picture + np.uint8(3), np.full((150, 200, 3), level), everywhere) == pytest.approx(
            38.6, abs=0.1
        )


def as_truth(hits, folder):
    """A file as make_truth.py writes it, of one view."""
    frame = as_frame(hits, CAMERA)
    about = {
        "camera": [*CAMERA.intrinsics, CAMERA.width, CAMERA.height],
        "poses": {0: np.eye(4).tolist()},
        "lamps": [],
        "up": [0, -1, 0],
    }
    arrays = {
        "depth_0": hits.depth,
        "normals_0": hits.normals,
        "albedo_0": np.rint(encode(hits.albedo)).astype(np.uint8),
    }
    path = folder / "board.npz"
    np.savez(path, **arrays, visible_0=hits.depth > 0, about=np.array(json.dumps(about)))
    assert (frame.color == arrays["albedo_0"]).all()
    return Truth(path)
