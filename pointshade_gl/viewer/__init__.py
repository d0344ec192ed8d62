"""The interactive demo: a window in which the light follows the mouse."""

from .canvas import CanvasViewer
from .events import Event
from .viewer import Viewer

__all__ = ["CanvasViewer", "Event", "Viewer"]
