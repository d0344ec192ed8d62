"""Small ICC profiles (v2, matrix and curve), and chunks of PNGs that say a colour space."""

import struct
import zlib
from pathlib import Path

import numpy as np

D50 = (0.9642, 1.0, 0.8249)
# columns of red, green and blue, adapted to D50, from the standards' own profiles
DISPLAY_P3 = ((0.5151, 0.2412, -0.0011), (0.2920, 0.6922, 0.0419), (0.1571, 0.0666, 0.7841))
ADOBE_RGB = ((0.6097, 0.3111, 0.0195), (0.2053, 0.6257, 0.0609), (0.1492, 0.0632, 0.7446))
SRGB = ((0.4361, 0.2225, 0.0139), (0.3851, 0.7169, 0.0971), (0.1431, 0.0606, 0.7141))


def icc(columns=DISPLAY_P3, name="Display P3", gamma=None, space=b"RGB "):
    """A profile of RGB, or of grey. gamma: None is the curve of sRGB."""
    if gamma is None:
        levels = np.arange(1024) / 1023
        light = np.where(levels <= 0.04045, levels / 12.92, ((levels + 0.055) / 1.055) ** 2.4)
        curve = b"curv\0\0\0\0" + struct.pack(">I", 1024) + np.rint(light * 65535).astype(">u2").tobytes()
    else:
        curve = b"curv\0\0\0\0" + struct.pack(">IH", 1, round(gamma * 256))
    text = name.encode() + b"\0"
    tags = {
        b"desc": b"desc\0\0\0\0" + struct.pack(">I", len(text)) + text + bytes(78),
        b"cprt": b"text\0\0\0\0none\0",
        b"wtpt": _xyz(D50),
    }
    if space == b"RGB ":
        tags |= {bytes([letter]) + b"XYZ": _xyz(one) for letter, one in zip(b"rgb", columns, strict=True)}
        tags |= {bytes([letter]) + b"TRC": curve for letter in b"rgb"}
    else:
        tags[b"kTRC"] = curve
    table, data = b"", b""
    start = 128 + 4 + 12 * len(tags)
    for key, content in tags.items():
        table += key + struct.pack(">2I", start + len(data), len(content))
        data += content + bytes(-len(content) % 4)
    body = struct.pack(">I", len(tags)) + table + data
    head = struct.pack(">I4sI4s4s4s", 128 + len(body), bytes(4), 0x02100000, b"mntr", space, b"XYZ ")
    head += bytes(12) + b"acsp" + bytes(28) + _fixed(D50)
    return head.ljust(128, b"\0") + body


def add_chunks(path, *chunks):
    """Put chunks, each (name, data), right behind a PNG's header."""
    png = Path(path).read_bytes()
    added = b"".join(struct.pack(">I", len(d)) + n + d + struct.pack(">I", zlib.crc32(n + d)) for n, d in chunks)
    Path(path).write_bytes(png[:33] + added + png[33:])


def _xyz(one):
    return b"XYZ \0\0\0\0" + _fixed(one)


def _fixed(values):
    return struct.pack(">3i", *(round(value * 65536) for value in values))
