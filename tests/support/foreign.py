"""What other libraries hand over: objects that show their numbers to NumPy in one way only."""

from __future__ import annotations

import array
from enum import Enum
from typing import Any

import numpy as np


class Held:
    """Holds an array; `of` is the memory that a reader should get."""

    def __init__(self, held: np.ndarray):
        self.held = held


class HasArray(Held):
    def __array__(self, dtype: Any = None, copy: bool | None = None) -> np.ndarray:
        return self.held


class HasInterface(Held):
    @property
    def __array_interface__(self) -> dict[str, Any]:
        return self.held.__array_interface__


class HasDLPack(Held):
    def __dlpack__(self, **how: Any) -> Any:
        return self.held.__dlpack__(**how)

    def __dlpack_device__(self) -> Any:
        return self.held.__dlpack_device__()


class DeviceType(Enum):
    """As Open3D names devices: no integer."""

    CPU = 1


class Rows(HasDLPack):
    """As a tensor of Open3D: rows that may be asked for one after the other, which NumPy takes for objects."""

    def __dlpack_device__(self) -> Any:
        return DeviceType.CPU, 0

    def __len__(self) -> int:
        return len(self.held)

    def __getitem__(self, key: int) -> Any:
        part = self.held[key]
        return Rows(part) if part.ndim else object()


class Copies(Held):
    """Makes a new array each time, as of a file or a compressed table."""

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> np.ndarray:
        return self.held.copy()


class Tensor(HasDLPack):
    """As PyTorch's: an array only where it is on the CPU, dense, of a known type and without a gradient."""

    def __init__(self, held: np.ndarray, dtype: str = "float32", device: str = "cpu", layout: str = "strided"):
        super().__init__(held)
        self.shape, self.dtype, self.device, self.layout = held.shape, f"torch.{dtype}", Device(device), layout
        self.requires_grad, self.ndim = False, held.ndim

    def with_gradient(self) -> Tensor:
        made = Tensor(self.held, self.dtype.removeprefix("torch."), str(self.device), self.layout)
        made.requires_grad = True
        return made

    def __float__(self) -> float:
        assert not self.requires_grad, "PyTorch warns"
        return float(self.held)

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> np.ndarray:
        if self.requires_grad:
            raise RuntimeError("Can't call numpy() on Tensor that requires grad. Use tensor.detach().numpy() instead.")
        if "float8" in self.dtype or "bfloat" in self.dtype or str(self.device) != "cpu" or self.layout != "strided":
            raise TypeError("can't convert it to numpy: a line of another library\nand a second one")
        return self.held

    def __dlpack_device__(self) -> tuple[int, int]:
        return (1, 0) if str(self.device) == "cpu" else (2, 0)

    def detach(self) -> Tensor:
        return Tensor(self.held, self.dtype.removeprefix("torch."), str(self.device), self.layout)

    def cpu(self) -> Tensor: ...

    def float(self) -> Tensor: ...

    def to_dense(self) -> Tensor: ...

    def permute(self, *axes: int) -> Tensor: ...


class Device:
    """As torch.device."""

    def __init__(self, name: str):
        self.name, self.type = name, name.partition(":")[0]

    def __str__(self) -> str:
        return self.name


WAYS = {
    "array": HasArray,
    "array interface": HasInterface,
    "DLPack": HasDLPack,
    "rows": Rows,
    "tensor": Tensor,
    "tensor with a gradient": lambda held: Tensor(held).with_gradient(),
    "memoryview": memoryview,
}  # each shares its memory


def as_buffer(values: np.ndarray) -> array.array[Any]:
    """Return a row of numbers as array.array, which shares nothing with it."""
    return array.array(values.dtype.char, values.ravel().tolist())
