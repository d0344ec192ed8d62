"""Finds the EGL device of a GPU that CUDA names: EGL counts devices in its own order, software renderers included."""

from __future__ import annotations

import ctypes
from collections.abc import Sequence

EGL_CUDA_DEVICE_NV = 0x323A  # of EGL_NV_device_cuda
_MOST_DEVICES = 64


def egl_device(gpu: int | str, visible: str) -> int:
    """Return the number of the EGL device that is this GPU.

    gpu      as Ray and CUDA_VISIBLE_DEVICES name it: a number, or a text such as "GPU-8932f937"
    visible  what CUDA_VISIBLE_DEVICES holds in this process; "" where it is not set
    """
    return matching(_cuda_numbers(), str(gpu), [name for name in visible.split(",") if name])


def matching(numbers: Sequence[int | None], gpu: str, visible: Sequence[str]) -> int:
    """Return the place of a GPU among EGL devices, from the numbers that their driver gives them, None where it gives
    none.

    A driver counts within CUDA_VISIBLE_DEVICES. Some old ones do not: they give numbers beyond it, or one number twice;
    then the GPU's own number counts. Without an answer EGL's order is used, and the first device beyond its end.
    """
    given = [number for number in numbers if number is not None]
    is_within = gpu in visible and max(given, default=0) < len(visible) and given.count(visible.index(gpu)) == 1
    wanted = visible.index(gpu) if is_within else int(gpu) if gpu.isdecimal() else 0
    if given.count(wanted) == 1:
        return numbers.index(wanted)
    return wanted if wanted < len(numbers) else 0


def _cuda_numbers() -> list[int | None]:
    """Return the CUDA number of each EGL device, in EGL's order; None for one that has none."""
    egl = ctypes.CDLL("libEGL.so.1")
    egl.eglGetProcAddress.restype = ctypes.c_void_p
    list_devices = egl.eglGetProcAddress(b"eglQueryDevicesEXT")
    ask = egl.eglGetProcAddress(b"eglQueryDeviceAttribEXT")
    if not (list_devices and ask):
        return []
    devices, count = (ctypes.c_void_p * _MOST_DEVICES)(), ctypes.c_int()
    ctypes.CFUNCTYPE(ctypes.c_uint, ctypes.c_int, ctypes.c_void_p, ctypes.c_void_p)(list_devices)(
        _MOST_DEVICES, devices, ctypes.byref(count)
    )
    number = ctypes.c_ssize_t()
    attribute = ctypes.CFUNCTYPE(ctypes.c_uint, ctypes.c_void_p, ctypes.c_int, ctypes.c_void_p)(ask)
    return [
        number.value if attribute(device, EGL_CUDA_DEVICE_NV, ctypes.byref(number)) else None
        for device in devices[: count.value]
    ]
