"""Normals that are estimated in a view, on the depth that several frames add up to there."""

from __future__ import annotations

import moderngl

from ..camera import Camera
from ..estimators import parse_max_depth_step
from ..look import Look
from .images import empty
from .merge import key_inputs
from .passes import FullscreenPass
from .surface import Estimator, SurfacePass
from .target import SplatImage, SumImage
from .textures import DepthTextures


def target_estimator(look: Look) -> Estimator | None:
    """What estimates normals in the view; None where those of the frames are mixed, or none are needed.

    It is the frames' own method. Their noise is not that of the merged depth, so that is measured.
    """
    if look.normals_at == "source" or look.shading != "phong":
        return None
    assert isinstance(look.normals, str), "arrays belong to one frame"
    return look.normals, parse_max_depth_step(look.max_depth_step), None, "keep"


class TargetNormals:
    """The passes of a frame's normals, for the depth that a view shows."""

    def __init__(self, context: moderngl.Context):
        self._context, self._surface = context, SurfacePass(context)
        self._depth: dict[bool, FullscreenPass] = {}
        self._view: ViewDepth | None = None

    def find(
        self, sums: SumImage, splats: SplatImage, look_up: bool, camera: Camera, estimator: Estimator
    ) -> moderngl.Texture:
        """The sums of part.frag -> unit normal and depth at each pixel of the view; depth 0 where nothing is known."""
        view = self._fit(sums.size)
        view.surface.confine(splats.window)
        empty(view.target, splats.window)
        maps = {"geometry_map": sums.geometry, "albedo_map": sums.albedo}
        self._pass(look_up).draw(view.target, maps, **key_inputs(splats, look_up))
        self._surface.run(view, camera, *estimator)
        return view.surface.texture

    def _pass(self, look_up: bool) -> FullscreenPass:
        if look_up not in self._depth:
            version = 430 if look_up else 330
            self._depth[look_up] = FullscreenPass(self._context, "merged_depth.frag", version, LOOK_UP=int(look_up))
        return self._depth[look_up]

    def _fit(self, size: tuple[int, int]) -> ViewDepth:
        if self._view is None or self._view.size != size:
            if self._view is not None:
                self._view.release()
            self._view = None
            self._view = ViewDepth(self._context, size)
        return self._view

    def release(self) -> None:
        for item in (self._view, *self._depth.values(), self._surface):
            if item is not None:
                item.release()


class ViewDepth(DepthTextures):
    """A depth picture that is drawn instead of uploaded, and its surface."""

    def __init__(self, context: moderngl.Context, size: tuple[int, int]):
        super().__init__(context, size)
        with self._all_or_nothing():
            self.target = self._framebuffer(self.depth)
