"""What a window shows: a frame, several views of one thing, or a scene; and whose camera looks."""

from __future__ import annotations

from ..scene.camera import Camera
from ..scene.frame import Frame
from ..scene.graph import Scene
from .views import Views

Shown = Frame | Scene | Views


def home_of(shown: Shown) -> Frame | Scene:
    """Whose camera looks."""
    return shown.home if isinstance(shown, Views) else shown


def camera_of(shown: Shown) -> Camera:
    """Its own camera, in its own size."""
    home = home_of(shown)
    camera = home.picture_camera if isinstance(home, Frame) else home.camera
    assert camera is not None  # `framed` gave scenes a camera
    return camera
