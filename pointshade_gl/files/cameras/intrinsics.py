"""Intrinsics as a file states them, by the names that programs give their numbers."""

from __future__ import annotations

import math
import re
from collections import ChainMap
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...notes.notes import Doubt, Note
from ...notes.words import option
from ...scene.camera import Camera
from ..arrays.named_numbers import Named
from .lens_names import COLMAP, KEPT, OWNED, find_lens, kalibr_words, names_a_model
from .lenses import PANORAMA, UNKNOWN, Lens

Size = tuple[int, int]  # width, height
Numbers = tuple[float, float, float, float]  # fx, fy, cx, cy

NOT_KNOWN: Numbers = (math.nan, math.nan, math.nan, math.nan)  # a panorama has none
NORMALIZED = (1, 1)  # the size of a picture whose sides have length 1: MoGe's, or a file that gives angles of view
_WIDEST = 150  # degrees from top to bottom: a wider pinhole camera is a mistake
_SAME_VIEW = 0.02  # pictures whose aspect ratios differ by less may show the same, at different sizes


@dataclass(frozen=True)
class Intrinsics:
    """What a source states about a camera; None = nothing."""

    name: str  # of the source, for messages
    # fx, fy, cx, cy in pixels, pixel centres at integers; fy is NaN if pixels are square, cx and cy are NaN if only the
    # focal length is known
    numbers: Numbers
    size: Size | None = None  # (width, height) of the picture that they are for; NORMALIZED fits any
    depth_scale: float | None = None  # raw depth values per metre
    depth_kind: str | None = None  # one of depth_kinds.KINDS
    baseline: float | None = None  # metres between the cameras of a disparity
    doffs: float | None = None  # pixels to add to a disparity, where the two principal points differ (Middlebury)
    near: float | None = None  # metres of the planes of a depth buffer
    far: float | None = None
    alternatives: tuple[Intrinsics, ...] = ()  # other cameras of the same source, such as that of the colour picture
    lens: Lens | None = None  # what bends the picture; None: it is a pinhole's


def merged(given: Intrinsics, filed: Intrinsics | None) -> Intrinsics:
    """Return the given camera; what it does not state about the depth comes from the other."""
    if filed is None:
        return given
    names = ("depth_scale", "depth_kind", "baseline", "doffs", "near", "far")
    missing: dict[str, Any] = {key: getattr(filed, key) for key in names if getattr(given, key) is None}
    return replace(given, **missing)


def place_camera(intrinsics: Intrinsics, depth: Size, color: Size | None, note: Note) -> Camera:
    """The camera of the depth picture; sizes are (width, height). Raises ValueError if it fits neither picture."""
    return place_lens(intrinsics, depth, color, note)[0]


def place_lens(intrinsics: Intrinsics, depth: Size, color: Size | None, note: Note) -> tuple[Camera, Lens | None]:
    """The same, and the lens that bends the picture."""
    chosen = next((one for one in (intrinsics, *intrinsics.alternatives) if one.size == depth), intrinsics)
    size = chosen.size or _guess_size(chosen, depth, color, note)
    turned = size[1], size[0]
    if size != NORMALIZED and not _fits(size, depth, color) and _fits(turned, depth, color):
        chosen, size = _turned(chosen, size, note), turned
    if min(size) < 1:
        raise ValueError(f"{chosen.name}: intrinsics are for {_text(size)} pixels: there is no such picture")
    if size != NORMALIZED and not _fits(size, depth, color):
        seen = f"depth is {_text(depth)} and " + (f"color is {_text(color)}" if color else "there is no color")
        way_out = "pass the intrinsics of one of the two pictures"
        raise ValueError(f"{chosen.name}: intrinsics are for {_text(size)} pixels, but {seen}: {way_out}")
    fx, fy, cx, cy = chosen.numbers
    if math.isnan(fy):
        fy = fx * (depth[0] / depth[1] if size == NORMALIZED else 1)
    if math.isnan(cx):
        cx, cy = (size[0] - 1) / 2, (size[1] - 1) / 2
    try:
        camera = Camera(fx, fy, cx, cy, *size)
    except ValueError as error:
        raise ValueError(f"{chosen.name}: {error}") from None
    if size != NORMALIZED and max(abs((cx + 0.5) / size[0] - 0.5), abs((cy + 0.5) / size[1] - 0.5)) > _FAR_OFF:
        what = f"the principal point ({cx:g}, {cy:g}) is far from the middle of {_text(size)} pixels"
        note(Doubt(f"{chosen.name}: {what}: is it the camera of these pictures, at their size?"))
    angle = math.degrees(2 * math.atan(camera.height / 2 / abs(camera.fy)))
    if angle > _WIDEST and chosen.lens is None:
        way_out = f"if that is wrong, pass {option('intrinsics', 'fx,fy,cx,cy')} or {option('fov', 'DEGREES')}"
        note(f"{chosen.name} has fy {camera.fy:g} px for {_text(size)}, which sees {angle:.0f} degrees: {way_out}")
    if size == depth:
        return camera, chosen.lens
    if chosen.size not in (None, NORMALIZED) or size == color:
        what = f"the color of {_text(size)}" if size == color else f"{_text(size)} pixels"
        note(f"{Path(chosen.name).name} is for {what}, scaled to the depth's {_text(depth)}")
    return camera.resized(*depth), chosen.lens


def _fits(size: Size, depth: Size, color: Size | None) -> bool:
    """Return whether a camera of this size is that of one of the pictures."""
    return min(size) > 0 and (size in (depth, color) or shows_the_same(size, depth))


def _turned(intrinsics: Intrinsics, size: Size, note: Note) -> Intrinsics:
    """Return the camera of a picture that was turned since: upright ones clockwise, as telephones do, others back."""
    (fx, fy, cx, cy), (width, height) = intrinsics.numbers, size
    center = (height - 1 - cy, cx) if width > height else (cy, width - 1 - cx)
    way_out = f"pass {option('intrinsics', 'fx,fy,cx,cy')} if that is wrong"
    note(f"{intrinsics.name} is for {_text(size)} and the picture is turned: the camera is turned, too; {way_out}")
    lens = intrinsics.lens and intrinsics.lens.turned(clockwise=width > height)
    return replace(intrinsics, numbers=(fx if math.isnan(fy) else fy, fx, *center), lens=lens)


def shows_the_same(size: Size, depth: Size) -> bool:
    """Return whether a picture of another size may be the depth picture made smaller or larger."""
    return abs(size[0] / size[1] * depth[1] / depth[0] - 1) < _SAME_VIEW


def _guess_size(intrinsics: Intrinsics, depth: Size, color: Size | None, note: Note) -> Size:
    """Return the picture whose middle is nearest to the principal point, among those that contain it."""
    cx, cy = intrinsics.numbers[2:]
    if math.isnan(cx):
        note(f"{intrinsics.name}: the principal point is taken as the middle of the depth picture")
        return depth

    def distance(size: Size) -> float:
        return max(abs(cx / size[0] - 0.5), abs(cy / size[1] - 0.5))

    size = min((depth, color or depth), key=distance)  # the depth when both are as near
    if other := _size_by_center(cx, cy, size):
        way_out = "pass a file with its width and height if that is wrong"
        doubt = f"{intrinsics.name} is for {_text(other)} pixels by its principal point ({cx:g}, {cy:g})"
        note(Doubt(f"{doubt}, not for {_text(size)}: it is scaled; {way_out}"))
        return other
    if not distance(size) <= 0.5:
        expected = f"must lie in the depth picture of {_text(depth)}"
        raise ValueError(f"{intrinsics.name}: the principal point ({cx:g}, {cy:g}) {expected}")
    if color and color != depth:
        which = "depth" if size == depth else "color"
        note(f"{intrinsics.name}: no picture size is given, taken as for the {which} picture of {_text(size)}")
    return size


_RATIOS = [1 / 8, 1 / 6, 1 / 5, 1 / 4, 1 / 3, 2 / 5, 1 / 2, 5 / 8, 2 / 3, 3 / 4, 4 / 5]  # usual, and their inverses
_RATIOS += [1 / ratio for ratio in _RATIOS]
_LEAST_RATIO = 1.2  # no lens is so far off its picture's middle in both directions
_ALIKE = 0.15  # both directions show the same ratio: principal points lie some per cent off the middle
_USUALLY = 0.06  # so near to a usual ratio it is that one
_FAR_OFF = 0.3  # of the picture, from its middle: nothing but a part that was cut out has its principal point there


def _size_by_center(cx: float, cy: float, size: Size) -> Size | None:
    """Return the size whose middle the principal point is, if this one's it cannot be; None if no size fits."""
    across, down = (2 * cx + 1) / size[0], (2 * cy + 1) / size[1]
    if min(across, down) <= 0 or abs(across / down - 1) > _ALIKE:
        return None
    ratio = math.sqrt(across * down)
    if max(ratio, 1 / ratio) < _LEAST_RATIO:
        return None
    for corner in (1, 0):  # the middle of 640 pixels is 319.5, or 320 where they are counted from the corner
        whole = 2 * cx + corner, 2 * cy + corner
        if whole[0] % 1 == whole[1] % 1 == 0 and whole[0] * size[1] == whole[1] * size[0]:
            return int(whole[0]), int(whole[1])
    usual = min(_RATIOS, key=lambda one: abs(math.log(one / ratio)))
    ratio = usual if abs(usual / ratio - 1) < _USUALLY else ratio
    return max(1, round(size[0] * ratio)), max(1, round(size[1] * ratio))


def _text(size: Size) -> str:
    return f"{size[0]}x{size[1]}"


_SQUARE = 0.05  # fx and fy of a lens differ by less
_APART = 0.2  # and from cx or cy by more, where the order of four numbers is to be found


def from_matrix(values: Sequence[float] | NDArray[np.float64]) -> Numbers | None:
    """fx, fy, cx, cy of a 3x3, 3x4 or 4x4 matrix, by rows or by columns, or of four numbers; None for anything else."""
    array = np.asarray(values, np.float64).ravel()
    if array.size == 4:
        a, b, c, d = array.tolist()
        # OpenLORIS writes fx, cx, fy, cy: the two focal lengths are alike
        is_crossed = abs(c) and abs(a / c - 1) < _SQUARE and abs(b) and abs(a / b - 1) > _APART
        return (a, c, b, d) if is_crossed else (a, b, c, d)
    if array.size not in (9, 12, 16):
        return None
    k = array.reshape((3, -1) if array.size == 12 else (int(array.size**0.5), -1))[:3, :3]
    if k[2, 0] and k[2, 1] and not (k[0, 2] or k[1, 2]):
        k = k.T  # written by columns
    if abs(k[2] - (0, 0, 1)).max() > 1e-6 or k[1, 0] != 0 or not (k[0, 0] and k[1, 1]):
        return None
    return float(k[0, 0]), float(k[1, 1]), float(k[0, 2]), float(k[1, 2])


def from_numbers(values: NDArray[np.float64], name: str) -> Intrinsics | None:
    """A camera of nothing but numbers: a focal length, four, a matrix, one with a baseline, a range or a size; or None.
    `width height fx fy cx cy` is ARKitScenes' (Matterport3D adds five of distortion); or fx fy cx cy come first."""
    if values.size == 1 and values[0] > 1:
        return Intrinsics(name, (float(values[0]), math.nan, math.nan, math.nan))
    if values.size == 10 and (matrix := from_matrix(values[:9])):  # FoundationStereo's K.txt
        return Intrinsics(name, matrix, baseline=float(values[9]))
    if values.size == 12 and values[9] >= 1 and values[10] == 0 < values[11] and (matrix := from_matrix(values[:9])):
        # of Peng et al., "Depth super-resolution meets uncalibrated photometric stereo", 2017: a factor, and the least
        # and the largest millimetres, which 16 bits fill
        return Intrinsics(name, matrix, depth_scale=65535 / (float(values[11]) / 1000))
    first = values[:6].tolist() if values.size in (6, 11) else []
    for width, height, fx, fy, cx, cy in (first, (*first[4:], *first[:4])) if first else ():
        if width % 1 == height % 1 == 0 and 0 < cx < width and 0 < cy < height and fx > 0 and fy > 0:
            lens = find_lens({"d": values[6:].tolist()}, {})
            return Intrinsics(name, (fx, fy, cx, cy), (int(width), int(height)), lens=lens)
    four = from_matrix(values)
    return Intrinsics(name, four) if four else None


Words = Mapping[str, list[float]]  # numbers of a group by their last word


# What others call it, in lower case, without blanks, dashes and underscores. Of several in a file the earlier wins.
FX = ("fx", "flx", "focalx", "focallengthx", "fxdepth", "depthfx", "fxd", "fxrgb", "fxcolor", "gamma1", "mu")
FY = ("fy", "fly", "focaly", "focallengthy", "fydepth", "depthfy", "fyd", "fyrgb", "fycolor", "gamma2", "mv")
CX = ("cx", "ppx", "px", "u0", "principalx", "principalpointx", "cxdepth", "mxdepth", "cxd", "cxrgb", "mxcolor")
CY = ("cy", "ppy", "py", "v0", "principaly", "principalpointy", "cydepth", "mydepth", "cyd", "cyrgb", "mycolor")
FOCAL = ("f", "fl", "focal", "focallength", "focallengthpx", "focalpx", "focallengthpixels")
MATRIX = (
    "depthintrinsics", "depthintrinsic", "kdepth", "depthk", "intrinsicmatrix", "intrinsics", "intrinsic", "k",
    "cameramatrix", "cameraintrinsics", "cameraintrinsic", "camk", "kcam", "kmatrix", "camintrinsics", "cam0",
    "prect02", "p2", "prect00", "p0", "intrinsicdepth", "kcolor", "krgb", "intrinsicscolor", "rgbintrinsics", "p",
    "intrinsicsmatrix", "camerakmatrix",
)  # fmt: skip
WIDTH = (
    "width", "w", "imagewidth", "imgwidth", "imw", "depthwidth", "dw", "resx", "resolutionx", "camerawidth",
    "cols",
)  # fmt: skip
HEIGHT = (
    "height", "h", "imageheight", "imgheight", "imh", "depthheight", "dh", "resy", "resolutiony", "cameraheight",
    "rows",
)  # fmt: skip
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
NEAR, FAR = (
    (key, f"z{key}", f"{key}val", f"{key}plane", f"{key}clip", f"clip{key}", f"{key}clippingplane")
    for key in ("near", "far")
)

_BOP = "camk"
_SHORTEST = 0.15  # of the width: 147 degrees
_CORNER = ("flx", "cameraanglex", "pixelaspectratio")  # nerfstudio, nerf and nerfies count from the picture's corner
_REALSENSE = re.compile(  # in one line
    r"(\d{2,5})x(\d{2,5})\s+p\[([\d.]+) ([\d.]+)\]\s+f\[([\d.]+) ([\d.]+)\](?:\s*([A-Za-z][\w ]*)\[([-+\d.e ]*)\])?"
)
# not the depth's
_OTHERS = re.compile(r"(?i)(right|infra|imu|distort|rectif|project(?!ion_?param)|extrin|(?<![a-z])ir(?![a-z]))")
_SENS = re.compile(r"m_(?:calibration)?(color|depth)(\w+)", re.IGNORECASE)  # ScanNet's and BundleFusion's info.txt
_DEPTH, _COLOR = re.compile(r"(?i)depth|tof|left|cam0"), re.compile(r"(?i)colou?r|rgb|cam1|second")


def word(name: str) -> str:
    """The last part of a name, as the rows above spell it."""
    return re.sub(r"[^a-z0-9]", "", name.rsplit(".", 1)[-1].lower())


def from_named(named: Mapping[str, list[float]], name: str, of_color: bool = False) -> list[Intrinsics]:
    """The cameras that named numbers describe: the depth's own before others, colour cameras last. of_color: the colour
    camera first: the depth was brought to it."""
    bends = _Bends(named)
    named = {_SENS.sub(r"\1.\2", key): numbers for key, numbers in named.items()}
    grouped: dict[str, dict[str, list[float]]] = {}  # by what stands before their last word
    for key, numbers in named.items():
        group, _, last = key.removesuffix(".data").rpartition(".")  # ROS and OpenCV put a matrix one level deeper
        if not _OTHERS.search(last):
            grouped.setdefault(group, {}).setdefault(word(last), numbers)
    # "" is the top; cameras that took neither picture are left out
    names = dict.fromkeys(["", *(key.rpartition(".")[0] for key in named)])
    own = [group for group in names if not _OTHERS.search(group)]
    first, last = (_COLOR, _DEPTH) if of_color else (_DEPTH, _COLOR)
    own.sort(key=lambda group: (bool(last.search(group)), not first.search(group), group.count(".")))
    groups = [(bends.divided(group, grouped.get(group, {})), _with_above(grouped, group)) for group in own]
    outside = next((numbers[0] for key, numbers in named.items() if word(key) in BASELINE), None)
    found = [_from_group(*words, name) for words in groups]
    found = [camera and replace(camera, baseline=camera.baseline or outside) for camera in found]
    if not any(found):
        found = [_from_angles(words, name) for words, _ in groups]
    lenses = [bends.lens(group) for group in own]
    if not any(found) and (panorama := next((one for one in lenses if one and one.curve == PANORAMA), None)):
        above = groups[0][1]
        return [Intrinsics(name, NOT_KNOWN, _size_of(above, name), _scale_of(above), lens=panorama)]
    pairs = zip(found, lenses, strict=True)
    return [camera if lens is None else replace(camera, lens=lens) for camera, lens in pairs if camera]


class _Bends:
    """What a file says of lenses: numbers and texts by the group of the camera that they belong to."""

    def __init__(self, named: Mapping[str, list[float]]):
        self._numbers = _by_owner((key, one) for key, one in named.items() if word(key.removesuffix(".data")) in KEPT)
        texts = named.texts if isinstance(named, Named) else {}
        self._texts = _by_owner((key, one) for key, one in texts.items() if names_a_model(word(key)))

    def divided(self, group: str, words: Words) -> Words:
        """The words of a group, without the numbers of a lens that stand before fx."""
        return kalibr_words(words, self._texts.get(group, {})) if self._texts else words

    def lens(self, group: str) -> Lens | None:
        if not (self._numbers or self._texts):
            return None
        # ORB-SLAM 3 has Camera.type beside Camera1.fx
        texts = _with_above(self._texts, group) or self._texts.get(group.rstrip("0123456789"), {})
        return find_lens(kalibr_words(_with_above(self._numbers, group), texts), texts)


def _by_owner(items: Iterable[tuple[str, Any]]) -> dict[str, dict[str, Any]]:
    """Values by the group of their camera, and their last word: `left.distortion.k1` belongs to `left`."""
    found: dict[str, dict[str, Any]] = {}
    for key, value in items:
        *groups, last = key.removesuffix(".data").split(".")
        while groups and OWNED.search(groups[-1]):
            groups.pop()
        found.setdefault(".".join(groups), {}).setdefault(word(last), value)
    return found


def _with_above(grouped: Mapping[str, dict[str, Any]], group: str) -> Mapping[str, Any]:
    """The words of a group with what stands further up: sizes and units often do."""
    parts = group.split(".") if group else []
    return ChainMap(*(grouped.get(".".join(parts[:k]), {}) for k in range(len(parts), -1, -1)))


def _from_group(words: Words, with_above: Words, name: str) -> Intrinsics | None:
    sensor, lens = _first(words, SENSOR), _first(words, FOCAL)
    if sensor and lens and sensor > 0 and lens > 0:
        return Intrinsics(name, (lens / sensor, math.nan, 0.0, 0.0), NORMALIZED)
    if not any(key in words for key in (*FX, *FOCAL, *MATRIX, *LENS, "matrix")):
        return None
    size = _size_of(with_above, name)
    numbers = _numbers_of(words, size)
    if numbers is None:
        return None
    if any(key in words for key in _CORNER):
        numbers = (numbers[0], numbers[1], numbers[2] - 0.5, numbers[3] - 0.5)
    scale = _scale_of(with_above)
    baseline, doffs = _first(with_above, BASELINE), _first(with_above, DOFFS)
    if doffs is not None and baseline is not None:  # Middlebury, where the baseline is in millimetres
        baseline /= 1000
    for left, right in (("prect02", "prect03"), ("p2", "p3")) if baseline is None else ():
        if len(words.get(left, ())) == len(words.get(right, ())) == 12 and words[left][0]:
            # between KITTI's two colour cameras: the fourth number of a projection is -fx times its place
            baseline = (words[left][3] - words[right][3]) / words[left][0]
            break
    near, far = (
        plane if plane and plane > 0 else None for plane in (_first(with_above, NEAR), _first(with_above, FAR))
    )
    if scale and _BOP in words and _first(with_above, METRES_EACH) is None:
        scale = 1000 / scale  # BOP's is millimetres for each unit
    return Intrinsics(name, numbers, size, scale, None, baseline, doffs, near, far)


def _scale_of(words: Words) -> float | None:
    """Raw depth values per metre."""
    each = _first(words, METRES_EACH)
    return 1 / each if each else _first(words, PER_METRE)


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
    cx, cy, fx, fy = (float(number) for number in found.groups()[2:6])
    lens = find_lens({"coeffs": [float(one) for one in found[8].split()]}, {"model": found[7]}) if found[8] else None
    return Intrinsics(name, (fx, fy, cx, cy), (int(found[1]), int(found[2])), lens=lens)


def from_colmap(text: str, name: str) -> dict[str, Intrinsics]:
    """The cameras of COLMAP's cameras.txt, by number: `1 PINHOLE 640 480 fx fy cx cy`; none for any other text."""
    found: dict[str, Intrinsics] = {}
    for line in text.splitlines():
        words = line.partition("#")[0].split()
        if len(words) < 6 or not re.fullmatch(r"[A-Z_]+", words[1]):
            continue
        try:
            size = int(float(words[2])), int(float(words[3]))
            camera = colmap_camera(words[1], size, [float(part) for part in words[4:]], name)
        except (ValueError, OverflowError):
            continue
        if camera:
            found[words[0]] = camera
    return found


def colmap_camera(model: str, size: Size, numbers: Sequence[float], name: str) -> Intrinsics | None:
    """A camera of one of COLMAP's models; None unless it holds at least fx, fy, cx and cy, or f, cx and cy."""
    order = next((order for title, order in COLMAP if title == model), None)
    if order == ["w", "h"]:
        return Intrinsics(name, NOT_KNOWN, size, lens=find_lens({}, {"cameramodel": model}))
    values = dict(zip(order or ["fx", "fy", "cx", "cy"], numbers, strict=False))
    if len(values) < (3 if "f" in values else 4):
        return None
    fx, fy = (values["f"],) * 2 if "f" in values else (values["fx"], values["fy"])
    lens = Lens(model, UNKNOWN)  # of a later version
    if order is not None:
        lens = find_lens({key: [one] for key, one in values.items()}, {"cameramodel": model})
    # COLMAP counts from the picture's corner
    return Intrinsics(name, (fx, fy, values["cx"] - 0.5, values["cy"] - 0.5), size, lens=lens)
