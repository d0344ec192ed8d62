"""What a page shows, as plain values: who looks, the lights, the stage that the mouse moves, and all things; with fewer
pixels and points if need be."""

from __future__ import annotations

import base64
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cache, partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..estimation import environment_light as lighting
from ..notes.words import counted
from ..renderer.requests import STRAIGHT, RenderRequest, Scenes
from ..scene.appearance import Appearance, strengths_in
from ..scene.camera import Camera, down_axis
from ..scene.cloud import ARRAYS, CloudStyle, PointCloud
from ..scene.environment import FAR_AS_SEEN, NO_ENVIRONMENT, EnvironmentLight
from ..scene.frame import Frame
from ..scene.graph import Scene
from ..scene.light import Light, at_upper_left
from ..scene.node import Placed, with_drawn
from ..scene.objects import PointObject
from ..scene.orbit import OrbitStage, State
from ..scene.settings import STILL, OutputSettings
from ..scene.shadow_cameras import SMOOTH, Roughness, contact_of
from ..scene.values import linear_to_srgb
from ..scene.visible import coarser, is_alone, points_at


def reduced(
    request: RenderRequest, largest: int, most: int, points: int = 0, splats: float = math.inf
) -> RenderRequest:
    """The request for the same, where depths and colours have up to `largest` pixels a side, and all clouds together
    about `most` points, or as many as such a picture has; itself if they do.

    points  of all clouds
    splats  how many trained ones it has at most: those that show most
    """
    frames = tuple(_reduced_frame(frame, largest) for frame in request.frames)
    if frames:
        return request if frames == request.frames else replace(request, source=frames)
    level = max(math.log2(max(points, 1) / min(most, largest**2)), 0.0)
    cloud_at = cache(partial(_reduced_cloud, level=level))
    source: Any = request.source
    is_cloud = isinstance(source, PointCloud)
    least = _least_shown(Scenes().of(request), splats)
    splats_above = cache(partial(_splats_above, least=least))

    def smaller(content: Any) -> Any:
        if content.clouds:
            return splats_above(content) if content.is_gaussian else cloud_at(content.as_discs)
        frames = tuple(_reduced_frame(frame, largest) for frame in content.frames)
        return content if frames == content.frames else PointObject(frames, look=content.look)

    source = smaller(source) if is_cloud else source.with_every_node(lambda node: with_drawn(node, smaller))
    return request if source is request.source else replace(request, source=source)


def cloud_points(scene: Scene) -> tuple[int, int]:
    """How many points the visible clouds have, and how many trained splats."""
    clouds = [cloud for placed in scene.instances for cloud in placed.content.clouds]
    points = sum(len(cloud.as_discs) for cloud in clouds if not cloud.is_gaussian)
    return points, sum(len(cloud) for cloud in clouds if cloud.is_gaussian)


def _shown(cloud: PointCloud) -> NDArray[np.floating]:
    """How much each trained splat shows: its opacity times its area. No two are equal, as some must go."""
    assert cloud.gaussians is not None, "a cloud of splats"
    scales = np.sort(cloud.gaussians.scales, 1)
    apart = 1 + np.float32(1e-3) * np.random.default_rng(1).random(len(cloud), np.float32)
    return cloud.gaussians.opacities * scales[:, 1] * scales[:, 2] * apart


def _least_shown(scene: Scene, most: float) -> float:
    """What each trained splat shows at least, so that no more than `most` are left."""
    clouds = [cloud for placed in scene.instances for cloud in placed.content.clouds if cloud.is_gaussian]
    if sum(map(len, clouds)) <= most:
        return 0.0
    return float(np.partition(np.concatenate(list(map(_shown, clouds))), -int(most))[-int(most)])


def _splats_above(cloud: PointCloud, least: float) -> PointCloud:
    return cloud if least == 0 else _selected(cloud, np.flatnonzero(_shown(cloud) >= least))


def _reduced_cloud(cloud: PointCloud, level: float) -> PointCloud:
    """An even sample of the points, those with sizes of their own larger by as much as they are fewer."""
    some = points_at(cloud, level)
    if some is None:
        return cloud
    found = _selected(cloud, some)
    return found if found.sizes is None else replace(found, sizes=found.sizes * np.float32(2 ** (level / 2)))


def _selected(cloud: PointCloud, some: NDArray[np.integer]) -> PointCloud:
    arrays: dict[str, Any] = {name: getattr(cloud, name) for name in ARRAYS}
    arrays = {name: one[some] if np.ndim(one) and len(one) == len(cloud) else one for name, one in arrays.items()}
    look = {name: getattr(cloud, name) for name in CloudStyle.__annotations__}
    held = cloud.gaussians and cloud.gaussians.select(some)
    return PointCloud(**arrays, gaussians=held, origin=cloud.origin, up=cloud.up, front=cloud.front, **look)


def _reduced_frame(frame: Frame, largest: int) -> Frame:
    color = frame.color
    if color is not None and max(color.shape[:2]) > largest:
        smaller = Frame(_averaged(color, largest), frame.depth, frame.camera, frame.pose, source=frame.source)
        frame = smaller.turning_as(frame)
    step = -(-max(frame.depth.shape) // largest)
    return frame if step == 1 else coarser(frame, step)


def _averaged(color: NDArray[np.uint8], largest: int) -> NDArray[np.uint8]:
    """A smaller picture, each pixel the mean of those that it takes the place of."""
    from PIL import Image

    height, width = color.shape[:2]
    share = largest / max(height, width)
    size = max(round(width * share), 1), max(round(height * share), 1)
    return np.asarray(Image.fromarray(color).resize(size, Image.Resampling.BOX))


def left_out(scene: Scene, finish: OutputSettings, points: int, splats: int) -> Iterator[str]:
    """Of a scene, finished like this. points, splats: of its clouds, before some were left out."""
    objects = [p.content for p in scene.instances if p.content.frames]
    shown, kept = cloud_points(scene)
    if shown < points:
        yield f"of {counted(points, 'point')} an even sample is drawn, {counted(shown, 'point')}"
    if kept < splats:
        yield f"of {counted(splats, 'splat')} those that show most are drawn, {counted(kept, 'splat')}"
    if finish.ground:
        yield "the ground and its shadows are in the still picture only"
    if not finish.is_light:
        yield f"{finish.show} in colours is in the still picture only"
    if any(one.look.splat == "mesh" for one in objects):
        yield "triangles between pixels are drawn as splats"


@dataclass(frozen=True, eq=False)
class Showing:
    """How a page begins. All its places are in *home axes*: those of the camera that the stage stands before.

    home  (4, 4) pose of that camera
    turn  yaw, pitch and dolly by which the page's first picture of a frame is seen from elsewhere
    seen  (4, 4) pose from which it is seen; None: `turn` tells
    frame  the source, or the first of its frames; None: the source is a scene or a cloud
    fill  share of light from all around that is mixed in
    roughness  noise of depth
    """

    scene: Scene
    camera: Camera
    home: NDArray[np.float64]
    turn: tuple[float, float, float]
    lights: Sequence[Light]
    shading: str
    finish: OutputSettings
    frame: Frame | None = None
    environment_light: EnvironmentLight = NO_ENVIRONMENT
    fill: float = 0.0
    roughness: Roughness = SMOOTH
    seen: NDArray[np.float64] | None = None

    @property
    def is_lit(self) -> bool:
        """Whether it begins with light: trained splats alone show their own colours until it is asked for."""
        return any(placed.content.shading != "auto" for placed in self.scene.instances)

    @property
    def stage(self) -> OrbitStage:
        if self.frame is None:
            return OrbitStage.of(replace(self.scene, pose=self.home))
        stage, is_home = OrbitStage.of(self.frame), np.array_equal(self.home, self.frame.pose)
        is_single = all(placed.content.is_single for placed in self.scene.instances)
        pivot = stage.upright @ self._at_home(self.frame.pivot)
        if self.frame.upright is not None:
            x, y, z = stage.upright @ self.home[:3, :3].T @ self.frame.upright
            stage = replace(stage, axis=(float(x), float(y), float(z)))
        return replace(stage, pivot=pivot, one_sided=is_single and is_home)

    def values(self, points: int = 0, splats: int = 0) -> dict[str, Any]:
        """For the JSON: all but the things. points, splats: of all clouds, before some were left out."""
        stage = self.stage
        start = self.start(stage)
        held, *lights = (self._light(light) for light in self._placed(start.pose(stage)))
        casts = any(light.shadow for light in self.lights)
        for light in [] if casts else [held, *lights]:  # all do, once shadows are switched on
            light["shadow"] = True
        behind = self.finish.behind
        levels = ", ".join(f"{255 * linear_to_srgb(c):.0f}" for c in behind or ())
        return {
            "camera": vars(self.camera),
            "stage": {
                "pivot": stage.pivot.tolist(), "radius": stage.radius, "upright": stage.upright.tolist(),
                "axis": down_axis(np.eye(4), np.array(stage.axis)).tolist(), "oneSided": stage.one_sided,
            },
            "start": {
                "yaw": start.yaw, "pitch": start.pitch, "distance": start.distance,
                "pan": start.pan, "pivot": start.pivot,
                "lightAt": start.light_at, "lightReach": start.light_reach,
                "lightColor": start.light_color, "lightIntensity": start.light_intensity,
                "shadows": casts, "shading": self.shading,
                **({} if self.is_lit else {"lit": False}),
            },
            "held": held, "lights": lights, "ambient": list(self.scene.ambient), "fill": self.fill,
            "around": self._around(),
            "bounds": self.bounds, "toWorld": self.home[:3, :3].tolist(), "distance": self.distance,
            "background": None if behind is None else f"rgb({levels})", "behind": behind,
            "samples": max(self.finish.samples, STILL), "tone": self.finish.tone,
            "leftOut": list(left_out(self.scene, self.finish, points, splats)),
        }  # fmt: skip

    def start(self, stage: OrbitStage) -> State:
        """The state in which the page begins: its first light is the one that is held."""
        yaw, pitch, dolly = self.turn
        state = State(yaw=yaw, pitch=pitch * stage.upright[1, 1], distance=1 - dolly)
        if self.seen is not None:
            state = state.seen_from(np.linalg.inv(self.home) @ self.seen, stage)
        (first, *_) = self._placed(state.pose(stage))
        return state.with_light(first, stage, self.home)

    def _placed(self, pose: NDArray[np.float64]) -> list[Light]:
        return [at_upper_left(light, self.home @ pose) for light in self.lights or [Light(intensity=0)]]

    def _at_home(self, point: Any) -> NDArray[np.float64]:
        return self.home[:3, :3].T @ (np.asarray(point) - self.home[:3, 3])

    def _light(self, light: Light) -> dict[str, Any]:
        turn = self.home[:3, :3].T
        kept = "color", "intensity", "attenuation", "cone", "radius", "angle", "size", "shadow"
        return {
            "position": None if light.position is None else self._at_home(light.position).tolist(),
            "direction": None if light.direction is None else (turn @ np.array(light.direction)).tolist(),
            **{name: getattr(light, name) for name in kept},
        }

    def _around(self) -> dict[str, Any]:
        """The light from all around, in home axes."""
        light, turn = self.environment_light, np.array(self.environment_light.to_sky) @ self.home[:3, :3]
        found: dict[str, Any] = {"occlusion": light.occlusion if light.occlusion < FAR_AS_SEEN else True}
        if light.environment is None:
            return found
        picture, up = light.environment.picture, light.floor_in_sky
        bands = light.intensity * lighting.radiance_bands(picture, up)
        found |= {"bands": lighting.sh_rotation(bands, turn).tolist(), "toSky": turn.tolist()}
        if self.exponents:
            whole = picture if up is None else lighting.above_horizon(picture, up)
            maps = light.intensity * lighting.lobe_maps(whole, self.exponents)
            texels = np.concatenate([maps, np.ones_like(maps[..., :1])], -1).clip(0, 65504).astype("<f2")
            size = {"width": maps.shape[1], "height": maps.shape[0], "count": len(self.exponents)}
            found["lobes"] = size | {"texels": base64.b64encode(texels.tobytes()).decode()}
        return found

    @property
    def exponents(self) -> tuple[float, ...]:
        """Those of highlights that show an environment."""
        if self.environment_light.environment is None:
            return ()
        return lighting.exponents_of(p.content.material for p in self.scene.instances)

    def lobe_of(self, placed: Placed) -> int:
        """Which of the maps shows the highlights of a thing."""
        return lighting.nearest_lobe(self.exponents, placed.content.material.shininess) if self.exponents else 0

    @property
    def bounds(self) -> dict[str, Any]:
        """How far everything reaches, in home axes, and what casts no shadow on what it touches."""
        extent = self.scene.extent
        return {
            "corners": [self._at_home(corner).tolist() for corner in extent.corners],
            "centre": self._at_home(extent.centre).tolist(), "radius": extent.radius,
            "contact": contact_of(extent, self.roughness.noise), "farther": (self.roughness.plane @ self.home).tolist(),
        }  # fmt: skip

    @property
    def distance(self) -> float | None:
        """How far everything is taken to be for the near plane; None if it depends on who looks."""
        if not is_alone(self.scene.instances):
            return None
        alone = self.scene.instances[0]
        return alone.content.scale * alone.rigid_axes[1]


def arranged(request: RenderRequest) -> Showing:
    """Return what a page shows first."""
    scene = Scenes().of(request)
    lights, (camera, seen) = request.lights_of(scene), request.seen_by(scene)
    if not request.frames:
        shading = request.source.shading if isinstance(request.source, PointCloud) else "phong"
        shading = "phong" if shading == "auto" else shading
        home = np.asarray(scene.pose) if request.pose is None else seen
        return Showing(scene, camera, home, STRAIGHT, lights, shading, request.finish, seen=seen)
    frame = scene.instances[0].content.frame
    home, turns = (frame.pose, request.turns) if request.pose is None else (seen, STRAIGHT)
    return Showing(scene, camera, home, turns, lights, request.look.shading, request.finish, frame)


def look_of(placed: Placed, showing: Showing) -> dict[str, Any]:
    """How a thing is lit, for the JSON."""
    (ambient, *others, shininess), rest = strengths_in(placed.content.material, showing.fill), 1 - showing.fill
    strengths = [rest * ambient + showing.fill, *(rest * one for one in others), shininess]
    shading = placed.content.shading if showing.shading == "phong" else "phong"  # the page's is that of a thing alone
    if shading == "auto":
        shading = "none" if showing.is_lit else "phong"
    return {"material": strengths, "shading": shading, "shadow": placed.node.shadow}


SAME_CAMERA = 1e-3  # pixels: a camera that differs by less is the same


def command_of(showing: Showing, line: str | None) -> dict[str, Any] | None:
    """Return it for the JSON; None without a line, and where no `--picture-size` leads to the camera of the page.

    line  `pointshade render ...`, without lights, shading, view, size and samples

    isScene is None for several frames of one object, which may stand in a scene or not. isOwn means that the page's
    home is where the line looks from without `--pose`; turns, that it turns around the same point as `--yaw`.
    """
    own, scene = showing.scene.camera, showing.scene
    assert own is not None, "scenes of requests have one"
    fitted = showing.camera.fitted(own.width, own.height)
    if line is None or not np.allclose(fitted.intrinsics, own.intrinsics, 0, SAME_CAMERA):
        return None
    is_own = bool(np.allclose(showing.home, scene.pose, 0, 1e-12))
    is_frame = showing.frame is not None and scene.instances[0].content.is_single
    is_set = showing.frame is None and len(scene.instances) == 1 and isinstance(scene.instances[0].content, PointObject)
    return {
        "line": line, "shading": Appearance().shading, "isScene": None if is_set else showing.frame is None,
        "isOwn": is_own, "turns": is_own and is_frame, "home": np.asarray(showing.home).tolist(),
    }  # fmt: skip
