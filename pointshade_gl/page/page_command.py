"""What a page knows about the command line that makes the pictures which it shows; command.js says the rest."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..renderer.requests import RenderRequest, Scenes
from ..scene.appearance import Look
from ..scene.cloud import PointCloud
from ..scene.frame import Frame
from ..scene.graph import Scene

CLOSE = 1e-3  # pixels: a camera that differs by less is the same


def command_of(request: RenderRequest, line: str | None) -> dict[str, Any] | None:
    """Return it for the JSON; None without a line, and where no `--picture-size` leads to the camera of the page.

    line  `pointshade render ...`, without lights, shading, view, size and samples

    Of what it gives, isOwn says that the page's home is where the line looks from without `--pose`; turns, that the
    page turns around the same point as `--yaw`.
    """
    scene, is_scene = Scenes().of(request), isinstance(request.source, Scene | PointCloud)
    camera, seen = request.seen_by(scene)
    assert scene.camera is not None, "scenes of requests have one"
    own = scene.camera
    if line is None or not np.allclose(camera.fitted(own.width, own.height).intrinsics, own.intrinsics, 0, CLOSE):
        return None
    own_pose = np.asarray(scene.pose if is_scene else scene.things[0].content.frame.pose)
    home = seen if is_scene or request.pose is not None else own_pose
    is_own = bool(np.allclose(home, own_pose, 0, 1e-12))
    return {
        "line": line,
        "shading": Look().shading,
        "isScene": is_scene,
        "isOwn": is_own,
        "turns": is_own and isinstance(request.source, Frame),
        "home": home.tolist(),
    }
