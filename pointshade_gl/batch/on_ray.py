"""Work on a Ray cluster: each worker is an actor with one GL context; one that is lost is replaced."""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Callable, Generator, Iterable, Iterator, Sized
from dataclasses import dataclass, field
from functools import partial
from typing import Any, NamedTuple

from ..files.whole import OURS
from ..gpu.cuda_devices import egl_device
from ..notes import print_note
from ..wording import option
from .cluster import LOCAL, connected

CPUS = 0.5  # of a worker: whoever reads frames for us on the same Ray needs some, too, or all would wait for each other
QUEUED = 2  # small tasks that a worker has at a time: the next one is there when one is done
TRIES = 2  # of a task whose worker dies: it may have been another program that used up the memory
SLOW = 20.0  # seconds without a worker, after which a note tells why
GRACE = 10.0  # seconds in which workers may end what they are at when nobody waits for it any more


class Task(NamedTuple):
    """A numbered piece of work, and how often a worker was lost with it."""

    number: int
    item: Any
    lost: int = 0


class _Worker:
    """What an actor does. Ray gives it a process of its own, and calls it from one thread."""

    def __init__(self, function: Callable[[Any, int], Any], device: int, threads: int):
        os.environ.setdefault("LP_NUM_THREADS", str(threads))  # of a software driver: others have other workers
        self._function, self._device = function, device_here(device)

    def ready(self) -> str:
        """How the names of its hidden files begin."""
        return OURS

    def work(self, item: Any) -> Any:
        return self._function(item, self._device)


@dataclass(eq=False)
class _Hand:
    """A worker as its employer sees it."""

    actor: Any
    ours: str = ""  # how the names of its hidden files begin
    tasks: list[Task] = field(default_factory=list)


def device_here(otherwise: int = 0) -> int:
    """The EGL device of the GPU that Ray has handed to this process; another where it has handed out none."""
    import ray

    gpus = ray.get_gpu_ids() if ray.is_initialized() else []
    return egl_device(gpus[0], os.environ.get("CUDA_VISIBLE_DEVICES", "")) if gpus else otherwise


def on_ray(
    function: Callable[[Any, int], Any],
    items: Iterable[Any],
    address: str,
    workers: int | None = None,
    num_gpus: float = 0.0,
    device: int = 0,
    ahead: int | None = None,
    lost: Callable[[Any, str], None] = lambda item, ours: None,
) -> Generator[tuple[int, Any], None, None]:
    """Calls function(item, device) for all items on a Ray cluster: (number of the item, result), as they are done.

    In place of a result comes the exception that the function raised; or RuntimeError, for a task whose worker was
    killed TRIES times, perhaps with its machine. Items are taken from their iterable when workers are free. When the
    iteration is left, the workers end, each after its task.

    function  picklable, as the items are; it must give the same for an item wherever and whenever it is called
    address   see `connected`
    workers   how many; None: one a processor of the cluster; with num_gpus as many as its GPUs have room for
    num_gpus  that Ray reserves for each worker, which gets the device of the first; 0.25 lets four share one
    device    without num_gpus
    ahead     for small items: a worker has the next one at hand, and none is taken that comes so many after the first
              one that is not done. None: workers take one when they are free.
    lost      called with an item and the beginning of the hidden files of the worker that was lost with it

    Raises ValueError or OSError as `connected` does, OSError where workers do not start.
    """
    most = len(items) if isinstance(items, Sized) else None
    if most == 0:
        return
    with connected(address, workers) as ray:
        cpus, gpus = (ray.cluster_resources().get(name, 0) for name in ("CPU", "GPU"))
        if gpus < num_gpus and address == LOCAL:
            raise ValueError(f"Ray finds {gpus:g} GPUs on this machine: leave out {option('num_gpus', num_gpus)}")
        count = workers or max(1, int(gpus / num_gpus if num_gpus else cpus))
        count = count if most is None else min(count, most)
        kind = ray.remote(_Worker).options(num_cpus=CPUS, num_gpus=num_gpus)
        crew = _Crew(ray, partial(kind.remote, function, device, max(1, int(cpus / count))), ahead, lost)
        try:
            crew.hire(count)
            yield from crew.results(items)
        finally:
            crew.dismiss()


class _Crew:
    """The workers and what they are at. Only who has answered gets work: for others there may never be room."""

    def __init__(self, ray: Any, start: Callable[[], Any], ahead: int | None, lost: Callable[[Any, str], None]):
        self._ray, self._start, self._ahead, self._lost = ray, start, ahead, lost
        self._hands: list[_Hand] = []  # those who have answered
        self._awaited: dict[Any, tuple[_Hand, Task | None]] = {}  # by Ray's reference; no task: whether it is ready
        self._again: deque[Task] = deque()
        self._taken = self._failed = 0

    def hire(self, count: int = 1) -> None:
        for _ in range(count):
            hand = _Hand(self._start())
            self._awaited[hand.actor.ready.remote()] = hand, None

    def results(self, items: Iterable[Any]) -> Iterator[tuple[int, Any]]:
        """See `on_ray`."""
        coming = iter(items)
        while True:
            while (hand := self._free()) and (task := self._next(coming)):
                hand.tasks.append(task)
                self._awaited[hand.actor.work.remote(task.item)] = hand, task
            if self._hands and not any(hand.tasks for hand in self._hands):
                return
            yield from self._wait()

    def _free(self) -> _Hand | None:
        """Who gets the next task: the least busy. A task that is tried again is alone, as it may kill its worker."""
        most = 1 if self._again or self._ahead is None else QUEUED
        free = [hand for hand in self._hands if len(hand.tasks) < most and not any(task.lost for task in hand.tasks)]
        return min(free, key=lambda hand: len(hand.tasks), default=None)

    def _next(self, coming: Iterator[Any]) -> Task | None:
        if self._again:
            return self._again.popleft()
        is_open = [task.number for hand in self._hands for task in hand.tasks]
        if self._ahead is not None and self._taken - min(is_open, default=self._taken) >= self._ahead:
            return None
        for item in coming:
            self._taken += 1
            return Task(self._taken - 1, item)
        return None

    def _wait(self) -> Iterator[tuple[int, Any]]:
        """Waits until something has happened, and gives the results of it."""
        done, _ = self._ray.wait(list(self._awaited), timeout=None if self._hands else SLOW)
        if not done:
            print_note(f"Ray has no room for a worker yet: free are {_told(self._ray.available_resources())}")
        for reference in done:
            hand, task = self._awaited.pop(reference)
            if task is None:
                self._welcome(hand, reference)
            elif (result := self._result(hand, task, reference)) is not None:
                yield task.number, result[0]

    def _welcome(self, hand: _Hand, reference: Any) -> None:
        """A worker has answered, or has failed to start. Raises OSError when that happens TRIES times in a row."""
        try:
            hand.ours = self._ray.get(reference)
        except self._ray.exceptions.RayError as error:
            self._failed += 1
            if self._failed == TRIES:
                raise OSError(f"no worker starts on Ray: {_last_line(error)}") from None
            self.hire()
        else:
            self._failed = 0
            self._hands.append(hand)

    def _result(self, hand: _Hand, task: Task, reference: Any) -> tuple[Any] | None:
        """What came of a task; None if it will be tried again."""
        hand.tasks.remove(task)
        try:
            return (self._ray.get(reference),)
        except self._ray.exceptions.RayTaskError as error:
            return (error.cause,)
        except self._ray.exceptions.RayError:
            self._replace(hand)
            self._lost(task.item, hand.ours)
        if task.lost + 1 == TRIES:
            return (RuntimeError(f"its worker process died {TRIES} times (is there enough memory?)"),)
        self._again.append(task._replace(lost=task.lost + 1))
        return None

    def _replace(self, hand: _Hand) -> None:
        if hand in self._hands:  # not yet for another of its tasks
            self._hands.remove(hand)
            self.hire()

    def dismiss(self) -> None:
        """Ends the workers. What they are at they may end, so that no file is left half-written."""
        busy = [reference for reference, (_, task) in self._awaited.items() if task is not None]
        try:
            if busy:
                self._ray.wait(busy, num_returns=len(busy), timeout=GRACE)
        finally:
            starting = [hand for hand, task in self._awaited.values() if task is None]
            for hand in [*self._hands, *starting]:
                self._ray.kill(hand.actor)
                for task in hand.tasks:
                    self._lost(task.item, hand.ours)


def _told(resources: dict[str, float]) -> str:
    return " and ".join(f"{resources.get(name, 0):g} {name}" for name in ("CPU", "GPU"))


def _last_line(error: Exception) -> str:
    return str(error).strip().splitlines()[-1].strip()
