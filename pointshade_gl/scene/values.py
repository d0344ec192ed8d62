"""What frozen values with arrays have in common: nobody writes into them, also after copying and pickling."""

from __future__ import annotations

from dataclasses import fields
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

_Array = TypeVar("_Array", bound=NDArray[Any])


class Value:
    """A frozen dataclass that never changes: a copy of it is the value itself, a pickle holds its fields only."""

    def __copy__(self) -> Any:
        return self

    def __deepcopy__(self, memo: dict[int, Any]) -> Any:
        return self

    def __getstate__(self) -> dict[str, Any]:
        kept: Any = self
        return {one.name: getattr(self, one.name) for one in fields(kept)}

    def __setstate__(self, state: dict[str, Any]) -> None:
        for name, value in state.items():
            object.__setattr__(self, name, frozen(value) if _is_array(value) else value)


class Options(Value):
    """A value that equals another one with the same fields. Arrays are the same if all their numbers are."""

    def __eq__(self, other: object) -> bool:
        if self is other:
            return True
        if not isinstance(other, Options) or type(other) is not type(self):
            return NotImplemented
        return all(map(_is_same, self.__getstate__().values(), other.__getstate__().values()))

    def __hash__(self) -> int:
        values = self.__getstate__().values()
        return hash(tuple(np.shape(value) if _is_array(value) else value for value in values))


def frozen(array: _Array) -> _Array:
    """Return the array itself, read-only from now on."""
    array.flags.writeable = False
    return array


def _is_same(one: Any, other: Any) -> bool:
    if _is_array(one) or _is_array(other):
        return one is other or (_is_array(one) and _is_array(other) and np.array_equal(one, other, equal_nan=True))
    return bool(one == other)


def _is_array(value: Any) -> bool:
    return isinstance(value, np.ndarray)
