"""A pool of Renderers: right pictures for many threads and coroutines, whatever befalls the others; and its end."""

import asyncio
import inspect
import threading
from concurrent.futures import CancelledError, ThreadPoolExecutor

import numpy as np
import pytest

import pointshade_gl as ps
from pointshade_gl.renderer import functions as thread_renderer
from pointshade_gl.renderer.functions import RendererPool  # before a test replaces `render`

from .test_lifetime import small

YAWS = range(12)


@pytest.fixture
def pool(renderer):
    with RendererPool(2) as made:
        yield made


@pytest.fixture
def expected(renderer):
    return [renderer.render(small(), yaw=yaw) for yaw in YAWS]


class Gate:
    """Holds the threads of a pool at work until it is opened."""

    def __init__(self, pool, count):
        self._open, there = threading.Event(), threading.Barrier(count + 1)
        self.held = [pool._threads.submit(lambda: (there.wait(60), self._open.wait(60))) for _ in range(count)]
        there.wait(60)

    def open(self):
        self._open.set()


def test_many_threads_get_their_own_pictures(pool, expected):
    with ThreadPoolExecutor(8) as clients:
        drawn = list(clients.map(lambda yaw: pool.render(small(), yaw=yaw), YAWS))
    assert np.array_equal(drawn, expected)


def test_coroutines_get_their_own_pictures(pool, expected):
    async def ask():
        return await asyncio.gather(*(pool.render_async(small(), yaw=yaw) for yaw in YAWS))

    assert np.array_equal(asyncio.run(ask()), expected)


def test_it_takes_the_options_of_a_renderer(pool):
    wanted = [parameter.name for parameter in inspect.signature(ps.Renderer.render).parameters.values()]
    for method in (pool.render, pool.render_async, pool.submit):
        assert ["self", *inspect.signature(method).parameters] == wanted
    with pytest.raises(TypeError, match=r"'shadng' \(did you mean shading\?\)"):
        pool.render(small(), shadng="flat")


def test_a_request_that_fails_leaves_the_pool_usable(pool, expected):
    failing = [pool.submit(small(), camera=ps.Camera(9, 9, 9, 9, 10**6, 4)) for _ in range(4)]
    drawn = [pool.submit(small(), yaw=yaw) for yaw in YAWS]
    assert all("larger than this GPU's textures" in str(one.exception()) for one in failing)
    assert np.array_equal([one.result() for one in drawn], expected)


def test_what_is_cancelled_is_not_drawn_and_the_rest_is(pool, expected):
    gate = Gate(pool, 2)
    waiting = [pool.submit(small(), yaw=yaw) for yaw in YAWS]
    assert all(one.cancel() for one in waiting[::2])
    gate.open()
    assert np.array_equal([one.result() for one in waiting[1::2]], expected[1::2])
    with pytest.raises(CancelledError):
        waiting[0].result()


def test_a_coroutine_that_is_cancelled_takes_its_request_along(pool, expected):
    async def ask():
        gate = Gate(pool, 2)
        waiting = [asyncio.ensure_future(pool.render_async(small(), yaw=yaw)) for yaw in YAWS]
        await asyncio.sleep(0)
        waiting[0].cancel()
        with pytest.raises(asyncio.CancelledError):
            await waiting[0]
        assert pool._threads._work_queue.qsize() == len(YAWS)
        gate.open()
        return await asyncio.gather(*waiting[1:])

    assert np.array_equal(asyncio.run(ask()), expected[1:])


def test_release_draws_what_was_asked_for_ends_all_threads_and_frees_their_renderers(renderer):
    made = []

    def render(self, frame):
        made.append(self)
        return drawing(self, frame)

    drawing = ps.Renderer.render
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(ps.Renderer, "render", render)
        with RendererPool(3) as pool:
            asked = [pool.submit(small()) for _ in YAWS]
            threads = list(pool._threads._threads)
    assert len(threads) == 3 and not any(thread.is_alive() for thread in threads)
    assert all(one.done() and one.result().any() for one in asked)
    assert made and all(one.context.is_released for one in made)
    pool.release()
    for ask in (pool.render, pool.submit):
        with pytest.raises(ps.ContextError, match=r"^this RendererPool was released: make a new one$"):
            ask(small())


def test_one_that_cannot_be_made_says_why_and_leaves_no_thread(renderer):
    before = threading.active_count()
    with pytest.raises(ps.ContextError, match=r"no OpenGL 3\.3 context on device 99: try device=0"):
        RendererPool(3, device=99)
    assert threading.active_count() == before


@pytest.mark.parametrize("options", [{"size": 0}, {"size": "2"}, {"device": -1}, {"rasterizer": "pionts"}])
def test_wrong_arguments_are_refused_at_once(options):
    with pytest.raises((TypeError, ValueError), match=f"{next(iter(options))}"):
        RendererPool(**options)


class TestOfThisThread:
    """The Renderer that `ps.render` keeps for a thread."""

    @pytest.fixture(autouse=True)
    def alone(self, renderer):
        ps.release()
        yield
        ps.use_device(0)
        ps.release()

    def test_release_frees_it_and_the_next_picture_makes_a_new_one(self):
        expected = ps.render(small())
        before = thread_renderer.renderer_here()
        ps.release()
        ps.release()
        assert before.context.is_released
        assert (ps.render(small()) == expected).all() and thread_renderer.renderer_here() is not before

    def test_the_device_is_that_of_the_thread(self, monkeypatch):
        made = []

        def make(context, device, rasterizer):
            made.append(device)
            return renderer(context, 0, rasterizer)

        renderer = thread_renderer.Renderer
        monkeypatch.setattr(thread_renderer, "Renderer", make)
        ps.render(small())
        ps.use_device(1)
        ps.render(small())
        ps.render(small())
        other = threading.Thread(target=ps.render, args=(small(),))
        other.start()
        other.join()
        assert made == [0, 1, 0]

    def test_a_device_that_is_not_there_is_an_error_of_the_next_picture(self):
        ps.use_device(99)
        with pytest.raises(ps.ContextError, match="on device 99"):
            ps.render(small())

    def test_a_device_must_be_a_number(self):
        with pytest.raises(TypeError, match="device must be a whole number"):
            ps.use_device("gpu")
