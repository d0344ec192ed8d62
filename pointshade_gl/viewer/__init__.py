"""The interactive demo: a window in which the light follows the mouse."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .events import Event
    from .viewer import Viewer

__all__ = ["Event", "Viewer"]


def __getattr__(name: str) -> Any:
    """A page needs the viewer's arithmetic, but no window: that is imported when it is first used."""
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module({"Event": ".events", "Viewer": ".viewer"}[name], __name__), name)
