"""Known names of arrays in files, and what each means: depth, points, camera, pose. A new name is an entry in ROLES.

Read in the sources and papers of: Depth Anything 1-3, MiDaS, Depth Pro, Metric3D, MoGe 1-3, UniDepth, Pi3, VGGT,
DUSt3R, MASt3R, MapAnything, MegaSaM; Hypersim, BlenderProc, NYU Depth v2 and its copies in HDF5.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from ...notes.words import shown

# Role: names, the best first. Letters' case and everything but letters and digits do not count.
ROLES: dict[str, tuple[str, ...]] = {
    "depth": (
        "depth", "depths", "depth_map", "depth_maps", "metric_depth", "depth_meters", "depth_m", "depth_image",
        "depth_images", "pred_depth", "depth_pred", "im_depth", "raw_depth", "depth_z", "predicted_depth",
    ),
    "inverse": ("inverse_depth", "inv_depth", "depth_inv", "disparity", "disparities", "disp"),
    "ray": ("distance", "distances", "distance_map", "ray_depth", "depth_along_ray"),
    # (h, w, 3) in the camera's own axes, even beside a pose
    "own_points": ("local_points", "pts3d_cam", "pts3d_in_self_view", "points_cam", "cam_points"),
    # in the camera's axes or, beside a pose, in the world's: whichever a pinhole camera sees
    "points": ("points", "pts3d", "pts3ds", "point_map", "point_maps", "pointmap", "xyz", "world_points"),
    "color": (
        "image", "images", "rgb", "rgbs", "color", "colors", "colour", "colours", "img", "imgs", "processed_images",
        "im_rgb", "rgb_image", "rgb_images", "img_no_norm", "frame", "frames",
    ),
    "intrinsics": (
        "intrinsics", "intrinsic", "k", "ks", "cam_k", "camera_k", "camera_matrix", "intrinsic_matrix",
        "camera_intrinsics", "cam_intrinsics", "pred_intrinsics", "camera_intrinsic",
    ),
    "focal": ("focallength_px", "focal_length_px", "focal_px", "focal_length", "focal", "focals"),
    "center": ("principal_points", "principal_point", "pp", "pps"),
    "world_to_camera": ("extrinsics", "extrinsic", "w2c", "world_to_camera", "world2cam", "cam_w2c", "viewmats"),
    "camera_to_world": (
        "pose", "poses", "c2w", "cam2world", "cams2world", "camera_to_world", "cam_c2w", "camera_pose", "camera_poses",
        "cam_poses", "im_poses",
    ),
    "mask": ("mask", "masks", "valid", "valid_mask", "depth_mask"),
    "sky": ("sky", "sky_mask", "invalid", "invalid_mask"),
    "confidence": (
        "conf", "depth_conf", "confidence", "confidences", "confs", "depth_confidence", "conf_map", "world_points_conf",
    ),
    "normals": ("normal", "normals", "normal_map"),
    "scale": ("depth_scale", "factor_depth", "depth_factor"),
}  # fmt: skip
SURFACES = ("depth", "inverse", "ray", "own_points", "points")  # the first of them that a file has is its depth
MAYBE_INVERSE = ("predicted_depth",)  # inverse for the relative networks of a family, metres for its metric ones
MAYBE_ERROR = ("confidence",)  # UniDepth's and UniK3D's of floats is the error they expect: high where they are unsure
_LISTED = 12


def find_roles(names: Iterable[str]) -> dict[str, str]:
    """The best name for each role. Of names in groups, such as frame/depth, the last part counts."""
    plain = {}
    for name in names:
        plain.setdefault(_plain(name.rpartition("/")[2]), name)
    found = {role: [plain[_plain(name)] for name in known if _plain(name) in plain] for role, known in ROLES.items()}
    return {role: matching[0] for role, matching in found.items() if matching}


def is_named(name: str, names: Sequence[str]) -> bool:
    return _plain(name.rpartition("/")[2]) in map(_plain, names)


def list_arrays(shapes: dict[str, tuple[int, ...]]) -> str:
    """Names and shapes for an error or a note."""
    listed = [f"{shown(name)[1:-1]} {shape}" for name, shape in list(shapes.items())[:_LISTED]]
    return ", ".join(listed) + (f" and {len(shapes) - _LISTED} more" if len(shapes) > _LISTED else "")


def _plain(name: str) -> str:
    return "".join(filter(str.isalnum, name.lower()))
