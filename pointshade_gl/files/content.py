"""What is inside a file: its first bytes, its text, its numbers, its JSON."""

from __future__ import annotations

import json
import re
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..checks import check_path

FilePath = str | PathLike[str]


def read_head(path: FilePath, size: int = 64) -> bytes:
    """The first bytes of a file, by which its format is known.

    Raises OSError for what is no file, ValueError for an empty one and for a git-LFS pointer.
    """
    path = check_path(path)
    if path.is_dir():
        raise IsADirectoryError(f"{path} is a folder, expected a file")
    try:
        with path.open("rb") as file:
            head = file.read(size)
    except FileNotFoundError:
        raise FileNotFoundError(f"{path} does not exist") from None
    if not head:
        raise ValueError(f"{path} is empty, expected a file of more than 0 bytes")
    if head.startswith(b"version https://git-lfs"):
        raise ValueError(f"{path} is a git-LFS pointer, not the file itself: run `git lfs pull` in its repository")
    return head


def read_numbers(path: FilePath) -> NDArray[np.float64]:
    """(n,) all numbers of a text, .json or .npy file, row after row. Raises ValueError for any other content."""
    if read_head(path).startswith(b"\x93NUMPY"):
        try:
            return np.asarray(np.load(path, allow_pickle=False), np.float64).ravel()
        except Exception as error:  # a broken header raises of everything
            raise ValueError(f"{path} is a broken NumPy file: {error}") from None
    text = read_text(path)
    lines = "\n".join(line.split("#")[0] for line in text.splitlines()).replace("[", " ").replace("]", " ")
    numbers = split_numbers(lines)
    if numbers is None:
        raise ValueError(f"{path} must hold numbers only, got {text[:40]!r}")
    return np.array(numbers)


def read_text(path: FilePath) -> str:
    """The text of a file. Raises OSError for what is no file, ValueError for what is no text."""
    read_head(path)
    try:
        return Path(path).read_text(encoding="utf-8-sig")
    except UnicodeDecodeError:
        raise ValueError(f"{path} is not a text file") from None


def parse_json(text: str, path: FilePath) -> Any:
    """What the JSON of a file holds. Raises ValueError, naming the file, when it is none."""
    try:
        return json.loads(text)
    except (ValueError, RecursionError) as error:
        raise ValueError(f"{path} is not valid JSON: {error}") from None


def split_numbers(text: str) -> list[float] | None:
    """The numbers of a text that holds nothing but numbers, else None."""
    try:
        return [float(part) for part in re.split(r"[\s,;]+", text.strip(" \t\r\n,;[]()"))]
    except ValueError:
        return None
