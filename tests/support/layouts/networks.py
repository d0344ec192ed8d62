"""What networks write beside a photograph."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from .room import SMALL, Expected, Pinhole, Room, View
from .writing import as_json, exr, numbers, pfm, picture, quaternion, text

PHOTO = Pinhole(262.5, 262.5, 159.5, 119.5, 320, 240)
FOV = 2 * math.degrees(math.atan(120 / PHOTO.fy))


def _photo(folder: Path, room: Room, name: str = "photo.jpg") -> View:
    """The photograph, whole: a network leaves no hole."""
    view = room.through(PHOTO, 1)[0]
    picture(folder / name, view.color)
    return View(view.color, np.where(view.depth > 0, view.depth, 3.4).astype(np.float32), view.pose)


def _inverse(view: View) -> np.ndarray:
    """Relative inverse depth as networks give it: larger is nearer, any scale, any offset."""
    return (7.3 * (1 / view.depth - 0.9 / view.depth.max())).astype(np.float32)


def _mapped(view: View, name: str) -> np.ndarray:
    """Inverse depth, stretched to 0..255, through a colour map of matplotlib."""
    import matplotlib

    inverse = _inverse(view)
    levels = ((inverse - inverse.min()) / (inverse.max() - inverse.min()) * 255).astype(np.uint8)
    return (matplotlib.colormaps[name](levels)[..., :3] * 255).astype(np.uint8)


def _asks(folder: Path, view: View, metric: bool = True) -> Expected:
    """The focal length is nowhere: a guess with a note, or an error that asks for it."""
    kind = {} if metric else {"depth_kind": "inverse"}
    says = "fov|intrinsics" if metric else "fov|intrinsics|depth.kind"
    then = {"fov": FOV, **kind}
    return Expected(folder, PHOTO, [view], poses=False, metric=metric, or_says=says, then=then)


def depth_anything_mapped(folder: Path, room: Room) -> Expected:
    """Depth Anything V2's run.py --pred-only: the map Spectral_r."""
    view = _photo(folder, room)
    picture(folder / "photo_depth.png", _mapped(view, "Spectral_r"))
    return _asks(folder, view, metric=False)


def depth_anything_v1_mapped(folder: Path, room: Room) -> Expected:
    """Depth Anything V1's run.py: the map inferno, photo_depth.png."""
    view = _photo(folder, room)
    picture(folder / "photo_depth.png", _mapped(view, "inferno"))
    return _asks(folder, view, metric=False)


def depth_anything_grey(folder: Path, room: Room) -> Expected:
    """Depth Anything's run.py --grayscale: 8 bits in three equal channels, larger is nearer."""
    view = _photo(folder, room)
    inverse = _inverse(view)
    levels = ((inverse - inverse.min()) / (inverse.max() - inverse.min()) * 255).astype(np.uint8)
    picture(folder / "photo_depth.png", np.repeat(levels[..., None], 3, 2))
    return _asks(folder, view, metric=False)


def midas(folder: Path, room: Room) -> Expected:
    """MiDaS' run.py: photo-dpt_beit_large_512.png (16 bit, larger is nearer) and .pfm of the same."""
    view = _photo(folder, room)
    inverse = _inverse(view)
    levels = (inverse - inverse.min()) / (inverse.max() - inverse.min()) * 65535
    picture(folder / "photo-dpt_beit_large_512.png", levels.astype(np.uint16))
    pfm(folder / "photo-dpt_beit_large_512.pfm", 100 * inverse)
    return _asks(folder, view, metric=False)


def relative_npy(folder: Path, room: Room) -> Expected:
    """A relative network's raw array, as people save it: photo.npy."""
    view = _photo(folder, room)
    np.save(folder / "photo.npy", _inverse(view))
    return _asks(folder, view, metric=False)


def depth_anything_metric(folder: Path, room: Room) -> Expected:
    """Depth Anything V2, metric_depth/run.py --save-numpy: photo_raw_depth_meter.npy and a Spectral picture beside."""
    view = _photo(folder, room)
    np.save(folder / "photo_raw_depth_meter.npy", view.depth)
    picture(folder / "photo.png", _mapped(view, "Spectral"))
    return _asks(folder, view)


def depth_pro(folder: Path, room: Room) -> Expected:
    """Depth Pro's prediction saved whole: depth in metres and focallength_px."""
    view = _photo(folder, room)
    np.savez(folder / "photo.npz", depth=view.depth, focallength_px=np.float32(262.5))
    return Expected(folder, PHOTO, [view], poses=False)


def depth_pro_run(folder: Path, room: Room) -> Expected:
    """Depth Pro's own depth-pro-run -o into the photograph's folder: photo.npz, and photo.jpg is a turbo picture."""
    view = _photo(folder, room, "photo.png")
    np.savez_compressed(folder / "photo.npz", depth=view.depth)
    picture(folder / "photo.jpg", _mapped(view, "turbo"))
    return _asks(folder, view)


def moge(folder: Path, room: Room) -> Expected:
    """MoGe's infer.py --maps: depth.exr (inf outside mask.png), depth_vis.png, normal.png, points.exr, fov."""
    view = _photo(folder, room, "image.jpg")
    mask = room.through(PHOTO, 1)[0].depth > 0
    mask[:30, :50] = False
    view = View(view.color, np.where(mask, view.depth, 0).astype(np.float32), view.pose)
    depth = np.where(mask, view.depth, np.inf)
    exr(folder / "depth.exr", Y=depth)
    exr(folder / "points.exr", R=depth, G=depth, B=depth)
    picture(folder / "mask.png", mask.astype(np.uint8) * 255)
    picture(folder / "depth_vis.png", np.where(mask[..., None], np.uint8((90, 20, 200)), np.uint8(0)))
    picture(folder / "normal.png", np.full(view.color.shape, (128, 128, 255), np.uint8))
    fov_x = 2 * math.degrees(math.atan(160 / 262.5))
    as_json(folder / "fov.json", {"fov_x": round(fov_x, 2), "fov_y": round(FOV, 2)})
    return Expected(folder, PHOTO, [view], poses=False)


def moge_npz(folder: Path, room: Room) -> Expected:
    """MoGe's output dictionary as .npz: intrinsics normalised by width and height, mask, points."""
    view = _photo(folder, room)
    mask = np.ones(view.depth.shape, bool)
    mask[:30, :50] = False
    view = View(view.color, np.where(mask, view.depth, 0).astype(np.float32), view.pose)
    y, x = np.mgrid[:240, :320]
    depth = np.where(mask, view.depth, np.inf)
    with np.errstate(invalid="ignore"):
        points = np.stack([(x - 159.5) / 262.5 * depth, (y - 119.5) / 262.5 * depth, depth], -1)
    matrix = np.array([[262.5 / 320, 0, 0.5], [0, 262.5 / 240, 0.5], [0, 0, 1]], np.float32)
    np.savez(folder / "photo.npz", points=points.astype(np.float32), depth=depth, mask=mask, intrinsics=matrix)
    return Expected(folder, PHOTO, [view], poses=False)


def vggt(folder: Path, room: Room) -> Expected:
    """VGGT's predictions.npz: depth (n, h, w, 1), extrinsic (n, 3, 4) world-to-camera, images (n, 3, h, w)."""
    views = room.through(SMALL)
    poses = np.array([np.linalg.inv(view.pose)[:3] for view in views], np.float32)
    colors = np.array([view.color.transpose(2, 0, 1) / 255 for view in views], np.float32)
    depth = np.array([view.depth[..., None] for view in views])
    np.savez(
        folder / "predictions.npz",
        pose_enc=np.zeros((3, 9), np.float32),
        depth=depth,
        depth_conf=1 + 10 * (depth[..., 0] > 0).astype(np.float32),
        images=colors,
        extrinsic=poses,
        intrinsic=np.array([SMALL.matrix] * 3, np.float32),
        world_points=np.zeros((3, 240, 320, 3), np.float32),
    )
    return Expected(folder / "predictions.npz", SMALL, views, pixels=0.6)


def megasam(folder: Path, room: Room) -> Expected:
    """MegaSaM's outputs_cvd/scene_sgd_cvd_hr.npz (Li 2025): images (n, h, w, 3), depths, intrinsic, cam_c2w."""
    views = room.through(SMALL)
    np.savez(
        folder / "scene_sgd_cvd_hr.npz",
        images=np.array([view.color for view in views]),
        depths=np.array([view.depth for view in views], np.float16),
        intrinsic=SMALL.matrix.astype(np.float32),
        cam_c2w=np.array([view.pose for view in views], np.float32),
    )
    return Expected(folder / "scene_sgd_cvd_hr.npz", SMALL, views, pixels=0.6)


def monst3r(folder: Path, room: Room) -> Expected:
    """MonST3R's demo folder (Zhang 2024): frame_0000.png and .npy, K of nine numbers a line, pred_traj.txt.

    The trajectory looks like TUM's but its quaternions begin with w; the views tell which it is.
    """
    views, poses = room.through(SMALL), []
    for k, view in enumerate(views):
        picture(folder / f"frame_{k:04d}.png", view.color)
        np.save(folder / f"frame_{k:04d}.npy", view.depth)
        np.save(folder / f"conf_{k}.npy", np.full(view.depth.shape, 3.0, np.float32))
        np.save(folder / f"init_conf_{k}.npy", np.full(view.depth.shape, 2.0, np.float32))
        picture(folder / f"dynamic_mask_{k}.png", np.zeros(view.depth.shape, np.uint8))
        turn = np.roll(quaternion(view.pose), 1)
        poses.append(f"{float(k)} {numbers(view.pose[:3, 3])} {numbers(turn)}")
    text(folder / "pred_traj.txt", *poses)
    text(folder / "pred_intrinsics.txt", *[numbers(SMALL.matrix.reshape(-1), "%.18e")] * 3)
    return Expected(folder, SMALL, views, pixels=0.6, or_notes="pose|traj")


MAKERS = (
    depth_anything_mapped,
    depth_anything_v1_mapped,
    depth_anything_grey,
    midas,
    relative_npy,
    depth_anything_metric,
    depth_pro,
    depth_pro_run,
    moge,
    moge_npz,
    vggt,
    megasam,
    monst3r,
)
