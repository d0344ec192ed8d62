"""Converts cameras and lights from and to glTF: both look along -z with y up, ours along z with y down."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from ...notes.words import shown
from ...scene.camera import Camera
from ...scene.light import LUX, Light, Vector, unit
from ..access.limits import check_pixels
from .checks import numbers
from .extras import options, switch

Matrix = NDArray[np.float64]
FLIP = np.diag([1.0, -1.0, -1.0, 1.0])  # between the axes of a glTF camera and ours, either way
LUMENS = 683.0  # a watt, as Blender reads and writes them
Units = Literal["photometric", "unitless"]
AHEAD = np.array([0.0, 0.0, -1.0])
_HEIGHT, _ASPECT = 480, 4 / 3
_CAMERA_KEYS = ("fx", "fy", "cx", "cy", "width", "height")  # in the order of Camera
_LIGHT_KEYS = ("shadow", "attenuation", "reach", "at", "radius", "angle", "size", "units", "cone")
_DIRECTIONAL, _FALLING = (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)


def read_camera(camera: SimpleNamespace, max_pixels: float) -> Camera:
    """A perspective camera, 480 pixels high unless its extras say otherwise. Raises ValueError."""
    view = camera.perspective
    if view is None:
        raise ValueError("has no perspective")
    said = options(camera.extras, _CAMERA_KEYS)
    if said:
        missing = [key for key in _CAMERA_KEYS if key not in said]
        if missing:
            raise ValueError(f"its extras 'pointshade' have no {', '.join(missing)}")
        fx, fy, cx, cy, width, height = numbers([said[key] for key in _CAMERA_KEYS], (6,), "the camera").tolist()
        check_pixels(math.ceil(width), math.ceil(height), "its picture", max_pixels)
        return Camera(fx, fy, cx, cy, width, height)  # type: ignore[arg-type]
    fov = numbers(view.yfov, (), "yfov").item()
    aspect = numbers(_ASPECT if view.aspectRatio is None else view.aspectRatio, (), "aspectRatio").item()
    if not 0 < fov < math.pi or aspect <= 0:
        raise ValueError(f"yfov must lie between 0 and pi and aspectRatio be above 0, got {fov:g} and {aspect:g}")
    width = max(1, round(_HEIGHT * aspect))
    check_pixels(width, _HEIGHT, "its picture", max_pixels)
    return Camera.from_fov(math.degrees(fov), width, _HEIGHT)


def camera_pose(world: Matrix) -> Matrix:
    """Camera-to-world of a node: its place and where it looks; a scale or a mirror above it changes nothing."""
    z = -world[:3, 2] / np.linalg.norm(world[:3, 2])
    x = np.cross(world[:3, 1], -z)
    x /= np.linalg.norm(x)
    pose = np.eye(4)
    pose[:3] = np.column_stack([x, np.cross(z, x), z, world[:3, 3]])
    return pose


def write_camera(camera: Camera) -> dict[str, Any]:
    """A glTF camera. Our numbers stand in its extras: the principal point and the size in pixels are not in glTF."""
    field = 2 * math.atan(camera.height / 2 / abs(camera.fy))
    aspect = camera.width / camera.fx * abs(camera.fy) / camera.height
    return {
        "type": "perspective",
        "perspective": {"yfov": field, "aspectRatio": aspect, "znear": 0.01},
        "extras": {"pointshade": {key: getattr(camera, key) for key in _CAMERA_KEYS}},
    }


def read_light(light: Any, exposure: float, node_casts: bool, is_blenders: bool) -> Light:
    """A light in node axes. Raises ValueError.

    exposure    a factor on its intensity
    node_casts  whether it casts shadows when its own extras do not say
    is_blenders  whether Blender wrote it
    """
    if not isinstance(light, dict):
        raise ValueError(f"must be an object, got {shown(light)}")
    kind = light.get("type")
    if kind not in ("directional", "point", "spot"):
        raise ValueError(f"its type must be directional, point or spot, got {shown(kind)}")
    said = options(light.get("extras"), _LIGHT_KEYS)
    if said.get("at", "viewer") != "viewer":
        raise ValueError(f"its extras: at must be 'viewer', got {shown(said['at'])}")
    if said.get("units", "photometric") != "photometric":
        raise ValueError(f"its extras: units must be 'photometric', got {shown(said['units'])}")
    placed, falls, is_area = "at" not in said, kind != "directional", "size" in said
    attenuation = _three(numbers(said.get("attenuation", _FALLING if falls else _DIRECTIONAL), (3,), "attenuation"))
    factor = LUX * exposure / (LUMENS if is_blenders or "units" in said else 1)
    if "reach" in said:
        factor /= _gain(attenuation, numbers(said["reach"], (), "reach").item())
    return Light(
        position=(0.0, 0.0, 0.0) if falls and placed else None,
        direction=(0.0, 0.0, -1.0) if kind != "point" and placed else None,
        color=_three(numbers(light.get("color", (1, 1, 1)), (3,), "color")),
        intensity=float(f"{numbers(light.get('intensity', 1), (), 'intensity').item() * factor:.15g}"),
        attenuation=attenuation,
        cone=_read_cone(light.get("spot"), said, is_blenders) if kind == "spot" and not is_area else (0.0, 45.0),
        shadow=switch(said, "shadow", node_casts),
        radius=numbers(said.get("radius", 0), (), "radius").item(),
        angle=numbers(said.get("angle", 0), (), "angle").item(),
        size=numbers(said["size"], (2,), "size") if is_area else None,
    )


def _gain(attenuation: Vector, reach: float) -> float:
    """Return by how much a light with inverse-square falloff must be stronger to be as bright at a distance."""
    constant, linear, quadratic = attenuation
    divisor = constant + linear * reach + quadratic * reach * reach
    if not (reach > 0 and divisor > 0):
        raise ValueError(f"reach must be above 0, got {reach:g}")
    return reach * reach / divisor


def _read_cone(spot: Any, said: dict[str, Any], is_blenders: bool) -> tuple[float, float]:
    if "cone" in said and not is_blenders:
        inner, outer = numbers(said["cone"], (2,), "cone").tolist()
        return inner, outer
    spot = spot if isinstance(spot, dict) else {}
    outer = numbers(spot.get("outerConeAngle", math.pi / 4), (), "outerConeAngle").item()
    inner = numbers(spot.get("innerConeAngle", 0), (), "innerConeAngle").item()
    if is_blenders and 0 <= inner <= outer <= math.pi:  # Blender blends cosines, but its exporter blends the angles
        blend = 1 - inner / outer if outer else 0.0
        inner = math.acos(min(math.cos(outer) + (1 - math.cos(outer)) * blend, 1.0))
    return min(math.degrees(inner), 90.0), min(math.degrees(outer), 90.0)  # pi/2 in float32 is more than that


def _write_cone(cone: tuple[float, float], units: Units) -> dict[str, float]:
    """Return a spot's angles, in photometric files those from which Blender makes the blend that looks the same."""
    inner, outer = map(math.radians, cone)
    if units == "photometric":
        blend = (math.cos(inner) - math.cos(outer)) / (1 - math.cos(outer))
        inner = outer * (1 - blend)
    return {"innerConeAngle": min(max(inner, 0.0), outer * (1 - 1e-9)), "outerConeAngle": outer}


def _three(values: Matrix) -> tuple[float, float, float]:
    x, y, z = values.tolist()
    return x, y, z


def light_place(light: Light) -> Matrix:
    """(4, 4) the place below our node of a glTF node that shines as the light does."""
    place = np.eye(4) if light.direction is None else looking_along(light.direction)
    if light.position is not None:
        place[:3, 3] = light.position
    return place


def looking_along(direction: Any) -> Matrix:
    """(4, 4) of a node at zero whose -z is a direction, (3,)."""
    turn = np.eye(4)
    z = -unit(direction)
    if np.abs(z + AHEAD).max() > 1e-12:
        side = np.cross((0, 1, 0) if abs(z[1]) < 0.9 else (1, 0, 0), z)
        side /= np.linalg.norm(side)
        turn[:3, :3] = np.column_stack([side, np.cross(z, side), z])
    return turn


def write_light(light: Light, node_casts: bool, reach: float, units: Units) -> dict[str, Any]:
    """A light of KHR_lights_punctual, for a node at `light_place`: of an area light the widest spot.

    reach   the distance at which a light of another falloff than glTF's is as bright as ours
    """
    kind = "directional" if light.position is None else "point" if light.direction is None else "spot"
    strongest = max(1.0, *light.color)  # glTF's colours end at 1
    said: dict[str, Any] = {}
    intensity = light.intensity * strongest / LUX
    if units == "photometric":
        said["units"] = units
        intensity *= LUMENS
    if light.shadow != node_casts:
        said["shadow"] = light.shadow
    if light.attenuation != (_DIRECTIONAL if kind == "directional" else _FALLING):
        said["attenuation"] = list(light.attenuation)
        if kind != "directional":
            said["reach"] = reach
            intensity *= _gain(light.attenuation, reach)
    values: dict[str, Any] = {
        "type": kind,
        "color": [part / strongest for part in light.color],
        "intensity": intensity,
    }
    if kind == "spot":
        cone = (0.0, 90.0) if light.is_area else light.cone
        values["spot"] = _write_cone(cone, units)
        if not light.is_area and _read_cone(values["spot"], {}, is_blenders=False) != cone:
            said["cone"] = list(cone)
    said |= {name: size for name in ("radius", "angle", "size") if (size := getattr(light, name))}
    if light.position is None and light.direction is None:
        said["at"] = "viewer"
    if said:
        values["extras"] = {"pointshade": said}
    return values
