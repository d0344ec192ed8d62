"""Connecting to Ray: to a cluster, to a Ray of this machine's own, or to the one that the program already uses."""

from __future__ import annotations

import os
import signal
import socket
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

LOCAL = "local"
MISSING = "Ray is not installed: pip install 'pointshade-gl[ray]'"
PATIENCE = 5.0  # seconds for a cluster to answer: by itself Ray would try for minutes
STORE = 500 << 20  # bytes of shared memory of a Ray of our own: a few pictures are on their way at a time
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
        raise ValueError(MISSING) from None
    if ray.is_initialized():
        yield ray
        return
    before = {ending: signal.getsignal(ending) for ending in _ENDINGS}
    quiet = {"log_to_driver": False, "logging_level": "CRITICAL"}
    try:
        if address == LOCAL:
            processors = max(os.cpu_count() or 1, workers or 1)
            with _no_reports():
                ray.init(LOCAL, num_cpus=processors, include_dashboard=False, object_store_memory=STORE, **quiet)
        else:
            _check_answers(address)
            ray.init(address, **quiet)
    except (ConnectionError, ValueError, RuntimeError) as error:
        _restore(before)
        raise OSError(f"no Ray at {address}: {str(error).strip().splitlines()[0]}") from None
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
def _no_reports() -> Iterator[None]:
    """A Ray that starts inside tells its makers nothing over the network, unless the user has decided about it."""
    name = "RAY_USAGE_STATS_ENABLED"
    is_decided = name in os.environ
    os.environ.setdefault(name, "0")
    try:
        yield
    finally:
        if not is_decided:
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
        socket.create_connection((host.strip("[]"), int(port)), PATIENCE).close()
    except (OSError, OverflowError) as error:
        raise ConnectionError(f"{error}") from None
