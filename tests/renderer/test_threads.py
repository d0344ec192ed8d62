"""Two Renderers in two threads at once: each draws as if it were alone, whatever befalls the other."""

import threading

import numpy as np
import pytest

import pointshade_gl as ps

from .test_lifetime import small

TURNS = 12
LIGHTS = ps.Light(), ps.Light(direction=(1, 1, 2), shadow=True)


def pictures(renderer, seed, between=lambda: None):
    """Of frames, looks and views that depend on the seed."""
    drawn = []
    for turn in range(TURNS):
        frame, shading = small(100 * seed + turn, 16 + turn, 12), ("phong", "flat", "gouraud", "none")[turn % 4]
        between()
        drawn.append(renderer.render(frame, LIGHTS[turn % 2], yaw=3.0 * turn, shading=shading))
    return drawn


def at_once(*works):
    """What each gives, all started together in threads of their own; an exception is its result."""
    results, start = [None] * len(works), threading.Barrier(len(works))

    def run(k):
        try:
            with ps.Renderer() as renderer:
                start.wait(timeout=60)
                results[k] = works[k](renderer)
        except Exception as error:
            results[k] = error

    threads = [threading.Thread(target=run, args=(k,)) for k in range(len(works))]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    return results


@pytest.fixture
def expected(renderer):
    with ps.Renderer() as alone:
        return [pictures(alone, seed) for seed in range(2)]


def same(drawn, expected):
    return all(np.array_equal(one, other) for one, other in zip(drawn, expected, strict=True))


def test_two_threads_draw_what_one_draws(expected):
    turn = threading.Barrier(2, timeout=60)  # picture by picture, so that they do meet
    first, second = at_once(lambda r: pictures(r, 0, turn.wait), lambda r: pictures(r, 1, turn.wait))
    assert same(first, expected[0]) and same(second, expected[1])


def test_errors_in_one_thread_are_nothing_to_the_other(expected):
    def failing(renderer):
        for _ in range(TURNS):
            with pytest.raises(ValueError, match="larger than this GPU's textures"):
                renderer.render(small(), camera=ps.Camera(9, 9, 9, 9, 10**6, 4))
            with pytest.raises(ValueError, match="unknown shading"):
                renderer.render(small(), shading="toon")
        raise KeyError("the thread ends by it")

    drawn, error = at_once(lambda r: pictures(r, 0), failing)
    assert same(drawn, expected[0]) and isinstance(error, KeyError)


def test_a_renderer_is_refused_by_a_thread_that_draws_with_its_own(renderer):
    (error,) = at_once(lambda own: (own.render(small()), renderer.render(small())))
    assert isinstance(error, ps.ContextError) and "belongs to the thread that made it" in str(error)
    assert renderer.render(small()).any()
