"""The module `pointshade_gl.files.frame_sources` under its public name."""

import sys

from .files import frame_sources as sources

sys.modules[__name__] = sources
