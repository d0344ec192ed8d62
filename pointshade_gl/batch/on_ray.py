"""Work on a Ray cluster: connecting, actors with one GL context each, the outputs of a batch."""

from __future__ import annotations

import os
import secrets
import signal
import socket
from collections.abc import Callable, Generator, Iterable, Iterator, Sequence, Sized
from contextlib import closing, contextmanager
from dataclasses import replace
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from ..files.access.atomic_write import OURS, hidden_beside, written_whole
from ..gpu.context.context import egl_device
from ..notes.notes import print_note
from ..notes.version import __version__
from ..notes.words import option
from .jobs import Done, Job
from .processes import Failed, Function, Task, Tasks, Worker, checked, outcome_of, results_of

LOCAL = "local"
ANSWERS_WITHIN = 5.0  # seconds for a cluster to answer: by itself Ray would try for minutes
STORE_BYTES = 500 << 20  # of shared memory of a Ray of our own: a few pictures are on their way at a time
OWN_TOKEN = secrets.token_hex(32)  # Ray reads it once in a process
_ENDINGS = [getattr(signal, name) for name in ("SIGINT", "SIGTERM") if hasattr(signal, name)]


@contextmanager
def connected(address: str, workers: int | None = None) -> Iterator[Any]:
    """The module ray, connected. A connection that is there already is used and left open.

    address  "local" starts a Ray on this machine, which ends with the block; else a cluster's, as "auto", "host:6379"
             or "ray://host:10001"
    workers  that a local Ray must have room for; None: one a processor

    Raises ValueError without Ray, and OSError where no cluster answers, in one sentence.
    """
    try:
        import ray
    except ImportError:
        raise ValueError("Ray is not installed: pip install '.[ray]' in the clone") from None
    if ray.is_initialized():
        yield ray
        return
    before = {ending: signal.getsignal(ending) for ending in _ENDINGS}
    quiet = {"log_to_driver": False, "logging_level": "CRITICAL"}
    try:
        if address == LOCAL:
            processors = max(os.cpu_count() or 1, workers or 1)
            with settings_of_local():
                ray.init(LOCAL, num_cpus=processors, include_dashboard=False, object_store_memory=STORE_BYTES, **quiet)
        else:
            _check_answers(address)
            ray.init(address, **quiet)
    except (ConnectionError, ValueError, RuntimeError) as error:
        raise OSError(f"no Ray at {address}: {str(error).strip().splitlines()[0]}") from None
    finally:
        _restore(before)  # Ray ends a process by handlers of its own
    try:
        yield ray
    finally:
        ray.shutdown()
        _restore(before)


def silence_ray() -> None:
    """For the command line, before Ray is imported: it will print nothing to stdout, not even about lost workers."""
    os.environ.setdefault("RAY_DEDUP_LOGS_SKIP_REGEX", ".")


@contextmanager
def settings_of_local() -> Iterator[None]:
    """A Ray of our own starts inside, with settings about which the user has not decided. It sends its makers nothing
    over the network. Its token lies in the home, or nowhere if that cannot be written."""
    home = Path(os.path.expanduser("~"))  # noqa: PTH111 - without a home it stays ~
    settings = {"RAY_USAGE_STATS_ENABLED": "0"}
    if not (home / ".ray").exists() and not os.access(home, os.W_OK):
        settings["RAY_AUTH_TOKEN"] = OWN_TOKEN
    ours = settings.keys() - os.environ.keys()
    os.environ.update({name: settings[name] for name in ours})
    try:
        yield
    finally:
        for name in ours:
            del os.environ[name]


def _restore(handlers: dict[Any, Any]) -> None:
    for ending, handler in handlers.items():
        if signal.getsignal(ending) is not handler:
            signal.signal(ending, handler)


def _check_answers(address: str) -> None:
    """Raises OSError unless something listens at host:port. "auto" is found by Ray itself."""
    host, colon, port = address.removeprefix("ray://").rpartition(":")
    if not (colon and port.isdecimal()):
        return
    try:
        socket.create_connection((host.strip("[]"), int(port)), ANSWERS_WITHIN).close()
    except (OSError, OverflowError) as error:
        raise ConnectionError(f"{error}") from None


# Processors for each worker: who reads frames for us on the same Ray needs some, too, or all would wait for each other.
CPUS_EACH = 0.5
QUEUED = 2  # small tasks that a worker has at a time: the next one is there when one is done
NOTED_AFTER = 20.0  # seconds without a worker, after which a note explains why
GRACE = 10.0  # seconds in which workers may end what they are at when nobody waits for it any more


class _Actor:
    """Ray gives it a process of its own, and calls it from one thread."""

    def __init__(self, function: Function, device: int, threads: int):
        os.environ.setdefault("LP_NUM_THREADS", str(threads))  # of a software driver: others have other workers
        self._function, self._device = function, device_here(device)

    def ready(self) -> tuple[str, str, str]:
        """How the names of its hidden files begin, where it is, and its version of this package."""
        return OURS, socket.gethostname(), __version__

    def work(self, item: Any) -> Any:
        return self._function(item, self._device)


class _RayWorker(Worker):
    """An actor. references: of the answers that it will give, in this order."""

    never_begins = "no worker starts on Ray"

    def __init__(self, ray: Any, start: Callable[[], Any]):
        super().__init__()
        self._ray, self.actor = ray, start()
        self.references = [self.actor.ready.remote()]

    def give(self, task: Task) -> None:
        super().give(task)
        self.references.append(self.actor.work.remote(task.item))

    def receive(self) -> tuple[bool, Any]:
        """Raises OSError for a machine with another version of this package, and what the function has raised."""
        try:
            answer = self._ray.get(self.references.pop(0))
        except self._ray.exceptions.RayError as error:
            if self.hidden and isinstance(error, self._ray.exceptions.RayTaskError):
                raise error.cause from error
            self.remove_rest()
            return False, "is there enough memory?" if self.hidden else str(error).strip().splitlines()[-1].strip()
        if self.hidden:
            return True, answer
        hidden, host, version = answer
        if version != __version__:
            raise OSError(f"{host} has pointshade_gl {version}, and here it is {__version__}: install the same")
        return True, hidden


def device_here(otherwise: int = 0) -> int:
    """The EGL device of the GPU that Ray has handed to this process; another where it has handed out none."""
    import ray

    gpus = ray.get_gpu_ids() if ray.is_initialized() else []
    return egl_device(gpus[0], os.environ.get("CUDA_VISIBLE_DEVICES", "")) if gpus else otherwise


def on_ray(
    function: Function, items: Iterable[Any], address: str, workers: int | None = None, num_gpus: float = 0.0,
    device: int = 0, ahead: int | None = None,
) -> Generator[tuple[int, Any], None, None]:  # fmt: skip
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
        kind = ray.remote(_Actor).options(num_cpus=CPUS_EACH, num_gpus=num_gpus)
        actor = partial(kind.remote, function, device, max(1, int(cpus / count)))
        start, pool = partial(_RayWorker, ray, actor), list[_RayWorker]()
        try:
            pool += (start() for _ in range(count))
            tasks = Tasks(items, ahead and ahead * count)
            yield from results_of(tasks, pool, start, partial(_wait_for, ray), QUEUED if ahead else 1)
        finally:
            _dismiss(ray, pool)


def _wait_for(ray: Any, pool: list[_RayWorker]) -> list[_RayWorker]:
    """Notes on the way that there is no room for workers."""
    by_reference = {worker.references[0]: worker for worker in pool if worker.references}
    done, _ = ray.wait(list(by_reference), timeout=None if any(worker.hidden for worker in pool) else NOTED_AFTER)
    if not done:
        free = ray.available_resources()
        room = " and ".join(f"{free.get(name, 0):g} {name}" for name in ("CPU", "GPU"))
        print_note(f"Ray has no room for a worker yet: free are {room}")
    return [by_reference[reference] for reference in done]


def _dismiss(ray: Any, pool: list[_RayWorker]) -> None:
    """Ends the workers. What they are at they may end, so that no file is left half-written."""
    busy = [reference for worker in pool if worker.tasks for reference in worker.references]
    try:
        if busy:
            ray.wait(busy, num_returns=len(busy), timeout=GRACE)
    finally:
        for worker in pool:
            ray.kill(worker.actor)
            worker.remove_rest()


def run_all_on_ray(
    jobs: Sequence[Job], output: Path, address: str, workers: int | None = None, num_gpus: float = 0.0, device: int = 0
) -> Generator[tuple[Job, Done | Failed], None, None]:
    """Runs the jobs on a Ray cluster, and gives each with what became of it, as soon as it is known.

    Workers write into the folder of the outputs where they see it; others send the files here. What is read they must
    all see.

    output  the folder of the outputs, which exists

    Other arguments, and errors, are those of `on_ray`; and ContextError where a worker has no OpenGL.
    """
    mark = hidden_beside(output.absolute() / "any")  # by it others find out whether they see this folder
    mark.touch()
    try:
        with closing(on_ray(partial(_make, mark=mark), jobs, address, workers, num_gpus, device)) as results:
            for number, result in results:
                outcome, content = (result, None) if isinstance(result, Exception) else result
                if content is not None:
                    jobs[number].path.parent.mkdir(parents=True, exist_ok=True)
                    with written_whole(jobs[number].path) as hidden:
                        hidden.write_bytes(content)
                yield jobs[number], checked(outcome)
    finally:
        mark.unlink(missing_ok=True)


def _make(job: Job, device: int, mark: Path) -> tuple[Done | Failed, bytes | None]:
    """What became of a job, and the content of its file where this machine does not see the folder of the outputs."""
    if mark.exists():
        return _outcome(job, device), None
    with TemporaryDirectory() as folder:
        there = Path(folder, job.path.name)
        outcome = _outcome(replace(job, path=there), device)
        return (outcome._replace(path=job.path), there.read_bytes()) if isinstance(outcome, Done) else (outcome, None)


def _outcome(job: Job, device: int) -> Done | Failed:
    outcome = outcome_of(job, device)
    if isinstance(outcome, Failed) and Path(job.source).is_absolute() and not Path(job.source).exists():
        return Failed(f"{socket.gethostname()} does not see {job.source}: put it where all machines of the cluster do")
    return outcome
