"""Whether colour and depth show the same: edges of both lie on each other, neither shifted, mirrored nor turned."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...scene.values import median, quantile

_WIDTH = 160  # pixels to which both are reduced
_REACH = 10  # pixels of those in each direction that are searched
_STEP = 0.06  # change of log z that is a step
_FEW = 150  # steps that are too few to decide
_CLEAR = 3.3  # how far the best shift must stand out from all others, in their standard deviations
_BETTER, _ALIKE = 1.15, 1.01  # how much better it must be than none, and than the farthest
_NEAR = 2  # pixels: no shift

Map = NDArray[np.float32]  # (height, _WIDTH)
_TURNS = {  # with the signs of the steps through rows and columns
    "": (1, 1),
    "mirrored left to right": (1, -1),
    "mirrored top to bottom": (-1, 1),
    "turned by 180 degrees": (-1, -1),
}
# Of 193 frames, wrong turns that were better than the right one stood out by up to 4.5, and by up to 3.0 more than it.
# Of frames that were mirrored, 95 % pass both limits.
_SURE, _SURER = 7.0, 4.0  # how far a turn stands out from all shifts, and by how much further than none
_CERTAIN = 13.0  # what stands out so far lies right: wrong turns stand out by up to 11.1
_WIDE = 6  # pixels of a surrounding, at half the size
_SOME = 3  # one of so many shifts is looked at to see what is usual
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
    steps = _steps(z)
    turn, is_certain = _find_turn(edges, [steps, _creases(z)])
    shift, is_clear = ((0, 0), False) if is_certain else _find_shift(steps, edges)
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
    found = _around(_correlated(edges, steps), _REACH)
    usual = median(found)
    above, spread = found.max() - usual, 1.48 * median(abs(found - usual))
    row, column = np.unravel_index(found.argmax(), found.shape)
    y, x = int(row) - _REACH, int(column) - _REACH
    if max(abs(x), abs(y)) <= _NEAR:
        return (0, 0), False
    here = found[_REACH - _NEAR : _REACH + _NEAR + 1, _REACH - _NEAR : _REACH + _NEAR + 1].max()
    border = max(
        found[0].max(), found[-1].max(), found[:, 0].max(), found[:, -1].max()
    )  # as high along a straight edge
    is_clear = above > _CLEAR * spread and found.max() > max(_BETTER * here, _ALIKE * border)
    return (x, y), bool(is_clear)


def _find_turn(edges: Map, maps: list[Map]) -> tuple[str | None, bool]:
    """Return the turn of colours by which their edges lie on those of the depth, "" if they do as they are. None if
    that is unclear. The second is whether nothing else is possible."""
    color, details = _detail(edges), [_detail(one) for one in maps if np.count_nonzero(one) >= _FEW]
    both = np.zeros_like(color)
    for depth in details:
        some = _correlated(color, depth).ravel()[::_SOME]  # by how much a shift stands out is the same for all turns
        both += depth / np.float32(1.48 * median(abs(some - median(some))) + 1e-12)
    score: dict[str, float] = {}
    for name, (down, along) in _TURNS.items():
        inner = both[::down, ::along][1:-1, 1:-1]
        score[name] = max(float((part * inner).sum()) for part in _moved(color))
        if score[""] > _CERTAIN:
            return "", True
    best = max(score, key=score.__getitem__)
    if score[best] < _SURE or (best and score[best] < score[""] + _SURER):
        return None, False
    return best, False


def _moved(edges: Map) -> Iterator[Map]:
    """Yield a picture without its border, moved by up to a pixel."""
    height, width = edges.shape
    for y in range(3):
        for x in range(3):
            yield edges[y : height - 2 + y, x : width - 2 + x]


def _correlated(color: Map, depth: Map) -> NDArray[np.floating]:
    """Return how well edges lie on each other for all shifts, that without one first."""
    return np.fft.irfft2(np.fft.rfft2(color) * np.conj(np.fft.rfft2(depth)), s=depth.shape)


def _around(found: Map, reach: int) -> Map:
    """Return the correlations of shifts up to so many pixels, the smallest first."""
    return np.roll(found, (reach, reach), (0, 1))[: 2 * reach + 1, : 2 * reach + 1]


def _detail(edges: Map) -> Map:
    """Return edges at half the size, without what is spread over their surroundings: a texture is everywhere."""
    from PIL import Image

    image = Image.fromarray(edges).reduce(2)
    coarse = image.resize((image.width // _WIDE, image.height // _WIDE), Image.Resampling.BOX)
    return np.asarray(image) - np.asarray(coarse.resize(image.size, Image.Resampling.BILINEAR))


def _reduced(depth: NDArray[np.float32], height: int) -> NDArray[np.float32]:
    sizes = zip((height, _WIDTH), depth.shape, strict=True)
    rows, columns = (((np.arange(n) + 0.5) * size / n).astype(int) for n, size in sizes)
    return depth[np.ix_(rows, columns)]


def _steps(z: NDArray[np.float32]) -> Map:
    """Return 1 beside a step between two known depths."""
    logs = np.log(np.where(z > 0, z, np.float32(np.nan)))
    found = np.zeros(z.shape, bool)
    for own, steps in ((logs, found), (logs.T, found.T)):
        is_step = np.abs(own[1:] - own[:-1]) > _STEP  # not where it is NaN
        steps[1:] |= is_step
        steps[:-1] |= is_step
    return found.astype(np.float32)


def _creases(z: NDArray[np.float32]) -> Map:
    """Return how sharply 1/z bends, from 0 to 1; 0 beside missing depth."""
    inverse = 1 / np.where(z > 1e-18, z, np.float32(np.nan))  # what is nearer is no depth
    result = np.zeros_like(inverse)
    for own, found in ((inverse, result), (inverse.T, result.T)):
        middle = own[_SPAN:-_SPAN]
        bend = np.abs(own[: -2 * _SPAN] + own[2 * _SPAN :] - 2 * middle) / (_CREASE * middle)
        np.fmax(found[_SPAN:-_SPAN], bend, out=found[_SPAN:-_SPAN])  # of a number and NaN the number
    return np.minimum(result, 1)


def _color_edges(color: NDArray[np.uint8], height: int) -> Map:
    """Return changes of brightness; the strongest 5 % count alike."""
    from PIL import Image

    step = max(1, color.shape[0] // (2 * height))  # two rows for each are enough
    image = Image.fromarray(np.ascontiguousarray(color[step // 2 :: step, :, :3]))
    image = image.reduce((max(1, image.width // _WIDTH), max(1, image.height // height))).convert("L")
    edges = _changes(np.asarray(image.resize((_WIDTH, height), Image.Resampling.BOX), np.float32))
    return np.minimum(edges, quantile(edges, 0.95))


def _changes(values: Map) -> Map:
    """Return the largest difference to one of four neighbours."""
    result = np.zeros_like(values)
    for own, found in ((values, result), (values.T, result.T)):
        change = np.abs(own[1:] - own[:-1])
        np.maximum(found[1:], change, out=found[1:])
        np.maximum(found[:-1], change, out=found[:-1])
    return result
