"""Depth pictures of a room made of planes, and what sensors and networks make of it."""

import numpy as np

F = 525 / 4  # pixels
_RANDOM = np.random.default_rng(8)


def room(height=120, width=160, noise=0.0):
    """(h, w) z in metres: floor, ceiling, two walls, a far wall and a box, 1.0 to 5 m away."""
    v, u = np.mgrid[:height, :width]
    x, y = (u - (width - 1) / 2) / F, (v - (height - 1) / 2) / F
    with np.errstate(divide="ignore"):
        sides = [distance / side.clip(0) for distance, side in ((1.2, y), (1.4, -y), (1.5, x), (1.3, -x))]
    z = np.minimum.reduce([*sides, np.full_like(x, 5.0), 4.5 / (1 + 0.3 * x + 0.1 * y)])
    box = (np.abs(x + 0.1) < 0.12) & (np.abs(y - 0.25) < 0.12)
    z[box] = (1.6 / (1 + 0.9 * x))[box]
    return z * (1 + noise * _RANDOM.standard_normal(z.shape))


def stretched(values, top=255):
    """Values laid from 0 to the top, as whole numbers."""
    return np.round((values - values.min()) / np.ptp(values) * top).astype(np.uint8 if top == 255 else np.uint16)


def kinect_disparity(metres):
    """Raw disparity of a first Kinect: eighths of a pixel, 2047 where the depth is 0."""
    known = metres > 0
    return np.where(known, np.round(1091.5 - 348 / np.where(known, metres, 1)), 2047).astype(np.uint16)


def corner(yaw=0.2, pitch=0.0, roll=0.0, size=(240, 320), focal=262.5, scale=1.0):
    """A room of right angles with a ball, from its middle: (h, w, 3) uint8, (h, w) z in metres, and what is seen.

    That is 0, 1, 2 for walls across x, y and z, 3, 4, 5 for those behind them, 6 for the ball. Angles are in radians.
    """
    height, width = size
    v, u = np.mgrid[:height, :width]
    rays = np.stack([(u - (width - 1) / 2) / focal, (v - (height - 1) / 2) / focal, np.ones(size)], -1)
    for i, j, angle in ((0, 1, roll), (1, 2, pitch), (0, 2, yaw)):
        turn = np.eye(3)
        turn[[i, j], [i, j]], turn[i, j], turn[j, i] = np.cos(angle), np.sin(angle), -np.sin(angle)
        rays = rays @ turn.T
    low, high = np.array([-1.5, -1.2, -2.0]), np.array([1.2, 1.0, 3.0])
    with np.errstate(divide="ignore"):
        walls = np.where(rays > 0, high / rays, low / rays)
    z, nearest = walls.min(-1), walls.argmin(-1)
    seen = np.where(np.take_along_axis(rays, nearest[..., None], -1)[..., 0] > 0, nearest, nearest + 3)
    center = np.array([0.2, 0.5, 2.0])
    across, along = (rays * rays).sum(-1), rays @ center
    inside = along**2 - across * (center @ center - 0.16)
    ball = np.where(inside > 0, (along - np.sqrt(inside.clip(0))) / across, np.inf)
    is_ball = (ball > 0) & (ball < z)
    z, seen = np.where(is_ball, ball, z), np.where(is_ball, 6, seen)
    tiles = np.floor(rays * z[..., None] * 4).sum(-1) % 2
    paint = [
        [190, 140, 130],
        [120, 90, 60],
        [210, 190, 160],
        [140, 160, 200],
        [230] * 3,
        [160, 160, 110],
        [200, 60, 50],
    ]
    color = np.array(paint)[seen] * (0.75 + 0.25 * tiles)[..., None]
    return color.astype(np.uint8), z * scale, seen


def misread(frame, z, seen):
    """What is wrong about a frame of `corner`, at whatever scale: walls at other angles, depth that is another's."""
    depth = frame.depth.astype(float)
    known = depth > 0
    points = frame.camera.unproject(np.where(known, depth, np.nan))
    normals = {}
    for wall in range(6):
        some = points[(seen == wall) & known]
        if len(some) > 0.02 * depth.size:
            normals[wall] = np.linalg.svd(some - some.mean(0), full_matrices=False)[2][2]
    wrong = []
    for k in normals:
        for j in (one for one in normals if one < k):
            angle = np.degrees(np.arccos(min(1, abs(normals[k] @ normals[j]))))
            if abs(angle - (0 if k == j + 3 else 90)) > 1.5:
                wrong.append(f"walls {j} and {k} at {angle:.1f} degrees")
    alike = np.corrcoef(depth[known], z[known])[0, 1]
    return wrong + ([f"correlation {alike:.4f}"] if alike < 0.999 else [])
