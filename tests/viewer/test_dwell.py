"""Where the light was held on purpose: what the mouse did before it left, in time and place. No window."""

import pytest

from pointshade_gl.viewer.controller import MOMENT, Dwell

STEP = 0.01  # seconds between two moves


class Walk:
    """A mouse with the light right under it."""

    def __init__(self):
        self.dwell, self.time, self.at = Dwell(), 0.0, (0.0, 0.0)

    def go(self, x, y, seconds):
        (x0, y0), count = self.at, max(round(seconds / STEP), 1)
        for k in range(1, count + 1):
            self.time += seconds / count
            before, self.at = self.at, (x0 + (x - x0) * k / count, y0 + (y - y0) * k / count)
            self.dwell = self.dwell.moved(self.time, self.at, before, self.at)
        return self

    def rest(self, seconds=2 * MOMENT):
        self.time += seconds
        return self

    def left(self):
        return self.dwell.left(self.time, self.at)


def test_after_a_rest_the_way_out_does_not_count():
    assert Walk().go(0.5, 0.5, 0.3).rest().go(2, 0.5, 0.3).left() == pytest.approx((0.5, 0.5))


def test_neither_does_one_through_a_corner_nor_one_with_a_short_stop():
    walk = Walk().go(0.5, 0.5, 0.3).rest().go(1, 1, 0.2).rest(0.5 * MOMENT).go(2, 1, 0.2)
    assert walk.left() == pytest.approx((0.5, 0.5))


def test_a_light_that_rests_at_the_edge_stays_there():
    assert Walk().go(1.4, 0.2, 0.3).rest().left() == (1.4, 0.2)


def test_a_light_that_is_moved_slowly_is_held_on_purpose():
    x, _ = Walk().go(0.5, 0.5, 0.3).rest().go(1.0, 0.5, 6).left()
    assert x == pytest.approx(1.0, abs=0.1)


def test_a_trembling_hand_rests():
    walk = Walk().go(0.5, 0.5, 0.2)
    for k in range(30):
        walk.go(0.5 + 0.01 * (k % 2), 0.5, 0.02)
    assert walk.go(2, 0.5, 0.2).left() == pytest.approx((0.5, 0.5), abs=0.03)


def test_a_light_that_somebody_else_has_moved_since_stays_there():
    walk = Walk().go(0.5, 0.5, 0.3).rest().go(0.9, 0.5, 0.05)
    assert walk.dwell.left(walk.time, (0.1, 0.1)) == (0.1, 0.1)
