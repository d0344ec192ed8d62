"""The names that programs give to focal lengths, camera matrices, image sizes and units in their files.

A new word is added to a row below; a camera in a form of its own gets a reader beside `from_colmap`.
"""

from __future__ import annotations

import math
import re
from collections import ChainMap
from collections.abc import Mapping, Sequence
from dataclasses import replace

from ..arrays.named_numbers import Named
from .camera_numbers import from_matrix
from .intrinsics import NORMALIZED, Intrinsics, Numbers, Size

Words = Mapping[str, list[float]]  # numbers of a group by their last word


# What others call it, in lower case, without blanks, dashes and underscores. Of several in a file the earlier wins.
FX = ("fx", "flx", "focalx", "focallengthx", "fxdepth", "depthfx", "fxd", "fxrgb", "fxcolor")
FY = ("fy", "fly", "focaly", "focallengthy", "fydepth", "depthfy", "fyd", "fyrgb", "fycolor")
CX = ("cx", "ppx", "px", "u0", "principalx", "principalpointx", "cxdepth", "mxdepth", "cxd", "cxrgb", "mxcolor")
CY = ("cy", "ppy", "py", "v0", "principaly", "principalpointy", "cydepth", "mydepth", "cyd", "cyrgb", "mycolor")
FOCAL = ("f", "fl", "focal", "focallength", "focallengthpx", "focalpx", "focallengthpixels")
MATRIX = (
    "depthintrinsics", "depthintrinsic", "kdepth", "depthk", "intrinsicmatrix", "intrinsics", "intrinsic", "k",
    "cameramatrix", "cameraintrinsics", "cameraintrinsic", "camk", "kcam", "kmatrix", "camintrinsics", "cam0",
    "prect02", "p2", "prect00", "p0", "intrinsicdepth", "kcolor", "krgb", "intrinsicscolor", "rgbintrinsics", "p",
    "intrinsicsmatrix", "camerakmatrix",
)  # fmt: skip
WIDTH = ("width", "w", "imagewidth", "imgwidth", "imw", "depthwidth", "dw", "resx", "camerawidth", "cols")
HEIGHT = ("height", "h", "imageheight", "imgheight", "imh", "depthheight", "dh", "resy", "cameraheight", "rows")
SIZE = (
    "dimension", "renderproductresolution", "resolution", "imagesize", "imgsize", "size", "imsize", "srect02",
    "srect00",
)  # fmt: skip
PER_METRE = ("depthscale", "depthmapfactor", "factordepth", "depthfactor", "pngdepthscale", "scale", "depthshift")
METRES_EACH = ("depthunitscalefactor", "integerdepthscale", "depthunit", "depthunits", "metersperunit", "metresperunit")
FOV_X, FOV_Y = ("fovx", "hfov", "fovh", "horizontalfov"), ("fovy", "vfov", "fovv", "verticalfov", "yfov")
ANGLE_X, ANGLE_Y = ("cameraanglex",), ("cameraangley",)  # radians, nerf's own
CENTER = ("principalpoint", "principalpoints")  # cx, cy
ASPECT = ("pixelaspectratio",)  # fy/fx
APERTURE, LENS = ("cameraaperture",), ("camerafocallength",)  # Omniverse: both in the same unit
SENSOR = ("sensorwidth", "sensorwidthmm")  # Blender, Kubric: beside a focal length in millimetres
BASELINE, DOFFS = ("baseline",), ("doffs",)
DISTORTION = ("k1", "k2", "k3", "k4", "p1", "p2")

_BOP = "camk"
_SHORTEST = 0.15  # of the width: 147 degrees
_CORNER = ("flx", "cameraanglex", "pixelaspectratio")  # nerfstudio, nerf and nerfies count from the picture's corner
_REALSENSE = re.compile(r"(\d{2,5})x(\d{2,5})\s+p\[([\d.]+) ([\d.]+)\]\s+f\[([\d.]+) ([\d.]+)\]")  # in one line
_OTHERS = re.compile(r"(?i)(right|infra|imu|distort|rectif|project|extrin|(?<![a-z])ir(?![a-z]))")  # not the depth's
_SENS = re.compile(r"m_(?:calibration)?(color|depth)(\w+)", re.IGNORECASE)  # ScanNet's and BundleFusion's info.txt
_DEPTH, _COLOR = re.compile(r"(?i)depth|tof|left|cam0"), re.compile(r"(?i)colou?r|rgb|cam1|second")


def word(name: str) -> str:
    """The last part of a name, as the rows above spell it."""
    return re.sub(r"[^a-z0-9]", "", name.rsplit(".", 1)[-1].lower())


def from_named(named: Named, name: str, of_color: bool = False) -> list[Intrinsics]:
    """The cameras that named numbers describe: the depth's own before others, colour cameras last.

    of_color  the colour camera first: the depth was brought to it
    """
    named = {_SENS.sub(r"\1.\2", key): numbers for key, numbers in named.items()}
    grouped = _grouped(named)
    groups = [(grouped.get(group, {}), _around(grouped, group)) for group in _groups(named, of_color)]
    outside = next((numbers[0] for key, numbers in named.items() if word(key) in BASELINE), None)
    found = [_from_group(*words, name) for words in groups]
    found = [camera and replace(camera, baseline=camera.baseline or outside) for camera in found]
    if not any(found):
        found = [_from_angles(words, name) for words, _ in groups]
    return [camera for camera in found if camera]


def _groups(named: Named, of_color: bool) -> list[str]:
    """The names under which other names lie; "" is the top. Cameras that took neither picture are left out."""
    groups = dict.fromkeys(["", *(key.rpartition(".")[0] for key in named)])
    own = [group for group in groups if not _OTHERS.search(group)]
    first, last = (_COLOR, _DEPTH) if of_color else (_DEPTH, _COLOR)
    return sorted(own, key=lambda group: (bool(last.search(group)), not first.search(group), group.count(".")))


def _grouped(named: Named) -> dict[str, dict[str, list[float]]]:
    """The words of each group. ROS and OpenCV put the numbers of a matrix one level deeper, as `data`."""
    found: dict[str, dict[str, list[float]]] = {}
    for key, numbers in named.items():
        group, _, last = key.removesuffix(".data").rpartition(".")
        if not _OTHERS.search(last):
            found.setdefault(group, {}).setdefault(word(last), numbers)
    return found


def _around(grouped: dict[str, dict[str, list[float]]], group: str) -> Words:
    """The words of a group with what stands further up: sizes and units often do."""
    levels = [grouped.get(group, {})]
    while group:
        group = group.rpartition(".")[0]
        levels.append(grouped.get(group, {}))
    return ChainMap(*levels)


def _from_group(words: Words, around: Words, name: str) -> Intrinsics | None:
    sensor, lens = _first(words, SENSOR), _first(words, FOCAL)
    if sensor and lens and sensor > 0 and lens > 0:
        return Intrinsics(name, (lens / sensor, math.nan, 0.0, 0.0), NORMALIZED)
    if not any(key in words for key in (*FX, *FOCAL, *MATRIX, *LENS, "matrix")):
        return None
    size = _size_of(around, name)
    numbers = _numbers_of(words, size)
    if numbers is None:
        return None
    if any(key in words for key in _CORNER):
        numbers = (numbers[0], numbers[1], numbers[2] - 0.5, numbers[3] - 0.5)
    scale, each = _first(around, PER_METRE), _first(around, METRES_EACH)
    baseline, doffs = _first(around, BASELINE), _first(around, DOFFS)
    if doffs is not None and baseline is not None:  # Middlebury, where the baseline is in millimetres
        baseline /= 1000
    if baseline is None:
        baseline = _between(words)
    if scale and _BOP in words:
        scale = 1000 / scale  # BOP's is millimetres for each unit
    return Intrinsics(name, numbers, size, 1 / each if each else scale, None, baseline, doffs)


def _between(words: Words) -> float | None:
    """Metres between KITTI's two colour cameras: the fourth number of a projection is -fx times its place."""
    for left, right in (("prect02", "prect03"), ("p2", "p3")):
        if len(words.get(left, ())) == len(words.get(right, ())) == 12 and words[left][0]:
            return (words[left][3] - words[right][3]) / words[left][0]
    return None


def _numbers_of(words: Words, size: Size | None) -> Numbers | None:
    """fx, fy, cx, cy: as four numbers, as a matrix, as one focal length, or as angles of view."""
    fx, fy, cx, cy = (_first(words, keys) for keys in (FX, FY, CX, CY))
    if fx is not None and cx is not None and cy is not None:
        return fx, fx if fy is None else fy, cx, cy
    projection, sides = words.get("matrix", ()), words.get("dimension", ())
    if len(projection) == 9 and len(sides) == 2:  # Unity Perception's: from the middle, in halves of the picture
        width, height = sides
        return projection[0] * width / 2, projection[4] * height / 2, (width - 1) / 2, (height - 1) / 2
    for key in MATRIX:
        if (matrix := words.get(key)) and (found := from_matrix(matrix)):
            return found
    if size is None:
        return None
    middle = (size[0] - 1) / 2, (size[1] - 1) / 2
    lens, aperture = _first(words, LENS), next((words[key] for key in APERTURE if key in words), None)
    if lens and aperture:
        return lens / aperture[0] * size[0], lens / aperture[0] * size[0], *middle
    focal = _first(words, FOCAL) if fx is None else fx
    if focal is None or focal < _SHORTEST * size[0]:
        return None  # too short to be in pixels: millimetres of an unknown sensor
    fy = focal * (_first(words, ASPECT) or 1) if fy is None else fy
    center = next((words[key] for key in CENTER if len(words.get(key, ())) == 2), None)
    if center is None:
        center = middle if cx is None or cy is None else (cx, cy)
    return focal, fy, center[0], center[1]


def _first(words: Words, keys: Sequence[str]) -> float | None:
    return next((words[key][0] for key in keys if len(words.get(key, ())) == 1), None)


def _size_of(words: Words, name: str) -> Size | None:
    width, height = _first(words, WIDTH), _first(words, HEIGHT)
    if width is None or height is None:
        width, height = next((words[key] for key in SIZE if len(words.get(key, ())) == 2), (None, None))
    if width is None or height is None:
        return None
    if not (width >= 1 and height >= 1 and width % 1 == height % 1 == 0):
        raise ValueError(f"{name}: width and height must be whole numbers of pixels above 0, got {width:g}x{height:g}")
    return int(width), int(height)


def _from_angles(words: Words, name: str) -> Intrinsics | None:
    """The camera of a file that gives no more than its horizontal field of view, or both."""
    wide, high = _first(words, FOV_X), _first(words, FOV_Y)
    x, y = (None if angle is None else math.radians(angle) for angle in (wide, high))
    x, y = x or _first(words, ANGLE_X), y or _first(words, ANGLE_Y)
    if x is None or not all(0 < angle < math.pi for angle in (x, y or x)):
        return None
    fx, fy = (math.nan if angle is None else 0.5 / math.tan(angle / 2) for angle in (x, y))
    return Intrinsics(name, (fx, fy, 0.0, 0.0), NORMALIZED)


def from_realsense(text: str, name: str) -> Intrinsics | None:
    """The camera in pyrealsense2's own words: `[ 640x480  p[cx cy]  f[fx fy]  Brown Conrady [0 0 0 0 0] ]`."""
    found = _REALSENSE.search(text)
    if found is None:
        return None
    cx, cy, fx, fy = (float(number) for number in found.groups()[2:])
    return Intrinsics(name, (fx, fy, cx, cy), (int(found[1]), int(found[2])))


def from_colmap(text: str, name: str) -> dict[str, Intrinsics]:
    """The cameras of COLMAP's cameras.txt, by number: `1 PINHOLE 640 480 fx fy cx cy`; none for any other text."""
    found: dict[str, Intrinsics] = {}
    for line in text.splitlines():
        words = line.partition("#")[0].split()
        if len(words) < 7 or not re.fullmatch(r"[A-Z_]+", words[1]):
            continue
        single = words[1].startswith(("SIMPLE", "RADIAL"))  # one focal length for both directions
        try:
            size = int(float(words[2])), int(float(words[3]))
            rest = [float(part) for part in words[4:]]
            fx, fy, cx, cy = (rest[0], *rest[:3]) if single else rest[:4]
        except (ValueError, OverflowError):
            continue
        # COLMAP counts from the picture's corner
        found[words[0]] = Intrinsics(name, (fx, fy, cx - 0.5, cy - 0.5), size)
    return found
