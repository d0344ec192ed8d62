"""What the shell completes: the values of options, and INPUT. With no answer it completes files, as always."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from contextlib import suppress
from pathlib import Path

from ..files.access.known_names import FRAMES, SCENES


def one_of(known: Iterable[str]) -> Callable[[str], list[str]]:
    """Completes an option that takes one of these names."""
    names = tuple(known)

    def complete(incomplete: str) -> list[str]:
        return [name for name in names if name.startswith(incomplete)]

    return complete


def complete_input(incomplete: str) -> list[str]:
    """The built-in names that fit and, beside them, folders and files. Where no name fits the shell finds the files."""
    names = [name for name in (*FRAMES, *SCENES) if name.startswith(incomplete)]
    beside: list[str] = []
    with suppress(OSError):
        beside = [path.name for path in Path().iterdir() if path.name[0] != "." and path.name.startswith(incomplete)]
    return [*names, *sorted(set(beside) - set(names))] if names else []
