"""Limits how much memory a file may ask for. Every limit follows from one number of pixels, the option `max_pixels`.

A picture or array may have `max_pixels` pixels, and a few bytes of file can ask for that many: a PNG packs 500 to one.
So the size that a header declares is checked before anything is decoded.
"""

from __future__ import annotations

import math

from ...notes.words import option

MAX_PIXELS = 2**27  # 134 million; a frame of 12 288 x 8 192 pixels has 101 million
LONGEST_SIDE = 2**16  # pixels; graphics cards take up to 2**14 or 2**15
FOLDER_FILES = 200_000  # files and folders of one folder that are looked at
_ENDLESS = 10**18

# Other limits for each pixel of that number: they rise with it, and never fall below what the default gives.
FILE_BYTES = 16  # bytes of a picture, an array or a buffer: four channels of 32 bits (2 GiB)
TEXT_BYTES = 1 / 16  # bytes of a text file of numbers or names (8 MiB)
PICTURE_TEXT = 1 / 4  # bytes of a picture whose values are written as text (32 MiB)
JSON_VALUES = 1 / 32  # values in a JSON file (4 million); texts in it may be long
CLOUD_TEXT = 1  # bytes of a point cloud that is written as text (128 MiB)
SCENE_TEXT = 1  # bytes of a .gltf file, which may hold its buffers as text (128 MiB)
SCENE_BYTES = 4  # bytes of a .glb file and of each buffer (512 MiB)
SCENE_CORNERS = 1 / 4  # corners, normals, texture coordinates and indices of all meshes of a scene (34 million)
SCENE_PIXELS = 4  # pixels of all textures and frames of a scene (537 million)
SCENE_FRAMES = 2**-19  # frames of a scene (256)
PARTS = 1 / 1024  # lines of a list of pictures, nodes of a scene (131 072)


def check_limit(amount: int, what: str, max_pixels: float, share: float | None = None) -> None:
    """Raises ValueError, naming `max_pixels`, if the amount is larger.

    what   the sentence that says how much it is, such as "a.png has 9x9 pixels"
    share  for anything but pixels: the limit is this share of `max_pixels`, or of the default if that is larger
    """
    limit = max_pixels if share is None else max(max_pixels, MAX_PIXELS) * share
    if amount > limit:
        raised = option("max_pixels", math.ceil(min(amount, _ENDLESS) / (share or 1)), beside_file=True)
        raise ValueError(f"{what}, the limit is {limit:.0f}: pass {raised} to allow it")


def check_pixels(width: int, height: int, name: str, max_pixels: float) -> None:
    """Raises ValueError if a picture of this size has more pixels than the limit, or a longer side than any has."""
    if max(width, height) > LONGEST_SIDE:
        raise ValueError(f"{name} has {width}x{height} pixels, the limit for a side is {LONGEST_SIDE}")
    check_limit(width * height, f"{name} has {width}x{height} pixels", max_pixels)
