"""Pairs depth images with colour images: by name, by number, by time stamp, or by order."""

from __future__ import annotations

from operator import attrgetter
from pathlib import Path

import numpy as np

from ...notes.notes import Note
from ..access.file_name_patterns import VIDEO_SUFFIXES
from ..access.folder_listing import Item


def find_partners(folder: Path, depths: list[Item], colors: list[Item], note: Note) -> list[Item | None]:
    """For each depth picture its colour picture, None where there is none."""
    if colors[0].suffix in VIDEO_SUFFIXES:
        return [colors[0]] * len(depths)
    if len(depths) == len(colors) == 1:
        return [colors[0]]
    enough = min(len(depths), len(colors)) / 2
    if len(depths) > 1 and len({item.numbers[-1:] for item in depths}) == 1:  # r_0_depth_0001.png, r_1_depth_0001.png
        named = {item.numbers: item for item in colors}
        partners = [named.get(item.numbers[:-1]) for item in depths]
        if all(partners):
            return partners
    for same in (attrgetter("key"), attrgetter("numbers"), lambda item: item.numbers[-1:]):
        named = {same(item): item for item in colors if same(item)}
        if len({same(item) for item in depths}) < len(depths):
            continue
        partners = [named.get(same(item)) for item in depths]
        if len(depths) - partners.count(None) > enough and len(named) == len(colors):
            return partners
    times, color_times = ([item.time for item in items if item.time is not None] for items in (depths, colors))
    if len(times) == len(depths) and len(color_times) == len(colors):
        near = nearest(np.array(times), np.array(color_times))
        apart = np.abs(np.array(color_times)[near] - times)
        close = apart <= (np.median(np.abs(np.diff(times))) if len(times) > 1 else np.inf)
        if close.any():
            widest = apart[close].max()
            note(f"{folder}: depth and colour are paired by the nearest time stamp, up to {widest:.3g} apart")
            return [colors[i] if good else None for i, good in zip(near, close, strict=True)]
    if len(depths) == 1:
        return [colors[0]]
    if len(depths) != len(colors):
        raise ValueError(
            f"{folder} has {len(depths)} depth and {len(colors)} colour pictures whose names do not show which belong "
            "together: give the two of a frame the same name"
        )
    note(f"{folder}: depth and colour are paired by order, their names do not match")
    return list(colors)


def nearest(wanted: np.ndarray, offered: np.ndarray) -> np.ndarray:
    """(n,) for each of n time stamps the index of the nearest of the m offered ones."""
    order = np.argsort(offered, kind="stable")
    right = np.searchsorted(offered[order], wanted).clip(1, len(offered) - 1) if len(offered) > 1 else np.zeros(1, int)
    left = np.maximum(right - 1, 0)
    is_left = np.abs(offered[order][left] - wanted) <= np.abs(offered[order][right] - wanted)
    return order[np.where(is_left, left, right)]
