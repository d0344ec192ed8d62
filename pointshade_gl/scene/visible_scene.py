"""Determines what one view of a scene needs: the objects in view, the near plane, and the objects that cast shadows."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import compress
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .appearance import NOT_LIT, Material
from .camera import Camera, Eye
from .color_scale import ColorScale
from .graph import Scene
from .light import Light, at_upper_left
from .mesh import Mesh
from .placed import Placed
from .point_object import PointObject
from .rotation import moved
from .surroundings import NOTHING_AROUND, Surroundings

Matrix = NDArray[np.float64]


class VisibleScene(NamedTuple):
    """What one picture of a scene shows, and what casts shadows in it."""

    eye: Eye
    lights: list[Light]  # each with a position or a direction, world axes
    scene: Scene
    shown: Sequence[Placed]  # in view
    casting: Sequence[Placed]  # may cast shadows; empty if no light casts any
    gain: float = 1.0  # factor on all light: the exposure
    surroundings: Surroundings = NOTHING_AROUND
    sample: int = 0  # of the picture
    scale: ColorScale | None = None  # of colours that are no light

    @property
    def materials(self) -> list[Material]:
        """The materials of all that is shown, each once; never empty."""
        contents = dict.fromkeys(p.content for p in self.shown)  # of many copies of one, one
        return list(dict.fromkeys(map(_material, contents))) or [Material()]

    @property
    def is_lit(self) -> bool:
        """Return whether light is seen on anything that is shown."""
        return any(shading_of(p) not in NOT_LIT for p in self.shown)


def shading_of(placed: Placed) -> str:
    """Return the shading model of an object."""
    content = placed.content
    return content.look.shading if isinstance(content, PointObject) else content.shading


def material_of(placed: Placed) -> Material:
    """Return the material of an object: how its surface reflects light."""
    return _material(placed.content)


def _material(content: PointObject | Mesh) -> Material:
    return content.look.material if isinstance(content, PointObject) else content.material


def compose(
    scene: Scene, lights: Sequence[Light], camera: Camera, pose: Matrix, surroundings: Surroundings = NOTHING_AROUND
) -> VisibleScene:
    """Return what a camera at a pose (4, 4) sees of a scene under these lights."""
    things = scene.things
    eye = Eye.at_distance(camera, pose, looking_distance(scene, pose))
    shown = things if is_alone(things) else list(compress(things, in_view(*scene.boxes, eye)))
    casting = [p for p in things if p.node.shadow] if any(light.shadow for light in lights) else []
    lights = [at_upper_left(light, pose) for light in lights]
    return VisibleScene(eye, lights, scene, shown, casting, surroundings=surroundings)


def is_alone(things: Sequence[Placed]) -> bool:
    """Return whether this is a single point object, which is always drawn from all of its points."""
    return len(things) == 1 and isinstance(things[0].content, PointObject)


def looking_distance(scene: Scene, pose: Matrix) -> float:
    """Return how far away the objects are that a viewer at this pose looks at, world units: it decides about the near
    plane.

    Of a frame alone, the median distance from which it was taken, wherever the viewer is. Of several objects, the
    distance to their middle, or their radius where that is more.
    """
    if is_alone(scene.things):
        alone = scene.things[0]
        return alone.content.scale * alone.rigid_axes[1]
    centre, radius = scene.bounds
    return max(float(np.linalg.norm(centre - pose[:3, 3])), radius)


def in_view(corners: Matrix, counts: NDArray[np.int64], eye: Eye) -> NDArray[np.bool_]:
    """Return which things may be visible: none that lies outside one side of the picture, and none without a box.

    corners  (n, 3) of boxes round them, world
    counts   how many of them are each thing's
    """
    view, camera = np.linalg.inv(eye.pose), eye.camera
    x, y, z = moved(corners, view).T
    u, v = camera.fx * x + (camera.cx + 0.5) * z, camera.fy * y + (camera.cy + 0.5) * z
    outside = (u < 0, u > camera.width * z, v < 0, v > camera.height * z, z < eye.near)
    owners = np.repeat(np.arange(len(counts)), counts)
    return np.all([np.bincount(owners[~side], minlength=len(counts)) > 0 for side in outside], axis=0)
