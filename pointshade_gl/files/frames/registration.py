"""Checks whether colour and depth are aligned: steps in depth should lie on edges in the colours."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...notes.notes import Note
from ...scene.frame import Frame
from ...scene.values import median, quantile

_WIDTH = 160  # pixels to which both are reduced
_REACH = 10  # pixels of those in each direction that are searched
_STEP = 0.06  # change of log z that is a step
_FEW = 150  # steps that are too few to tell
_CLEAR = 3.3  # how far the best shift must stand out from all others, in their standard deviations
_BETTER = 1.15  # how much better it must be than none
_NEAR = 2  # pixels: no shift


def check_registration(frame: Frame, note: Note) -> None:
    """Print a note if the colours look shifted against the depth. A scene without clear edges passes."""
    shift = find_shift(frame)
    if shift:
        x, y = (round(part * frame.depth.shape[1] / _WIDTH) for part in shift)
        where = [f"{abs(x)} pixels to the {'right' if x > 0 else 'left'}"] if x else []
        where += [f"{abs(y)} pixels {'down' if y > 0 else 'up'}"] if y else []
        note(f"the colours look shifted by {' and '.join(where)} of the depth picture: the two may not be registered")


def find_shift(frame: Frame) -> tuple[int, int] | None:
    """Return by how many reduced pixels the colours are shifted right and down; None if they fit or show too few edges.

    The cross-correlation of both pictures' edges has a clear maximum where they fit.
    """
    height = round(_WIDTH * frame.depth.shape[0] / frame.depth.shape[1])
    if frame.color is None or min(height, _WIDTH) < 4 * _REACH:
        return None
    steps, edges = _depth_steps(frame.depth, height), _color_edges(frame.color, height)
    steps[:_REACH] = steps[-_REACH:] = steps[:, :_REACH] = steps[:, -_REACH:] = 0
    if np.count_nonzero(steps) < _FEW or not edges.any():
        return None
    product = np.fft.irfft2(np.fft.rfft2(edges) * np.conj(np.fft.rfft2(steps)), s=steps.shape)
    found = np.roll(product, (_REACH, _REACH), (0, 1))[: 2 * _REACH + 1, : 2 * _REACH + 1]
    usual = median(found)
    spread = 1.48 * median(abs(found - usual))
    row, column = np.unravel_index(found.argmax(), found.shape)
    y, x = int(row) - _REACH, int(column) - _REACH
    here = found[_REACH - _NEAR : _REACH + _NEAR + 1, _REACH - _NEAR : _REACH + _NEAR + 1].max()
    if max(abs(x), abs(y)) <= _NEAR or max(abs(x), abs(y)) == _REACH:
        return None
    is_clear = found.max() - usual > _CLEAR * spread and found.max() > _BETTER * here
    return (x, y) if is_clear else None


def _depth_steps(depth: NDArray[np.float32], height: int) -> NDArray[np.float64]:
    """(height, _WIDTH) 1 beside a step between two known depths."""
    sizes = zip((height, _WIDTH), depth.shape, strict=True)
    rows, columns = (((np.arange(n) + 0.5) * size / n).astype(int) for n, size in sizes)
    z = depth[np.ix_(rows, columns)]
    with np.errstate(divide="ignore", invalid="ignore"):
        return (_changes(np.log(z)) > _STEP).astype(np.float64)


def _color_edges(color: NDArray[np.uint8], height: int) -> NDArray[np.float64]:
    """(height, _WIDTH) changes of brightness; the strongest 5 % count alike."""
    from PIL import Image

    grey = Image.fromarray(np.ascontiguousarray(color[..., :3])).convert("L")
    edges = _changes(np.asarray(grey.resize((_WIDTH, height), Image.Resampling.BOX), np.float64))
    return np.minimum(edges, quantile(edges, 0.95))


def _changes(values: NDArray[np.floating]) -> NDArray[np.float64]:
    """The largest difference to one of four neighbours; 0 beside what is not finite."""
    result = np.zeros(values.shape)
    for axis in (0, 1):
        change = np.nan_to_num(abs(np.diff(values, axis=axis)), nan=0.0, posinf=0.0)
        first, last = [(0, 0), (0, 0)], [(0, 0), (0, 0)]
        first[axis], last[axis] = (1, 0), (0, 1)
        result = np.maximum(result, np.maximum(np.pad(change, first), np.pad(change, last)))
    return result
