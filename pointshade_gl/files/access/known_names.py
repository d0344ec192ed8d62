"""Names of files: those that data sets and programs give, in one table; series (%04d.png); what may be written.

A new data set adds words to a row of the table.
"""

from __future__ import annotations

import os
import re
from pathlib import Path
from typing import NamedTuple

from ...checks.arguments import check_path
from ...notes.words import option
from .content import FilePath

# If a folder holds several, the earlier ones win: for depth those that keep the most, for colour the lossless ones.
RAW_SUFFIXES = (".bin", ".raw")  # numbers without a header, or COLMAP's; only where there is nothing else
COLOR_SUFFIXES = (".png", ".tif", ".tiff", ".bmp", ".ppm", ".webp", ".jpg", ".jpeg", ".heic", ".heif", ".avif", ".jp2")
DEPTH_SUFFIXES = (
    ".exr", ".npy", ".npz", ".pfm", ".dpt", ".h5", ".hdf5", ".mat", ".tif", ".tiff", ".png", ".pgm", ".webp", ".bmp",
    ".jpg", ".jpeg", *RAW_SUFFIXES,
)  # fmt: skip
PICTURE_SUFFIXES = (*COLOR_SUFFIXES, ".exr", ".pfm", ".pgm")
# may hold colour and camera too
CONTAINERS = (".r3d", ".heic", ".heif", ".npz", ".h5", ".hdf5", ".mat", ".zip", ".pcd")
INSIDE = (".exr", ".jpg", ".jpeg")  # of depth pictures that may hold their colours, camera or unit
VIDEO_SUFFIXES = (".mp4", ".mov", ".mkv", ".avi", ".webm", ".m4v")
# Never pictures for the eye.
ONLY_DEPTH = (".exr", ".npy", ".npz", ".pfm", ".dpt", ".h5", ".hdf5", ".mat", *RAW_SUFFIXES)


def _words(names: str) -> frozenset[str]:
    return frozenset(names.split())


def _patterns(*patterns: str) -> tuple[re.Pattern[str], ...]:
    return tuple(map(re.compile, patterns))


# Words in the names of files and folders: depth_0001.png, frame-000001.color.jpg, images/7.png.
DEPTH = _words("depth depths depthmap depthmaps depthcrop disp disparity disparities distance")
ANY_PICTURE = _words("image images img imgs im photo photos picture")  # depth/IMG_0001.png is depth
COLOR = ANY_PICTURE | _words("color colors colour rgb rgbs tonemap wide crop")
SHOWN_DEPTH = _words("vis visual preview colored coloured colorized colormap colormapped cmap jet")
NEITHER = _words(
    "mask masks maskcrop conf confidence confidences normal normals label labels seg segmentation semantic semantics "
    "instance instances ir infra infrared flow albedo error weight sky edges amplitude thumb thumbnail thumbnails right"
)
SPARSE = _words("sparse")  # a few points of depth: only where there is no other
# Middlebury: the second camera's, and the first's.
RIGHT_VIEWS = {"im1": "im0", "disp1": "disp0", "view5": "view1", "disp5": "disp1", "im6": "im2", "disp6": "disp2"}
REGISTERED = re.compile(r"aligned|registered|depth_?to_?(colou?r|rgb)")  # depth that was brought to the colour's camera
RAY_NAMES = re.compile(r"euclidean|distance_to_camera|depth_?perspective|ray_?(depth|distance)")  # not along the axis
# COLMAP's and NeuS' files, and the labels of Cityscapes
NOT_PICTURES = re.compile(
    r"(.*/)?(cameras|images|points3d|rigs|frames|cameras_sphere)\.(bin|npz)|(.*[/_])?gt(fine|coarse)[/_].*"
)
CONFIDENCE = _words("conf confs confidence confidences")
VALID = CONFIDENCE | _words("mask")

# Lists of pictures, a line each: "time file" (TUM), or "time file time file".
COLOR_LISTS, DEPTH_LISTS = ("color.txt", "rgb.txt"), ("aligned_depth.txt", "depth.txt")
PAIR_LISTS = re.compile(r"assoc\w*\.txt")
TRANSFORMS = re.compile(r"transforms(_\w+)?\.json")

# Cameras, one for all frames or one for each. The first name that fits is tried first.
# Names are relative to the folder, in lower case.
CAMERAS = _patterns(
    r"intrinsics\.json",
    r"(.*/)?[\w-]*depth[\w-]*(intrinsics?|camera|calib)[\w-]*\.\w+",
    r"(.*/)?[\w-]*(intrinsics?|camera|calib)[\w-]*depth[\w-]*\.\w+",
    r"(.*/)?(camera[-_])?intrinsics?\.\w+",
    r"transforms(_\w+)?\.json",
    r"scene_camera\.json",
    r"(.*/)?(camera[-_]?(matrix|info|params?|parameters)?|cam[-_]?(params?|info|k)|k|fov|calib(ration)?)\.\w+",
    r"(.*/)?cameras?\.(txt|bin|json|ya?ml)",
    r"focal\w*\.txt",
    r"(.*/)?[\w.-]*frame_data\.json",
    r"(.*/)?[\w-]*(calib|camera|intrinsic)[\w-]*(/[\w.-]+)?\.\w+",
    r"(.*/)?([\w-]*metadata|meta|_?info)(\.\w+)?",
    r"(.*/)?[\w-]+[-_]meta\.mat",
    r"scene\w+_\d\d\.txt",
    r"\w*pose\w*intrinsic\w*\.json",
    r"(.*/)?[\w.-]*\.(ya?ml|pincam)",
    r"(scene/)?[\w-]*traj\w*\.json",
)
CAMERA_SUFFIXES = (
    ".json", ".txt", ".yaml", ".yml", ".csv", ".npy", ".mat", ".pincam", ".cam", ".bin", ".cfg", ".conf", ".ini", "",
)  # fmt: skip
NOT_A_CAMERA = re.compile(
    r"extrinsic|pose(?!.*(intrinsic|\.json))|traj(?!\w*\.json)|right|(?<!intrinsic_)imu|(?<!un)distort|accel|(^|/)ir[_.-]|infra"
)
# Folders of files about frames elsewhere.
ABOUT_FRAMES = re.compile(
    r"(?<![a-z])(cams?|camdata|camera\w*|calib\w*|intrinsics?|extrinsics?|poses?|param\w*|meta|metadata|info|sparse|traj\w*|"
    r"scene|groundtruth|(key)?frames?)(?![a-z])"
)
FRAME_CAMERAS = _words("intrinsics intrinsic cameras camera cams cam calib meta pincam pose frame frames")
FRAME_SUFFIXES = (".json", ".yaml", ".yml", ".cam")  # of a file called like its frame and nothing else

# Poses: a file for each frame, or one for all.
FRAME_POSES = _words("pose poses cameras camera cams cam extrinsics extrinsic meta frame frames")
POSE_SUFFIXES = (
    ".txt", ".csv", ".log", ".json", ".yaml", ".yml", ".npy", ".npz", ".mat", ".cam", ".bin", ".conf", ".freiburg",
    ".traj", ".pose", "",
)  # fmt: skip
POSES = _patterns(
    r"groundtruth\.txt",
    r"poses_tum\.txt",
    r"trajectory\.log",
    r"(scene/)?trajectory\.(log|json)",
    r"transforms(_\w+)?\.json",
    r"traj\.txt",
    r"odometry\.csv",
    r"scene_camera\.json",
    r"(.*/)?images\.(txt|bin)",
    r"info\.ya?ml",
    r"(.*/)?[\w-]*camera_param\w*/[\w.-]+\.conf",
    r"(.*/)?[\w.-]*(trajectory|groundtruth|poses?|traj|odometry|extrinsics?|cam2world|c2w|w2c)[\w-]*(/[\w.-]+)?\.\w+",
    r"[\w.-]*\.(freiburg|traj|pose)",
    r"metadata(\.json)?",
)
MAY_HOLD_POSES = re.compile(r"metadata(\.json)?")  # other programs write other things under these names
NOT_A_POSE = re.compile(r"annotated|object|(^|[/_])ob(j|ject)?s?[_/]")  # of objects, not of the camera


class DataSet(NamedTuple):
    """A data set whose folders hold no camera: how it is known, and what its web page states."""

    title: str
    known_by: str  # pattern in the folder's path, or in the names and first lines of its lists
    numbers: tuple[float, float, float, float]
    size: tuple[int, int] = (640, 480)
    depth_scale: float = 1000
    is_resized: bool = False  # often kept at another size of the same shape


_TUM = (640, 480), 5000
DATA_SETS = (
    DataSet("TUM freiburg1", r"freiburg1|\bfr1", (517.3, 516.5, 318.6, 255.3), *_TUM),
    DataSet("TUM freiburg2", r"freiburg2|\bfr2", (520.9, 521.0, 325.1, 249.7), *_TUM),
    DataSet("TUM freiburg3", r"freiburg3|\bfr3", (535.4, 539.2, 320.1, 247.6), *_TUM),
    DataSet("Bonn", r"rgbd_bonn", (542.822841, 542.57687, 315.59352, 237.756098), *_TUM),
    DataSet("ICL-NUIM", r"icl[-_]?nuim|traj\d_frei|gt\.freiburg", (481.2, -480, 319.5, 239.5), *_TUM),
    DataSet("TUM", r"\brgb\.txt\b|\bassoc\w*\.txt\b", (525, 525, 319.5, 239.5), *_TUM),
    DataSet("NOCS' Real275", r"real_(test|train)", (591.0125, 590.16775, 322.525, 244.11084)),
    DataSet("DIODE", r"doors?_\d{3}_\d{3}_depth\.npy", (886.81, 927.06, 512, 384), (1024, 768), 1),
    DataSet("TartanAir", r"\d{6}_left_depth\.npy", (320, 320, 320, 240), (640, 480), 1, True),
    DataSet("TartanAir V2", r"\d{6}_lcam_\w+_depth\.png", (320, 320, 320, 320), (640, 640), 1, True),
    DataSet("SceneNet RGB-D", r"\bphoto/\d+\.jpg", (277.128, 289.706, 159.5, 119.5), (320, 240)),
    DataSet("InteriorNet", r"depth\d/data/\d+\.png", (600, 600, 320, 240)),
    DataSet(
        "raw NYU Depth v2 (its colours are not registered)", r"d-\d+\.\d+-\d+\.pgm", (582.62, 582.69, 313.04, 238.44)
    ),
    DataSet("Redwood indoor", r"(livingroom|office)\d-(depth|color)", (525, 525, 319.5, 239.5)),
    DataSet("7-Scenes", r"frame-\d{6}\.depth\.png", (585, 585, 320, 240)),
)


class SetCoding(NamedTuple):
    """How the pictures of a data set hold depth, where no file states it: known by the names of files and folders."""

    title: str
    known_by: str  # pattern
    depth_scale: float | None
    depth_kind: str = "z"


CODINGS = (
    SetCoding("KITTI depth", r"proj_depth|velodyne_raw|groundtruth_depth", 256),
    SetCoding("KITTI disparity", r"disp_(occ|noc)", 256, "disparity"),
    SetCoding("Virtual KITTI", r"vkitti|clone/frames/depth|frames/depth/camera_\d", 100),
    SetCoding("2D-3D-S and Taskonomy", r"domain_depth(_zbuffer)?\.png", 512),
    SetCoding("Taskonomy", r"domain_depth_euclidean\.png", 512, "ray"),
    SetCoding("distance from the camera", RAY_NAMES.pattern, None, "ray"),
    SetCoding("Matterport3D", r"matterport|undistorted_depth_images", 4000),
    SetCoding("Hypersim", r"depth_meters\.hdf5", 1, "ray"),
)

# Cameras that are usual for depth pictures of a size, assumed where none is known: fx,fy,cx,cy.
COMMON_CAMERAS = {
    (640, 480): ("a Kinect v1 or a PrimeSense", "525,525,319.5,239.5"),
    (512, 424): ("a Kinect v2", "365.5,365.5,255.5,211.5"),
    (640, 576): ("an Azure Kinect", "504,504,319.5,287.5"),
    (848, 480): ("a RealSense D4xx", "425,425,423.5,239.5"),
    (1280, 720): ("a RealSense D4xx", "640,640,639.5,359.5"),
    (256, 192): ("an iPhone's LiDAR", "212,212,127.5,95.5"),
}


_NUMBER = re.compile(r"%(0?\d{0,2})d|\{(?::(0?\d{0,2})d?)?\}|(##+)")


def is_numbered(path: Path) -> bool:
    """True for a name with a place for a number, as C (%04d), Python ({:04d}) or Nuke (####) writes it."""
    return bool(_NUMBER.search(path.name))


def numbered(path: Path, number: int) -> Path:
    """out/0007.png for out/%04d.png and 7. Raises ValueError unless the name has exactly one place for a number."""
    places = list(_NUMBER.finditer(path.name))
    if len(places) != 1:
        found = ", ".join(place[0] for place in places) or "none"
        raise ValueError(f"cannot write {path}: its name must have one place for a number, such as %04d, got {found}")
    (place,) = places
    marks = place[3]
    digits = format(number, f"0{len(marks)}d" if marks else f"{place[1] or place[2] or ''}d")
    return path.with_name(path.name[: place.start()] + digits + path.name[place.end() :])


def first_of(path: Path) -> Path:
    """The first file of a series, number 0; a path without a place for a number is itself."""
    return numbered(path, 0) if is_numbered(path) else path


def existing_files(path: Path) -> list[Path]:
    """The file, if it exists; of a series those of its files that do."""
    place = _NUMBER.search(path.name)
    if place is None:
        return [path] if path.exists() else []
    before, after = map(re.escape, (path.name[: place.start()], path.name[place.end() :]))
    names = (re.fullmatch(rf"{before}(\d+){after}", item.name, re.IGNORECASE) for item in path.parent.glob("*"))
    found = {numbered(path, int(name[1])) for name in names if name}  # on some systems A.png is a.png
    return sorted(one for one in found if one.exists())


PICTURES = (".png", ".jpg", ".jpeg", ".webp", ".tif", ".tiff")
IMAGES = (*PICTURES, ".npy")
NORMALS = (*IMAGES, ".exr")
DEPTH_MAPS = (".png", ".exr", ".tif", ".tiff", ".npy")
FILMS = (".mp4", ".gif")
PAGES = (".html", ".htm")
SCENE_SUFFIXES = (".gltf", ".glb")
POINTS = (".ply", ".glb", ".gltf")
POSE_LISTS = (".txt",)
CLOUD_NORMALS = (*POINTS, ".npy")
FOUND_POSES = (".json", *POSE_LISTS)
LAYERED = (".exr",)  # passes
RENDERED = (*IMAGES, *LAYERED, *FILMS, *PAGES, *POINTS)  # by `pointshade render`
NUMBERED = (*IMAGES, *LAYERED, *POINTS)  # by it, to many files

# of a batch, each behind a dot; names distinguish its normals from its pictures
BATCH_PICTURES = ("png", "jpg", "webp", "tif")
BATCH_NORMALS = ("normals.png", "normals.exr", "normals.npy")
BATCH_PAGE = "html"
BATCH_FILMS = tuple(suffix[1:] for suffix in FILMS)
BATCH = (*BATCH_PICTURES, *BATCH_NORMALS, BATCH_PAGE, *BATCH_FILMS)


def check_suffix(path: FilePath, known: tuple[str, ...], subject: str = "its suffix") -> Path:
    """The path. Raises as `check_path`, and ValueError, listing the known ones, for another suffix."""
    path = check_path(path)
    if path.suffix.lower() not in known:
        one_of = f"one of {', '.join(known)}" if len(known) > 2 else " or ".join(known)
        raise ValueError(f"cannot write {path}: {subject} must be {one_of}")
    return path


# By the first name, pictures that turn away from the front take all sides: frames of one object, or the front alone.
VASE, WHOLE, FRONT = "vase", "vase/whole", "vase/front"
FRAMES = {VASE: "vase", WHOLE: "vase_whole", FRONT: "vase"}
BUILT_IN_UP = 0.0, -0.974370064785, -0.224951054344  # in the axes of its front's camera, which looks down by 13 degrees
BUILT_IN_MIDDLE = 0.0, 0.0, 1.0  # on the axis of the vase, in its front's axes
SCENES = {"demo": "scene/scene.gltf"}


def builtin_name(source: object) -> str | None:
    """The built-in frame or scene that a source names; None for any other. A text always is the built-in name, as
    "./vase" is the folder of that name; a Path only where no such file exists."""
    name = os.fspath(source) if isinstance(source, str | os.PathLike) else None
    if name not in (*FRAMES, *SCENES) or (not isinstance(source, str) and Path(name).exists()):
        return None
    return name


def builtin_folder(source: FilePath) -> Path:
    """The folder of a built-in frame, or several, for its name; anything else is a path already."""
    name = builtin_name(source)
    return asset(FRAMES[name]) if name in FRAMES else check_path(source)


def is_built_in(folder: Path) -> bool:
    """Return whether a folder is that of a built-in frame, or of several."""
    return folder.name in FRAMES.values() and folder.absolute() == asset(folder.name).absolute()


def builtin_scene(source: FilePath) -> Path:
    """The file of a built-in scene for its name; anything else is a path already."""
    name = builtin_name(source)
    return asset(SCENES[name]) if name in SCENES else check_path(source)


def asset(name: str) -> Path:
    """A file or folder that comes with the package."""
    package = Path(__file__).resolve().parents[2]
    places = [parent / "assets" / name for parent in (package, package.parent)]  # installed, checked out
    return next((place for place in places if place.exists()), places[0])


class _Kind(NamedTuple):
    """A kind of file. head: how its first bytes begin; None: only the suffix shows it."""

    title: str
    suffixes: str
    head: bytes | None
    way_out: str


_TOPICS = "write its colour and depth topics as PNG, 16 bits for depth, then pass their folder"
_TOOL = "export colour and 16-bit depth as pictures, then pass their folder; that does"
_MODEL = "it has no pictures: of models glTF (.gltf, .glb) and PLY are read, Blender and MeshLab convert to them"
_MODELS = "obj|mtl|stl|fbx|usdz?|usd[ac]|dae|off|3mf|3ds|blend|abc|wrl|x3d|max|c4d|ifc|step|stp|iges"
_SPLATS = "it has no pictures: convert it to .ply, as SuperSplat does, which load_cloud and `pointshade render` read"
_CLOUD = "it has no pictures: `pointshade render` draws it, load_cloud reads it"
_TENSORS = "save its depth as .npy or .npz and pass that"
_NETWORK = "depth_model"
_VIDEO = (
    "pass the folder of its depth pictures, put its film of depth beside it (clip.mp4, clip_depth.mp4), or pass a "
    f"network that makes depth of its pictures as {_NETWORK}"
)
_UNPACK = "unpack it and pass the folder"
_KINDS = (
    _Kind("a ROS bag", "bag", b"#ROSBAG", _TOPICS),
    _Kind("a ROS 2 bag", "mcap", b"\x89MCAP", _TOPICS),
    _Kind("a ROS 2 bag", "db3", b"SQLite", _TOPICS),
    _Kind("a database of RTAB-Map", "db", b"SQLite", f"{_TOOL} `rtabmap-export --images --poses`"),
    _Kind("a recording of a ZED camera", "svo|svo2", None, f"{_TOOL} `ZED_SVO_Export`"),
    _Kind("a recording of an Azure Kinect, or a video", "mkv", None, f"{_TOOL} Open3D's azure_kinect_mkv_reader.py"),
    _Kind("a recording of OpenNI", "oni", None, f"{_TOOL} OpenNI's or PCL's tools"),
    _Kind("a recording of ElasticFusion's Logger", "klg", None, f"{_TOOL} any converter from .klg to PNG"),
    _Kind("a ScanNet recording", "sens", None, f"{_TOOL} ScanNet's SensReader"),
    _Kind("a point cloud", "ply|las|laz|xyz|pts|e57|spz|splat|sog", None, _CLOUD),
    _Kind("a file of Gaussian splats", "ksplat|rad|lcc", None, _SPLATS),
    _Kind("a model", _MODELS, None, _MODEL),
    _Kind("a scene of glTF", "gltf|glb", None, "pass it alone, as INPUT"),
    _Kind("a video", "mp4|mov|avi|webm|m4v", None, _VIDEO),
    _Kind("a file of Python objects", "pkl|pickle|pt|pth|joblib", None, _TENSORS),
    _Kind("an archive", "tar|gz|tgz|bz2|xz|7z|rar", None, _UNPACK),
)


def what_else(path: Path) -> str | None:
    """Return what a file is that cannot be read here, and what to do, to end a sentence; None for any other file."""
    suffix = path.suffix.lower().removeprefix(".")
    kind = next((kind for kind in _KINDS if re.fullmatch(kind.suffixes, suffix)), None)
    if kind is None:
        return None
    if kind.head is not None:
        if not path.is_file():
            return None
        with path.open("rb") as file:
            if not file.read(len(kind.head)).startswith(kind.head):
                return None
    return f"{kind.title}: {kind.way_out.replace(_NETWORK, option(_NETWORK, 'FILE'))}"
