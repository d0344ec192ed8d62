"""The words of messages: options and values as their user writes them, and what a misspelt name was meant to be."""

from __future__ import annotations

import re
import reprlib
from collections.abc import Collection, Iterable, Iterator
from contextlib import AbstractContextManager, contextmanager, suppress
from itertools import islice
from pathlib import Path

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


def as_one() -> str:
    """Return how frames of one place are drawn together."""
    return "--views all draws them as one" if _is_typed else "render takes a list of them as one object"


def as_command_line() -> AbstractContextManager[None]:
    """Name options in messages as the command line has them, inside the context."""
    return _naming(True, typed=True)


def as_python() -> AbstractContextManager[None]:
    """Name options in messages as Python has them, inside the context. Files use these names, too."""
    return _naming(False, typed=_is_typed)


@contextmanager
def _naming(is_command_line: bool, typed: bool) -> Iterator[None]:
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


_DIGIT = re.compile(r"\d")
_MOST = 1000  # entries of a folder that are compared
_LISTED = 6  # entries of a folder that a message lists
_ALIKE = 0.65  # of 1: names that are spelt so much alike are near
_ELSEWHERE = {  # what options are called in other programs
    "camera": "--intrinsics", "focal": "--intrinsics", "fx": "--intrinsics",
    "width": "--picture-size", "height": "--picture-size", "size": "--picture-size",
    "image": "--color", "photo": "--color", "rgb": "--color",
    "gpu": "--device", "method": "--normals", "units": "--depth-scale",
    "inverse": "--depth-kind inverse", "shadow": '--light "X,Y,Z shadow"',
}  # fmt: skip


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

    near = get_close_matches(word.lower(), names, 3, _ALIKE)
    near.sort(key=lambda name: name[:1] != word[:1].lower())  # of those as near, the one that begins alike
    return names[near[0]] if near else None


def _entries(folder: Path) -> list[str]:
    """Return the names in a folder that are not hidden; none if it cannot be read."""
    with suppress(OSError):
        return [path.name for path in islice(folder.iterdir(), _MOST) if path.name[0] != "."]
    return []
