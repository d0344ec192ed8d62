"""Arrays to put into files of other programs: a surface, its points, its camera, a pose, colours."""

import numpy as np

CAMERA = 50.0, 52.0, 30.5, 22.5
H, W = 48, 64


def wavy(h=H, w=W, shift=0.0):
    """(h, w) float32 metres of a smooth surface."""
    rows, columns = np.mgrid[0:h, 0:w]
    return (2 + shift + 0.3 * np.sin(columns / 9) + 0.01 * rows).astype(np.float32)


def points_of(depth, camera=CAMERA):
    fx, fy, cx, cy = camera
    rows, columns = np.mgrid[0 : depth.shape[0], 0 : depth.shape[1]]
    return np.stack([(columns - cx) / fx * depth, (rows - cy) / fy * depth, depth], axis=2).astype(np.float32)


def matrix(camera=CAMERA):
    fx, fy, cx, cy = camera
    return np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1]])


def pose(angle=0.2, place=(1.0, -2.0, 0.5)):
    """(4, 4) camera-to-world."""
    c, s = np.cos(angle), np.sin(angle)
    result = np.eye(4)
    result[:3, :3] = [[c, 0, s], [0, 1, 0], [-s, 0, c]]
    result[:3, 3] = place
    return result


def colors(n, h=H, w=W):
    """(n, h, w, 3) uint8, no two pixels alike."""
    rng = np.random.default_rng(7)
    return rng.integers(0, 256, (n, h, w, 3), np.uint8)
