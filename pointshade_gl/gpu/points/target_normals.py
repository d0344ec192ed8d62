"""Estimates normals from the depth that several merged frames show in a view, not from the frames themselves."""

from __future__ import annotations

import moderngl

from ...scene.appearance import Look
from ...scene.camera import Camera
from ...scene.noise import parse_max_depth_step
from ..core.frame_textures import DepthTextures
from ..core.images import Fitted, Image, empty
from ..core.passes import FullscreenPasses
from ..core.view_images import SplatImage
from ..surface.normals import Estimator, SurfacePass
from .set_merge import key_inputs


def target_estimator(look: Look) -> Estimator | None:
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
