"""Draws point clouds: discs that are blended into a surface, or balls, in views and in shadow maps."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import moderngl
import numpy as np

from ...scene.camera import Eye, view_matrix
from ...scene.cloud import PointCloud
from ..context.caller_state import DEPTH_TEST, PROGRAM_POINT_SIZE, enabled
from ..core.images import R32F, RGBA32F, Fitted, Image, Images, confine, depth_tested, empty
from ..core.programs import AdditiveBlend, FullscreenPasses, build_program, set_inputs
from ..core.steps import Parts
from ..core.view_images import Drawable, SurfaceImage, Target
from ..shading.light_set import ShadowTile
from .cloud_store import CloudPoints

CORE = 0.65  # share of a disc's radius that makes the front surface: outlines end there
BAND = 0.6  # radii before and behind the front surface that belong to it
STEP_BACK = 1.0  # radii by which a hole in it shows what lies behind
RING = 0.45  # radii from a hole to what lies around it
SHADOW_SHARE, SHADOW_PUSH = 0.7, 1.5  # a disc rises over its neighbours by less than so many of these smaller radii
BALL_SHARE = 0.55  # of the radius of discs, for a point without a plane among them


@dataclass(eq=False, slots=True)
class PlacedCloud(Parts, Drawable):
    """A level of a cloud, its place in the world, and how it is drawn."""

    points: CloudPoints
    cloud: PointCloud
    pose: np.ndarray  # (4, 4) from node axes to the world, without the scale
    scale: float
    grown: float  # by how much points are larger than those of the whole cloud

    @property
    def shading(self) -> str:
        return self.cloud.shading

    def add_shadow(self, passes: Any, tile: ShadowTile, eye: Eye) -> None:
        passes.clouds.add_shadow(tile, self, eye)

    def add_surface(self, passes: Any, target: Target, eye: Eye, number: int, lights: dict[str, Any]) -> None:
        passes.clouds.add_surface(target.surfaces, self, eye, number)

    @property
    def is_blended(self) -> bool:
        return self.cloud.splat == "disc"

    def away(self, eye: Eye) -> float:
        """Return how far the middle of the cloud lies ahead, at least the near plane."""
        return max(float(self._view(eye)[1][2]), eye.near)

    def widest(self, eye: Eye) -> float:
        """Return what the box of no point is wider than in a view, pixels, if there are points."""
        (world, spacings, pixels), camera = self.radius, eye.camera
        size, (turn, shift) = self.scale * (world + spacings * self.points.largest), self._view(eye)
        nearest = max(float((self.points.corners @ turn[2]).min() + shift[2]), eye.near, 2 * size)
        share = min(size / nearest + pixels / _focal(eye), 0.5)  # of the distance: nearer ones are not drawn
        aside = float(np.abs((camera.ray_at(0, 0), camera.ray_at(camera.width, camera.height))).max())
        return 2 * max(camera.fx, abs(camera.fy)) * share / (1 - share) * math.hypot(1, aside + 2 * share)

    def _view(self, eye: Eye) -> tuple[np.ndarray, np.ndarray]:
        """Return (3, 3) and (3,) that take the points' own positions to an eye's axes."""
        view = view_matrix(self.pose, eye.pose)
        turn = self.scale * view[:3, :3]
        return turn, view[:3, 3] + turn @ self.points.middle

    @property
    def radius(self) -> tuple[float, float, float]:
        """Return what adds up to the radius: world units, spacings or sizes of the points, pixels."""
        number, unit = self.cloud.radius_rule
        grown = 1.0 if self.cloud.sizes is None else self.grown  # spacings are those of this level
        return number * (unit == ""), number * grown * (unit == "x"), number * (unit == "px")

    def inputs(self, eye: Eye, share: float = 1.0) -> dict[str, Any]:
        """Return the uniforms of shaders/clouds/splat.vert. share: of the radius that is drawn."""
        view, camera = np.eye(4), eye.camera
        view[:3, :3], view[:3, 3] = self._view(eye)
        return {
            "view": view.T.astype("f4").tobytes(), "scale": self.scale, "radius": self.radius, "share": share,
            "target": camera.intrinsics, "target_size": (camera.width, camera.height), "near": eye.near,
        }  # fmt: skip


def _focal(eye: Eye) -> float:
    """As mean_focal_length of shaders/common/camera.glsl."""
    return 0.5 * (abs(eye.camera.fx) + abs(eye.camera.fy))


class FrontImage(Images):
    """The front surface of a cloud in a view: how far it is, and the sums of the discs on it."""

    @cached_property
    def depth(self) -> moderngl.Texture:
        """1 - near/z of the nearest core of a disc."""
        return self._depth_texture()

    @cached_property
    def sums(self) -> Image:
        """RGBA32F: normal and 1/z times the weight; linear colour times the weight, and the weight."""
        return self._keep(Image(self._context, self.size, RGBA32F, RGBA32F))

    @cached_property
    def front(self) -> Image:
        """R32F: z of the front surface, 0 where there is none."""
        return self._keep(Image(self._context, self.size, R32F))

    @cached_property
    def cores(self) -> moderngl.Framebuffer:
        return self._framebuffer(depth=self.depth)


class CloudObjects(FullscreenPasses):
    """Draws clouds into views and into shadow maps."""

    def __init__(self, context: moderngl.Context):
        super().__init__(context)
        self._adding = AdditiveBlend(context)
        self._images = self._keep(Fitted(context, FrontImage))
        self._programs: dict[tuple[str, int, bool], moderngl.Program] = {}
        self._largest = context.info["GL_POINT_SIZE_RANGE"][1]

    def add_surface(self, surfaces: SurfaceImage, placed: PlacedCloud, eye: Eye, number: int) -> None:
        """Draw the cloud among the surfaces of other objects. number: of its material, counted from 1."""
        shown = {"near": eye.near, "is_lit": placed.shading == "phong", "material_number": float(number)}
        if not placed.is_blended:
            surfaces.shared_target.use()
            with enabled(self._context, DEPTH_TEST, PROGRAM_POINT_SIZE):
                self._draw("ball", placed, eye, placed.inputs(eye) | shown)
            return
        image = self._images.fit(surfaces.size)
        self._find_front(image, placed, eye)
        empty(image.sums.target)
        with self._adding.on(), enabled(self._context, PROGRAM_POINT_SIZE):
            self._draw("blend", placed, eye, placed.inputs(eye) | {"front": image.front.texture, "band": BAND})
        sums = image.sums.textures
        maps = {"geometry_map": sums[0], "albedo_map": sums[1], "front": image.front.texture}
        with depth_tested(self._context, surfaces.shared_target, (0, 0, *surfaces.size)):
            resolve = self.fullscreen("clouds/resolve.frag", None, MARKED=int(surfaces.marks_doubts))
            resolve.draw(surfaces.shared_target, maps, target=eye.camera.intrinsics, **shown)

    def add_shadow(self, tile: ShadowTile, placed: PlacedCloud, eye: Eye) -> None:
        """Draw the cloud's depth into a shadow map. eye: the light's camera."""
        tile.target.use()
        with enabled(self._context, DEPTH_TEST, PROGRAM_POINT_SIZE):
            inputs = placed.inputs(eye, SHADOW_SHARE) | {"push": SHADOW_PUSH, "first_pixel": tile.first}
            self._draw("depth", placed, eye, inputs)

    def _find_front(self, image: FrontImage, placed: PlacedCloud, eye: Eye) -> None:
        """Find the front surface: of the cores of discs, and closed between them."""
        confine(image.cores, None)
        image.cores.use()
        image.cores.clear(depth=1.0)
        with enabled(self._context, DEPTH_TEST, PROGRAM_POINT_SIZE):
            self._draw("depth", placed, eye, placed.inputs(eye, CORE) | {"push": 0.0, "first_pixel": (0.0, 0.0)})
        (world, spacings, pixels), focal, away = placed.radius, _focal(eye), placed.away(eye)
        radius = placed.scale * (world + spacings * placed.points.spacing) + pixels * away / focal  # the discs' median
        ring = RING * radius * focal, RING * radius * focal / away
        inputs = {"near": eye.near, "step_back": STEP_BACK * radius, "ring": ring}
        self.fullscreen("clouds/front.frag").draw(image.front.target, {"cores": image.depth}, **inputs)

    def _draw(self, name: str, placed: PlacedCloud, eye: Eye, inputs: dict[str, Any]) -> None:
        """Draw the discs of a cloud, and its balls."""
        points, of_balls = placed.points, {"push": 0.0} if "push" in inputs else {}
        if placed.is_blended:
            self._draw_some(name, placed, eye, points.discs, 0, inputs)
            self._draw_some(name, placed, eye, points.others, 1, inputs | of_balls | {"share": BALL_SHARE})
        else:
            self._draw_some(name, placed, eye, points.discs + points.others, 1, inputs | of_balls | {"share": 1.0})

    def _draw_some(
        self, name: str, placed: PlacedCloud, eye: Eye, buffers: list[moderngl.Buffer], balls: int,
        inputs: dict[str, Any],
    ) -> None:  # fmt: skip
        if not buffers:
            return
        as_quads = placed.widest(eye) > self._largest
        program = self._program(name, balls, as_quads)
        set_inputs(program, dict(inputs))
        placed.points.draw(buffers, program, as_quads)

    def _program(self, name: str, balls: int, as_quads: bool) -> moderngl.Program:
        key = name, balls, as_quads
        if key not in self._programs:
            files = "clouds/splat.vert", f"clouds/{name}.frag"
            self._programs[key] = self._keep(build_program(self._context, *files, BALLS=balls, QUADS=int(as_quads)))
        return self._programs[key]
