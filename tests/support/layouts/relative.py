"""More outputs of networks, as their demos write them."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from .networks import FOV, PHOTO
from .room import Expected, Room
from .writing import picture


def _depth01(depth: np.ndarray) -> np.ndarray:
    near, far = depth[depth > 0].min(), depth.max()
    return ((depth.clip(near) - near) / (far - near)).astype(np.float32)


def marigold(folder: Path, room: Room) -> Expected:
    """Marigold's run.py (Ke 2024): depth_npy/photo_pred.npy (0 near, 1 far), depth_bw 16-bit, depth_colored."""
    view = room.through(PHOTO, 1)[0]
    depth = _depth01(view.depth)
    picture(folder / "photo.jpg", view.color)
    (folder / "depth_npy").mkdir()
    np.save(folder / "depth_npy/photo_pred.npy", depth)
    picture(folder / "depth_bw/photo_pred.png", np.rint(depth * 65535).astype(np.uint16))
    picture(folder / "depth_colored/photo_pred_colored.png", np.full((*depth.shape, 3), (200, 60, 30), np.uint8))
    return Expected(folder, PHOTO, [view], {"fov": FOV}, poses=False, metric=False)


def geo_wizard(folder: Path, room: Room) -> Expected:
    """GeoWizard (Fu 2024): the same, with normal_npy/ and normal_colored/ beside."""
    expected = marigold(folder, room)
    (folder / "normal_npy").mkdir()
    np.save(folder / "normal_npy/photo_pred.npy", np.full((*expected.views[0].depth.shape, 3), 0.57, np.float32))
    shape = (*expected.views[0].depth.shape, 3)
    picture(folder / "normal_colored/photo_pred_colored.png", np.full(shape, (128, 128, 255), np.uint8))
    return expected


def zoe_depth(folder: Path, room: Room) -> Expected:
    """ZoeDepth's save_raw_16bit (Bhat 2023): photo.jpg and photo_depth.png, 256 a metre, which nothing says."""
    view = room.through(PHOTO, 1)[0]
    picture(folder / "photo.jpg", view.color)
    picture(folder / "photo_depth.png", np.rint(view.depth * 256).astype(np.uint16))
    given = {"or_says": "depth-scale|depth_scale", "then": {"depth_scale": 256}}
    return Expected(folder, PHOTO, [view], {"fov": FOV}, poses=False, **given)


def depth_crafter(folder: Path, room: Room) -> Expected:
    """DepthCrafter and Video Depth Anything (Hu 2024, Chen 2025): clip.npz `depth` (n, h, w), inverse from 0 to 1."""
    views = room.through(PHOTO)
    inverse = np.stack([np.where(view.depth > 0, 1 / view.depth.clip(0.1), 0) for view in views])
    folder.mkdir(parents=True, exist_ok=True)
    np.savez_compressed(folder / "clip.npz", depth=(inverse / inverse.max()).astype(np.float32))
    given = {"or_says": "depth-kind inverse|depth_kind='inverse'", "then": {"depth_kind": "inverse"}}
    return Expected(folder / "clip.npz", PHOTO, views, {"fov": FOV}, poses=False, color=False, metric=False, **given)


MAKERS = (marigold, geo_wizard, zoe_depth, depth_crafter)
