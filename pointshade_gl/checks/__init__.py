"""Checks of what callers pass: arguments, and arrays of other libraries."""

from __future__ import annotations
