"""Live sets: several sources, each at its own rate, drawn as one object that pays only for what is new."""

import gc
import threading
import weakref
from contextlib import closing
from itertools import repeat

import numpy as np
import pytest
from PIL import Image

import pointshade_gl as ps
from pointshade_gl.estimation import multi_view as consensus

from ..support import frames
from ..support.view_sets import noisy, pose_at, replaced, seen_from
from .test_lifetime import alive


@pytest.fixture(autouse=True)
def no_thread_stays():
    before = set(threading.enumerate())
    yield
    assert set(threading.enumerate()) <= before


def few(count, depth=1.0):
    """Different small frames."""
    camera = ps.Camera(20, 20, 7.5, 5.5, 16, 12)
    return [ps.Frame(np.full((12, 16, 3), k % 256, np.uint8), np.full((12, 16), depth), camera) for k in range(count)]


class Paced:
    """A source that gives each frame when it is told to."""

    def __init__(self, given):
        self.given, self.go = given, threading.Semaphore(0)

    def __iter__(self):
        for frame in self.given:
            self.go.acquire()
            yield frame


class TestSets:
    def test_each_source_keeps_its_own_rate(self):
        fast, slow = Paced(few(6)), Paced(few(3, 2.0))
        seen = []
        fast.go.release()
        with closing(ps.live_set([fast, slow])) as sets:
            for frames_ in sets:
                seen.append(frames_)
                if len(seen) < 6:
                    fast.go.release()
                elif len(seen) == 6:
                    fast.go.release()  # its end
                    slow.go.release()
                elif len(seen) < 9:
                    slow.go.release()
        assert [one[0] for one in seen] == [*fast.given, *fast.given[-1:] * 3]
        assert [one[1:] for one in seen] == [()] * 6 + [(frame,) for frame in slow.given]

    def test_no_frame_of_any_source_is_lost_and_none_comes_back(self):
        sources = [few(30), few(7), few(1)]
        for k, given in enumerate(sources):
            seen = [one[k] for one in ps.live_set([*map(iter, sources)]) if len(one) == 3]
            assert list(dict.fromkeys(seen)) == given[-len(set(seen)) :] and seen[-1] is given[-1]

    def test_a_frame_stays(self):
        frame, others = few(1)[0], few(4)
        assert {frame, others[-1]} == set(list(ps.live_set([frame, iter(others)]))[-1])

    def test_a_source_that_fails_is_told_and_the_others_go_on(self):
        def failing():
            yield from few(2)
            raise OSError("the cable is out")

        class Torn(list):
            def __getitem__(self, k):
                if k == 1:
                    raise ValueError("frame 1: torn")
                return super().__getitem__(k)

        said = []
        *_, last = ps.live_set([failing(), Torn(few(3)), few(9)], said.append)
        assert sorted(said) == ["source 0: it ends: the cable is out", "source 1: frame 1: torn"]
        assert [frame.color[0, 0, 0] for frame in last] == [1, 2, 8]

    def test_sources_without_a_frame_end_at_once(self):
        assert list(ps.live_set([[], iter(())])) == []

    @pytest.mark.parametrize(
        ("sources", "kind", "message"),
        [
            ([], ValueError, "1 to 200 sources, got 0"),
            ([few(1)] * 201, ValueError, "1 to 200 sources, got 201"),
            ("vase", TypeError, "got 'vase'"),
            (few(1)[0], TypeError, "sources must be"),
            (repeat(few(1)[0]), TypeError, "sources must be"),  # a camera itself
            ([few(1), "vase"], TypeError, "source 1 is 'vase'"),
            ([few(1), 7], TypeError, "source 1 is 7"),
            ([few(1), iter("ab")], TypeError, "what source 1 gives must be a Frame, got 'a'"),
        ],
    )
    def test_anything_else_is_one_clear_sentence(self, sources, kind, message):
        with pytest.raises(kind, match=message):
            list(ps.live_set(sources))

    def test_leaving_early_ends_the_threads(self):
        def endless():
            while True:
                yield few(1)[0]

        with closing(ps.live_set([endless(), few(500)])) as sets:
            next(sets)


class TestDrawing:
    @pytest.fixture
    def folders(self, tmp_path):
        """Two folders of the same scene, each of a camera that stands still."""
        made = []
        for k, yaw in enumerate((-6, 6)):
            folder = tmp_path / f"camera_{k}"
            view = seen_from(pose_at(yaw))
            for name in ("color", "depth", "pose"):
                (folder / name).mkdir(parents=True)
            for n in range(8 - 4 * k):
                shown = noisy(view, 10 * k + n)
                Image.fromarray(view.color).save(folder / "color" / f"{n}.png")
                Image.fromarray(np.round(shown.depth * 1000).astype(np.uint16)).save(folder / "depth" / f"{n}.png")
                np.savetxt(folder / "pose" / f"{n}.txt", view.pose)
            camera = view.camera
            (folder / "intrinsics.txt").write_text(f"{camera.fx} 0 {camera.cx}\n0 {camera.fy} {camera.cy}\n0 0 1\n")
            made.append(folder)
        return made

    def test_two_prefetched_folders_of_which_one_is_twice_as_fast_pay_for_what_is_new(self, renderer, folders):
        """Beside a third camera, whose frame stays."""
        sources = [ps.open_source(folder, depth_scale=1000, notes=lambda _: None) for folder in folders]
        fast, slow = paced = [Paced(ps.prefetched(source, pytest.fail)) for source in sources]
        with ps.Renderer() as fresh, closing(ps.live_set([seen_from(pose_at(0)), *paced], pytest.fail)) as sets:
            shown = ()

            def draw_new(count):
                """What ran until so many new frames were drawn."""
                nonlocal shown
                before = fresh.steps.counts.copy()
                while count > 0:
                    count -= len(set(one := next(sets)) - set(shown))
                    shown = one
                    image = fresh.render(shown, camera=frames.CAMERA)
                assert count == 0 and image[..., 3].any()
                return fresh.steps.counts - before

            fast.go.release()
            slow.go.release()
            draw_new(3)
            for k in range(1, 8):
                fast.go.release()
                counts = draw_new(1)
                assert [counts[name] for name in ("upload", "surface", "agreement", "trust")] == [1, 1, 4, 3], k
                if k % 2 == 0:
                    slow.go.release()
                    assert draw_new(1)["upload"] == 1
            assert next(sets, None) is None
            assert fresh.steps.counts["upload"] == 1 + 8 + 4
        assert len(shown) == 3

    def test_a_set_drawn_again_after_another_with_the_same_frames_is_the_same(self, renderer):
        """The other one lets a third frame vote, and is kept by its own first frame."""
        a, b, c = (noisy(seen_from(pose_at(yaw)), yaw) for yaw in (0, 6, 12))
        options = {"camera": frames.CAMERA, "pose": pose_at(3), "shading": "none"}
        with ps.Renderer() as fresh:
            before = fresh.render([a, b], **options)
            fresh.render([b, a, c], **options)
            assert (fresh.render([a, b], **options) == before).all()

    @pytest.mark.system
    def test_a_long_live_set_leaves_nothing_behind(self, renderer, monkeypatch):
        """Of five frames, more than each is compared with, one after the other is replaced, and moved a little."""
        monkeypatch.setattr(consensus, "COMPARED", 2)
        rng = np.random.default_rng(0)

        def new():
            return replaced(few(1, rng.uniform(1, 1.01))[0], pose=pose_at(rng.uniform(-20, 20)))

        shown = [new() for _ in range(5)]
        seen, kept = weakref.WeakSet(shown), []
        with ps.Renderer() as fresh:
            for k in range(70):
                shown[k % 5] = new()
                seen.add(shown[k % 5])
                fresh.render(shown)
                if k in (20, 69):
                    gc.collect()
                    kept.append((len(seen), alive(fresh), len(fresh._pipeline.gpu_scene.frames._kept)))
            assert len(fresh.steps._done) < 50
        assert kept[0] == kept[1] and kept[0][0] == 5

    def test_frames_of_a_set_are_let_go_when_others_take_their_textures(self, renderer):
        views = [seen_from(pose_at(yaw)) for yaw in (0, 5, 10)]
        refs = list(map(weakref.ref, views))
        alone = ps.Scene(tuple(ps.Node(ps.PointObject(replaced(view))) for view in views))
        with ps.Renderer() as fresh:
            fresh.render(ps.Scene((ps.Node(ps.PointObject(views)),)))
            del views
            fresh.render(alone)
            gc.collect()
            assert [ref() for ref in refs] == [None] * 3
