"""Finds out which files of a folder belong together."""

from __future__ import annotations
