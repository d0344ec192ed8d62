"""Makes arrays of what other libraries keep numbers in: tensors, buffers, pictures, tables. It imports none of them."""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..notes.words import cut

_ON_CPU = 1, 3  # DLPack's numbers of devices whose memory a program reads: its own, and what CUDA has pinned of it
_DEVICES = {2: "cuda", 4: "opencl", 7: "vulkan", 8: "metal", 10: "rocm", 13: "cuda", 14: "oneapi"}  # some others
_TO_CPU = "cpu", "get", "copy_to_host"  # methods of PyTorch, CuPy, Numba
_TO_DENSE = "to_dense", "toarray", "todense"  # of PyTorch, SciPy, sparse
_MODES = "1", "L", "RGB", "RGBA", "F", "I", "I;16", "I;16B", "I;16L", "I;16N"  # of Pillow: numbers as they are meant


class HasArray(Protocol):
    """What makes an array of itself, such as a tensor of PyTorch or a table of pandas."""

    def __array__(self) -> NDArray[Any]: ...


class HasArrayInterface(Protocol):
    """What shows NumPy its memory, such as a picture of Pillow."""

    @property
    def __array_interface__(self) -> dict[str, Any]: ...


class HasDLPack(Protocol):
    """What shows its memory to every array library, such as a tensor of PyTorch, JAX or TensorFlow."""

    def __dlpack__(self) -> Any: ...

    def __dlpack_device__(self) -> Any: ...


class HasBuffer(Protocol):
    """What shows its memory to all of Python, such as a memoryview or an array.array."""

    def __buffer__(self, flags: int, /) -> memoryview: ...


Exporter = HasArray | HasArrayInterface | HasDLPack | HasBuffer
Numbers = NDArray[Any] | Exporter | list[Any] | tuple[Any, ...]  # without texts and single numbers
AnyArray = ArrayLike | Exporter


class UnreadableError(TypeError):
    """Numbers that NumPy cannot read. The message names what was got, and what to give instead."""


def as_numpy(value: Any) -> NDArray[Any]:
    """Return the value as an array: its own memory wherever NumPy can use that.

    It takes what NumPy takes, what has DLPack alone, and tensors that require a gradient, without it. Raises
    UnreadableError for what is on another device, sparse, or of a type that NumPy lacks, ValueError for rows of
    different lengths. What is no array at all becomes one of type object, as in NumPy.
    """
    if isinstance(value, np.ndarray):
        return _checked(np.asarray(value))
    if _is_picture(value) and value.mode not in _MODES:
        plain = "RGBA" if value.mode.lower().endswith("a") else "RGB"
        raise UnreadableError(f"a picture of mode {value.mode}: give image.convert({plain!r})")
    array, problem = _asked(np.from_dlpack if _has_dlpack_alone(value) else np.asarray, value)
    if array is not None and array.dtype.kind != "O":
        return _checked(array)
    if isinstance(value, list | tuple):
        return np.asarray([as_numpy(item) for item in value])
    for plain in _plainer(value):
        return as_numpy(plain)
    reason = _why_not(value)
    if reason:
        raise UnreadableError(reason)
    if array is None:
        raise UnreadableError(f"a {type(value).__name__} that NumPy cannot read ({cut(problem)})")
    return array


def _has_dlpack_alone(value: Any) -> bool:
    """Return whether NumPy would take a tensor for one object, or for rows of objects, which is slow."""
    names = "__dlpack__", "__array__", "__array_interface__"
    return [hasattr(value, name) for name in names] == [True, False, False]


def _asked(read: Any, value: Any) -> tuple[NDArray[Any] | None, Exception | None]:
    """Return the array that NumPy makes of a value, or what it raises."""
    try:
        return read(value), None
    except Exception as error:  # the value's own code runs, and raises what it wants to
        return None, error


def _checked(array: NDArray[Any]) -> NDArray[Any]:
    """Return the array. Raises UnreadableError for numbers of types that other libraries have added to NumPy."""
    if array.dtype.isbuiltin == 2:  # ml_dtypes of JAX
        raise UnreadableError(f"{array.dtype} numbers, which NumPy lacks: give array.astype('float32')")
    return array


def _plainer(value: Any) -> list[Any]:
    """Return a tensor without what keeps NumPy from reading it, a gradient or a sign that is not applied yet."""
    if getattr(value, "requires_grad", False) is True:
        return [value.detach()]
    if any(_answer(value, name) is True for name in ("is_neg", "is_conj")):
        return [value.resolve_conj().resolve_neg()]
    return []


def _why_not(value: Any) -> str:
    """Return why NumPy cannot read a tensor and what to give instead, or nothing."""
    name, dtype = type(value).__name__, str(getattr(value, "dtype", "")).rpartition(".")[2]
    device = _device_of(value)
    if device:
        return f"a {name} on {device}: give it as a CPU array{_way_out(value, _TO_CPU)}"
    if "sparse" in str(getattr(value, "layout", "")) or "sparse" in type(value).__module__:
        return f"a sparse {name}: give it as a dense array{_way_out(value, _TO_DENSE)}"
    if dtype.startswith(("bfloat", "float8", "float4")):
        return f"a {name} of {dtype}, which NumPy lacks: give it as float32{_way_out(value, ('float',))}"
    return ""


def _device_of(value: Any) -> str:
    """Return the device that holds a tensor, unless a program can read it there."""
    kind, number = _answer(value, "__dlpack_device__") or (None, 0)
    kind = getattr(kind, "value", kind)  # a number, or an enumeration
    own = getattr(value, "device", None)
    type_of_own = getattr(own, "type", None)  # of PyTorch
    if kind in _ON_CPU:
        return ""
    if isinstance(type_of_own, str):
        return "" if type_of_own == "cpu" else str(own)
    if kind is not None:
        return f"{_DEVICES.get(kind, 'another device')}:{number}"
    return "cuda" if hasattr(value, "__cuda_array_interface__") else ""


def _way_out(value: Any, names: tuple[str, ...]) -> str:
    """Return the method of a value that makes it readable, as ", tensor.cpu()"."""
    return next((f", {type(value).__name__.lower()}.{name}()" for name in names if hasattr(value, name)), "")


def _answer(value: Any, name: str) -> Any:
    """Return what a method of a value without arguments gives; None where there is none, or it fails."""
    method = getattr(value, name, None)
    return _asked(lambda _: method(), value)[0] if callable(method) else None


def _is_picture(value: Any) -> bool:
    """Return whether a value is a picture of Pillow, whose mode defines what its numbers mean."""
    return isinstance(getattr(value, "mode", None), str) and hasattr(value, "getbands")


def way_to(shape: tuple[int, ...], name: str, value: Any, channels: tuple[int, ...] = ()) -> str:
    """Return how to make a picture of a batch of one, or of channels that come first, for the end of a message.

    Such as ": give color.permute(1, 2, 0)", or nothing where the shape does not look like that.

    name      of the argument
    channels  that a picture may have; none: it is (h, w)
    """
    sides, batch = 3 if channels else 2, 0
    while len(shape) - batch > sides and shape[batch] == 1:
        batch += 1
    rest = shape[batch:]
    stated = name + (f"[{', '.join('0' * batch)}]" if batch else "")
    if channels and len(rest) == 2:
        return ": give image.convert('RGB')" if _is_picture(value) else f": give np.stack([{stated}] * 3, -1)"
    if channels and len(rest) == 3 and rest[2] not in channels and rest[0] in channels:
        stated = f"{stated}.permute(1, 2, 0)" if hasattr(value, "permute") else f"np.moveaxis({stated}, 0, 2)"
    elif not channels and len(rest) == 3 and rest[2] == 1:
        stated += "[..., 0]"
    elif not batch or len(rest) != sides or (channels and rest[2] not in channels):
        return ""
    return f": give {stated}"
