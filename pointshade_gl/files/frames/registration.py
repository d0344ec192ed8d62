"""Whether colour and depth show the same: edges of both lie on each other, neither shifted, mirrored nor turned."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...scene.values import median, quantile

_WIDTH = 160  # pixels to which both are reduced
_REACH = 10  # pixels of those in each direction that are searched
_STEP = 0.06  # change of log z that is a step
_FEW = 150  # steps that are too few to decide
_CLEAR = 3.3  # how far the best shift must stand out from all others, in their standard deviations
_FITS = 3.0  # the same of one that is none: of 193 frames, mirrored or turned, none had more than 2.6
_BETTER = 1.15  # how much better it must be than none
_NEAR = 2  # pixels: no shift

Map = NDArray[np.float64]  # (height, _WIDTH)
_TURNS = {  # with the signs of the steps through rows and columns
    "": (1, 1),
    "mirrored left to right": (1, -1),
    "mirrored top to bottom": (-1, 1),
    "turned by 180 degrees": (-1, -1),
}
# Of 193 frames, wrong turns that were better than the right one stood out by up to 3.8, and by up to 2.7 more than it.
# Of frames that were mirrored, 95 % pass both limits.
_SURE, _SURER = 7.0, 4.0  # how far a turn stands out from all shifts, and by how much further than none
_SOME = 7  # one of so many shifts is looked at to see what is usual
_CREASE, _SPAN = 0.02, 3  # a bend of 1/z, as a share of it, over so many pixels on both sides


class Registration(NamedTuple):
    """How colours lie on a depth picture: shifted by so many of its pixels, or one of `_TURNS`."""

    is_clear: bool  # False: there are too few edges to tell
    shift: tuple[int, int] = (0, 0)  # right and down
    turn: str = ""

    @property
    def doubt(self) -> str:
        """What does not fit, in a sentence; "" if nothing."""
        x, y = self.shift
        where = [f"{abs(x)} pixels to the {'right' if x > 0 else 'left'}"] if x else []
        where += [f"{abs(y)} pixels {'down' if y > 0 else 'up'}"] if y else []
        if where:
            what = f"the colours look shifted by {' and '.join(where)} of the depth picture"
            return f"{what}: the two may not be registered"
        way_out = "by the edges of both: turn one of the two files"
        return f"the colours look {self.turn} against the depth, {way_out}" if self.turn else ""


def compare(color: NDArray[np.uint8], depth: NDArray[np.float32]) -> Registration:
    """Find how colours (h, w, 3|4) lie on depth (h, w). A scene without clear edges is not judged."""
    height = round(_WIDTH * depth.shape[0] / depth.shape[1])
    if min(height, _WIDTH) < 4 * _REACH:
        return Registration(False)
    z, edges = _reduced(depth, height), _color_edges(color, height)
    with np.errstate(divide="ignore", invalid="ignore"):
        steps = (_changes(np.log(z)) > _STEP).astype(np.float64)
    shift, is_clear = _find_shift(steps, edges)
    if is_clear and shift == (0, 0):
        return Registration(True)
    turn = _find_turn(edges, [steps, _creases(z)])
    if turn or not is_clear:
        return Registration(turn is not None, turn=turn or "")
    x, y = (round(part * depth.shape[1] / _WIDTH) for part in shift)
    return Registration(True, (x, y))


def _find_shift(steps: Map, edges: Map) -> tuple[tuple[int, int], bool]:
    """Return by how many pixels the edges are shifted right and down, and whether that is clear."""
    steps = steps.copy()
    steps[:_REACH] = steps[-_REACH:] = steps[:, :_REACH] = steps[:, -_REACH:] = 0
    if np.count_nonzero(steps) < _FEW or not edges.any():
        return (0, 0), False
    # the cross-correlation of both pictures' edges has a clear maximum where they fit
    found = _around(np.fft.irfft2(np.fft.rfft2(edges) * np.conj(np.fft.rfft2(steps)), s=steps.shape), _REACH)
    usual = median(found)
    above, spread = found.max() - usual, 1.48 * median(abs(found - usual))
    row, column = np.unravel_index(found.argmax(), found.shape)
    y, x = int(row) - _REACH, int(column) - _REACH
    if max(abs(x), abs(y)) <= _NEAR:
        return (0, 0), bool(above > _FITS * spread)
    here = found[_REACH - _NEAR : _REACH + _NEAR + 1, _REACH - _NEAR : _REACH + _NEAR + 1].max()
    is_clear = above > _CLEAR * spread and found.max() > _BETTER * here and max(abs(x), abs(y)) < _REACH
    return (x, y), bool(is_clear)


def _find_turn(edges: Map, maps: list[Map]) -> str | None:
    """Return the turn of colours by which their edges lie on those of the depth, "" if they do as they are.

    None if that is unclear.
    """
    color = np.fft.rfft2(_detail(edges))
    score = dict.fromkeys(_TURNS, 0.0)
    for one in maps:
        if np.count_nonzero(one) < _FEW:
            continue
        depth = _detail(one)
        for name, (down, along) in _TURNS.items():
            found = np.fft.irfft2(color * np.conj(np.fft.rfft2(depth[::down, ::along])), s=depth.shape)
            some = found.ravel()[::_SOME]
            usual = median(some)
            score[name] += (_around(found, _NEAR).max() - usual) / (1.48 * median(abs(some - usual)) + 1e-12)
    best = max(score, key=score.__getitem__)
    if score[best] < _SURE or (best and score[best] < score[""] + _SURER):
        return None
    return best


def _around(found: Map, reach: int) -> Map:
    """Return the correlations of shifts up to so many pixels, the smallest first."""
    return np.roll(found, (reach, reach), (0, 1))[: 2 * reach + 1, : 2 * reach + 1]


def _detail(edges: Map) -> Map:
    """Return edges a little blurred, and without what is spread over their surroundings: a texture is everywhere."""
    from PIL import Image

    height, width = edges.shape
    wide = np.pad(edges, 1, mode="edge")
    rows = wide[:-2] + wide[1:-1] + wide[2:]
    image = Image.fromarray((rows[:, :-2] + rows[:, 1:-1] + rows[:, 2:]).astype(np.float32))
    coarse = image.resize((width // 12, height // 12), Image.Resampling.BOX)
    detail = np.asarray(image, np.float64) - np.asarray(coarse.resize((width, height), Image.Resampling.BILINEAR))
    return detail - detail.mean()


def _reduced(depth: NDArray[np.float32], height: int) -> NDArray[np.float32]:
    """Return the depth of some pixels."""
    sizes = zip((height, _WIDTH), depth.shape, strict=True)
    rows, columns = (((np.arange(n) + 0.5) * size / n).astype(int) for n, size in sizes)
    return depth[np.ix_(rows, columns)]


def _creases(z: NDArray[np.float32]) -> Map:
    """Return how sharply 1/z bends, from 0 to 1; 0 beside missing depth."""
    result = np.zeros(z.shape)
    with np.errstate(divide="ignore", invalid="ignore"):
        inverse = 1 / np.where(z > 0, z, np.nan).astype(np.float64)
        for own, found in ((inverse, result), (inverse.T, result.T)):
            middle = own[_SPAN:-_SPAN]
            bend = np.abs(own[: -2 * _SPAN] - 2 * middle + own[2 * _SPAN :]) / middle
            found[_SPAN:-_SPAN] = np.maximum(found[_SPAN:-_SPAN], np.nan_to_num(bend))
    return np.minimum(result / _CREASE, 1)


def _color_edges(color: NDArray[np.uint8], height: int) -> Map:
    """Return changes of brightness; the strongest 5 % count alike."""
    from PIL import Image

    image = Image.fromarray(np.ascontiguousarray(color[..., :3]))
    image = image.reduce(max(1, min(image.width // _WIDTH, image.height // height))).convert("L")
    edges = _changes(np.asarray(image.resize((_WIDTH, height), Image.Resampling.BOX), np.float64))
    return np.minimum(edges, quantile(edges, 0.95))


def _changes(values: NDArray[np.floating]) -> Map:
    """Return the largest difference to one of four neighbours; 0 beside what is not finite."""
    result = np.zeros(values.shape)
    for own, found in ((values, result), (values.T, result.T)):
        change = np.nan_to_num(abs(np.diff(own, axis=0)), nan=0.0, posinf=0.0)
        found[1:] = np.maximum(found[1:], change)
        found[:-1] = np.maximum(found[:-1], change)
    return result
