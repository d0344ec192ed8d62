"""`pointshade info`: what is in a file or folder, and what draws."""

from __future__ import annotations

import json
from typing import Annotated

import typer

from ...notes.version import __version__
from ..inputs import check_frame
from ..options import Device, FrameOptions, Overwrite, Quiet, SheetOutput, spread
from ..output import open_renderer


@spread
def info(
    frame: FrameOptions,
    output: SheetOutput = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON, for programs.")] = False,
    overwrite: Overwrite = False,
    device: Device = 0,
    quiet: Quiet = False,
) -> None:
    """Print what is in a file or folder, and how it would be read; without INPUT, what draws: GL vendor, limits."""
    if frame.input or frame.depth or frame.color:
        from ...files.clouds.load_cloud import check_frame_options
        from ...files.frame_sources import is_cloud

        if is_cloud(frame.input):
            from ..cloud_report import show_cloud

            show_cloud(frame, output, as_json)
            return
        from ..input_report import show_input

        check_frame(frame)
        check_frame_options(frame.cloud_options, frame.input)
        frame.check_exist()
        show_input(frame, output, as_json, device)
        return
    if output:
        raise ValueError(f"a contact sheet shows a frame: pass INPUT, as in `pointshade info vase -o {output}`")
    with open_renderer(device) as renderer:
        limits = {"pointshade_gl": __version__, **renderer.context.limits()}
        if as_json:
            print(json.dumps({name.replace(" ", "_"): value for name, value in limits.items()}, indent=1))
        else:
            print("\n".join(f"{name:16s}{limits[name]}" for name in limits))
