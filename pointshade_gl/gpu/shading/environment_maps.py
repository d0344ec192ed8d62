"""An environment as shaders look it up: spherical harmonics for diffuse light, and maps for highlights."""

from __future__ import annotations

from collections.abc import Sequence

import moderngl
import numpy as np

from ...estimation.environment_light import above_horizon, lobe_maps, radiance_bands, turned_bands
from ...scene.environment import Environment, Surroundings
from ..core.memory import Owner
from ..core.steps import Steps
from .light_set import AroundLookUp, Lobes


class EnvironmentMaps(Owner):
    """Keeps what was made of the last environment."""

    def __init__(self, context: moderngl.Context, steps: Steps):
        super().__init__(context)
        self._steps = steps
        self._texture: moderngl.Texture | None = None

    def find(self, around: Surroundings, exponents: Sequence[float]) -> AroundLookUp | None:
        """Return what shaders look up, in world axes; None without an environment.

        exponents  of the highlights in a picture
        """
        if around.environment is None:
            return None
        to_sky, wanted = np.array(around.to_sky), tuple(exponents)
        up = None if around.floor_in_sky is None else tuple(around.floor_in_sky.tolist())
        bands = self._steps.run("environment", _bands, around.environment, up)
        lobes = self._steps.run("lobes", self._fill, around.environment, up, wanted) if wanted else None
        if lobes is not None and around.intensity != 1:
            lobes = lobes._replace(intensity=around.intensity)
        return AroundLookUp(around.intensity * turned_bands(bands, to_sky), to_sky, lobes)

    def _fill(self, environment: Environment, up: tuple[float, ...] | None, exponents: tuple[float, ...]) -> Lobes:
        picture = environment.picture if up is None else above_horizon(environment.picture, np.array(up))
        maps = lobe_maps(picture, exponents)
        texels = np.concatenate([maps, np.ones_like(maps[..., :1])], -1)
        if self._texture is None or self._texture.size != texels.shape[1::-1]:
            self.release()
            self._texture = self._allocate(self._context.texture, texels.shape[1::-1], 4, dtype="f4")
            self._texture.filter = (moderngl.LINEAR, moderngl.LINEAR)
            self._texture.repeat_x, self._texture.repeat_y = True, False
        self._texture.write(np.ascontiguousarray(texels))
        return Lobes(self._texture, exponents)

    def release(self) -> None:
        self._texture = None
        super().release()


def _bands(environment: Environment, up: tuple[float, ...] | None) -> np.ndarray:
    return radiance_bands(environment.picture, None if up is None else np.array(up))
