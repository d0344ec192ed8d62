"""The commands of `pointshade`."""

from __future__ import annotations
