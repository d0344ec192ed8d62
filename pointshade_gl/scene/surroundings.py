"""What is around the objects of a picture: the light that comes from everywhere, and what may hide it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .environment import Environment

Row = tuple[float, float, float]
AS_IT_IS = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)


class Surroundings(NamedTuple):
    """The light from all around.

    occlusion    whether what is near hides some of it; a number is how far near reaches, world units, and True the
                 distance of what is seen
    environment  where it comes from; None is the scene's ambient light
    intensity    factor on the environment
    to_sky       (3, 3) rotation from world axes to the environment's
    on_ground    whether a ground is drawn below
    floor        (3,) unit, world: the normal of a floor that hides what is below; None without one
    """

    occlusion: bool | float = False
    environment: Environment | None = None
    intensity: float = 1.0
    to_sky: tuple[Row, Row, Row] = AS_IT_IS
    floor: Row | None = None
    on_ground: bool = False

    @property
    def floor_in_sky(self) -> NDArray[np.float64] | None:
        """The floor's normal in the environment's axes, rounded: turning about it changes nothing."""
        return None if self.floor is None else np.round(np.array(self.to_sky) @ self.floor, 6)

    def radius(self, distance: float) -> float:
        """Return how far things may be that hide light, world units. distance: of what is seen."""
        return distance if self.occlusion is True else float(self.occlusion)


NOTHING_AROUND = Surroundings()
