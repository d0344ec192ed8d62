"""`pointshade depth`: writes the depth of the picture that render draws."""

from __future__ import annotations

from ...files.access.known_names import first_of, is_numbered
from ...scene.graph import Scene
from ..inputs import as_scene, check_look, load
from ..look_options import NormalOptions
from ..options import DepthOutput, Device, FrameOptions, Overwrite, Quiet, ViewOptions, spread


@spread
def depth(
    output: DepthOutput,
    frame: FrameOptions,
    options: NormalOptions,
    place: ViewOptions,
    overwrite: Overwrite = False,
    device: Device = 0,
    quiet: Quiet = False,
) -> None:
    """Write the depth of the picture that render draws: metres to .exr, .tif and .npy, millimetres to .png.

    Write all frames of a sequence to numbered files such as %04d.png. Missing depth is 0.
    """
    from ...files.writing.maps_and_points import check_depth_path
    from ..written_maps import write_depth

    check_depth_path(first_of(output))
    view = place.view(options.look())
    source = as_scene(load(frame, sequence=is_numbered(output), scene=True), view.look, NormalOptions().look())
    if isinstance(source, Scene):
        check_look(view.look)
    write_depth(source, view, output, device)
