"""The package's own exceptions: for OpenGL contexts, shaders and cancelled work. All others are built-in ones."""

from __future__ import annotations

import os
from typing import Any

from .formatting import shown

SPAWN = "start processes by spawn, multiprocessing.get_context('spawn')"


class ContextError(RuntimeError):
    """No usable OpenGL context: none on this machine, too old, released, or of another thread or process."""


class ShaderError(RuntimeError):
    """A shader cannot be assembled or compiled; the message names file and line."""


class Cancelled(Exception):
    """Work that its `progress` has ended by returning False: nothing is half-written, and renderers go on."""


def check_process(process: int, what: str) -> None:
    """Raise ContextError where what a process made is used in its fork, which has none of its threads.

    process  what os.getpid() said as it was made
    """
    if os.getpid() != process:
        raise ContextError(f"this {what} was made before a fork: {SPAWN}, and make a new one in each")


def check_function(value: Any, name: str) -> Any:
    """The value. Raises TypeError unless it can be called."""
    if not callable(value):
        raise TypeError(f"{name} must be a function, got {shown(value)}")
    return value
