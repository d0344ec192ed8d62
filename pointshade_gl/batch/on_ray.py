"""Work on a Ray cluster: each worker is an actor with one GL context; one that is lost is replaced."""

from __future__ import annotations

import os
import socket
from collections.abc import Callable, Generator, Iterable, Iterator, Sized
from dataclasses import dataclass, field
from functools import partial
from typing import Any

from ..files.access.atomic_write import OURS
from ..gpu.context.context import egl_device
from ..notes.notes import print_note
from ..notes.version import __version__
from ..notes.words import option
from .cluster import LOCAL, connected
from .processes import TRIES, Function, Lost, Task, Tasks, no_rest

CPUS = 0.5  # of a worker: whoever reads frames for us on the same Ray needs some, too, or all would wait for each other
QUEUED = 2  # small tasks that a worker has at a time: the next one is there when one is done
SLOW = 20.0  # seconds without a worker, after which a note tells why
GRACE = 10.0  # seconds in which workers may end what they are at when nobody waits for it any more


class _Worker:
    """What an actor does. Ray gives it a process of its own, and calls it from one thread."""

    def __init__(self, function: Function, device: int, threads: int):
        os.environ.setdefault("LP_NUM_THREADS", str(threads))  # of a software driver: others have other workers
        self._function, self._device = function, device_here(device)

    def ready(self) -> tuple[str, str, str]:
        """How the names of its hidden files begin, where it is, and its version of this package."""
        return OURS, socket.gethostname(), __version__

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
    function: Function,
    items: Iterable[Any],
    address: str,
    workers: int | None = None,
    num_gpus: float = 0.0,
    device: int = 0,
    ahead: int | None = None,
    lost: Lost = no_rest,
) -> Generator[tuple[int, Any], None, None]:
    """What `on_processes` does, on a Ray cluster. A worker may also be lost with its machine.

    When the iteration is left, the workers end after what they are at, or after GRACE seconds.

    address   see `connected`
    workers   how many; None: one a processor of the cluster; with num_gpus as many as its GPUs have room for
    num_gpus  that Ray reserves for each worker, which gets the device of the first; 0.25 lets four share one
    device    without num_gpus
    ahead     with it a worker has its next item at hand; None: for work that takes long

    Raises ValueError or OSError as `connected` does, OSError where workers do not start.
    """
    most = len(items) if isinstance(items, Sized) else None
    if most == 0:
        return
    with connected(address, workers) as ray:
        cpus, gpus = (ray.cluster_resources().get(name, 0) for name in ("CPU", "GPU"))
        if gpus < num_gpus and address == LOCAL:
            raise ValueError(f"Ray finds {gpus:g} GPUs on this machine: leave out {option('num_gpus')}")
        count = workers or max(1, int(gpus / num_gpus if num_gpus else cpus))
        count = count if most is None else min(count, most)
        kind = ray.remote(_Worker).options(num_cpus=CPUS, num_gpus=num_gpus)
        crew = _Crew(ray, partial(kind.remote, function, device, max(1, int(cpus / count))), lost)
        try:
            crew.hire(count)
            yield from crew.results(Tasks(items, ahead and ahead * count), QUEUED if ahead else 1)
        finally:
            crew.dismiss()


class _Crew:
    """The workers and what they are at. Only who has answered gets work: for others there may never be room."""

    def __init__(self, ray: Any, start: Callable[[], Any], lost: Lost):
        self._ray, self._start, self._lost, self._failed = ray, start, lost, 0
        self._hands: list[_Hand] = []  # those who have answered
        self._awaited: dict[Any, tuple[_Hand, Task | None]] = {}  # by Ray's reference; no task: whether it is ready

    def hire(self, count: int = 1) -> None:
        for _ in range(count):
            hand = _Hand(self._start())
            self._awaited[hand.actor.ready.remote()] = hand, None

    def results(self, tasks: Tasks, most: int) -> Iterator[tuple[int, Any]]:
        """See `on_processes`. most: tasks that a worker has at a time."""
        while True:
            while (hand := self._free(most)) and (task := tasks.next(not hand.tasks)):
                hand.tasks.append(task)
                self._awaited[hand.actor.work.remote(task.item)] = hand, task
            if self._hands and not any(hand.tasks for hand in self._hands):
                return
            for hand, task, reference in self._wait():
                yield from self._result(tasks, hand, task, reference)

    def _free(self, most: int) -> _Hand | None:
        """Who gets the next task: the least busy. A task that is tried again is alone, as it may kill its worker."""
        free = [hand for hand in self._hands if len(hand.tasks) < most and all(task.tries == 1 for task in hand.tasks)]
        return min(free, key=lambda hand: len(hand.tasks), default=None)

    def _wait(self) -> list[tuple[_Hand, Task, Any]]:
        """Waits until something has happened. Returns the tasks that have ended, and who worked on them."""
        done, _ = self._ray.wait(list(self._awaited), timeout=None if self._hands else SLOW)
        if not done:
            free = self._ray.available_resources()
            told = " and ".join(f"{free.get(name, 0):g} {name}" for name in ("CPU", "GPU"))
            print_note(f"Ray has no room for a worker yet: free are {told}")
        ended = []
        for reference in done:
            hand, task = self._awaited.pop(reference)
            if task is None:
                self._welcome(hand, reference)
            else:
                ended.append((hand, task, reference))
        return ended

    def _welcome(self, hand: _Hand, reference: Any) -> None:
        """A worker has answered, or has failed to start. Raises OSError when that happens TRIES times in a row."""
        try:
            hand.ours, host, version = self._ray.get(reference)
        except self._ray.exceptions.RayError as error:
            self._failed += 1
            if self._failed == TRIES:
                last = str(error).strip().splitlines()[-1].strip()
                raise OSError(f"no worker starts on Ray: {last}") from None
            self.hire()
        else:
            if version != __version__:
                raise OSError(f"{host} has pointshade_gl {version}, and here it is {__version__}: install the same")
            self._failed = 0
            self._hands.append(hand)

    def _result(self, tasks: Tasks, hand: _Hand, task: Task, reference: Any) -> list[tuple[int, Any]]:
        hand.tasks.remove(task)
        try:
            return [tasks.done(task, self._ray.get(reference))]
        except self._ray.exceptions.RayTaskError as error:
            raise error.cause from error
        except self._ray.exceptions.RayError:
            if hand in self._hands:  # not yet replaced for another of its tasks
                self._hands.remove(hand)
                self.hire()
            self._lost(task.item, hand.ours)
            return tasks.lost(task, "is there enough memory?")

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
