"""A contact sheet of a frame: its colours, depth, normals, and how it looks in the light."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..files.pictures.picture_files import normals_to_rgb
from ..scene.frame import Frame
from .renderer import Renderer

WIDEST = 640  # pixels of one of the four pictures
_GAP = 4
_NEAR, _FAR = 255, 40  # grey of the nearest and the farthest depth


def contact_sheet(renderer: Renderer, frame: Frame) -> NDArray[np.uint8]:
    """(h, w, 4) uint8: colour and depth above, normals and the lit frame below; near is bright in the depth."""
    c = frame.camera
    width = min(c.width, WIDEST)
    camera = c.resized(width, max(1, round(c.height * width / c.width)))
    plain = renderer.render(frame, camera=camera, shading="none")
    lit = renderer.render(frame, camera=camera, exposure="sensor")
    step_v, step_u = ((np.arange(n) + 0.5) * size / n for n, size in ((camera.height, c.height), (width, c.width)))
    at = np.ix_(step_v.astype(int), step_u.astype(int))
    normals = normals_to_rgb(renderer.estimate_normals(frame))[at]
    sheet = np.zeros((2 * camera.height + _GAP, 2 * width + _GAP, 4), np.uint8)
    for picture, bottom, right in ((plain, 0, 0), (_shades(frame)[at], 0, 1), (normals, 1, 0), (lit, 1, 1)):
        top, left = bottom * (camera.height + _GAP), right * (width + _GAP)
        sheet[top : top + camera.height, left : left + width] = picture
    return sheet


def _shades(frame: Frame) -> NDArray[np.uint8]:
    """(h, w, 4) 1/z in grey: distances far beyond the others do not make all others dark."""
    known = frame.depth > 0
    inverse = np.divide(1, frame.depth, out=np.zeros_like(frame.depth), where=known)
    low, high = np.quantile(inverse[known], (0.02, 0.98))
    grey = _FAR + (_NEAR - _FAR) * ((inverse - low) / max(high - low, 1e-12)).clip(0, 1)
    shades = np.repeat(np.rint(grey * known).astype(np.uint8)[..., None], 4, axis=2)
    shades[..., 3] = known * np.uint8(255)
    return shades
