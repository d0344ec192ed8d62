"""Makes the small truth of the tests from what make_truth.py wrote at three times their size:

    python -m tests.truth.make_truth DIR --seed 5 --size 600x450 --lit 0,5,15,30
    python -m tests.truth.keep DIR

A frame holds the middle one of each 3x3 pixels. Pictures stay large; their alpha says what may be asked of the frame.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

import pointshade_gl as ps
from pointshade_gl.bench.tracing import encode

from .compare import reached
from .files import Truth, View
from .kept import FINE, FOLDER, PICTURES, UNASKED
from .measures import grown, seen_by_frame
from .shell import shaded_by_shell


def main() -> None:
    FOLDER.mkdir(exist_ok=True)
    for scene, wanted in PICTURES.items():
        fine = Truth(Path(sys.argv[1]) / f"{scene}.npz")
        coarse = Truth(fine.path, FINE)
        keep_frames(coarse)
        for name in wanted:
            lamp, yaw = name.split("_")
            keep = kept_albedo if lamp == "albedo" else kept_picture
            picture = keep(fine, coarse, lamp, int(yaw))
            ps.save_image(FOLDER / f"{scene}_{name}.png", picture)


def keep_frames(truth: Truth) -> None:
    """What the sheet feeds: the frame, and a second one from 30 degrees."""
    second = truth.view(30)
    depths = {"depth": truth.source.depth, "depth_30": second.depth}
    albedos = {"albedo": truth.source.albedo, "albedo_30": second.albedo}
    about = {"about": truth.about}
    np.savez_compressed(FOLDER / f"{truth.name}.npz", **depths, **albedos, **about)


def kept_picture(fine: Truth, coarse: Truth, name: str, yaw: int) -> np.ndarray:
    """(h, w, 4) uint8: the traced picture; alpha 0 is empty, UNASKED what the frame did not see or cannot shade."""
    lamp = next(lamp for lamp in fine.lamps if lamp.name == name)
    view, light = fine.view(yaw), fine.light(lamp, yaw)
    seen = seen_by_frame(coarse, view)
    dark = seen & reached(lamp, view) & (light.max(-1) == 0)
    through = dark.copy()
    through[dark] = ~shaded_by_shell(coarse, lamp, view.points[dark])
    return with_alpha(np.rint(encode(np.clip(light, 0, 1))), view, opened(~seen) | opened(through))


def kept_albedo(fine: Truth, coarse: Truth, _: str, yaw: int) -> np.ndarray:
    """The same without light."""
    view = fine.view(yaw)
    return with_alpha(view.albedo, view, opened(~seen_by_frame(coarse, view)))


def with_alpha(colour: np.ndarray, view: View, unasked: np.ndarray) -> np.ndarray:
    hit = view.depth > 0
    return np.dstack([colour * hit[..., None], np.where(unasked, UNASKED, 255) * hit]).astype(np.uint8)


def opened(mask: np.ndarray) -> np.ndarray:
    """The mask without what is narrower than a pixel of the frame."""
    by = FINE // 2
    return grown(~grown(~mask, by), by)


if __name__ == "__main__":
    main()
