"""An interactive view: what it orbits around, its camera, light and appearance, and how mouse drags change it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..checks.arguments import LARGEST, check_color, check_flag, check_number, check_numbers, check_point, check_type
from .appearance import NOT_LIT, Appearance
from .camera import Camera, orbit_pose
from .frame import Frame, probing_step
from .graph import Scene
from .light import Light, at_upper_left
from .settings import SIMPLE, OutputSettings, with_environment_turned
from .values import Options, frozen

Axis = tuple[float, float, float]
VERTICAL: Axis = (0.0, 1.0, 0.0)


@dataclass(frozen=True, eq=False)
class OrbitStage(Options):
    """What the viewer moves around. Stage and State are in *view axes*: x right, y down in the picture.

    pivot      (3,) the object's middle, as the frame's own camera sees it
    radius     the light's distance from the pivot
    upright    (3, 3) from the camera's axes to view axes and back: with a negative fy the camera's y points up
    axis       (3,) that yaw turns about, view axes: the picture's vertical, or what is known to be up
    one_sided  a single frame: drags end softly where little of what is seen was measured
    """

    pivot: NDArray[np.float64]
    radius: float
    upright: NDArray[np.float64]
    axis: Axis = VERTICAL
    one_sided: bool = False

    @classmethod
    def of(cls, frame: Frame | Scene) -> OrbitStage:
        """Return the stage of a frame or scene. The light moves outside most of it, but not behind the camera."""
        if isinstance(frame, Scene):
            return cls._of_scene(frame)
        pivot = frame.pose[:3, :3].T @ (frame.pivot - frame.pose[:3, 3])
        h, w = frame.depth.shape
        step = probing_step(frame.depth)
        v, u = np.mgrid[0:h:step, 0:w:step]
        z = frame.depth[::step, ::step].astype(np.float64)
        points = frame.camera.unproject(z, np.stack([u, v], -1))[z > 0]
        extent = np.quantile(np.linalg.norm(points - pivot, axis=1), 0.8) if len(points) else 0.0
        radius = float(np.clip(1.5 * extent, 0.5 * pivot[2], pivot[2]))
        upright = np.diag([1.0, np.sign(frame.camera.fy), 1.0])
        x, y, z = VERTICAL if frame.up is None else upright @ frame.up
        return cls(upright @ pivot, radius, upright, (float(x), float(y), float(z)), one_sided=True)

    @classmethod
    def _of_scene(cls, scene: Scene) -> OrbitStage:
        pose, (_, radius) = np.asarray(scene.pose), scene.bounds
        pivot = pose[:3, :3].T @ (scene.pivot - pose[:3, 3])
        pivot = np.array([0.0, 0.0, max(pivot[2], 0.1 * radius)])  # what the camera looks at stays in the middle
        stage = cls(pivot, min(radius, float(pivot[2])), np.eye(3))
        if any(p.content.up_direction is not None for p in scene.instances):
            x, y, z = pose[:3, :3].T @ scene.upright
            return replace(stage, axis=(float(x), float(y), float(z)))
        return stage


RIM = 0.5  # share of the window's smaller side between the object's middle and its rim
FARTHEST = math.radians(175)  # radians from the viewer's direction: straight behind, left and right would meet
DEGREES = 120.0  # around the object, for a drag across the window's smaller side
# Degrees from where a single frame was taken. At 50 degrees of yaw three sensors' frames fill 45 to 69 % of what they
# fill from the front, and the front of the vase is 83 % of what is seen; at 40 degrees of pitch some are below 40 %.
SLOWS, NEAR_END, ENDS = 25.0, 40.0, 50.0  # from where drags turn it less and less, are told to end, and where they end
END_TEXT = "drags end here: the other sides were not measured"
WHEEL = 1.1  # factor on distances per step of the wheel
UPPER_LEFT = (-0.3, -0.3)  # where the light starts, rims
OWN_LIGHT = Light(position=(0, 0, 0), shadow=True)  # the kind of light that the mouse holds when it is given none
BESIDE = 0.25  # intensity of that light beside light from all around
NEAREST = 1e-6  # of a distance: it must not be 0
Pair = tuple[float, float]


@dataclass(frozen=True)
class State:
    """Everything that decides what the window shows, except the frame and the window's size.

    yaw, pitch    degrees around the pivot, as in `orbit_pose`
    roll          degrees about the viewer's own axis
    distance      from the pivot, 1 = that of the object's middle from the frame's own camera
    pan           shift of the pivot in the picture, in focal lengths
    pivot         what orbits turn around: from the object's middle, in view axes of the frame's own camera
    light_at      the light's place on the window, rims from the object's middle, y down
    light_reach   factor on the light's distance from the object's middle
    light_mode    whether the light follows the mouse while no button is down
    lit           False shows the frame's own colours
    shadows       False switches off the shadows of all lights; True leaves each light its own switch
    look          how the frame is drawn; of a scene only a shading other than "phong" counts, for all its objects
    finish        of it only light counts: the environment, whether what is near hides it, how it rolls off, and what
                  colours show in its place
    readout       whether values under the mouse are shown; None: where colours are no light

    Raises TypeError or ValueError for anything else, and for a look with arrays: the next frame of a sequence may have
    another size.
    """

    yaw: float = 0.0
    pitch: float = 0.0
    roll: float = 0.0
    distance: float = 1.0
    pan: Pair = (0.0, 0.0)
    pivot: tuple[float, float, float] = (0.0, 0.0, 0.0)
    light_at: Pair = UPPER_LEFT
    light_reach: float = 1.0
    light_mode: bool = True
    light_color: tuple[float, float, float] = (1.0, 1.0, 1.0)
    light_intensity: float = 1.0
    lit: bool = True
    shadows: bool = False
    look: Appearance = Appearance(missing="complete")
    finish: OutputSettings = SIMPLE
    help: bool = False
    panel: bool = False
    readout: bool | None = None

    def __post_init__(self) -> None:
        for name, (check, *limits) in _CHECKS.items():
            object.__setattr__(self, name, check(getattr(self, name), f"state {name}", *limits))
        if self.readout is not None:
            object.__setattr__(self, "readout", check_flag(self.readout, "state readout"))
        check_type(self.look, Appearance, "state look")
        check_type(self.finish, OutputSettings, "state finish")
        if not self.look.is_uniform:
            expected = "the viewer's look must have one value for all pixels"
            raise ValueError(f"{expected}: no arrays for normals, point_size, noise")

    @property
    def point_size(self) -> float:
        """The splats' size in source pixels."""
        size = self.look.point_size
        return 1.0 if size is None or self.look.fills else float(np.asarray(size))

    def with_look(self, **changes: Any) -> State:
        """The state with other values of its look: `state.with_look(shading="flat")`."""
        return replace(self, look=replace(self.look, **changes))

    def with_finish(self, **changes: Any) -> State:
        """The state with other light from all around: `state.with_finish(environment="sky")`."""
        return replace(self, finish=replace(self.finish, **changes))

    def environment_turned(self, degrees: float) -> State:
        """Return the state with its environment turned, counterclockwise seen from above; without one it stays."""
        if self.finish.environment is None:
            return self
        return replace(self, finish=with_environment_turned(self.finish, degrees))

    def orbited(self, dx: float, dy: float, smaller_side: float, stage: OrbitStage | None = None) -> State:
        """Return the state after a drag by (dx, dy) pixels: the near side of the object follows the mouse.

        In light mode the light stays with the viewer, otherwise with the object.
        """
        dx, dy, _ = _rolled(self.roll) @ (dx, dy, 0.0)
        right, up = -dx / smaller_side * DEGREES, dy / smaller_side * DEGREES
        if stage and stage.one_sided:
            return self.turned(softly_turned(self.yaw, right), softly_turned(self.pitch, up), stage.axis)
        # straight above or below, yaw would be a roll
        pitch = min(max(self.pitch + up, -89.0), 89.0)
        return self.turned(self.yaw + right, pitch, stage.axis if stage else VERTICAL)

    def turned(self, yaw: float, pitch: float, axis: Axis = VERTICAL, roll: float | None = None) -> State:
        """Return the state seen from elsewhere around the pivot, degrees. The light stays as after a drag.

        roll  None: it stays
        """
        turned = replace(self, yaw=(yaw + 180) % 360 - 180, pitch=pitch, roll=self.roll if roll is None else roll)
        if self.light_mode:
            return turned
        return turned.with_light_direction(_turn(turned, axis).T @ _turn(self, axis) @ self.towards)

    def framed(self, stage: OrbitStage, camera: Camera) -> State:
        """Return the state with the object's middle in the middle of the picture, from as near as shows all of it."""
        half = min(camera.width / camera.fx, camera.height / abs(camera.fy)) / 2
        distance = stage.radius / math.sin(math.atan(half)) / stage.pivot[2]
        across = ((camera.width - 1) / 2 - camera.cx) / camera.fx
        down = ((camera.height - 1) / 2 - camera.cy) / abs(camera.fy)
        x, y = (float(one) for one in (across, down) - stage.pivot[:2] / stage.pivot[2])
        return replace(self, pivot=(0.0, 0.0, 0.0), pan=(x, y), distance=float(distance))

    def seen_from(self, pose: NDArray[np.float64], stage: OrbitStage) -> State:
        """Return the state whose viewer stands at a pose (4, 4), to the axes of the frame's camera.

        It orbits around the same point, or around what is straight ahead where that point is behind the viewer.
        """
        turn = stage.upright @ pose[:3, :3] @ stage.upright
        yaw, pitch, roll = _angles_of(turn, stage.axis)
        eye, pivot = stage.upright @ pose[:3, 3], np.asarray(self.pivot)
        seen = turn.T @ (stage.pivot + pivot - eye)
        if seen[2] <= NEAREST * stage.pivot[2]:
            seen = np.array([0.0, 0.0, stage.pivot[2]])
            pivot = eye + turn @ seen - stage.pivot
        distance = float(seen[2] / stage.pivot[2])
        pan = seen[:2] / seen[2] - stage.pivot[:2] / stage.pivot[2]
        return replace(
            self, yaw=yaw, pitch=pitch, roll=roll, distance=distance, pan=tuple(map(float, pan)),
            pivot=tuple(map(float, pivot)),
        )  # fmt: skip

    def panned(self, dx: float, dy: float, focal: float) -> State:
        """Return the state after a drag by (dx, dy) pixels; the picture's focal length is in pixels."""
        return replace(self, pan=(self.pan[0] + dx / focal, self.pan[1] + dy / focal))

    def zoomed(self, steps: float) -> State:
        nearest, farthest = min(0.05, self.distance), max(20.0, self.distance)  # a pivot may lie beyond both
        return replace(self, distance=min(max(self.distance / WHEEL**steps, nearest), farthest))

    def with_pivot(self, point: Sequence[float] | NDArray[np.float64], stage: OrbitStage) -> State:
        """Return a state with the same picture and light, whose orbits turn around another point in front of the
        viewer: (3,), view axes."""
        x, y, z = check_point(point, "pivot")
        turned = _turn(self, stage.axis) @ ((x, y, z) - self.seen_pivot(stage))
        middle = stage.pivot / stage.pivot[2]
        pivot = tuple(map(float, self.pivot + turned))
        pan = float(x / z - middle[0]), float(y / z - middle[1])
        return replace(self, pivot=pivot, distance=float(z / stage.pivot[2]), pan=pan)

    def light_reached(self, steps: float) -> State:
        """Return the state with the light moved away from the object (steps above 0) or nearer to it."""
        return replace(self, light_reach=min(max(self.light_reach * WHEEL**steps, 0.1), 20.0))

    def with_light_direction(self, towards: Sequence[float] | NDArray[np.float64]) -> State:
        """Return the state with the light in another direction: (3,) from the middle, view axes, of any length."""
        x, y, z = check_point(towards, "direction")
        angle, around = math.atan2(math.hypot(x, y), -z), math.atan2(y, x)
        rims = angle / (math.pi / 2)
        return replace(self, light_at=(rims * math.cos(around), rims * math.sin(around)))

    def with_light(self, light: Light, stage: OrbitStage, frame_pose: NDArray[np.float64]) -> State:
        """Return the state in which the mouse controls a light of the scene. A directional light gives its direction
        only.

        A spot keeps its place, and turns to the object's middle. `light` has the rest, from a light of the same kind.
        """
        pose = frame_pose @ self.pose(stage)
        state = replace(self, light_color=light.color, light_intensity=light.intensity)
        to_view = stage.upright @ pose[:3, :3].T
        if light.position is None:
            return state.with_light_direction(-to_view @ np.array(at_upper_left(light, pose).direction))
        place = to_view @ (np.array(light.position) - pose[:3, 3]) - self.seen_middle(stage)
        reach = max(float(np.linalg.norm(place)) / stage.radius, 1e-3)
        return replace(state, light_reach=reach).with_light_direction(place)

    @property
    def towards(self) -> NDArray[np.float64]:
        """(3,) unit, from the object's middle to the light, view axes."""
        angle = min(math.hypot(*self.light_at) * math.pi / 2, FARTHEST)
        around = math.atan2(self.light_at[1], self.light_at[0])
        side = math.sin(angle)
        return np.array([side * math.cos(around), side * math.sin(around), -math.cos(angle)])

    def is_near_end(self, stage: OrbitStage) -> bool:
        """Return whether drags turn it no farther, or hardly."""
        return stage.one_sided and max(abs(self.yaw), abs(self.pitch)) > NEAR_END

    @property
    def is_lit(self) -> bool:
        """Return whether any light is visible."""
        return self.lit and self.look.shading not in NOT_LIT and self.finish.is_light

    @property
    def reads(self) -> bool:
        """Return whether values under the mouse are shown."""
        return not self.finish.is_light if self.readout is None else self.readout

    @property
    def is_behind(self) -> bool:
        return math.hypot(*self.light_at) > 1

    def seen_pivot(self, stage: OrbitStage) -> NDArray[np.float64]:
        """(3,) what orbits turn around, view axes."""
        shift = np.array([*self.pan, 0.0])
        return (stage.pivot + shift * stage.pivot[2]) * self.distance

    def seen_middle(self, stage: OrbitStage) -> NDArray[np.float64]:
        """(3,) the object's middle, view axes: the light moves around it."""
        return self.seen_pivot(stage) - _turn(self, stage.axis).T @ self.pivot

    def pose(self, stage: OrbitStage) -> NDArray[np.float64]:
        """(4, 4) of the viewer, to the axes of the frame's camera."""
        turn = _turn(self, stage.axis)
        pose = np.eye(4)
        pose[:3, :3] = stage.upright @ turn @ stage.upright
        pose[:3, 3] = stage.upright @ (stage.pivot + self.pivot - turn @ self.seen_pivot(stage))
        return pose

    def light(self, stage: OrbitStage, frame_pose: NDArray[np.float64], kind: Light = OWN_LIGHT) -> Light:
        """The light in the world, directed at the object's middle.

        kind  is a point light, a spot, an area or directional, and has all else: cone, attenuation, shadow switch,
              radius, angle, size
        """
        place = self.seen_middle(stage) + self.towards * stage.radius * self.light_reach
        pose = frame_pose @ self.pose(stage)
        x, y, z = (pose[:3, :3] @ stage.upright @ place + pose[:3, 3]).tolist()
        dx, dy, dz = (pose[:3, :3] @ stage.upright @ -self.towards).tolist()
        position = None if kind.position is None else (x, y, z)
        direction = (dx, dy, dz) if kind.position is None or kind.direction is not None else None
        own = {"color": self.light_color, "intensity": self.light_intensity}
        return replace(kind, position=position, direction=direction, **own)

    def middle(self, stage: OrbitStage, camera: Camera) -> Pair:
        """Return the object's middle in pixels, kept inside the picture, so that the light stays within reach."""
        x, y, z = self.seen_middle(stage)
        z = max(z, NEAREST * stage.pivot[2])  # behind the viewer it is at the side where it left the picture
        u, v = camera.fx * x / z + camera.cx, abs(camera.fy) * y / z + camera.cy
        return min(max(u, 0.0), camera.width - 1.0), min(max(v, 0.0), camera.height - 1.0)

    def reset_view(self, start: State) -> State:
        """Return the state with view and light of another state; look, help, panel and readout stay."""
        return replace(start, look=self.look, help=self.help, panel=self.panel, readout=self.readout)


def _check_pair(value: Any, name: str) -> Pair:
    x, y = check_numbers(value, 2, f"{name} must be two finite numbers")
    return x, y


_ANGLE, _REACH, _FLAG = (check_number, -LARGEST), (check_number, NEAREST), (check_flag,)
_CHECKS: dict[str, tuple[Any, ...]] = {  # of the fields of State, and their limits
    "yaw": _ANGLE, "pitch": _ANGLE, "roll": _ANGLE, "distance": _REACH, "light_reach": _REACH,
    "pan": (_check_pair,), "light_at": (_check_pair,), "pivot": (check_point,), "light_color": (check_color,),
    "light_intensity": (check_number, 0), "light_mode": _FLAG, "lit": _FLAG, "shadows": _FLAG, "help": _FLAG,
    "panel": _FLAG,
}  # fmt: skip


def softly_turned(angle: float, by: float) -> float:
    """Return an angle after a drag by so many degrees, one long or many short ones: away from 0 it ends softly."""
    side = 1.0 if by > 0 else -1.0
    angle, by = side * angle, abs(by)
    free = min(by, max(SLOWS - angle, 0.0))
    angle, by = angle + free, by - free
    if angle < ENDS:
        angle = ENDS - (ENDS - angle) * math.exp(-by / (ENDS - SLOWS))
    return side * angle


def rims_from(middle: Pair, x: float, y: float, camera: Camera) -> Pair:
    """Return the place of the light, in rims, that a pixel of the picture stands for."""
    rim = RIM * min(camera.width, camera.height)
    return (x - middle[0]) / rim, (y - middle[1]) / rim


def marker_place(state: State, stage: OrbitStage, camera: Camera) -> Pair:
    """Return where the light's marker is drawn, in pixels of the picture."""
    rim = RIM * min(camera.width, camera.height)
    middle = state.middle(stage, camera)
    return middle[0] + state.light_at[0] * rim, middle[1] + state.light_at[1] * rim


def _turn(state: State, axis: Axis) -> NDArray[np.float64]:
    return _turned(state.yaw, state.pitch, state.roll, axis)


@lru_cache(maxsize=8)  # each picture asks several times
def _turned(yaw: float, pitch: float, roll: float, axis: Axis) -> NDArray[np.float64]:
    turn = orbit_pose(None, (0.0, 0.0, 1.0), yaw, pitch, upright=axis)[:3, :3]
    return frozen(turn @ _rolled(roll) if roll else turn.copy())


def _rolled(degrees: float) -> NDArray[np.float64]:
    c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def _angles_of(turn: NDArray[np.float64], axis: Axis) -> tuple[float, float, float]:
    """Yaw about an axis, then pitch and roll, degrees, that together make a turn (3, 3)."""

    def unturned(yaw: float) -> NDArray[np.float64]:
        return orbit_pose(None, (0, 0, 1), math.degrees(yaw), upright=axis)[:3, :3].T @ turn

    across = np.array([unturned(angle)[0, 2] for angle in (0.0, math.pi / 2, math.pi)])  # = a + b cos(yaw) + c sin(yaw)
    middle, cosine = (across[0] + across[2]) / 2, (across[0] - across[2]) / 2
    sine = across[1] - middle
    toward, reach = math.atan2(sine, cosine), math.hypot(cosine, sine)
    aside = math.acos(min(max(-middle / reach, -1.0), 1.0)) if reach > 1e-12 else 0.0
    either = (toward + aside, toward - aside)
    yaw = max(either, key=lambda angle: (unturned(angle)[2, 2] > 0, unturned(angle)[0, 0]))  # ahead, then upright
    left = unturned(yaw)
    pitch, roll = math.atan2(left[1, 2], left[2, 2]), math.atan2(-left[0, 1], left[0, 0])
    return tuple(math.degrees(math.remainder(angle, 2 * math.pi)) for angle in (yaw, pitch, roll))  # pyright: ignore
