"""The normals of a point cloud for those who read them: estimated where the cloud has none, and turned outwards."""

from __future__ import annotations

import moderngl
import numpy as np

from ..estimation.cloud_estimates import facing, outward
from ..gpu.clouds.cloud_store import CloudNormals, planes_of_slabs
from ..notes.notes import print_note
from ..notes.words import option
from ..scene.cloud import PointCloud


def read_cloud_normals(context: moderngl.Context, cloud: PointCloud, noise: float | None = None) -> CloudNormals:
    """Return what is known of each point. The cloud's own normals stay as they are, at unit length.

    Others point to `seen_from`; without one to where the surface is seen from outside, and those of a sheet up.
    """
    found = planes_of_slabs(context, cloud.positions, cloud.normals, noise)
    given = np.zeros(len(cloud), np.bool_)
    if cloud.normals is not None:
        given = np.any(cloud.normals, axis=1)
    if cloud.confidence is not None:
        found = found._replace(confidence=np.where(given, cloud.confidence, found.confidence))
    if given.all():
        return found
    if cloud.seen_from is not None:
        normals = facing(cloud.positions, found.normals, cloud.seen_from)
    else:
        normals, is_sheet = outward(cloud.positions, found.normals, cloud.up_direction)
        if is_sheet:
            print_note(
                f"the cloud is an open sheet, which has no outside: its normals point up ({option('up')} is {cloud.up})"
            )
    return found._replace(normals=np.where(given[:, None], found.normals, normals))
