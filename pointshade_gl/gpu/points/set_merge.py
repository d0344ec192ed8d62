"""Merges several frames of one object in a view: at each pixel the weighted mean of their visible surfaces."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import nullcontext
from typing import Any, NamedTuple

import moderngl

from ...scene.appearance import shader_model
from ..core.additive_blend import AdditiveBlend
from ..core.images import Box, Image, confine, depth_tested, empty
from ..core.passes import FullscreenPasses
from ..core.view_images import SplatImage, Target
from .resolve import Looking


class Part(NamedTuple):
    """One of several frames that are merged in a view."""

    looking: Looking
    trust: moderngl.Texture
    window: Box  # where its splats come to
    importance: float  # of the frame in this view
    gain: tuple[float, ...]


class SetMergePass(FullscreenPasses):
    """Adds up the surfaces of several frames by weight, and divides the sums."""

    def __init__(self, context: moderngl.Context):
        super().__init__(context)
        self._adding = AdditiveBlend(context)

    def add_up(self, sums: Image, parts: Sequence[Part], band: float) -> None:
        """The sums of all parts at each pixel of the view that shows a splat."""
        empty(sums.target, parts[0].looking.splats.window)
        for number, part in enumerate(parts):
            looking = part.looking
            maps, constants = looking.maps() | {"trust_map": part.trust}, {"SHADING": shader_model(looking.shading)}
            if looking.visibility is not None:
                maps["visibility_map"], constants["VISIBILITY"] = looking.visibility, 1
            inputs = key_inputs(looking.splats, looking.look_up) | looking.way()
            inputs |= {"band": band, "importance": part.importance, "gain": part.gain}
            confine(sums.target, part.window)
            part_pass = self.fullscreen("points/set_accumulate.frag", looking.look_up, **constants)
            with self._adding.on() if number else nullcontext():  # the first finds zeros
                part_pass.draw(sums.target, maps, **inputs)
        confine(sums.target, None)

    def draw_surfaces(
        self, target: Target, sums: Image, look_up: bool, inputs: dict[str, Any], normals: moderngl.Texture | None,
        marks_doubts: bool,
    ) -> None:  # fmt: skip
        """Divide the sums, and draw the resulting surfaces among those of other objects.

        inputs   near, scale, material_number; and others, the number of frames less one, if normals are uncertain
        normals  estimated in the view; None takes the mean of the frames'
        marks_doubts  what no frame is trusted for has a short normal, too
        """
        names = "geometry_map", "albedo_map", "visibility_map"
        maps: dict[str, Any] = dict(zip(names, sums.textures, strict=False))  # the last one only where it is needed
        maps |= {} if normals is None else {"target_map": normals}
        constants = {"AT_TARGET": int(normals is not None), "CERTAINTY": int("others" in inputs)}
        constants |= {"VISIBILITY": int("visibility_map" in maps), "MARKED": int(marks_doubts)}
        merged = self.fullscreen("points/set_resolve.frag", look_up, **constants)
        with depth_tested(self._context, target.surfaces.shared_target, target.splats.window):
            merged.draw(target.surfaces.shared_target, maps, **key_inputs(target.splats, look_up), **inputs)


def key_inputs(splats: SplatImage, look_up: bool) -> dict[str, Any]:
    """Return where shaders/points/set_visibility.glsl finds which splats of several frames are visible."""
    if not look_up:
        return {"keys": splats.source_ids}
    splats.nearest.bind_to_storage_buffer(0)
    return {"target_size": splats.size}
