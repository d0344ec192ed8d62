"""What a glTF file says in extras of the name "pointshade"; the names are listed in this package's docstring."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from ...notes.words import shown
from ..access.content import parse_json


def options(extras: Any, known: Sequence[str]) -> dict[str, Any]:
    """What `extras` says under "pointshade", checked for unknown names; {} when it says nothing."""
    said = extras.get("pointshade") if isinstance(extras, dict) else None
    if isinstance(said, str):
        said = from_text(said)
    if said is None:
        return {}
    if not isinstance(said, dict):
        raise ValueError(f"its extras 'pointshade' must be an object, got {shown(said)}")
    for key in said:
        if key not in known:
            raise ValueError(f"its extras 'pointshade' have an unknown {shown(key)}: known are {', '.join(known)}")
    return said


def from_text(said: str) -> Any:
    """The object in a text of JSON; any other text names a frame."""
    if not said.lstrip().startswith("{"):
        return {"frame": said}
    try:
        return parse_json(said)
    except ValueError as error:
        raise ValueError(f"its extras 'pointshade': its text {error}") from None


def switch(said: dict[str, Any], key: str, default: bool = True) -> bool:
    """A switch of extras; Blender's older ones are 0 and 1."""
    value = said.get(key, default)
    if not isinstance(value, int) or value not in (0, 1):
        raise ValueError(f"its extras: {key} must be true or false, got {shown(value)}")
    return bool(value)
