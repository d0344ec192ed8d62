"""Converts cameras, lights, transforms and image-based lights (EXT_lights_image_based) from and to glTF."""

from __future__ import annotations

import math
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from ...notes.words import shown
from ...scene.camera import Camera, is_rotation, quaternion_of, rotation_of
from ...scene.environment import WIDEST, Environment, reduced
from ...scene.light import LUX, Light, Vector, unit
from ...scene.values import srgb_to_linear
from ..access.content import check_pixels
from .buffers import IMAGE_BASED, GltfParts, named_light, naming_part, numbers, options, switch

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
    """A perspective camera, 480 pixels high unless its extras have its numbers. Raises ValueError."""
    view = camera.perspective
    if view is None:
        raise ValueError("has no perspective")
    ours = options(camera.extras, _CAMERA_KEYS)
    if ours:
        missing = [key for key in _CAMERA_KEYS if key not in ours]
        if missing:
            raise ValueError(f"its extras 'pointshade' have no {', '.join(missing)}")
        fx, fy, cx, cy, width, height = numbers([ours[key] for key in _CAMERA_KEYS], (6,), "the camera").tolist()
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
    """A light in node axes, its intensity times the exposure. Raises ValueError. node_casts: whether it casts shadows
    where its own extras do not state it."""
    if not isinstance(light, dict):
        raise ValueError(f"must be an object, got {shown(light)}")
    kind = light.get("type")
    if kind not in ("directional", "point", "spot"):
        raise ValueError(f"its type must be directional, point or spot, got {shown(kind)}")
    ours = options(light.get("extras"), _LIGHT_KEYS)
    for key, only in (("at", "viewer"), ("units", "photometric")):
        if ours.get(key, only) != only:
            raise ValueError(f"its extras: {key} must be {only!r}, got {shown(ours[key])}")
    placed, falls, is_area = "at" not in ours, kind != "directional", "size" in ours
    attenuation = _three(numbers(ours.get("attenuation", _FALLING if falls else _DIRECTIONAL), (3,), "attenuation"))
    factor = LUX * exposure / (LUMENS if is_blenders or "units" in ours else 1)
    if "reach" in ours:
        factor /= _gain(attenuation, numbers(ours["reach"], (), "reach").item())
    return Light(
        position=(0.0, 0.0, 0.0) if falls and placed else None,
        direction=(0.0, 0.0, -1.0) if kind != "point" and placed else None,
        color=_three(numbers(light.get("color", (1, 1, 1)), (3,), "color")),
        intensity=float(f"{numbers(light.get('intensity', 1), (), 'intensity').item() * factor:.15g}"),
        attenuation=attenuation,
        cone=_read_cone(light.get("spot"), ours, is_blenders) if kind == "spot" and not is_area else (0.0, 45.0),
        shadow=switch(ours, "shadow", node_casts),
        radius=numbers(ours.get("radius", 0), (), "radius").item(),
        angle=numbers(ours.get("angle", 0), (), "angle").item(),
        size=numbers(ours["size"], (2,), "size") if is_area else None,
    )


def _gain(attenuation: Vector, reach: float) -> float:
    """Return by how much a light with inverse-square falloff must be stronger to be as bright at a distance."""
    constant, linear, quadratic = attenuation
    divisor = constant + linear * reach + quadratic * reach * reach
    if not (reach > 0 and divisor > 0):
        raise ValueError(f"reach must be above 0, got {reach:g}")
    return reach * reach / divisor


def _read_cone(spot: Any, ours: dict[str, Any], is_blenders: bool) -> tuple[float, float]:
    if "cone" in ours and not is_blenders:
        inner, outer = numbers(ours["cone"], (2,), "cone").tolist()
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
    """A light of KHR_lights_punctual, for a node at `light_place`: of an area light the widest spot. One of another
    falloff than glTF's is as bright as ours at the distance `reach`."""
    kind = "directional" if light.position is None else "point" if light.direction is None else "spot"
    strongest = max(1.0, *light.color)  # glTF's colours end at 1
    ours: dict[str, Any] = {}
    intensity = light.intensity * strongest / LUX
    if units == "photometric":
        ours["units"] = units
        intensity *= LUMENS
    if light.shadow != node_casts:
        ours["shadow"] = light.shadow
    if light.attenuation != (_DIRECTIONAL if kind == "directional" else _FALLING):
        ours["attenuation"] = list(light.attenuation)
        if kind != "directional":
            ours["reach"] = reach
            intensity *= _gain(light.attenuation, reach)
    values: dict[str, Any] = {"type": kind, "color": [part / strongest for part in light.color], "intensity": intensity}
    if kind == "spot":
        cone = (0.0, 90.0) if light.is_area else light.cone
        values["spot"] = _write_cone(cone, units)
        if not light.is_area and _read_cone(values["spot"], {}, is_blenders=False) != cone:
            ours["cone"] = list(cone)
    ours |= {name: size for name in ("radius", "angle", "size") if (size := getattr(light, name))}
    if light.position is None and light.direction is None:
        ours["at"] = "viewer"
    if ours:
        values["extras"] = {"pointshade": ours}
    return values


def local_matrix(node: SimpleNamespace) -> Matrix:
    """(4, 4) node-to-parent. Raises ValueError for numbers that are not a transform."""
    if node.matrix is not None:
        return numbers(node.matrix, (4, 4), "matrix").T  # glTF writes columns
    result = np.eye(4)
    if node.rotation is not None:
        result[:3, :3] = turn_of(node.rotation)
    if node.scale is not None:
        result[:3, :3] *= numbers(node.scale, (3,), "scale")
    if node.translation is not None:
        result[:3, 3] = numbers(node.translation, (3,), "translation")
    return result


def turn_of(rotation: Any) -> Matrix:
    """(3, 3) of a quaternion x, y, z, w of any length but zero. Raises ValueError."""
    quaternion = numbers(rotation, (4,), "rotation")
    length = np.linalg.norm(quaternion)
    if length < 1e-12:
        raise ValueError("rotation must be a quaternion of unit length, got (0, 0, 0, 0)")
    return rotation_of(quaternion / length)


def transform_of(matrix: Matrix) -> dict[str, list[float]] | None:
    """translation, rotation and scale that make the matrix; None of a shear, which glTF has not."""
    scale = np.linalg.norm(matrix[:3, :3], axis=0)
    if np.linalg.det(matrix[:3, :3]) < 0:  # a mirror
        scale[2] *= -1
    turn = matrix[:3, :3] / scale
    if not is_rotation(turn, 1e-12):
        return None
    scale[np.abs(scale - 1) < 1e-12] = 1
    parts = {
        "translation": (matrix[:3, 3], (0, 0, 0)),
        "rotation": (quaternion_of(turn), (0, 0, 0, 1)),
        "scale": (scale, (1, 1, 1)),
    }
    return {name: value.tolist() for name, (value, usual) in parts.items() if not np.array_equal(value, usual)}


def unsheared(matrix: Matrix) -> tuple[Matrix, Matrix]:
    """Return the matrices of a node and of one below it, both without a shear, whose product is the matrix."""
    left, scale, right = np.linalg.svd(matrix[:3, :3])
    for turn, axis in ((left, np.s_[:, 2]), (right, np.s_[2])):
        if np.linalg.det(turn) < 0:
            turn[axis] *= -1
            scale[2] *= -1
    above, below = np.array(matrix), np.eye(4)
    above[:3, :3], below[:3, :3] = left * scale, right
    return above, below


Array = NDArray[np.float64]
BRIGHTEST = 255.0  # that RGBD holds
_GAMMA = 2.2  # of the colours in RGBD
_MIRROR = np.array([-1.0, 1.0, 1.0])  # from the axes of a cube map to glTF's, and back
# Of the faces +x, -x, +y, -y, +z and -z, in axes of the cube map: the ways that go right, down and ahead.
_FACES = np.array([
    [(0, 0, -1), (0, -1, 0), (1, 0, 0)],
    [(0, 0, 1), (0, -1, 0), (-1, 0, 0)],
    [(1, 0, 0), (0, 0, 1), (0, 1, 0)],
    [(1, 0, 0), (0, 0, -1), (0, -1, 0)],
    [(1, 0, 0), (0, -1, 0), (0, 0, 1)],
    [(-1, 0, 0), (0, -1, 0), (0, 0, -1)],
])  # fmt: skip
_SAMPLES = 128  # of the lobe of a rough surface


def face_directions(size: int) -> Array:
    """Return the unit directions of the pixels of all faces, (6, size, size, 3), glTF's axes."""
    at = (2 * np.arange(size) + 1) / size - 1
    right, down, ahead = (_FACES[:, None, None, k] for k in range(3))
    rays = ahead + at[:, None] * right + at[:, None, None] * down
    return rays / np.linalg.norm(rays, axis=-1, keepdims=True) * _MIRROR


def sphere_directions(width: int) -> Array:
    """Return the unit directions of the pixels of an environment's picture, (width / 2, width, 3)."""
    elevation = math.pi * (0.5 - (2 * np.arange(width // 2) + 1) / width)[:, None]
    azimuth = 2 * math.pi * ((np.arange(width) + 0.5) / width - 0.5)
    height = np.broadcast_to(np.sin(elevation), (width // 2, width))
    return np.stack([np.cos(elevation) * np.cos(azimuth), height, np.cos(elevation) * np.sin(azimuth)], -1)


def seen_in_cube(faces: Array, directions: Array) -> Array:
    """Return what the faces of a cube map, (6, n, n, 3), show along directions (..., 3), bilinear within a face."""
    rays, size = directions * _MIRROR, faces.shape[1]
    axis = np.abs(rays).argmax(-1)
    face = 2 * axis + (np.take_along_axis(rays, axis[..., None], -1)[..., 0] < 0)
    right, down, ahead = np.moveaxis((_FACES[face] @ rays[..., None])[..., 0], -1, 0)
    column, row = ((one / ahead + 1) * size / 2 - 0.5 for one in (right, down))
    return _bilinear(np.pad(faces, ((0, 0), (1, 1), (1, 1), (0, 0)), "edge"), face, row, column)


def seen_on_sphere(picture: NDArray[Any], directions: Array) -> Array:
    """Return what an environment's picture shows along directions (..., 3), bilinear."""
    (height, width), (x, y, z) = picture.shape[:2], np.moveaxis(directions, -1, 0)
    column = (0.5 + np.arctan2(z, x) / (2 * math.pi)) * width - 0.5
    row = (0.5 - np.arcsin(np.clip(y, -1, 1)) / math.pi) * height - 0.5
    padded = np.pad(np.pad(picture, ((1, 1), (0, 0), (0, 0)), "edge"), ((0, 0), (1, 1), (0, 0)), "wrap")
    return _bilinear(padded[None].astype(np.float64), np.zeros(row.shape, np.int64), row, column)


def _bilinear(padded: Array, which: NDArray[np.int64], row: Array, column: Array) -> Array:
    """Return values between pixels of one of several pictures, which have one pixel more on each side."""
    top, left = np.floor(row).astype(np.int64), np.floor(column).astype(np.int64)
    v, u = (row - top)[..., None], (column - left)[..., None]
    top, left = top + 1, left + 1
    upper = padded[which, top, left] * (1 - u) + padded[which, top, left + 1] * u
    lower = padded[which, top + 1, left] * (1 - u) + padded[which, top + 1, left + 1] * u
    return upper * (1 - v) + lower * v


def are_mirrored(faces: Array) -> bool:
    """Return whether each face (6, n, n, 3) is mirrored for itself, as the extension's text has it."""
    positive, negative, _, _, front, back = faces  # if so, sides fit together better with +x and -x exchanged

    def gap(left: Array, right: Array) -> float:
        return float(np.abs(left[:, -1] - right[:, 0]).sum())

    as_viewers = gap(front, positive) + gap(positive, back) + gap(back, negative) + gap(negative, front)
    as_written = gap(front, negative) + gap(negative, back) + gap(back, positive) + gap(positive, front)
    return as_written < 0.5 * as_viewers


def rough(picture: NDArray[Any], size: int, roughness: float) -> Array:
    """Return the faces (6, size, size, 3) of the mean over a rough surface's GGX lobe, seen from above (Karis 2013)."""
    ahead, total = face_directions(size), np.zeros((6, size, size, 3))
    side = np.cross(np.where(np.abs(ahead[..., 1:2]) < 0.9, (0, 1, 0), (1, 0, 0)), ahead)
    side /= np.linalg.norm(side, axis=-1, keepdims=True)
    other, weights = np.cross(ahead, side), 0.0
    for k in range(_SAMPLES):
        share, angle = (k + 0.5) / _SAMPLES, k * math.pi * (3 - math.sqrt(5))
        cosine = math.sqrt((1 - share) / (1 + (roughness**4 - 1) * share))  # of the half vector
        along = 2 * cosine * cosine - 1
        if along <= 0:
            continue
        across = math.sqrt(1 - along * along)
        ways = along * ahead + across * (math.cos(angle) * side + math.sin(angle) * other)
        total += along * seen_on_sphere(picture, ways)
        weights += along
    return total / weights


def irradiance_coefficients(picture: NDArray[Any]) -> list[list[float]]:
    """Return the irradiance of an environment's picture as spherical harmonics of order 2, (9, 3), in cube axes."""
    height, width = picture.shape[:2]
    edges = np.sin(math.pi * (0.5 - np.arange(height + 1) / height))
    light = picture.astype(np.float64) * ((edges[:-1] - edges[1:]) * 2 * math.pi / width)[:, None, None]
    elevation = math.pi * (0.5 - (np.arange(height) + 0.5) / height)[:, None]
    azimuth = 2 * math.pi * ((np.arange(width) + 0.5) / width - 0.5)
    x, y, z = -np.cos(elevation) * np.cos(azimuth), np.sin(elevation) + 0 * azimuth, np.cos(elevation) * np.sin(azimuth)
    second = 1.092548
    bases = [
        0 * x + 0.282095, 0.488603 * y, 0.488603 * z, 0.488603 * x, second * x * y, second * y * z,
        0.315392 * (3 * z * z - 1), second * x * z, second / 2 * (x * x - y * y),
    ]  # fmt: skip
    factors = [math.pi, *[2 * math.pi / 3] * 3, *[math.pi / 4] * 5]  # Ramamoorthi and Hanrahan 2001
    return [(factor * np.tensordot(one, light)).tolist() for factor, one in zip(factors, bases, strict=True)]


def from_rgbd(colors: NDArray[np.uint8]) -> Array:
    """Return the linear light of RGBD, (..., 4): colours by the power of 2.2, divided by alpha."""
    return (colors[..., :3] / 255.0) ** _GAMMA / (np.maximum(colors[..., 3:], 1) / 255.0)


def to_rgbd(light: Array) -> NDArray[np.uint8]:
    """Return linear light up to BRIGHTEST as RGBD, (..., 4)."""
    divisor = np.floor(np.clip(255 / np.maximum(light.max(-1, keepdims=True), 1), 1, 255))
    colors = np.rint(np.clip(light * divisor / 255, 0, 1) ** (1 / _GAMMA) * 255)
    return np.concatenate([colors, divisor], -1).astype(np.uint8)


_SMALLEST, _LARGEST = 16, 128  # pixels of a side of the faces that are written: of the last and of the first level
_BLURRED = 64  # columns of the picture of which the first rough level is made; half of it for the next, and so on


def read_environment(
    scene: SimpleNamespace | None, parts: GltfParts, factor: float, axes: NDArray[np.float64]
) -> Environment | None:
    """Return the environment of a scene of the file, its light times a factor; None without one. Raises ValueError.
    axes: (3, 3) from the scene's world to the file's."""
    found = named_light(parts.gltf, scene, IMAGE_BASED, "image-based light")
    if found is None:
        return None
    index, light = found
    if not isinstance(light, dict):
        raise ValueError(f"image-based light {index} must be an object, got {shown(light)}")
    with naming_part(f"image-based light {index}"):
        turn = turn_of(light.get("rotation", (0, 0, 0, 1)))
        intensity = numbers(light.get("intensity", 1), (), "intensity").item()
        if intensity < 0:
            raise ValueError(f"intensity must be 0 or above, got {intensity:g}")
        numbers(light.get("irradianceCoefficients", np.zeros(27)), (9, 3), "irradianceCoefficients")
        faces = _faces(light.get("specularImages"), parts)
        directions = sphere_directions(min(4 * faces.shape[1], WIDEST)) @ axes.T @ turn  # rows: the inverse turn
        return Environment(intensity * factor * seen_in_cube(faces, directions))


def _faces(levels: Any, parts: GltfParts) -> NDArray[np.float64]:
    """(6, n, n, 3) linear light of the first level."""
    level = levels[0] if isinstance(levels, list) and levels else None
    if not isinstance(level, list) or len(level) != 6:
        raise ValueError("specularImages must be levels of 6 images, the faces of a cube")
    pictures = [parts.picture(index) for index in level]
    sizes = {picture.shape[:2] for picture in pictures}
    if len(sizes) > 1 or len(set(*sizes)) > 1:
        found = ", ".join(f"{width}x{height}" for height, width in sorted(sizes))
        raise ValueError(f"the faces of a cube must be squares of one size, got {found}")
    faces = np.stack([from_rgbd(one) if one.shape[2] == 4 else srgb_to_linear(one / 255.0) for one in pictures])
    while faces.shape[1] > WIDEST // 4 and faces.shape[1] % 2 == 0:
        half = faces.shape[1] // 2
        faces = faces.reshape(6, half, 2, half, 2, 3).mean((2, 4))
    return faces[[1, 0, 2, 3, 4, 5]] if are_mirrored(faces) else faces


def write_environment(environment: Environment, add_image: Callable[[NDArray[np.uint8]], int]) -> dict[str, Any]:
    """Return the image-based light of an environment. add_image: writes (h, w, 4) uint8, and returns its number."""
    picture = environment.picture
    intensity = max(1.0, float(picture.max()) / BRIGHTEST)
    picture = picture / intensity
    size = 2 ** math.ceil(math.log2(min(max(picture.shape[1] / 2, _SMALLEST), _LARGEST)))
    count = int(math.log2(size / _SMALLEST)) + 1
    levels = [seen_on_sphere(picture, face_directions(size))]
    levels += [rough(reduced(picture, _BLURRED >> (k - 1)), size >> k, k / (count - 1)) for k in range(1, count)]
    return {
        "intensity": intensity,
        "irradianceCoefficients": irradiance_coefficients(picture),
        "specularImageSize": size,
        "specularImages": [[add_image(to_rgbd(face)) for face in level] for level in levels],
    }
