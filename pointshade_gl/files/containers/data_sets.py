"""Reads frames from HDF5 files, and knows the cameras of data sets whose files do not state them."""

from __future__ import annotations

from pathlib import Path

from ...notes.notes import Note
from ..access.content import FilePath
from ..access.limits import MAX_PIXELS
from ..arrays.hdf5 import hdf5_arrays
from ..arrays.stored_arrays import Stored
from ..cameras.intrinsics import Intrinsics
from .contents import Frames
from .networks import open_arrays

_HYPERSIM = "depth_meters"  # in the file's name; its only array is called dataset
_HYPERSIM_FOCAL = 886.81  # pixels of 1024x768 (Roberts et al. 2021)
_NYU = 518.857901, 519.469611, 325.582449, 253.736166  # the colour camera (Silberman et al. 2012)


def open_hdf5(path: FilePath, note: Note, max_pixels: float = MAX_PIXELS, is_matlab: bool = False) -> Frames:
    """The frames of an HDF5 file. Raises ValueError without the extra, for a broken file and without any depth."""
    arrays = hdf5_arrays(path, max_pixels)
    usual = _usual_camera(Path(path), arrays, note, is_matlab)
    if list(arrays) == ["dataset"] and "depth" in Path(path).name:
        arrays = {"ray_depth" if _HYPERSIM in Path(path).name else "depth": arrays["dataset"]}
    return open_arrays(str(path), arrays, note, max_pixels, is_matlab, usual)


def _usual_camera(path: Path, arrays: dict[str, Stored], note: Note, is_matlab: bool) -> Intrinsics | None:
    """The camera of data sets whose files do not say it."""
    shapes = {name: array.shape for name, array in arrays.items()}
    if is_matlab and shapes.get("depths", ())[-2:] == (640, 480) and "images" in shapes:
        note(f"{path}: the camera is taken as NYU Depth v2's, fx {_NYU[0]:.1f} at 640x480")
        return Intrinsics(f"{path} (NYU Depth v2)", _NYU, (640, 480))
    if shapes == {"dataset": (768, 1024)} and _HYPERSIM in path.name:
        note(f"{path}: the camera is taken as Hypersim's usual one, fx {_HYPERSIM_FOCAL} at 1024x768")
        numbers = _HYPERSIM_FOCAL, _HYPERSIM_FOCAL, 511.5, 383.5
        return Intrinsics(f"{path} (Hypersim)", numbers, (1024, 768), None, "ray")
    return None
