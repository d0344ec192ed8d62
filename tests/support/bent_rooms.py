"""A closed room with a ball, traced along any rays: what lenses and panoramas show of it, exactly."""

import json
import struct

import numpy as np
from PIL import Image

import pointshade_gl as ps

WALLS = (((0, 0, 1), 3.0), ((0, 0, -1), 2.0), ((0, 1, 0), 1.0), ((0, -1, 0), 1.3), ((1, 0, 0), 1.4), ((-1, 0, 0), 1.7))
BALL, RADIUS = np.array([0.2, 0.5, 1.9]), 0.35
_A, _C = np.cos(0.2), np.sin(0.2)
TURN = np.array([[_A, 0, _C], [0, 1, 0], [-_C, 0, _A]])  # the room is not seen straight on


def trace(rays):
    """Distances, and smooth colours (h, w, 3) uint8, along unit rays (h, w, 3) from the origin."""
    turned = rays @ TURN.T
    with np.errstate(divide="ignore"):
        ends = [np.where(turned @ n > 1e-9, far / (turned @ n), np.inf) for n, far in WALLS]
    far = np.min(ends, axis=0)
    along = turned @ BALL
    inside = along**2 - (BALL @ BALL - RADIUS**2)
    near = np.where((inside > 0) & (along > 0), along - np.sqrt(np.maximum(inside, 0)), np.inf)
    far = np.minimum(far, near)
    place = turned * far[..., None]
    waves = np.sin(place @ np.array([[7.0, 2, -4], [-2, 9.0, 2], [4, 2, 8.0]]))
    return far, np.rint(127 + 100 * waves).astype(np.uint8)


def off_surface(points):
    """How far points (..., 3) lie off the room's nearest surface, metres."""
    turned = points @ TURN.T
    sides = [abs(turned @ n - far) for n, far in np.array(WALLS, object)]
    return np.min([*sides, abs(np.linalg.norm(turned - BALL, axis=-1) - RADIUS)], axis=0)


def seen_by(lens, camera):
    """Depth z, distance and colours that a lens shows; 0 where it shows nothing, or nothing in front."""
    u, v = np.meshgrid(np.arange(camera.width), np.arange(camera.height))
    rays = np.stack(lens.ray_of(*camera.ray_at(u, v)), -1)
    known = np.isfinite(rays).all(-1)
    rays = np.where(known[..., None], rays, (0, 0, 1))
    distance, color = trace(rays)
    z = np.maximum(distance * rays[..., 2], 0)
    return z * known, distance * known, color


def panorama(width):
    """Distances and colours of a panorama, whose middle looks ahead."""
    across = (np.arange(width) + 0.5) / width * 2 * np.pi - np.pi
    up = np.pi / 2 - (np.arange(width // 2) + 0.5) / (width // 2) * np.pi
    longitude, latitude = np.meshgrid(across, up)
    flat = np.cos(latitude)
    return trace(np.stack([flat * np.sin(longitude), -np.sin(latitude), flat * np.cos(longitude)], -1))


def put(folder, depth, color=None, **named):
    """Write depth.npy and color.png, and texts or JSON by their names with _ for the dot."""
    folder.mkdir(parents=True, exist_ok=True)
    np.save(folder / "depth.npy", depth.astype(np.float32))
    if color is not None:
        Image.fromarray(color).save(folder / "color.png")
    for name, content in named.items():
        path = folder / ".".join(name.rsplit("_", 1))
        path.write_text(content if isinstance(content, str) else json.dumps(content))
    return folder


def colmap_binary(model, numbers, size):
    """COLMAP's cameras.bin with one camera."""
    return struct.pack("<QiiQQ", 1, 1, model, *size) + struct.pack(f"<{len(numbers)}d", *numbers)


def check_frame(frame: ps.Frame, share=0.001):
    """The points lie on the room, to 1 mm + 0.1 % but for a share at edges; colours lie within 0.1 pixel."""
    known = frame.depth > 0
    points = frame.camera.unproject(np.where(known, frame.depth, np.nan))[known]
    points = points @ frame.pose[:3, :3].T
    allowed = 0.001 + 0.001 * np.linalg.norm(points, axis=-1)
    assert (off_surface(points) > allowed).mean() < share
    rays = frame.camera.rays() @ frame.pose[:3, :3].T
    distance, want = trace(rays / np.linalg.norm(rays, axis=-1, keepdims=True))
    edge = np.hypot(*np.gradient(np.log(distance))) > 0.03
    for _ in range(4):  # pixels of the pinhole that one of a fisheye becomes at its rim: colours are mixed there
        edge[1:] |= edge[:-1]
        edge[:-1] |= edge[1:]
        edge[:, 1:] |= edge[:, :-1]
        edge[:, :-1] |= edge[:, 1:]
    assert np.abs(shifts(frame.color, want, known & ~edge)).max() < 0.1


def shifts(color, want, used, side=40):
    """By how many pixels the colours of each block are shifted, right and down, by least squares."""
    want = want.astype(float)
    down, right = np.gradient(want, axis=(0, 1))
    found = []
    for row in range(0, len(want), side):
        for column in range(0, want.shape[1], side):
            block = np.s_[row : row + side, column : column + side]
            good = used[block]
            if good.sum() < side * side / 2:
                continue
            slopes = np.stack([right[block][good].ravel(), down[block][good].ravel()], -1)
            off = (color[block].astype(float) - want[block])[good].ravel()
            found.append(-np.linalg.lstsq(slopes, off, rcond=None)[0])
    return np.array(found)
