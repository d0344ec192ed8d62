"""Finds what a misspelt name was meant to be, for messages: " (did you mean phong?)", or nothing if no name is near."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable
from contextlib import suppress
from itertools import islice
from pathlib import Path

_DIGIT = re.compile(r"\d")
_MOST = 1000  # entries of a folder that are compared
_LISTED = 6  # entries of a folder that a message lists
_ALIKE = 0.65  # of 1: names that are spelt so much alike are near
_ELSEWHERE = {  # what options are called in other programs
    "camera": "--intrinsics",
    "focal": "--intrinsics",
    "fx": "--intrinsics",
    "gpu": "--device",
    "height": "--picture-size",
    "image": "--color",
    "inverse": "--depth-kind inverse",
    "method": "--normals",
    "photo": "--color",
    "rgb": "--color",
    "shadow": '--light "X,Y,Z shadow"',
    "units": "--depth-scale",
    "width": "--picture-size",
}


def did_you_mean(word: object, known: Iterable[str]) -> str:
    """Return the known name that is nearest to a word, as " (did you mean phong?)", else "". Case does not count."""
    near = _nearest(word, known) if isinstance(word, str) else None
    return f" (did you mean {near}?)" if near else ""


def meant_option(typed: str, known: Collection[str]) -> str:
    """Return the same for an option: what other programs call so, or one with the word, or spelt nearly so."""
    word = typed.lstrip("-").lower()
    elsewhere = _ELSEWHERE.get(word, "")
    names = [name.removeprefix("--") for name in known if name.startswith("--")]
    near = next((name for name in names if word in name.split("-")), None) or _nearest(word, names)
    meant = elsewhere if elsewhere.partition(" ")[0] in known else f"--{near}" if near else ""
    return f" (did you mean {meant}?)" if meant else ""


def near_path(path: Path, names: Iterable[str] = ()) -> str:
    """Return the same for a path that does not exist: the path whose first wrong part is spelt nearly so.

    Another number is another file, not a misspelt one: of 003.png, 004.png is not near.

    names  that may stand in the place of a path, such as those of built-in frames
    """
    wrong = path
    while not wrong.parent.exists():
        wrong = wrong.parent
    rest = path.relative_to(wrong)
    beside = (name for name in _entries(wrong.parent) if _DIGIT.sub("#", name) != _DIGIT.sub("#", wrong.name))
    near = _nearest(wrong.name, (name for name in beside if (wrong.parent / name / rest).exists()))
    return did_you_mean(str(path), names) if near is None else f" (did you mean {wrong.parent / near / rest}?)"


def listed_beside(path: Path) -> str:
    """Describe the folder of a path that does not exist: ": frames holds a.png, b.png and 3 more", or nothing."""
    names = sorted(_entries(path.parent))
    more = f" and {len(names) - _LISTED} more" if len(names) > _LISTED else ""
    where = "this folder" if path.parent == Path() else str(path.parent)
    return f": {where} holds {', '.join(names[:_LISTED])}{more}" if names else ""


def _nearest(word: str, known: Iterable[str]) -> str | None:
    names = {name.lower(): name for name in known}
    from difflib import get_close_matches  # only who mistypes pays for it

    near = get_close_matches(word.lower(), names, 1, _ALIKE)
    return names[near[0]] if near else None


def _entries(folder: Path) -> list[str]:
    """Return the names in a folder that are not hidden; none if it cannot be read."""
    with suppress(OSError):
        return [path.name for path in islice(folder.iterdir(), _MOST) if path.name[0] != "."]
    return []
