"""Image-based lights, EXT_lights_image_based: a cube map in glTF, a picture of the whole sphere in `Environment`.

The first level of its images is read, whose light is not blurred; the others and the irradiance follow from it. Images
with alpha are RGBD, others sRGB. A light of 1 from everywhere lights a white surface white, as in viewers of glTF.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...notes.words import shown
from ...scene.environment import WIDEST, Environment, reduced
from ...scene.values import srgb_to_linear
from .buffers import Parts
from .checks import numbers, pick, telling
from .container import IMAGE_BASED
from .cube_maps import (
    BRIGHTEST,
    are_mirrored,
    face_directions,
    from_rgbd,
    irradiance_coefficients,
    rough,
    seen_in_cube,
    seen_on_sphere,
    sphere_directions,
    to_rgbd,
)
from .transforms import turn_of

_SMALLEST, _LARGEST = 16, 128  # pixels of a side of the faces that are written: of the last and of the first level
_BLURRED = 64  # columns of the picture of which the first rough level is made; half of it for the next, and so on


def read_environment(
    scene: SimpleNamespace | None, parts: Parts, factor: float, axes: NDArray[np.float64]
) -> Environment | None:
    """Return the environment of a scene of the file; None without one. Raises ValueError.

    factor  on its light
    axes    (3, 3) from the scene's world to the file's
    """
    held = (scene.extensions or {}).get(IMAGE_BASED) if scene else None
    if held is None:
        return None
    lights = (parts.gltf.extensions or {}).get(IMAGE_BASED)
    lights = lights.get("lights") if isinstance(lights, dict) else None
    index = held.get("light") if isinstance(held, dict) else None
    light = pick(lights if isinstance(lights, list) else [], index, "image-based light")
    if not isinstance(light, dict):
        raise ValueError(f"image-based light {index} must be an object, got {shown(light)}")
    with telling(f"image-based light {index}"):
        turn = turn_of(light.get("rotation", (0, 0, 0, 1)))
        intensity = numbers(light.get("intensity", 1), (), "intensity").item()
        if intensity < 0:
            raise ValueError(f"intensity must be 0 or above, got {intensity:g}")
        numbers(light.get("irradianceCoefficients", np.zeros(27)), (9, 3), "irradianceCoefficients")
        faces = _faces(light.get("specularImages"), parts)
        directions = sphere_directions(min(4 * faces.shape[1], WIDEST)) @ axes.T @ turn  # rows: the inverse turn
        return Environment(intensity * factor * seen_in_cube(faces, directions))


def _faces(levels: Any, parts: Parts) -> NDArray[np.float64]:
    """(6, n, n, 3) linear light of the first level."""
    level = levels[0] if isinstance(levels, list) and levels else None
    if not isinstance(level, list) or len(level) != 6:
        raise ValueError("specularImages must be levels of 6 images, the faces of a cube")
    pictures = [parts.picture(index) for index in level]
    sizes = {picture.shape[:2] for picture in pictures}
    if len(sizes) > 1 or len(set(*sizes)) > 1:
        found = ", ".join(f"{width}x{height}" for height, width in sorted(sizes))
        raise ValueError(f"the faces of a cube must be squares of one size, got {found}")
    faces = np.stack([_linear(picture) for picture in pictures])
    while faces.shape[1] > WIDEST // 4 and faces.shape[1] % 2 == 0:
        half = faces.shape[1] // 2
        faces = faces.reshape(6, half, 2, half, 2, 3).mean((2, 4))
    return faces[[1, 0, 2, 3, 4, 5]] if are_mirrored(faces) else faces


def _linear(picture: NDArray[np.uint8]) -> NDArray[np.float64]:
    return from_rgbd(picture) if picture.shape[2] == 4 else srgb_to_linear(picture / 255.0)


def write_environment(environment: Environment, add_image: Callable[[NDArray[np.uint8]], int]) -> dict[str, Any]:
    """Return the image-based light of an environment. add_image: writes (h, w, 4) uint8, and returns its number."""
    picture = environment.picture
    intensity = max(1.0, float(picture.max()) / BRIGHTEST)
    picture = picture / intensity
    size = 2 ** math.ceil(math.log2(min(max(picture.shape[1] / 2, _SMALLEST), _LARGEST)))
    count = int(math.log2(size / _SMALLEST)) + 1
    levels = [seen_on_sphere(picture, face_directions(size))]
    levels += [rough(reduced(picture, _BLURRED >> (k - 1)), size >> k, k / (count - 1)) for k in range(1, count)]
    return {
        "intensity": intensity,
        "irradianceCoefficients": irradiance_coefficients(picture),
        "specularImageSize": size,
        "specularImages": [[add_image(to_rgbd(face)) for face in level] for level in levels],
    }
