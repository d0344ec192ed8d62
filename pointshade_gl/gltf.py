"""The module `pointshade_gl.files.gltf` under its public name."""

import sys

from .files import gltf
from .files.gltf import load_scene as load_scene
from .files.gltf import save_scene as save_scene  # both for type checkers, which do not see the next line

sys.modules[__name__] = gltf
