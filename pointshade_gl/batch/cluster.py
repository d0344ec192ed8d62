"""Connecting to Ray: to a cluster, to a Ray of this machine's own, or to the one that the program already uses."""

from __future__ import annotations

import os
import secrets
import signal
import socket
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

LOCAL = "local"
MISSING = "Ray is not installed: pip install 'pointshade-gl[ray]'"
PATIENCE = 5.0  # seconds for a cluster to answer: by itself Ray would try for minutes
STORE = 500 << 20  # bytes of shared memory of a Ray of our own: a few pictures are on their way at a time
TOKEN = secrets.token_hex(32)  # Ray reads it once in a process
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
            with settings_of_local():
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
def settings_of_local() -> Iterator[None]:
    """A Ray of our own starts inside, with settings about which the user has not decided.

    It tells its makers nothing over the network. Its token lies in the home, or nowhere if that cannot be written.
    """
    home = Path(os.path.expanduser("~"))  # noqa: PTH111 - without a home it stays ~
    settings = {"RAY_USAGE_STATS_ENABLED": "0"}
    if not (home / ".ray").exists() and not os.access(home, os.W_OK):
        settings["RAY_AUTH_TOKEN"] = TOKEN
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
        socket.create_connection((host.strip("[]"), int(port)), PATIENCE).close()
    except (OSError, OverflowError) as error:
        raise ConnectionError(f"{error}") from None
