"""`pointshade normals`: writes the normals of a frame, or of each frame of a sequence."""

from __future__ import annotations

from ...files.access.known_names import first_of, is_numbered
from ...notes.words import option
from ...scene.viewpoint import View
from ..inputs import load
from ..look_options import NormalOptions
from ..options import Axes, Bits, Device, Explain, FrameOptions, NormalsOutput, Overwrite, Quiet, spread


@spread
def normals(
    output: NormalsOutput,
    frame: FrameOptions,
    options: NormalOptions,
    axes: Axes = None,
    bits: Bits = 8,
    explain: Explain = False,
    overwrite: Overwrite = False,
    device: Device = 0,
    quiet: Quiet = False,
) -> None:
    """Estimate normals: .npy and .exr get floats, a picture shows them in the usual colours.

    Of a point cloud, write a .ply of its points with normals, turned outwards, or the normals alone to an .npy.
    Write all frames of a sequence to numbered files such as %04d.png.
    """
    from ...files.frame_sources import is_cloud
    from ...files.writing.maps_and_points import check_normals_path
    from ..written_clouds import check_cloud_output, write_cloud
    from ..written_maps import write_normals

    if is_cloud(frame.input):
        check_cloud_output(output, axes)
        if bits != 8:
            raise ValueError(f"{option('bits')} is of pictures, and {frame.input} is a point cloud: leave it out")
        write_cloud(load(frame, scene=True), options.look(), output, axes, device)
        return
    check_normals_path(first_of(output), axes, bits)
    view = View(look=options.look())
    write_normals(load(frame, sequence=is_numbered(output)), view, output, axes, bits, explain, device)
