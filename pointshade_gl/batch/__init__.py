"""Long work: many outputs, each a job of its own, drawn by worker processes; what is done is kept in a manifest."""

from .map import Stage, map

__all__ = ["Stage", "map"]
