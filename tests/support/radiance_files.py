"""Writes Radiance pictures for the tests, in each of the ways in which lines are packed."""

from __future__ import annotations

import numpy as np


def mantissas(picture: np.ndarray) -> np.ndarray:
    """(h, w, 4) uint8 of (h, w, 3) linear light: three colours with a common exponent."""
    _, exponent = np.frexp(picture.max(-1))
    colors = np.floor(np.ldexp(picture, 8 - exponent[..., None]))
    return np.where(picture.max(-1)[..., None] > 0, np.dstack([colors, exponent + 128]), 0).astype(np.uint8)


def restored(pixels: np.ndarray) -> np.ndarray:
    """(h, w, 3) of what `mantissas` gave."""
    return np.ldexp(pixels[..., :3].astype(np.float64), pixels[..., 3:].astype(int) - 136)


def flat(line: np.ndarray) -> bytes:
    return line.tobytes()


def repeats(line: np.ndarray) -> bytes:
    """A colour that repeats is followed by how often, in digits of 256."""
    data, k = b"", 0
    while k < len(line):
        count = 1
        while k + count < len(line) and (line[k + count] == line[k]).all():
            count += 1
        data += line[k].tobytes()
        k, more = k + count, count - 1
        while more:
            data, more = data + bytes([1, 1, 1, more & 255]), more >> 8
    return data


def run_lengths(line: np.ndarray) -> bytes:
    """Each channel alone: runs of up to 127, and values one by one."""
    data = bytes([2, 2, len(line) >> 8, len(line) & 255])
    for values in line.T:
        k = 0
        while k < len(values):
            count = 1
            while k + count < len(values) and count < 127 and values[k + count] == values[k]:
                count += 1
            data += bytes([128 + count, values[k]]) if count > 2 else bytes([count, *values[k : k + count]])
            k += count
    return data


def radiance_file(pixels: np.ndarray, packed=run_lengths, header: str = "", size: str = "") -> bytes:
    """The bytes of a file with these mantissas; of another header and size if given."""
    height, width = pixels.shape[:2]
    head = f"#?RADIANCE\n# a comment\n{header}FORMAT=32-bit_rle_rgbe\n\n{size or f'-Y {height} +X {width}'}\n"
    return head.encode() + b"".join(map(packed, pixels))
