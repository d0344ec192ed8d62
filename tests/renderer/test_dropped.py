"""Renderers that nobody holds any more, and memory that was freed."""

import gc
import threading
import warnings
import weakref

import moderngl
import numpy as np
import pytest

import pointshade_gl as ps
from pointshade_gl.gpu.context import software_driver as freed_memory

from .test_lifetime import STATM, megabytes, small

SUN = ps.Light(direction=(1, 1, 2), shadow=True)


def dropped(renderer=None, **options):
    """A Renderer has drawn, and nobody holds it any more: its Context, and weak references to it and to the frame."""
    renderer, frame = renderer or ps.Renderer(), small()
    renderer.render([frame, frame], SUN, samples=2, **options)
    return renderer.context, weakref.ref(renderer), weakref.ref(frame)


@pytest.fixture
def no_collector():
    gc.collect()
    gc.disable()
    yield
    gc.enable()


def test_it_is_freed_at_once_and_warned_of(renderer, no_collector):
    with pytest.warns(ResourceWarning, match=r"unclosed Renderer: .* call its release\(\)$") as warned:
        context, *refs = dropped()
    assert context.is_released and context.is_gone and [ref() for ref in refs] == [None, None]
    assert [warning.filename for warning in warned] == [__file__]


def test_it_is_freed_by_a_thread_that_did_not_make_it(renderer):
    made = []
    thread = threading.Thread(target=lambda: made.append(ps.Renderer()))
    thread.start()
    thread.join()
    context = made[0].context
    with pytest.warns(ResourceWarning, match="unclosed Renderer"):
        made.clear()
    assert context.is_gone


def test_it_is_freed_while_another_draws(renderer):
    expected = renderer.render(small(1), SUN)
    with renderer.context.in_use():
        with pytest.warns(ResourceWarning, match="unclosed Renderer"):
            dropped()
        assert (renderer.render(small(1), SUN) == expected).all()
        assert (renderer.render(small(2), SUN) != renderer.render(small(1), SUN)).any()
    assert (renderer.render(small(1), SUN) == expected).all()


def test_a_context_of_the_callers_stays_without_a_word(renderer):
    context = moderngl.create_context(standalone=True, backend="egl")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        ours, ref, _ = dropped(ps.Renderer(context))
    assert ref() is None and not ours.is_gone
    with ps.Renderer(context) as other:
        assert other.render(small()).any()
    context.release()


def test_one_that_was_released_holds_no_frame(renderer, no_collector):
    frame = small()
    with ps.Renderer() as made:
        made.render(frame, SUN, samples=2)
    ref = weakref.ref(frame)
    del frame
    assert ref() is None


def test_one_that_cannot_be_made_leaves_no_context(renderer, monkeypatch):
    def fail(*_):
        raise MemoryError("half way")

    monkeypatch.setattr("pointshade_gl.renderer.renderer.Pipeline", fail)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with pytest.raises(MemoryError, match="half way") as error:
            ps.Renderer()
        made = next(entry.locals["self"] for entry in error.traceback if "_start" in str(entry))
        assert made.context.is_gone


@pytest.mark.parametrize(("said", "calls"), [(None, ["mallopt", "mallopt", "malloc_trim"]), ("default", [])])
def test_malloc_is_left_alone_where_the_user_says_so(monkeypatch, said, calls):
    called = []
    monkeypatch.setattr(freed_memory, "_of_glibc", lambda name: lambda *_: called.append(name))
    monkeypatch.delenv("POINTSHADE_MALLOC", raising=False)
    if said:
        monkeypatch.setenv("POINTSHADE_MALLOC", said)
    freed_memory.keep_freed_memory()
    freed_memory.return_freed_memory()
    assert called == calls


@pytest.mark.system
@pytest.mark.skipif(not STATM.exists(), reason="memory is counted by /proc")
@pytest.mark.filterwarnings("ignore:unclosed Renderer")
class TestMemory:
    """Of the process, in megabytes, as each of several Renderers has come and gone."""

    def test_that_of_dropped_renderers_goes_back(self, renderer):
        frame, held = ps.load_frame("vase"), []
        for _ in range(12):
            ps.Renderer().render(frame)
            held.append(megabytes())
        assert held[-1] - held[3] < 20  # each takes 25 and more

    def test_that_of_released_renderers_goes_back(self, renderer):
        frame, while_open, afterwards = ps.load_frame("vase"), [], []
        for _ in range(4):
            with ps.Renderer() as made:
                made.render(frame, SUN, samples=2)
                while_open.append(megabytes())
            afterwards.append(megabytes())
        assert np.median(while_open) - np.median(afterwards) > 10
