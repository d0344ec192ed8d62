"""Resolves which point each pixel of a view shows, of one frame, or of several that are merged."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import nullcontext
from typing import Any, NamedTuple

import moderngl
import numpy as np

from ...scene.appearance import LIT_EARLY, Appearance, shader_model
from ...scene.camera import Camera
from ...scene.noise import parse_max_depth_step
from ..context.software_driver import wants_software
from ..core.frame_textures import DepthTextures
from ..core.images import Box, Fitted, Image, confine, depth_tested, empty
from ..core.programs import AdditiveBlend, FullscreenPasses, source_and_target
from ..core.view_images import Canvas, SplatImage, Target
from ..shading.light_set import environment_of
from ..surface.surface_normals import Estimator, SurfacePass

UPRIGHT = 1e-6  # of a view's axes: turned by less they are the frame's


class ResolveInputs(NamedTuple):
    """Where the pixels of a view look up their points: the frame, its rasterised splats, and the transform between."""

    surface: moderngl.Texture  # of the frame's points
    colors: moderngl.Texture  # the picture, or for flat and gouraud the light of the points
    source: Camera  # that took the frame
    splats: SplatImage
    camera: Camera  # who looks
    view: np.ndarray  # (4, 4) source axes to target axes
    look_up: bool  # the splats left the nearest 1/z (compute), not source ids (points)
    near: float  # source units: the splats' depth is 1 - near/z
    shading: str
    certainty: moderngl.Texture | None  # of the frame's normals
    visibility: moderngl.Texture | None  # what its points see of the light from all around
    normals: moderngl.Texture | None  # for light, if they are not those of the surface

    def maps(self) -> dict[str, moderngl.Texture]:
        """Return the textures of the frame by the names of the shaders' samplers."""
        return {"surface_map": self.surface, "light_map" if self.shading in LIT_EARLY else "color_map": self.colors}

    def way(self) -> dict[str, Any]:
        """Return the uniforms that project the frame into the view."""
        return source_and_target(self.source, self.camera, self.view)


def shared_variant(view: np.ndarray, surface: moderngl.Texture, colors: moderngl.Texture) -> int:
    """Return `SHARED` of resolve_surfaces.frag for a view (4, 4) of a frame from its own place."""
    is_upright = np.abs(view[:3, :3] - np.eye(3)).max() < UPRIGHT
    return 2 if is_upright and surface.size == colors.size else 1


class ResolvePass(FullscreenPasses):
    """Turns rasterised splats into surfaces or into the picture. One program for each shading model."""

    def __init__(self, context: moderngl.Context):
        super().__init__(context)
        # of pictures on which nothing is that could be lost; and of sums
        self._finished = {"LINEAR": 0, "FILLED": int(wants_software(context))}
        self._summed = {"LINEAR": 1, "FILLED": 0}

    def draw_picture(self, canvas: Canvas, looking: ResolveInputs) -> None:
        """Draw the picture, for the shading models none, flat and gouraud."""
        constants = self._finished if canvas.adding is None else self._summed
        needs_way = looking.look_up or looking.shading == "gouraud"  # else the source id says it all
        inputs = looking.way() if needs_way else {}
        with canvas.opened(looking.splats.window) as image:
            self._draw("points/resolve_picture.frag", image, looking, inputs, **constants)

    def draw_lit(self, canvas: Canvas, looking: ResolveInputs, lights: dict[str, Any]) -> None:
        """Draw the picture, lit in the same pass, for phong. lights: the inputs of light_surface."""
        with canvas.opened(looking.splats.window) as image:
            inputs = lights | looking.way()
            constants = self._finished if canvas.adding is None else self._summed
            constants = constants | {"ALONE": int("only_light" in lights), **environment_of(lights)}
            constants["SAME_SIZE"] = int(looking.surface.size == looking.colors.size)
            self._draw("points/resolve_lit.frag", image, looking, inputs, **constants)

    def draw_surfaces(
        self, image: moderngl.Framebuffer, looking: ResolveInputs, number: int,
        depth: tuple[float, float] | None = None, samples: int | None = None,
    ) -> None:  # fmt: skip
        """Draw surfaces: unit normal and depth; albedo and the number of its material. A normal of 0 marks what is lit
        already.

        depth  (near, scale) of one of several objects, the nearest of which stays; without it the object is alone,
               and the image is emptied first
        samples  the albedo is the mean of so many: see `SHARED` in resolve_surfaces.frag
        """
        near, scale = depth or (0.0, 1.0)
        inputs = looking.way() | {"near": near, "scale": scale, "material_number": float(number)}
        if depth is None:
            empty(image, looking.splats.window)
            shared = {} if samples is None else {"samples": samples}
            how = shared_variant(looking.view, looking.surface, looking.colors) if shared else 0
            self._draw("points/resolve_surfaces.frag", image, looking, inputs | shared, SHARED=how)
            return
        with depth_tested(self._context, image, looking.splats.window):
            self._draw("points/resolve_surfaces.frag", image, looking, inputs)

    def _draw(
        self, fragment: str, image: moderngl.Framebuffer, looking: ResolveInputs, inputs: dict[str, Any],
        **constants: int,
    ) -> None:  # fmt: skip
        constants |= {"SHADING": shader_model(looking.shading)}
        textures = looking.maps()
        if looking.shading == "phong" and looking.certainty is not None:
            constants["CERTAINTY"], textures["certainty_map"] = 1, looking.certainty
        if looking.shading == "phong" and looking.normals is not None:
            constants["CALM"], textures["light_normals"] = 1, looking.normals
        if looking.shading == "phong" and looking.visibility is not None:
            constants["VISIBILITY"], textures["visibility_map"] = 1, looking.visibility
        if looking.look_up:
            looking.splats.nearest.bind_to_storage_buffer(0)
            inputs["target_size"], constants["HIDDEN"] = looking.splats.size, int(looking.splats.may_hide)
        else:
            textures["source_ids"] = looking.splats.source_ids
            inputs["first_id"] = 1
            if "view" in inputs:  # without it, the source id says it all
                textures["window_depths"], inputs["depth_scale"] = looking.splats.depth, looking.near
        self.fullscreen(fragment, looking.look_up, **constants).draw(image, textures, **inputs)


class SetPart(NamedTuple):
    """One of several frames that are merged in a view."""

    looking: ResolveInputs
    trust: moderngl.Texture
    window: Box  # where its splats come to
    importance: float  # of the frame in this view
    gain: tuple[float, ...]


class SetMergePass(FullscreenPasses):
    """Adds up the surfaces of several frames by weight, and divides the sums."""

    def __init__(self, context: moderngl.Context):
        super().__init__(context)
        self._adding = AdditiveBlend(context)

    def add_up(self, sums: Image, parts: Sequence[SetPart], band: float, is_exact: bool) -> None:
        """The sums of all parts at each pixel of the view that shows a splat. is_exact: they have no noise"""
        empty(sums.target, parts[0].looking.splats.window)
        for number, part in enumerate(parts):
            looking = part.looking
            maps, constants = looking.maps() | {"trust_map": part.trust}, {"SHADING": shader_model(looking.shading)}
            constants |= {"EXACT": 1} if is_exact else {}
            if looking.visibility is not None:
                maps["visibility_map"], constants["VISIBILITY"] = looking.visibility, 1
            if looking.shading == "phong" and looking.normals is not None:
                maps["light_normals"], constants["CALM"] = looking.normals, 1
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


def target_estimator(look: Appearance) -> Estimator | None:
    """Return the estimator for normals in the view; None where those of the frames are averaged, or none are needed.

    It is the frames' own method. Their noise is not that of the merged depth, so that is measured.
    """
    if look.normals_at == "source" or look.shading != "phong":
        return None
    assert isinstance(look.normals, str), "arrays belong to one frame"
    return look.normals, parse_max_depth_step(look.max_depth_step), None, "keep"


class TargetNormals(FullscreenPasses):
    """Estimates normals of the merged depth in a view, with the passes for frames."""

    def __init__(self, context: moderngl.Context):
        super().__init__(context)
        self._surface = self._keep(SurfacePass(context))
        self._view = self._keep(Fitted(context, DepthTextures))

    def find(
        self, sums: Image, splats: SplatImage, look_up: bool, camera: Camera, estimator: Estimator
    ) -> moderngl.Texture:
        """Turn the sums of set_accumulate.frag into unit normal and depth at each pixel; depth 0 is nothing."""
        view = self._view.fit(sums.size)
        view.surface.confine(splats.window)
        empty(view.depth_target, splats.window)
        maps = {"geometry_map": sums.textures[0], "albedo_map": sums.textures[1]}
        find_depth = self.fullscreen("points/set_resolve_depth.frag", look_up)
        find_depth.draw(view.depth_target, maps, **key_inputs(splats, look_up))
        self._surface.run(view, camera, estimator)
        return view.surface.texture
