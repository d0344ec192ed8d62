"""Formats options and values for messages: `depth_kind='inverse'` in Python is `--depth-kind inverse` in a terminal."""

from __future__ import annotations

import reprlib
from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager

_LONGEST = 120  # characters of a value that a message shows

_CONTROLS = {code: f"\\x{code:02x}" for code in (*range(32), *range(127, 160)) if chr(code) not in "\n\t"}

_short = reprlib.Repr()
_short.maxlevel, _short.maxlist, _short.maxtuple, _short.maxdict = 3, 16, 16, 8
_short.maxstring = _short.maxother = _LONGEST

_is_command_line = False  # plain variables, so that all threads see them
_is_typed = False  # by the user of the command line, also while a file's own options are named


def option(name: str, *values: object, of: str = "", beside_file: bool = False) -> str:
    """Format an option as its user writes it, with a value or with several to choose from.

    values       a text in capitals stands for something, such as FILE, and is not quoted; True is a switch
    of           whose value it is in Python: `option("shininess", of="material")` is "material shininess" or
                 "--shininess"
    beside_file  the option is never written in a file, only passed by the caller: `as_python` does not change it
    """
    if _is_typed if beside_file else _is_command_line:
        shown = " or ".join(str(value) for value in values if value is not True)
        return f"--{name.replace('_', '-')} {shown}".rstrip()
    name = f"{of} {name}".lstrip()
    return f"{name}={' or '.join(map(_literal, values))}" if values else name


def all_of_them() -> str:
    """Return how to go on for a user who wants all frames of a sequence, not only one."""
    return "; `pointshade render INPUT -o %04d.png` draws all" if _is_typed else "; open_source gives all"


def as_command_line() -> AbstractContextManager[None]:
    """Name options in messages as the command line has them, inside the context."""
    return _speaking(True, typed=True)


def as_python() -> AbstractContextManager[None]:
    """Name options in messages as Python has them, inside the context. Files use these names, too."""
    return _speaking(False, typed=_is_typed)


@contextmanager
def _speaking(is_command_line: bool, typed: bool) -> Iterator[None]:
    global _is_command_line, _is_typed
    before = _is_command_line, _is_typed
    _is_command_line, _is_typed = is_command_line, typed
    try:
        yield
    finally:
        _is_command_line, _is_typed = before


def _literal(value: object) -> str:
    return value if isinstance(value, str) and value.isupper() else repr(value)


def shown(value: object) -> str:
    """Format a value for a message: one line, cut where it is long, for files may hold values of any size and depth."""
    if type(value).__module__.startswith("pointshade_gl"):
        return f"a {type(value).__name__}"
    try:
        return cut(_short.repr(value), _LONGEST)
    except ValueError:  # Python does not write integers of more than 4300 digits
        return f"{type(value).__name__} of many digits"


def printable(text: str) -> str:
    """Return a text for a terminal: control characters, as names of files may hold them, as escapes."""
    return text.translate(_CONTROLS)


def cut(text: object, longest: int = 200) -> str:
    """Return a text, or the message of an error, in one line and cut where it is long."""
    line = " ".join(str(text).split())
    return line if len(line) <= longest else f"{line[: longest - 3]}..."


def counted(count: int, what: str) -> str:
    """Return a count with its noun: 1 node, 2 meshes, 93 207 points."""
    plural = "" if count == 1 else "es" if what.endswith("sh") else "s"
    return f"{count:,} {what}{plural}".replace(",", " ")
