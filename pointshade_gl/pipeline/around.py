"""Finds what is around the objects of a picture: its environment, which way is up in it, and whether things hide it."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import cast

import numpy as np

from ..scene.appearance import Material
from ..scene.environment import FAR_AS_SEEN, Environment, Row, Surroundings
from ..scene.frame import Frame
from ..scene.graph import Scene
from ..scene.light import Light, unit
from ..scene.settings import Finish

AS_IN_GLTF = np.diag([1.0, -1, -1, 1])  # pose of who looks along -z: a scene's own environment has the world's axes
Upright = Callable[[Frame | Scene], tuple[np.ndarray, bool]]
MUCH = 0.1  # share of the light that comes from all around, above which it is worth looking at what hides it


def surroundings_of(
    finish: Finish, source: Frame | Scene, scene: Scene, lights: Sequence[Light], materials: Sequence[Material],
    upright: Upright,
) -> Surroundings:  # fmt: skip
    """Return what is around a scene.

    source   of which the scene was made, which tells where up is
    upright  finds where, as `up_and_floor` does
    """
    environment = cast("Environment | None", finish.environment) or scene.environment
    wanted = finish.ambient_occlusion
    if wanted is None:
        wanted = environment is not None or any(_comes_from_around(scene, lights, one) for one in materials)
    occlusion = FAR_AS_SEEN if wanted is True else float(wanted)
    on_ground = finish.ground is not False
    if environment is None:
        return Surroundings(occlusion, on_ground=on_ground)
    if finish.up is not None:
        up, has_floor = np.array(finish.up), True
    else:
        up, has_floor = upright(source)
    floor = _row(up) if has_floor or on_ground else None
    rotation = cast("float | tuple[Row, Row, Row]", finish.environment_rotation)
    facing = AS_IN_GLTF if environment is scene.environment else np.asarray(scene.pose)
    to_sky = rotation if isinstance(rotation, tuple) else standing(up, rotation, facing)
    return Surroundings(occlusion, environment, finish.environment_intensity, to_sky, floor, on_ground)


def standing(up: np.ndarray, degrees: float, pose: np.ndarray) -> tuple[Row, Row, Row]:
    """Return the rotation (3, 3) from world axes to those of an environment that stands upright.

    up       (3,) unit, world
    degrees  by which it is turned about up, counterclockwise seen from above
    pose     (4, 4) of the scene's own camera, which looks along -z of an environment that is not turned
    """
    back = -pose[:3, 2] + up * (pose[:3, 2] @ up)
    if np.linalg.norm(back) < 1e-6:
        back = pose[:3, 1] - up * (pose[:3, 1] @ up)
    z = unit(back)
    x = np.cross(up, z)
    sine, cosine = math.sin(math.radians(degrees)), math.cos(math.radians(degrees))
    return _row(cosine * x - sine * z), _row(up), _row(sine * x + cosine * z)


def _comes_from_around(scene: Scene, lights: Sequence[Light], material: Material) -> bool:
    ambient = material.ambient * max(scene.ambient)
    direct = material.diffuse * sum(_arriving(light, scene) for light in lights)
    return ambient > MUCH * (ambient + direct) * (1 + 1e-6)


def _arriving(light: Light, scene: Scene) -> float:
    """Return how much of a light arrives in the middle of a scene."""
    strength = light.intensity * max(light.color)
    if light.position is None:
        return strength
    constant, linear, quadratic = light.attenuation
    if linear == quadratic == 0:  # the middle of a new frame is not found for nothing
        return strength / max(constant, 1e-9)
    distance = float(np.linalg.norm(scene.bounds[0] - light.position))
    return strength / max(constant + linear * distance + quadratic * distance * distance, 1e-9)


def _row(vector: np.ndarray) -> Row:
    x, y, z = np.asarray(vector, np.float64).tolist()
    return x, y, z
