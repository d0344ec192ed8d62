"""Finds frames whose depth contradicts that of the other frames of the same object: their poses are wrong."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from .multi_view import NARROWEST, SPREADS, Comparison

# Two frames contradict each other if more than this share of their points does: between these two, and so many times
# the usual share of the set, which noise raises
LEAST, MOST, USUAL = 0.1, 0.5, 2.0
CLEARLY = 0.3  # with fewer, something may have moved; then a wrong pose shows in the spread of all other points, too
Pair = tuple[int, int]


class Contradictions(NamedTuple):
    """Which frames' depths contradict those of others, where both see the same."""

    frames: frozenset[int]  # that fit none of the others, of which more fit each other
    undecided: bool  # whether others contradict each other, and nobody knows which are wrong


def contradictions(comparisons: Mapping[Pair, Comparison], count: int) -> Contradictions:
    """Find the frames with wrong poses, from comparisons of pairs (i, j).

    Frames that agree form groups. A frame is wrong if it contradicts a group with more members than contradict that
    group.
    """
    contradicts = _contradicts(comparisons)
    group_of = _groups([pair for pair, is_off in contradicts.items() if not is_off], count)
    against = [(i, j) for (i, j), is_off in contradicts.items() if is_off and group_of[i] is not group_of[j]]
    wrong: set[int] = set()
    for group in group_of:
        opponents = {other for i, j in against for one, other in ((i, j), (j, i)) if one in group}
        wrong |= opponents if len(group) > len(opponents) else set()
    return Contradictions(frozenset(wrong), any(i not in wrong and j not in wrong for i, j in against))


def _contradicts(comparisons: Mapping[Pair, Comparison]) -> dict[Pair, bool]:
    """Return, for each pair of frames that see the same, whether they contradict each other."""
    both_ways: dict[Pair, list[Comparison]] = {}
    for (i, j), one in comparisons.items():
        both_ways.setdefault((min(i, j), max(i, j)), []).append(one)
    known = {pair: ways for pair, ways in both_ways.items() if np.isfinite([one.apart for one in ways]).any()}
    if not known:
        return {}
    # what lies nearer than a frame expects hides the rest from it: only the other frame can tell
    aparts = np.array([np.nanmax([one.apart for one in ways]) for ways in known.values()])
    spreads = np.array([min(one.spread for one in ways) for ways in known.values()])
    is_apart = aparts > np.clip(USUAL * np.quantile(aparts, 0.25, method="lower"), LEAST, MOST)
    is_spread = spreads > USUAL * max(np.quantile(spreads, 0.25, method="lower"), NARROWEST / SPREADS)
    return dict(zip(known, (is_apart & (is_spread | (aparts > CLEARLY))).tolist(), strict=True))


def _groups(pairs: Sequence[Pair], count: int) -> list[set[int]]:
    """Return for each frame the set of frames that pairs connect it with, itself included."""
    group_of = [{k} for k in range(count)]
    for i, j in pairs:
        if group_of[i] is not group_of[j]:
            joined = group_of[i] | group_of[j]
            for k in joined:
                group_of[k] = joined
    return group_of
