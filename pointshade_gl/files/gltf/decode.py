"""JSON becomes pygltflib's objects, every value of the type that the library's class has for it.

The library's own way takes 0.2 ms for each object and lets wrong types pass.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import is_dataclass
from functools import cache
from typing import Any, Union, get_args, get_origin, get_type_hints

from ...messages.formatting import shown

_UNREAD = ("animations", "skins", "samplers")  # only their presence matters
_WHOLE = 2**63  # no larger number is needed

Reader = Callable[[Any, str], Any]  # of a value and of its place in the file


def decode(kind: type, value: Any, place: str = "") -> Any:
    """An object of the class. Raises ValueError, naming the place in the file, for a value of the wrong type."""
    if not isinstance(value, dict):
        raise ValueError(f"{place} must be an object, got {shown(value)}")
    readers = _readers(kind)
    before = f"{place}." if place else ""
    return kind(**{
        key: None if item is None else readers[key](item, before + key) for key, item in value.items() if key in readers
    })  # fmt: skip


@cache
def _readers(kind: type) -> dict[str, Reader]:
    """A reader for each field of a class. Unknown keys of a file are ignored, as glTF requires."""
    hints = get_type_hints(kind)
    return {name: _any if name in _UNREAD else _reader(hint) for name, hint in hints.items()} | {"extras": _extras}


def _reader(hint: Any) -> Reader:
    if get_origin(hint) is Union:  # Optional
        return _reader(get_args(hint)[0])
    if get_origin(hint) is list:
        return _list_of(_reader(get_args(hint)[0]))
    if get_origin(hint) is dict:
        return lambda value, place: _of(dict, value, place)
    if isinstance(hint, type) and is_dataclass(hint):
        return lambda value, place: decode(hint, value, place)
    return {int: _whole, float: _number, str: _text, bool: _switch}.get(hint) or _attributes_of(hint)


def _list_of(item: Reader) -> Reader:
    """A numbered part of the file may be null: `pick` refuses it where it is used."""

    def read(value: Any, place: str) -> list[Any]:
        may_be_null = "." not in place
        return [
            None if one is None and may_be_null else item(one, f"{place}[{k}]")
            for k, one in enumerate(_of(list, value, place))
        ]

    return read


def _of(kind: type, value: Any, place: str) -> Any:
    if not isinstance(value, kind):
        raise ValueError(f"{place} must be {'a list' if kind is list else 'an object'}, got {shown(value)}")
    return value


def _any(value: Any, _: str) -> Any:
    return value


def _extras(value: Any, _: str) -> dict[str, Any]:
    """glTF allows extras of any type, pygltflib objects only."""
    return value if isinstance(value, dict) else {}


def _whole(value: Any, place: str) -> int:
    is_whole = isinstance(value, int | float) and not isinstance(value, bool) and value % 1 == 0
    if not is_whole or abs(value) > _WHOLE:
        raise ValueError(f"{place} must be a whole number, got {shown(value)}")
    return int(value)


def _number(value: Any, place: str) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise ValueError(f"{place} must be a number, got {shown(value)}")
    return value


def _text(value: Any, place: str) -> str:
    if not isinstance(value, str):
        raise ValueError(f"{place} must be a text, got {shown(value)}")
    return value


def _switch(value: Any, place: str) -> bool:
    if not isinstance(value, bool):
        raise ValueError(f"{place} must be true or false, got {shown(value)}")
    return value


def _attributes_of(kind: type) -> Reader:
    """Numbers of accessors by any name, in a class that is not a dataclass."""

    def read(value: Any, place: str) -> Any:
        attributes = kind()
        for name, item in _of(dict, value, place).items():
            vars(attributes)[name] = None if item is None else _whole(item, f"{place}.{name}")
        return attributes

    return read
