"""Files that a caller names and that do not exist: the error says by which option, and what there is instead."""

from __future__ import annotations

from os import PathLike
from typing import Any

from ..checks import check_path
from ..suggestions import listed_beside, near_path
from ..wording import option
from .content import split_numbers


def check_exist(**given: Any) -> None:
    """Raises FileNotFoundError for an option whose value is a path to nothing. Arrays and numbers in a text pass."""
    for name, value in given.items():
        if not isinstance(value, str | PathLike) or (isinstance(value, str) and split_numbers(value) is not None):
            continue
        path = check_path(value)
        if not path.exists():
            told = near_path(path) or listed_beside(path)
            raise FileNotFoundError(f"{option(name)}: {path} does not exist{told}")
