"""Worker processes of this machine, and what becomes of the jobs of a batch in them."""

from __future__ import annotations

import errno
import os
import signal
from collections import deque
from collections.abc import Callable, Generator, Iterable, Iterator, Sequence, Sized
from concurrent.futures import ThreadPoolExecutor
from contextlib import AbstractContextManager, closing, contextmanager, nullcontext, suppress
from contextvars import copy_context
from functools import partial
from multiprocessing import get_context, resource_tracker
from multiprocessing.connection import Connection, wait
from queue import SimpleQueue
from threading import Thread
from typing import Any, NamedTuple, TypeVar

from ..files.access.atomic_write import OURS, remove_hidden
from ..notes.errors import ContextError, error_text
from ..notes.words import as_command_line
from .jobs import Done, Job, LeftOut, Parts, run
from .manifest import no_room

TRIES = 2  # of a task whose worker dies: something else may have used up the memory
_ENDS_WITHIN = 5.0  # seconds that an idle worker has to end by itself
_GONE = (EOFError, OSError)  # what a pipe raises when its other end is closed

AT_ONCE = 3  # tasks of a worker whose parts take turns: one is read, one is drawn, one is written
Function = Callable[[Any, int], Any]
FunctionInParts = Callable[[Any, int], Parts[Any]]


class Task(NamedTuple):
    """A numbered piece of work."""

    number: int
    item: Any
    tries: int = 1


class Tasks:
    """The items of an iterable as tasks, those first whose worker has died."""

    def __init__(self, items: Iterable[Any], ahead: int | None):
        # no item is taken that comes so many after the first one that is not done; None: no limit
        self._coming, self._ahead, self._taken = iter(items), ahead, 0
        self._count = len(items) if isinstance(items, Sized) else None
        self._again: deque[Task] = deque()
        self._open: set[int] = set()  # what is taken, and not done

    def next(self, is_idle: bool = True) -> Task | None:
        """None if there is none for now; and none at all if nothing is being done. is_idle: its worker has no other:
        what is tried again may kill whom it is given to."""
        if self._again and is_idle:
            return self._again.popleft()
        if self._ahead is not None and self._taken - min(self._open, default=self._taken) >= self._ahead:
            return None
        for item in self._coming:
            self._open.add(self._taken)
            self._taken += 1
            return Task(self._taken - 1, item)
        return None

    def share(self, workers: int, most: int) -> int:
        """Return how many tasks a worker may have at a time, up to `most`, so that others have some, too."""
        return most if self._count is None else min(most, 1 + (self._count - self._taken) // max(workers, 1))

    def done(self, task: Task, result: Any) -> tuple[int, Any]:
        self._open.remove(task.number)
        return task.number, result

    def lost(self, task: Task, cause: str) -> list[tuple[int, Any]]:
        """What a task comes to whose worker has died: nothing yet, or RuntimeError if it was tried TRIES times."""
        if task.tries < TRIES:
            self._again.append(task._replace(tries=task.tries + 1))
            return []
        return [self.done(task, RuntimeError(f"its worker process died {TRIES} times: {cause}"))]


class Worker:
    """A worker as its employer sees it.

    tasks   what it has been given; it works on the first
    hidden  how the names of its hidden files begin; "" until it has begun

    `receive` returns True and a message: first `hidden`, then the result of each task; or False and the cause if it is
    dead. Before that, something must have come, see `results_of`.
    """

    never_begins = "worker processes die before they begin"

    def __init__(self) -> None:
        self.tasks: list[Task] = []
        self.hidden = ""

    def give(self, task: Task) -> None:
        self.tasks.append(task)

    def receive(self) -> tuple[bool, Any]:
        raise NotImplementedError

    def remove_rest(self) -> None:
        """Removes what it has left of the files of its jobs, once it is dead."""
        for task in self.tasks:
            if isinstance(task.item, Job):
                remove_hidden(task.item.path.parent, self.hidden)


_AnyWorker = TypeVar("_AnyWorker", bound=Worker)


def results_of(
    tasks: Tasks, pool: list[_AnyWorker], start: Callable[[], _AnyWorker],
    wait_for: Callable[[list[_AnyWorker]], list[_AnyWorker]], most: int = 1,
) -> Iterator[tuple[int, Any]]:  # fmt: skip
    """Shares tasks among the workers of a pool, and gives (number, result) as they come. Who dies is replaced.

    Only who has begun gets tasks: for others there may never be room.

    wait_for  waits until something has come from some of the pool, and returns these
    most      tasks that a worker has at a time

    Raises OSError if workers keep dying before they begin.
    """
    results: list[tuple[int, Any]] = []
    stillborn = 0
    while True:
        while (worker := _least_busy(pool, tasks.share(len(pool), most))) and (task := tasks.next(not worker.tasks)):
            worker.give(task)
        yield from results  # while the next ones are being made
        if not any(worker.tasks for worker in pool) and (not pool or any(worker.hidden for worker in pool)):
            return
        results = []
        for worker in wait_for(pool):
            is_alive, message = worker.receive()
            if is_alive and worker.hidden:
                results.append(tasks.done(worker.tasks.pop(0), message))
            elif is_alive:
                worker.hidden, stillborn = message, 0
            else:
                stillborn += not worker.hidden
                if stillborn > TRIES:
                    raise OSError(f"{worker.never_begins}: {message}")
                pool[pool.index(worker)] = start()
                results += [result for task in worker.tasks for result in tasks.lost(task, message)]


def _least_busy(pool: list[_AnyWorker], most: int) -> _AnyWorker | None:
    """Who gets the next task. A task that is tried again is alone, as it may kill its worker."""
    free = (worker for worker in pool if worker.hidden and len(worker.tasks) < most)
    alone = (worker for worker in free if all(task.tries == 1 for task in worker.tasks))
    return min(alone, key=lambda worker: len(worker.tasks), default=None)


def on_processes(
    function: FunctionInParts, items: Iterable[Any], workers: int | None = None, device: int = 0,
    ahead: int | None = None, at_once: int = AT_ONCE, inside: Callable[[], AbstractContextManager[Any]] = nullcontext,
) -> Generator[tuple[int, Any], None, None]:  # fmt: skip
    """Calls function(item, device) for all items in processes: (number of the item, result), as they are done.

    Its parts are done by three threads: meanwhile the next item is in its first part, and the last one in its third.

    In place of a result comes RuntimeError for an item whose worker died TRIES times. Items are taken from their
    iterable when workers are free. After an exception, and where the consumer leaves early, the processes are ended at
    once.

    function  can be sent to a process, as the items can; it must give the same wherever and whenever it is called, and
              return what goes wrong instead of raising it. OpenGL is called in its second part only
    workers   how many; None: one for each core
    ahead     for each worker: no item is taken that comes so many after the first one that is not done; None: no limit
    at_once   how many items a worker has
    inside    the context that workers are in

    Raises OSError if workers die before they begin.
    """
    most = workers or usable_cores()
    count = min(most, len(items)) if isinstance(items, Sized) else most
    start = partial(_ProcessWorker, function, device, max(1, usable_cores() // max(1, count)), inside)
    pool: list[_ProcessWorker] = []
    try:
        pool += (start() for _ in range(count))
        yield from results_of(Tasks(items, ahead and ahead * count), pool, start, _wait_for, at_once)
    finally:
        with _interrupts_held():
            for worker in pool:
                worker.dismiss()
            for worker in pool:
                worker.end()


def usable_cores() -> int:
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


class _ProcessWorker(Worker):
    """A process, and the end of the pipe that leads to it."""

    def __init__(self, *arguments: Any):
        """The arguments are those of `_serve` after its pipe."""
        super().__init__()
        context = get_context("spawn")
        self.pipe, theirs = context.Pipe()
        arguments = theirs, *arguments
        self.process = context.Process(target=_serve, args=arguments, name="pointshade-worker", daemon=True)
        with _interrupts_held():
            self.process.start()
        theirs.close()

    def give(self, task: Task) -> None:
        super().give(task)
        with suppress(OSError):  # it is dead, which receive() finds
            self.pipe.send(task.item)

    def receive(self) -> tuple[bool, Any]:
        try:
            return True, self.pipe.recv()
        except _GONE:
            return False, self.end()

    def dismiss(self) -> None:
        """It ends by itself if it has no task; else now."""
        self.pipe.close()
        if self.tasks or not self.hidden:
            self.process.kill()

    def end(self) -> str:
        """Waits for its end, and removes what it has left. Returns the cause."""
        self.process.join(_ENDS_WITHIN if not self.tasks else 0.1)
        self.process.kill()
        self.process.join()
        self.remove_rest()
        code = self.process.exitcode or 0
        return f"signal {-code} (is there enough memory?)" if code < 0 else f"exit code {code}"


def _wait_for(pool: list[_ProcessWorker]) -> list[_ProcessWorker]:
    ready = wait([worker.pipe for worker in pool])
    return [worker for worker in pool if worker.pipe in ready]


def _serve(
    pipe: Connection, function: FunctionInParts, device: int, threads: int,
    inside: Callable[[], AbstractContextManager[Any]],
) -> None:  # fmt: skip
    """What a worker does: a task after the other, until the parent closes the pipe, or is no more. threads: of a
    software driver, which other workers need, too; unless the user has set how many."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # on Windows, where none can be held
    os.environ.setdefault("LP_NUM_THREADS", str(threads))
    coming: SimpleQueue[_Work | None] = SimpleQueue()

    def receive() -> None:
        """Takes tasks at once, for who gives large ones waits so long, and does their first parts."""
        try:
            with suppress(*_GONE):
                while True:
                    work = _Work(function(pipe.recv(), device))
                    work.go_on()
                    coming.put(work)
        finally:
            coming.put(None)

    with suppress(*_GONE), inside(), ThreadPoolExecutor(1) as writing:
        pipe.send(OURS)
        Thread(target=receive, daemon=True).start()
        while (work := coming.get()) is not None:
            work.go_on()
            writing.submit(_deliver, work, pipe)


class _Work:
    """What a function does in parts, each of which may be done by another thread."""

    result: Any = None

    def __init__(self, parts: Parts[Any]):
        self._parts, self._context = parts, copy_context()

    def go_on(self) -> None:
        try:
            self._context.run(next, self._parts)
        except StopIteration as end:
            self.result = self.result if end.value is None else end.value


def _deliver(work: _Work, pipe: Connection) -> None:
    """Sends the result of the last part. A process whose results cannot be sent ends: others get its tasks."""
    try:
        work.go_on()
        pipe.send(work.result)
    except BaseException:
        os._exit(1)


def whole(parts: Parts[Any]) -> Any:
    """What a function in parts returns, all done by this thread."""
    while True:
        try:
            next(parts)
        except StopIteration as end:
            return end.value


@contextmanager
def _interrupts_held() -> Iterator[None]:
    """Inside, Ctrl+C waits. Processes that start inside never get one: they inherit that, unlike a handler."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    resource_tracker.ensure_running()  # which would begin with the first process, and let interrupts through
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


_FULL = (errno.ENOSPC, errno.EDQUOT)
_ENDS = {"no GL": ContextError, "no room": OSError}  # what is raised where no other job can be done either


class Failed(NamedTuple):
    """Why there is no output."""

    sentence: str
    # "failed"; "left out" by its sequence; "no GL", or "no room" on the disk: then no job can be done
    kind: str = "failed"


def run_all(
    jobs: Sequence[Job], workers: int | None = None, device: int = 0
) -> Generator[tuple[Job, Done | Failed], None, None]:
    """Runs the jobs in so many processes, and gives each with what became of it, as soon as it is known.

    After an exception, and where the consumer leaves early, the processes are ended at once: what is whole stays, and
    nothing half-written is left.

    Raises ContextError if workers have no OpenGL, OSError if they die before they begin or the disk is full.
    """
    sources = {job.source: job for job in jobs}
    at_once = AT_ONCE if all(job.reads_ahead for job in sources.values()) else 1
    results = on_processes(_outcome_in_parts, jobs, workers, device, at_once=at_once, inside=as_command_line)
    with closing(results):
        for number, result in results:
            yield jobs[number], checked(result)


def checked(result: Done | Failed | Exception) -> Done | Failed:
    """What became of a job that worked, failed or killed its workers. Raises ContextError or OSError as `run_all`."""
    outcome = Failed(str(result)) if isinstance(result, Exception) else result
    if isinstance(outcome, Failed) and outcome.kind in _ENDS:
        raise _ENDS[outcome.kind](outcome.sentence)
    return outcome


def outcome_of(job: Job, device: int = 0) -> Done | Failed:
    """Runs a job; whatever it raises becomes a sentence, so that the next job can be done."""
    with as_command_line():
        return whole(_outcome_in_parts(job, device))


def _outcome_in_parts(job: Job, device: int) -> Parts[Done | Failed]:
    try:
        return (yield from run(job, device))
    except LeftOut as error:
        return Failed(str(error), "left out")
    except ContextError as error:
        return Failed(str(error), "no GL")
    except Exception as error:
        if isinstance(error, OSError) and error.errno in _FULL:
            return Failed(no_room(job.path, error), "no room")
        return Failed(error_text(error))
