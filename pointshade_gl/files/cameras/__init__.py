"""Reads camera intrinsics and poses from files of many programs."""

from __future__ import annotations
