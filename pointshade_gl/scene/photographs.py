"""Photographs of one view, each under its own light."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from .frame import Frame
from .point_object import check_frames


def check_photographs(frames: Sequence[Frame]) -> tuple[Frame, ...]:
    """Return the frames as a tuple. Raises TypeError for anything else, ValueError unless they show one view."""
    photos = check_frames(frames)
    if len(photos) < 2:
        raise ValueError("photographs of one view must be two or more, got 1")
    first = photos[0]
    for k, one in enumerate(photos):
        if one.color is None:
            raise ValueError(f"photographs must have colours, frame {k} has none")
        assert first.color is not None
        for what, own, other in (
            ("depth of the shape", one.depth.shape, first.depth.shape),
            ("colours of the shape", one.color.shape[:2], first.color.shape[:2]),
            ("the camera", one.camera, first.camera),
        ):
            if own != other:
                raise ValueError(f"photographs of one view must have {what} {other} of the first, frame {k} has {own}")
        if not np.allclose(one.pose, first.pose, atol=1e-4):
            raise ValueError(f"photographs of one view must have one pose, that of frame {k} is another")
    return photos
