"""Worker processes that make the outputs of a batch: one that dies is replaced, and its job tried once more.

Each is spawned, never forked, and makes its OpenGL context when it draws its first picture. Only the parent decides
when they end: Ctrl+C in a terminal, which every process there gets, does not reach them.
"""

from __future__ import annotations

import os
import signal
from collections import deque
from collections.abc import Generator, Iterator, Sequence
from contextlib import contextmanager, suppress
from multiprocessing import get_context, resource_tracker
from multiprocessing.connection import Connection, wait
from typing import NamedTuple

from ..errors import ContextError
from ..files.whole import OURS, remove_hidden
from ..wording import as_command_line
from .jobs import Done, Job, LeftOut, run

TRIES = 2  # of a job whose worker dies: something else may have used up the memory
_PATIENCE = 5.0  # seconds that an idle worker has to end by itself
_GONE = (EOFError, OSError)  # what a pipe raises when its other end is closed


class Failed(NamedTuple):
    """Why there is no output.

    kind  "failed"; "left out" by its sequence; or "no GL": then no job can be done
    """

    sentence: str
    kind: str = "failed"


class _Task(NamedTuple):
    job: Job
    tries: int = 1


def run_all(jobs: Sequence[Job], workers: int, device: int = 0) -> Generator[tuple[Job, Done | Failed], None, None]:
    """Runs the jobs in so many processes, and gives each with what became of it, as soon as it is known.

    After an exception, and where the consumer leaves early, the processes are ended at once: what is whole stays, and
    nothing half-written is left.

    Raises ContextError if workers have no OpenGL, OSError if they die before they begin.
    """
    waiting, crew, stillborn = deque(map(_Task, jobs)), list[_Worker](), 0
    share = max(1, usable_cores() // max(1, min(workers, len(jobs))))
    try:
        while waiting or any(worker.task for worker in crew):
            while len(crew) < workers and sum(not worker.is_ready for worker in crew) < len(waiting):
                crew.append(_Worker(device, share))
            results = []
            for pipe in wait([worker.pipe for worker in crew]):
                worker = next(one for one in crew if one.pipe is pipe)
                task, outcome = worker.task, worker.receive()
                if not worker.is_alive:
                    crew.remove(worker)
                    stillborn += not worker.is_ready
                    if stillborn > TRIES:
                        raise OSError(f"worker processes die before they begin: {worker.cause}")
                    if task and task.tries < TRIES:
                        waiting.append(task._replace(tries=task.tries + 1))
                        continue
                if task and outcome:
                    results.append((task.job, outcome))
            for worker in crew:
                if waiting and worker.is_ready and not worker.task:
                    worker.give(waiting.popleft())
            yield from results
    finally:
        with _interrupts_held():
            for worker in crew:
                worker.dismiss()
            for worker in crew:
                worker.end()


def outcome_of(job: Job, device: int = 0) -> Done | Failed:
    """Runs a job; whatever it raises becomes a sentence, so that the next job can be done."""
    try:
        return run(job, device)
    except LeftOut as error:
        return Failed(str(error), "left out")
    except ContextError as error:
        return Failed(str(error), "no GL")
    except (ValueError, TypeError, OSError) as error:
        return Failed(" ".join(str(error).split()))
    except MemoryError as error:
        return Failed(str(error) or "not enough memory")
    except Exception as error:
        return Failed(f"{type(error).__name__}: {' '.join(str(error).split())}")


def usable_cores() -> int:
    """How many this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


class _Worker:
    """A process, and the end of the pipe that leads to it.

    task      what it works on
    is_ready  it has begun, and its hidden files are known
    cause     of its death
    """

    def __init__(self, device: int, cores: int):
        context = get_context("spawn")
        self.pipe, theirs = context.Pipe()
        self.process = context.Process(target=_serve, args=(theirs, device), name="pointshade-worker", daemon=True)
        with _interrupts_held(), _drawing_threads(cores):
            self.process.start()
        theirs.close()
        self.task: _Task | None = None
        self.cause = ""
        self._hidden = ""

    @property
    def is_ready(self) -> bool:
        return bool(self._hidden)

    @property
    def is_alive(self) -> bool:
        return not self.cause

    def give(self, task: _Task) -> None:
        self.task = task
        with suppress(OSError):  # it is dead: receive() will tell
            self.pipe.send(task.job)

    def receive(self) -> Done | Failed | None:
        """What became of its task; None if it has only begun. If it is dead: what its task fails of."""
        try:
            message = self.pipe.recv()
        except _GONE:
            self.end()
            return Failed(f"its worker process died {TRIES} times: {self.cause}")
        if not self.is_ready:
            self._hidden = message
            return None
        self.task = None
        if isinstance(message, Failed) and message.kind == "no GL":
            raise ContextError(message.sentence)
        return message

    def dismiss(self) -> None:
        """It ends by itself if it has no task; else now."""
        self.pipe.close()
        if self.task or not self.is_ready:
            self.process.kill()

    def end(self) -> None:
        """Waits for its end, and removes what it has left."""
        self.process.join(_PATIENCE if not self.task else 0.1)
        self.process.kill()
        self.process.join()
        code = self.process.exitcode or 0
        self.cause = f"signal {-code} (is there enough memory?)" if code < 0 else f"exit code {code}"
        if self.task:
            remove_hidden(self.task.job.path.parent, self._hidden)


def _serve(pipe: Connection, device: int) -> None:
    """What a worker does: a job after the other, until the parent closes the pipe, or is no more."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # on Windows, where none can be held
    with as_command_line(), suppress(*_GONE):
        pipe.send(OURS)
        while True:
            pipe.send(outcome_of(pipe.recv(), device))


@contextmanager
def _drawing_threads(count: int) -> Iterator[None]:
    """Inside, processes start whose software driver draws by so many threads, unless the user has said how many."""
    if "LP_NUM_THREADS" in os.environ:
        yield
        return
    os.environ["LP_NUM_THREADS"] = str(count)
    try:
        yield
    finally:
        del os.environ["LP_NUM_THREADS"]


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
