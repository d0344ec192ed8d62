"""A soak of a server: threads and coroutines ask for pictures, cancel and fail, come and go.

POINTSHADE_SOAK_MINUTES says how long. `pytest -s` shows the figures.
"""

import asyncio
import os
import threading
import time
from collections import Counter
from concurrent.futures import CancelledError
from itertools import count

import numpy as np
import pytest

import pointshade_gl as ps

from ..renderer.test_lifetime import STATM, megabytes, small

pytestmark = [pytest.mark.system, pytest.mark.alone]

MINUTES = float(os.environ.get("POINTSHADE_SOAK_MINUTES", 1 / 3))
CLIENTS = 20
REQUESTS = 12  # of a client, before another takes its place
TOO_LARGE = ps.Camera(9, 9, 9, 9, 10**6, 4)
SUN = ps.Light(direction=(1, 1, 2), shadow=True)


class Server:
    """A pool, its clients, and what they saw."""

    def __init__(self, pool):
        self.pool, self.until = pool, time.monotonic() + 60 * MINUTES
        self.frames = [small(seed, 64 + 8 * seed, 48) for seed in range(4)]
        options = {}, {"light": SUN}, {"shading": "flat"}, {"samples": 2}
        self.calls = [(frame, {"yaw": 5 * k, **some}) for frame in self.frames for k, some in enumerate(options)]
        with ps.Renderer() as renderer:
            self.expected = [renderer.render(frame, **some) for frame, some in self.calls]
        self.seen, self.faults, self.first = Counter(), [], []
        self.numbers = count()

    def clients(self):
        """One client after the other, until the time is over."""
        while time.monotonic() < self.until:
            number = next(self.numbers)
            kind = (self.by_pool, self.by_pool, self.by_own_renderer, self.by_coroutines)[number % 4]
            thread = threading.Thread(target=self.guarded, args=(kind, np.random.default_rng(number)))
            thread.start()
            thread.join()

    def guarded(self, kind, random):
        try:
            kind(random)
        except BaseException as error:
            self.faults.append(repr(error))
            raise

    def check(self, k, picture):
        self.seen["pictures"] += 1
        if not np.array_equal(picture, self.expected[k]):
            self.faults.append(f"call {k} has another picture")

    def by_pool(self, random):
        for k in random.integers(len(self.calls), size=REQUESTS):
            frame, options = self.calls[k]
            asked = self.pool.submit(frame, **options)
            match random.integers(6):
                case 0:
                    self.seen["cancelled"] += asked.cancel()
                case 1:
                    self.fail(self.pool.render, frame)
            try:
                self.check(k, asked.result())
            except CancelledError:
                assert asked.cancelled()

    def by_own_renderer(self, random):
        began, worked = time.monotonic(), time.thread_time()
        self.check(0, ps.render(self.frames[0]))
        self.first.append((time.monotonic() - began, time.thread_time() - worked))
        for k in random.integers(len(self.calls), size=REQUESTS):
            frame, options = self.calls[k]
            self.check(k, ps.render(frame, **options))
            match random.integers(6):
                case 0:
                    ps.release()
                case 1:
                    self.fail(ps.render, frame)

    def by_coroutines(self, random):
        async def ask(k):
            frame, options = self.calls[k]
            self.check(k, await self.pool.render_async(frame, **options))

        async def ask_all():
            tasks = [asyncio.ensure_future(ask(k)) for k in random.integers(len(self.calls), size=REQUESTS)]
            await asyncio.sleep(0)
            for task in tasks[::5]:
                task.cancel()
            for result in await asyncio.gather(*tasks, return_exceptions=True):
                assert result is None or isinstance(result, asyncio.CancelledError), result
                self.seen["cancelled"] += result is not None

        asyncio.run(ask_all())

    def fail(self, ask, frame):
        with pytest.raises(ValueError, match="larger than this GPU's textures"):
            ask(frame, camera=TOO_LARGE)
        self.seen["errors"] += 1


@pytest.mark.skipif(not STATM.exists(), reason="memory is counted by /proc")
@pytest.mark.timeout(600 + 120 * MINUTES)
def test_a_server_serves_all_and_its_memory_stays(renderer):
    before, held = threading.active_count(), []
    with ps.RendererPool(4) as pool:
        server = Server(pool)
        clients = [threading.Thread(target=server.clients) for _ in range(CLIENTS)]
        for client in clients:
            client.start()
        while any(client.is_alive() for client in clients):
            held.append(megabytes())
            clients[0].join(0.5)
    third = len(held) // 3
    early, late = np.median(held[third:-third]), np.median(held[-third:])
    seconds, worked = np.array(server.first).T
    print(
        f"\n{dict(server.seen)} by {next(server.numbers)} clients in {MINUTES:.2g} minutes; memory {held[0]:.0f} MB at "
        f"first, {early:.0f}, then {late:.0f}, {max(held):.0f} at most; first picture of a thread after "
        f"{np.median(seconds):.2f} s, {seconds.max():.2f} at most, its own work {worked.max():.2f} at most"
    )
    assert not server.faults and threading.active_count() == before
    assert min(server.seen[what] for what in ("pictures", "cancelled", "errors")) > 0
    assert late - early < 30  # a Renderer holds 10, and hundreds come and go
    assert worked.max() < 1
