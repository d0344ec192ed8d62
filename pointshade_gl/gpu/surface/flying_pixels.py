"""Moves flying pixels, depth samples that hang between two surfaces, onto one of the two."""

from __future__ import annotations

import moderngl

from ...scene.camera import Camera
from ..core.frame_textures import DepthTextures, FrameTextures, PointSurface
from ..core.images import RG32F, Fitted, Image, Images
from ..core.passes import FullscreenPasses
from .normals import Estimator, SurfacePass

COUNTED = 16  # as in flying_pixel_mixing.glsl
# Share of mixed samples among those at steps, above which a sensor mixes. Measured: .99 to 1 by lidar, .65 by a Kinect,
# up to .77 in clean depth, where snapping would cost sharpness.
MIXES = 0.95
FEWEST = 50  # samples at steps that are enough to tell


class FlyingPixelPass(FullscreenPasses):
    """Moves mixed samples onto the plane of one side, chosen by their colour; they do not count for normals."""

    def __init__(self, context: moderngl.Context, surface: SurfacePass):
        super().__init__(context)
        self._surface = surface
        self._images = self._keep(Fitted(context, SnapImages))

    def run(
        self, frame: FrameTextures, guide: moderngl.Texture, camera: Camera, estimator: Estimator | None
    ) -> PointSurface:
        """Return the frame's surface, without flying pixels if its sensor makes any; valid until the next call.

        guide  mean colour of each sample
        """
        images = self._images.fit(frame.size)
        if estimator is None or not self._mixes(frame, images):
            return frame.surface
        images.unmixed.surface.confine(frame.surface.window)
        self._surface.run(images.unmixed, camera, estimator)
        maps = {"surface_map": images.unmixed.surface.texture, "mixed_map": frame.surface.texture}
        maps |= {"depth_map": frame.depth, "mixing_map": images.mixing, "guide_map": guide}
        images.snapped.confine(frame.surface.window)
        snap = self.fullscreen("surface/flying_pixel_snap.frag")
        snap.draw(images.snapped.target, maps, source=camera.intrinsics)
        return images.snapped

    def _mixes(self, frame: FrameTextures, images: SnapImages) -> bool:
        """Return whether the sensor mixes surfaces: nearly all steps in depth have samples between their two sides."""
        find, count = (self.fullscreen(f"surface/{name}.frag") for name in ("flying_pixels", "flying_pixel_counts"))
        find.draw(images.mixing_target, {"depth_map": frame.depth})
        count.draw(images.counts.target, {"mixing_map": images.mixing})
        mixed, sharp = images.counts.read().reshape(-1, 2).sum(0)
        return mixed + sharp >= FEWEST and mixed > MIXES * (mixed + sharp)


class SnapImages(Images):
    """mixing and counts (RG32F), see flying_pixel_mixing.glsl; depth without mixed samples; the snapped surface."""

    def __init__(self, context: moderngl.Context, size: tuple[int, int]):
        super().__init__(context, size)
        blocks = -(-size[0] // COUNTED), -(-size[1] // COUNTED)
        with self._all_or_nothing():
            self.unmixed = self._keep(DepthTextures(context, size))
            self.snapped = self._keep(PointSurface(context, size))
            self.mixing = self._texture(*RG32F)
            self.mixing_target = self._framebuffer(self.mixing, self.unmixed.depth)
            self.counts = self._keep(Image(context, blocks, RG32F))
