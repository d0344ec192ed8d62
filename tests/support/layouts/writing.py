"""Writers of the files that many layouts share."""

from __future__ import annotations

import json
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image
from scipy.spatial.transform import Rotation


def picture(path: Path, array: np.ndarray) -> None:
    """A picture of 8 or 16 bits, of the kind that its name says."""
    path.parent.mkdir(parents=True, exist_ok=True)
    Image.fromarray(array).save(path, **({"quality": 95} if path.suffix == ".jpg" else {"compress_level": 1}))


def depth16(path: Path, depth: np.ndarray, scale: float = 1000, missing: int = 0) -> None:
    """A 16-bit PNG: metres times scale, rounded."""
    raw = np.rint(np.where(depth > 0, depth * scale, missing))
    assert raw.max() <= 65535, "too far for 16 bits"
    picture(path, raw.astype(np.uint16))


def text(path: Path, *lines: str) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text("\n".join(lines) + "\n")


def as_json(path: Path, content: Any) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps(content, indent=2))


def rows(matrix: np.ndarray, form: str = "%.8f", between: str = " ") -> list[str]:
    """A matrix as lines of text."""
    return [between.join(form % value for value in row) for row in matrix]


def numbers(values: Iterable[float], form: str = "%.8f", between: str = " ") -> str:
    return between.join(form % value for value in values)


def quaternion(matrix: np.ndarray) -> np.ndarray:
    """x, y, z, w of a (4, 4) or (3, 3) matrix."""
    return Rotation.from_matrix(matrix[:3, :3]).as_quat()


def exr(path: Path, **channels: np.ndarray) -> None:
    """32-bit float EXR with these channels, each (h, w)."""
    import OpenEXR

    path.parent.mkdir(parents=True, exist_ok=True)
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    with OpenEXR.File(header, {name: np.ascontiguousarray(a, np.float32) for name, a in channels.items()}) as file:
        file.write(str(path))


def pfm(path: Path, array: np.ndarray) -> None:
    """Portable float map: rows from bottom to top, little-endian."""
    path.parent.mkdir(parents=True, exist_ok=True)
    head = f"Pf\n{array.shape[1]} {array.shape[0]}\n-1\n".encode()
    path.write_bytes(head + array[::-1].astype("<f4").tobytes())


def tum_poses(times: Iterable[float], poses: Iterable[np.ndarray]) -> list[str]:
    """Lines `t tx ty tz qx qy qz qw`."""
    return [
        f"{time:.4f} {numbers(pose[:3, 3], '%.6f')} {numbers(quaternion(pose), '%.7f')}"
        for time, pose in zip(times, poses, strict=True)
    ]


def log_trajectory(path: Path, poses: list[np.ndarray]) -> None:
    """Redwood's and Open3D's .log: camera-to-world, each after a line of three integers."""
    lines = []
    for k, pose in enumerate(poses):
        lines += [f"{k} {k} {k + 1}", *rows(pose)]
    text(path, *lines)
