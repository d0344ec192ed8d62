"""What one view of a scene needs: the objects in view, those that cast shadows, and how many points of each."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import compress
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..checks.arguments import check_float
from .appearance import NOT_LIT, Appearance, Material
from .camera import Camera, Eye, moved
from .cloud import PointCloud
from .environment import NO_ENVIRONMENT, EnvironmentLight
from .frame import Frame
from .graph import Scene
from .light import Light, at_upper_left
from .node import Placed
from .values import ColorScale

Matrix = NDArray[np.float64]


class VisibleScene(NamedTuple):
    """What one picture of a scene shows, and what casts shadows in it."""

    eye: Eye
    lights: list[Light]  # each with a position or a direction, world axes
    scene: Scene
    shown: Sequence[Placed]  # in view
    shadow_casters: Sequence[Placed]  # may cast shadows; empty if no light casts any
    gain: float = 1.0  # factor on all light: the exposure
    environment_light: EnvironmentLight = NO_ENVIRONMENT
    sample: int = 0  # of the picture
    scale: ColorScale | None = None  # of colours that are no light
    fill: float = 0.0  # share of light from all around that is mixed in
    materials: Sequence[Material] = ()  # of all that is shown, each once; never empty
    apart: bool = False  # copies of one mesh are drawn one by one, with numbers of their own
    coarse: int = 1  # how many times larger the pixels of shadow maps are, while things move
    steady: Eye | None = None  # of a sample whose eye looks through other places of the pixels: through their middle

    @property
    def is_lit(self) -> bool:
        """Return whether light is seen on anything that is shown."""
        return any(p.content.shading not in NOT_LIT for p in self.shown)


def compose(
    scene: Scene, lights: Sequence[Light], camera: Camera, pose: Matrix,
    environment_light: EnvironmentLight = NO_ENVIRONMENT, shows_all: bool = False,
) -> VisibleScene:  # fmt: skip
    """Return what a camera at a pose (4, 4) sees of a scene under these lights. shows_all: also what is out of view."""
    instances = scene.instances
    eye = Eye.at_distance(camera, pose, looking_distance(scene, pose))
    shown = instances if shows_all or is_alone(instances) else list(compress(instances, in_view(*scene.boxes, eye)))
    shadow_casters = [p for p in instances if p.node.shadow] if any(light.shadow for light in lights) else []
    lights = [at_upper_left(light, pose) for light in lights]
    contents = dict.fromkeys(p.content for p in shown)  # of many copies of one, one
    materials = list(dict.fromkeys(content.material for content in contents)) or [Material()]
    return VisibleScene(
        eye, lights, scene, shown, shadow_casters, environment_light=environment_light, materials=materials
    )


def is_alone(instances: Sequence[Placed]) -> bool:
    """Return whether this is a single point object, which is always drawn from all of its points."""
    return len(instances) == 1 and bool(instances[0].content.frames)


def looking_distance(scene: Scene, pose: Matrix) -> float:
    """Return how far away the objects are that a viewer at this pose looks at, world units: it decides about the near
    plane.

    Of a frame alone, the median distance from which it was taken, wherever the viewer is. Of several objects, the
    distance to their middle, or their radius where that is more.
    """
    if is_alone(scene.instances):
        alone = scene.instances[0]
        return alone.content.scale * alone.rigid_axes[1]
    centre, radius = scene.bounds
    return max(float(np.linalg.norm(centre - pose[:3, 3])), radius)


def in_view(corners: Matrix, counts: NDArray[np.int64], eye: Eye) -> NDArray[np.bool_]:
    """Return which instances may be visible: none that lies outside one side of the picture, and none without a box.

    corners  (n, 3) of boxes round them, world
    counts   how many of them are each thing's
    """
    view, camera = np.linalg.inv(eye.pose), eye.camera
    x, y, z = moved(corners, view).T
    u, v = camera.fx * x + (camera.cx + 0.5) * z, camera.fy * y + (camera.cy + 0.5) * z
    outside = (u < 0, u > camera.width * z, v < 0, v > camera.height * z, z < eye.near)
    owners = np.repeat(np.arange(len(counts)), counts)
    return np.all([np.bincount(owners[~side], minlength=len(counts)) > 0 for side in outside], axis=0)


MOST_COARSE, FEWEST = 32, 4  # of how many pixels one is drawn, at most; how many are drawn on each side, at least
PLACES = 160  # in a row of the surface that a frame hides, about
STRIDES = 4, 6  # pixels of the frame for each of these, at least and at most
MERGE = 1e-5  # of 1/z: invisible (`bench --speed` charts it), and gives planes their full speed


def check_merge(merge: float) -> float:
    """Return the tolerance of merged splats, a share of 1/z. Raises ValueError outside 0 to 0.01."""
    return check_float(merge, "merge must be a share of the inverse depth from 0 to 0.01", 0, 0.01)


def coarser_step(placed: Placed, eye: Eye) -> int:
    """Return 1, 2, 4, ...: every step-th pixel of a frame is enough, as several fall into one pixel of the view.

    Measured at the nearest corner of the object's box, so that no part of it is drawn too coarsely. At least FEWEST
    pixels are left on each side of the frame.
    """
    view, corners, frame = np.linalg.inv(eye.pose), placed.main_corners, placed.content.frame
    depth = moved(corners, view)[:, 2]
    nearest = float(depth.min()) if len(depth) else 0.0
    if nearest <= 0:
        return 1
    farthest = float(frame.main_corners[:, 2].max()) * placed.rigid_axes[1]
    spread = farthest / min(frame.camera.fx, abs(frame.camera.fy))  # between neighbours, world units, at most
    pixels = spread * max(eye.camera.fx, abs(eye.camera.fy)) / nearest
    most = min(MOST_COARSE, max(min(frame.depth.shape) // FEWEST, 1))
    return int(2 ** np.floor(np.log2(np.clip(1 / pixels, 1, most))))


def coarser_size(size: float, step: int) -> float:
    """Return a splat's size in pixels of a coarser frame, so that those at its border reach as far as before."""
    return 1 + (size - 1) / step if size > 1 else size


def coarser(frame: Frame, step: int) -> Frame:
    """Return a frame of every step-th pixel, with all of its colours."""
    first, c = (step - 1) // 2, frame.camera
    depth = frame.depth[first::step, first::step]
    height, width = depth.shape
    camera = Camera(c.fx / step, c.fy / step, (c.cx - first) / step, (c.cy - first) / step, width, height)
    return Frame(frame.color, depth, camera, frame.pose, source=frame.source).turning_as(frame)


def finer_camera(frame: Frame, look: Appearance, camera: Camera) -> Camera:
    """Return the frame's camera, at the size at which its points are drawn for a view by another camera.

    That is as fine as the pixels of the view, but no finer than the colours; the depth's own size where these are not
    larger, and where the look asks for the depth's own points. It does not depend on the pose: moving costs nothing.
    """
    small, large = frame.camera, frame.picture_camera
    if look.upsample == "none" or look.has_own_sizes or large == small:
        return small
    width = int(np.clip(round(small.width * camera.fx / small.fx), small.width, large.width))
    height = int(np.clip(round(small.height * abs(camera.fy / small.fy)), small.height, large.height))
    return small if (width, height) == (small.width, small.height) else small.resized(width, height)


def bridged_stride(camera: Camera) -> int:
    """Return how many pixels of a frame correspond to one of the smaller surface of what it hides."""
    least, most = STRIDES
    return min(max(-(-camera.width // PLACES), least), most)


def bridged_camera(camera: Camera) -> Camera:
    """Return the camera of that smaller surface: it has one pixel in the middle of each stride."""
    stride = bridged_stride(camera)
    cx, cy = (camera.cx - stride // 2) / stride, (camera.cy - stride // 2) / stride
    width, height = -(-camera.width // stride), -(-camera.height // stride)
    return Camera(camera.fx / stride, camera.fy / stride, cx, cy, width, height)


PER_PIXEL = 2.0  # points for each pixel that the cloud covers, those behind included
MOST_DRAWN = 1 << 24  # points, whatever the view
SAMPLE = 4096  # points that tell what a cloud covers
CELL = 16  # pixels along a side of the cells in which they are counted
SEED = 20010  # of the samples
CHUNK = 1 << 24


def level_of(placed: Placed, eye: Eye) -> int:
    """Return the level of a placed cloud that an eye needs: 0 is all points."""
    cloud: PointCloud = placed.content
    if not len(cloud):
        return 0
    least = max(math.ceil(math.log2(len(cloud) / MOST_DRAWN)), 0)
    if not cloud.thins:
        return least
    covered, share = _seen(placed, eye)
    wanted = PER_PIXEL * covered / share if share else 1.0
    return max(math.floor(math.log2(max(len(cloud) / wanted, 1)) + 0.5), least)


def _seen(placed: Placed, eye: Eye) -> tuple[float, float]:
    """Return how many pixels the cloud covers, roughly, and the share of its points that are in view."""
    cloud, camera = placed.content, eye.camera
    some = cloud.positions[:: -(-len(cloud) // SAMPLE)] + cloud.origin
    x, y, z = moved(some, np.linalg.inv(eye.pose) @ placed.world).T
    ahead = z > eye.near
    u, v = (camera.fx * x[ahead] / z[ahead] + camera.cx + 0.5, camera.fy * y[ahead] / z[ahead] + camera.cy + 0.5)
    inside = (u >= 0) & (u < camera.width) & (v >= 0) & (v < camera.height)
    columns = -(-camera.width // CELL)
    cells = (v[inside] // CELL).astype(int) * columns + (u[inside] // CELL).astype(int)
    return float(len(np.unique(cells)) * CELL**2), float(np.count_nonzero(inside) / len(some))


def points_at(cloud: PointCloud, level: float) -> NDArray[np.int64] | None:
    """Return which points of a cloud a level has, in order; None for all. Each level is part of those below it."""
    if level == 0:
        return None
    random = np.random.default_rng(SEED)
    found: list[NDArray[np.int64]] = []
    for first in range(0, len(cloud), CHUNK):
        drawn = random.random(min(CHUNK, len(cloud) - first), np.float32) < 0.5**level
        found.append(np.flatnonzero(drawn) + first)
    return np.concatenate(found)
