"""Single frames under the names that people give them, and pictures beside them that are no frame."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from .networks import FOV, PHOTO
from .room import Expected, Room
from .writing import as_json, depth16, picture

FOV_GIVEN = {"fov": FOV}


def _alone(folder: Path, room: Room, color: str, depth: str) -> Expected:
    view = room.through(PHOTO, 1)[0]
    picture(folder / color, view.color)
    if depth.endswith(".npy"):
        np.save(folder / depth, view.depth)
    else:
        depth16(folder / depth, view.depth)
    return Expected(folder, PHOTO, [view], FOV_GIVEN, poses=False)


def raw_depth_and_photo(folder: Path, room: Room) -> Expected:
    """raw_depth.png and the one other picture."""
    return _alone(folder, room, "IMG_2031.jpg", "raw_depth.png")


def number_and_number_depth(folder: Path, room: Room) -> Expected:
    """1.png and 1_depth.png."""
    return _alone(folder, room, "1.png", "1_depth.png")


def image_and_depth_npy(folder: Path, room: Room) -> Expected:
    """scene_image.jpg and scene_depth.npy."""
    return _alone(folder, room, "scene_image.jpg", "scene_depth.npy")


def capital_names(folder: Path, room: Room) -> Expected:
    """Color.PNG and Depth.PNG, as Windows programs write them."""
    expected = _alone(folder, room, "Color.png", "Depth.png")
    (folder / "Color.png").rename(folder / "Color.PNG")
    (folder / "Depth.png").rename(folder / "Depth.PNG")
    return expected


def many_images_and_arrays(folder: Path, room: Room) -> Expected:
    """000_image.jpg with 000_depth.npy, and so on."""
    views = room.through(PHOTO)
    for k, view in enumerate(views):
        picture(folder / f"{k:03d}_image.jpg", view.color)
        np.save(folder / f"{k:03d}_depth.npy", view.depth)
    return Expected(folder, PHOTO, views, FOV_GIVEN, poses=False)


def depth_file_alone(folder: Path, room: Room) -> Expected:
    """A depth file is typed, with nothing beside it."""
    view = room.through(PHOTO, 1)[0]
    depth16(folder / "depth.png", view.depth)
    return Expected(folder / "depth.png", PHOTO, [view], FOV_GIVEN, poses=False, color=False)


def beside_pictures_of_something_else(folder: Path, room: Room) -> Expected:
    """A frame beside a mask, normals, labels, a confidence, a coloured depth, and macOS' hidden files."""
    expected = _alone(folder, room, "color.png", "depth.png")
    shape = expected.views[0].depth.shape
    picture(folder / "mask.png", np.full(shape, 255, np.uint8))
    picture(folder / "normal.png", np.full((*shape, 3), (128, 128, 255), np.uint8))
    picture(folder / "label.png", np.full(shape, 3, np.uint8))
    picture(folder / "confidence.png", np.full(shape, 2, np.uint8))
    picture(folder / "depth_vis.png", np.full((*shape, 3), (200, 30, 90), np.uint8))
    picture(folder / "depth_colormap.jpg", np.full((*shape, 3), (200, 30, 90), np.uint8))
    for name in ("._color.png", "._depth.png", ".DS_Store", "Thumbs.db"):
        (folder / name).write_bytes(b"\0\5\x16\7\0\2\0\0Mac OS X")
    as_json(folder / "metadata.json", {"operator": "nobody", "date": "2024-05-01"})
    return expected


def beside_folders_of_something_else(folder: Path, room: Room) -> Expected:
    """A sequence beside folders of masks, confidences, semantic labels, normals and hidden files."""
    views = room.through(PHOTO)
    for k, view in enumerate(views):
        shape = view.depth.shape
        picture(folder / f"rgb/{k:05d}.png", view.color)
        depth16(folder / f"depth/{k:05d}.png", view.depth)
        for name in ("confidence", "mask", "semantic", "instance", "label-filt"):
            picture(folder / name / f"{k:05d}.png", np.full(shape, 2, np.uint8))
        picture(folder / f"normal/{k:05d}.png", np.full((*shape, 3), (128, 128, 255), np.uint8))
        picture(folder / f"depth_vis/{k:05d}.png", np.full((*shape, 3), (200, 30, 90), np.uint8))
        for name in ("rgb", "depth"):
            (folder / name / f"._{k:05d}.png").write_bytes(b"\0\5\x16\7\0\2\0\0Mac OS X")
    return Expected(folder, PHOTO, views, FOV_GIVEN, poses=False)


MAKERS = (
    raw_depth_and_photo,
    number_and_number_depth,
    image_and_depth_npy,
    capital_names,
    many_images_and_arrays,
    depth_file_alone,
    beside_pictures_of_something_else,
    beside_folders_of_something_else,
)
