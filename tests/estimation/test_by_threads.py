"""NumPy by threads: what comes out is what one thread would give."""

import numpy as np
import pytest

from pointshade_gl.estimation import by_threads as threads
from pointshade_gl.estimation.by_threads import by_threads, parts_of, sorted_by_threads


@pytest.mark.parametrize("can_start", [True, False])
def test_results_are_in_order_whether_threads_can_be_started_or_not(monkeypatch, can_start):
    def no_thread(*_):
        raise RuntimeError("can't start new thread")

    if not can_start:
        monkeypatch.setattr("threading.Thread.start", no_thread)
    monkeypatch.setattr("os.cpu_count", lambda: 4)
    assert by_threads(lambda k: k * k, range(20)) == [k * k for k in range(20)]
    assert by_threads(str, []) == []


def test_parts_hold_each_row_once():
    count = 3 * threads.ROWS + 5
    rows = np.concatenate([np.arange(count)[part] for part in parts_of(count)])
    assert (rows == np.arange(count)).all() and parts_of(0) == []


@pytest.mark.parametrize("kind", ["random", "sorted", "same", "few"])
@pytest.mark.parametrize("cores", [1, 16])
def test_values_are_sorted_on_any_number_of_cores(monkeypatch, kind, cores):
    monkeypatch.setattr("os.cpu_count", lambda: cores)
    monkeypatch.setattr(threads, "ROWS", 100)
    count = 801 if kind == "few" else 20_001
    values = np.random.default_rng(0).integers(0, 1 << 60, count)
    values = {"sorted": np.sort(values), "same": np.full(count, 7)}.get(kind, values)
    expected = np.sort(values)
    assert (sorted_by_threads(values) == expected).all()


def test_rows_are_those_of_numpy(monkeypatch):
    monkeypatch.setattr(threads, "ROWS", 10)
    rng = np.random.default_rng(0)
    values, places = rng.random((50, 3)), rng.integers(0, 50, 101)
    assert (threads.taken_by_threads(values, places) == values[places]).all()
    assert threads.taken_by_threads(values, places[:0]).shape == (0, 3)
