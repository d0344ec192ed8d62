"""The public face: the Renderer, what it is asked for, and series of pictures."""

from __future__ import annotations
