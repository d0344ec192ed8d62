"""How the JSON of a written scene looks: one line for each part."""

from __future__ import annotations

import json
from typing import Any


def layout(data: dict[str, Any]) -> str:
    """The text of a glTF file."""
    return _lines(data) + "\n"


def _lines(value: Any, indent: str = "") -> str:
    """One line for each short value and for each part of a list."""
    text = json.dumps(value, ensure_ascii=False, allow_nan=False)
    inner = indent + "  "
    if len(text) <= 100 or not isinstance(value, dict | list):
        return text
    if isinstance(value, list):
        lines = [json.dumps(item, ensure_ascii=False) for item in value]
    else:
        lines = [f"{json.dumps(key)}: {_lines(item, inner)}" for key, item in value.items()]
    begin, end = "[]" if isinstance(value, list) else "{}"
    return begin + ",".join(f"\n{inner}{line}" for line in lines) + f"\n{indent}{end}"
