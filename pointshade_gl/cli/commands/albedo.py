"""`pointshade albedo`: writes what several photographs of one view, each under its own light, have in common."""

from __future__ import annotations

import time

from ...files.pictures.picture_files import check_writable, save_image
from ..options import AlbedoOutput, Device, Explain, FrameOptions, Overwrite, Quiet, spread
from ..output import open_renderer, report
from ..photographs import albedo_of, load_photographs


@spread
def albedo(
    output: AlbedoOutput,
    frame: FrameOptions,
    explain: Explain = False,
    overwrite: Overwrite = False,
    device: Device = 0,
    quiet: Quiet = False,
) -> None:
    """Write the albedo that several photographs of one view share, each taken under its own light.

    INPUT is a folder with a sequence: one camera at one place, things at rest, only the light moves.
    """
    check_writable(output)
    photos = load_photographs(frame)
    with open_renderer(device, output) as renderer:
        start = time.perf_counter()
        image = albedo_of(renderer, photos, explain)
        spent = time.perf_counter() - start
        save_image(output, image)
        report(output, f"{image.shape[1]}x{image.shape[0]} pixels of {len(photos)} photographs", renderer, spent)
