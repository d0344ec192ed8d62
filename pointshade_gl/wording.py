"""How messages name options: `depth_kind='inverse'` in Python, `--depth-kind inverse` on the command line."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

_is_command_line = False  # a plain variable, so that all threads see it


def option(name: str, *values: object, of: str = "") -> str:
    """An option as its user writes it, with a value or with several to choose from.

    values  a text in capitals stands for something, such as FILE, and is not quoted
    of      whose value it is in Python: `option("shininess", of="material")` is "material shininess" or "--shininess"
    """
    if _is_command_line:
        return " ".join([f"--{name.replace('_', '-')}", " or ".join(map(str, values))]).rstrip()
    name = f"{of} {name}".lstrip()
    return f"{name}={' or '.join(map(_literal, values))}" if values else name


@contextmanager
def as_command_line() -> Iterator[None]:
    """Inside, messages name options as the command line has them."""
    with _speaking(True):
        yield


@contextmanager
def as_python() -> Iterator[None]:
    """Inside, messages name options as Python does. Files use these names, too."""
    with _speaking(False):
        yield


@contextmanager
def _speaking(is_command_line: bool) -> Iterator[None]:
    global _is_command_line
    before, _is_command_line = _is_command_line, is_command_line
    try:
        yield
    finally:
        _is_command_line = before


def _literal(value: object) -> str:
    return value if isinstance(value, str) and value.isupper() else repr(value)
