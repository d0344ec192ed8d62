"""Long work: many outputs, each a job of its own, drawn by worker processes; what is done is kept in a manifest."""

from .map import map
from .ray_data import Stage

__all__ = ["Stage", "map"]
