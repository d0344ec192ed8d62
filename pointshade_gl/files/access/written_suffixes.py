"""What the names of written files may end with: the one list for checks, errors and the help of the command line."""

from __future__ import annotations

from pathlib import Path

PICTURES = (".png", ".jpg", ".jpeg", ".webp", ".tif", ".tiff")
IMAGES = (*PICTURES, ".npy")
NORMALS = (*IMAGES, ".exr")
DEPTH = (".png", ".exr", ".tif", ".tiff", ".npy")
FILMS = (".mp4", ".gif")
PAGES = (".html", ".htm")
POINTS = (".ply", ".glb")
POSES = (".txt",)
CLOUD_NORMALS = (*POINTS, ".npy")
FOUND_POSES = (".json", *POSES)
SCENES = (".gltf", ".glb")
RENDERED = (*IMAGES, *FILMS, *PAGES, *POINTS)  # by `pointshade render`
NUMBERED = (*IMAGES, *POINTS)  # by it, to many files

# of a batch, each behind a dot; its normals are told from its pictures by their names
BATCH_PICTURES = ("png", "jpg", "webp", "tif")
BATCH_NORMALS = ("normals.png", "normals.exr", "normals.npy")
BATCH_PAGE = "html"
BATCH_FILMS = tuple(suffix[1:] for suffix in FILMS)
BATCH = (*BATCH_PICTURES, *BATCH_NORMALS, BATCH_PAGE, *BATCH_FILMS)


def check_suffix(path: Path, known: tuple[str, ...], subject: str = "its suffix") -> None:
    """Raises ValueError, listing the known ones, for another suffix."""
    if path.suffix.lower() not in known:
        one_of = f"one of {', '.join(known)}" if len(known) > 2 else " or ".join(known)
        raise ValueError(f"cannot write {path}: {subject} must be {one_of}")
