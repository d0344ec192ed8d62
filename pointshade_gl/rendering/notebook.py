"""Pictures that notebooks show."""

from __future__ import annotations

import numpy as np


class Picture(np.ndarray):
    """An array that a notebook shows as a picture, as long as it is one: (h, w, 3|4) uint8."""

    def _repr_png_(self) -> bytes | None:
        if self.dtype != np.uint8 or self.ndim != 3 or self.shape[2] not in (3, 4) or not self.size:
            return None  # the notebook prints the numbers
        from ..files.pictures.picture_files import encode_png

        return encode_png(np.asarray(self))
