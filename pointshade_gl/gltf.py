"""The module `pointshade_gl.files.gltf` under its public name."""

import sys

from .files import gltf

sys.modules[__name__] = gltf
