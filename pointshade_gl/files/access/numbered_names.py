"""File names with a number in them: %04d.png, {:04d}.exr and ####.ply each stand for a whole series of files."""

from __future__ import annotations

import re
from pathlib import Path

_NUMBER = re.compile(r"%(0?\d{0,2})d|\{(?::(0?\d{0,2})d?)?\}|(##+)")


def is_numbered(path: Path) -> bool:
    """True for a name with a place for a number, as C (%04d), Python ({:04d}) or Nuke (####) writes it."""
    return bool(_NUMBER.search(path.name))


def numbered(path: Path, number: int) -> Path:
    """out/0007.png for out/%04d.png and 7. Raises ValueError unless the name has exactly one place for a number."""
    places = list(_NUMBER.finditer(path.name))
    if len(places) != 1:
        found = ", ".join(place[0] for place in places) or "none"
        raise ValueError(f"cannot write {path}: its name must have one place for a number, such as %04d, got {found}")
    (place,) = places
    marks = place[3]
    digits = format(number, f"0{len(marks)}d" if marks else f"{place[1] or place[2] or ''}d")
    return path.with_name(path.name[: place.start()] + digits + path.name[place.end() :])


def first_of(path: Path) -> Path:
    """The first file of a series, number 0; a path without a place for a number is itself."""
    return numbered(path, 0) if is_numbered(path) else path


def existing_files(path: Path) -> list[Path]:
    """The file, if it exists; of a series those of its files that do."""
    place = _NUMBER.search(path.name)
    if place is None:
        return [path] if path.exists() else []
    before, after = map(re.escape, (path.name[: place.start()], path.name[place.end() :]))
    names = (re.fullmatch(rf"{before}(\d+){after}", item.name, re.IGNORECASE) for item in path.parent.glob("*"))
    found = {numbered(path, int(name[1])) for name in names if name}  # on some systems A.png is a.png
    return sorted(one for one in found if one.exists())
