"""The points of LAS files, and of LAZ and COPC, which are compressed. They come with the extra `las`."""

from __future__ import annotations

from typing import Any

import numpy as np

from ...notes.notes import Note
from ..access.content import FilePath, check_size, import_extra, naming, open_regular
from .found_points import FoundPoints, check_points
from .las_header import check_las_header

LAS = b"LASF"
_AT_A_TIME = 1 << 20  # points


def read_las_points(path: FilePath, note: Note, max_pixels: float) -> FoundPoints:
    """The points of a LAS, LAZ or COPC file. Raises ValueError for a broken one, and without the extra."""
    laspy = import_extra("laspy", "las", f"{path} is a LAS file")
    with open_regular(path) as file:
        size = check_size(file, path, max_pixels)
        with naming(path, "is a broken or truncated LAS file"), _no_panic():
            check_las_header(file, size)
            with laspy.open(file, closefd=False, laz_backend=laspy.LazBackend.Lazrs) as reader:
                header = reader.header
                check_points(header.point_count, path, max_pixels)
                if header.are_points_compressed:
                    _check_packed(header, path)
                return _read(reader, f"LAS {header.version}, point format {header.point_format.id}")


def _check_packed(header: Any, path: FilePath) -> None:
    """Raises ValueError without the decompressor, and if it would give points of another size."""
    lazrs = import_extra("lazrs", "las", f"{path} is a compressed LAS file")
    packed = lazrs.LazVlr(header.vlrs[header.vlrs.index("LasZipVlr")].record_data)
    if packed.item_size() != header.point_format.size:
        raise ValueError(f"its points have {header.point_format.size} bytes, and are packed as {packed.item_size()}")


def _read(reader: Any, form: str) -> FoundPoints:
    names = set(reader.header.point_format.dimension_names)
    has_color = {"red", "green", "blue"} <= names
    count, done = reader.header.point_count, 0
    parts: dict[str, list[np.ndarray]] = {"positions": [], "colors": [], "intensity": [], "classes": []}
    for chunk in reader.chunk_iterator(_AT_A_TIME):
        parts["positions"].append(np.stack([chunk.x, chunk.y, chunk.z], -1))
        parts["intensity"].append(np.array(chunk.intensity))
        parts["classes"].append(np.array(chunk.classification, np.uint8))
        if has_color:
            parts["colors"].append(np.stack([chunk.red, chunk.green, chunk.blue], -1))
        done += len(chunk)
    if done != count:
        raise ValueError(f"it has {done} of {count} points")
    found: dict[str, Any] = {name: np.concatenate(part) for name, part in parts.items() if part}
    positions = found.pop("positions", np.empty((0, 3)))
    if "colors" in found and not found["colors"].any():
        del found["colors"]  # a format with colours, and nobody wrote any
    return FoundPoints(form, positions, **found, up="z", up_from="always so in LAS")


class _no_panic:
    """A context in which the compressor's panics, which are no Exceptions, become ValueErrors."""

    def __enter__(self) -> None:
        pass

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, _: object) -> None:
        if kind is not None and kind.__name__ == "PanicException":
            raise ValueError("its compressed points are damaged") from None
