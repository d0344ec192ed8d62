"""Damage to files: what disks, networks and programs do to bytes, and what people do to texts. Seeded.

A wrong checksum often ends the reading before anything interesting happens: some of the damage is sealed again.
"""

from __future__ import annotations

import json
import re
import struct
import zipfile
import zlib
from collections.abc import Callable
from io import BytesIO
from typing import Any

import numpy as np

Random = np.random.Generator
NUMBERS = [*b"nan -inf 1e999 -1 0 1e-320 99999999999 1e18 0.5 x".split(), b"", b"9" * 400, b"-" * 9]
VALUES = [None, [], {}, "", "x" * 400, True, -1, 0, 0.5, 1e308, 10**400, float("nan"), [[]], [None], [1, [2]], {"": {}}]
LIMITS = [struct.pack(form, value) for form in (">I", "<I", ">Q", "<Q") for value in (0, 1, 0x7FFFFFFF, 0xFFFFFFFF)]


def damaged(data: bytes, random: Random) -> bytes:
    """The bytes of a file, with one or two kinds of damage."""
    for _ in range(1 + (random.random() < 0.3)):
        data = _kinds_for(data)[int(random.integers(len(_kinds_for(data))))](data, random)
    return data


def _kinds_for(data: bytes) -> list[Callable[[bytes, Random], bytes]]:
    if data[:8] == b"\x89PNG\r\n\x1a\n":
        return [*BYTES, *[in_a_chunk] * 6]
    if data[:4] == b"PK\x03\x04":
        return [*BYTES, *[in_a_member] * 20]
    if is_text(data):
        return [*BYTES, *TEXTS, *[in_json] * (12 if data[:1] in b"{[" else 0)]
    return [*BYTES, *BYTES, *BYTES, in_header]


def is_text(data: bytes) -> bool:
    return bool(data) and not re.search(rb"[\0-\x08\x0e-\x1f]", data[:4096])


def some_range(data: bytes, random: Random) -> tuple[int, int]:
    """The beginning and the end of a part, mostly short."""
    at = int(random.integers(len(data) + 1))
    return at, min(len(data), at + int(2 ** random.uniform(0, 12)))


def cut(data: bytes, random: Random) -> bytes:
    return data[: int(random.integers(len(data) + 1))]


def emptied(data: bytes, random: Random) -> bytes:
    return b"" if random.random() < 0.5 else bytes(len(data))


def flipped(data: bytes, random: Random) -> bytes:
    """A few bytes changed, more often near the beginning, where headers are."""
    array = bytearray(data)
    for _ in range(int(random.integers(1, 9)) if data else 0):
        array[int(len(data) * random.random() ** 3)] ^= 1 << int(random.integers(8))
    return bytes(array)


def zeroed(data: bytes, random: Random) -> bytes:
    low, high = some_range(data, random)
    return data[:low] + bytes(high - low) + data[high:]


def removed(data: bytes, random: Random) -> bytes:
    low, high = some_range(data, random)
    return data[:low] + data[high:]


def doubled(data: bytes, random: Random) -> bytes:
    low, high = some_range(data, random)
    return data[:high] + data[low:]


def swapped(data: bytes, random: Random) -> bytes:
    a, b = some_range(data, random)
    c, d = some_range(data[b:], random)
    c, d = c + b, d + b
    return data[:a] + data[c:d] + data[b:c] + data[a:b] + data[d:]


def inserted(data: bytes, random: Random) -> bytes:
    at, _ = some_range(data, random)
    return data[:at] + random.bytes(int(2 ** random.uniform(0, 10))) + data[at:]


def limits(data: bytes, random: Random) -> bytes:
    """A count or a size becomes as small or as large as it can be."""
    what = LIMITS[int(random.integers(len(LIMITS)))]
    at = int(max(len(data) - len(what), 0) * random.random() ** 4)
    return data[:at] + what + data[at + len(what) :]


def in_header(data: bytes, random: Random) -> bytes:
    """A number in a text at the beginning of binary data: PFM, PGM, NPY, EXR, GLB."""
    return other_number(data[:400], random) + data[400:]


def other_number(data: bytes, random: Random) -> bytes:
    found = [*re.finditer(rb"[-+]?\d[\d.eE+-]*", data)]
    if not found:
        return data
    one = found[int(random.integers(len(found)))]
    return data[: one.start()] + NUMBERS[int(random.integers(len(NUMBERS)))] + data[one.end() :]


def other_lines(data: bytes, random: Random) -> bytes:
    """A line is gone, twice there, at another place, or cut."""
    lines = data.splitlines(keepends=True)
    k, j = random.integers(len(lines), size=2) if lines else (0, 0)
    what = int(random.integers(4))
    if not lines:
        return data
    line = lines[k]
    if what == 0:
        del lines[k]
    elif what == 1:
        lines.insert(j, line)
    elif what == 2:
        lines[k], lines[j] = lines[j], line
    else:
        lines[k] = line[: int(random.integers(len(line)))] + b"\n"
    return b"".join(lines)


def other_words(data: bytes, random: Random) -> bytes:
    """A word is gone or changes places with another."""
    words = re.split(rb"(\s+)", data)
    k, j = 2 * random.integers((len(words) + 1) // 2, size=2)
    words[k], words[j] = (words[j], words[k]) if random.random() < 0.5 else (b"", words[j])
    return b"".join(words)


def other_letters(data: bytes, random: Random) -> bytes:
    """Another encoding, other line ends, another separator or sign."""
    old, new = ((b"\n", b"\r"), (b" ", b","), (b".", b","), (b"-", b"\xe2\x88\x92"), (b'"', b"'"), (b"\n", b" "))[
        int(random.integers(6))
    ]
    what = int(random.integers(4))
    if what == 0:
        return data.decode("latin-1").encode("utf-16")
    return b"\xef\xbb\xbf" + data if what == 1 else data.replace(old, new)


def in_json(data: bytes, random: Random) -> bytes:
    """A value of another kind somewhere in a JSON file."""
    try:
        whole = json.loads(data)
    except ValueError:
        return other_number(data, random)
    places: list[tuple[Any, Any]] = []
    stack = [whole]
    while stack:
        one = stack.pop()
        keys = one.keys() if isinstance(one, dict) else range(len(one)) if isinstance(one, list) else ()
        places += [(one, key) for key in keys]
        stack += [one[key] for key in keys]
    if not places:
        return b"[]"
    owner, key = places[int(random.integers(len(places)))]
    what = int(random.integers(5))
    if what == 0:
        del owner[key]
    elif what == 1:
        other, name = places[int(random.integers(len(places)))]
        owner[key] = json.loads(json.dumps(other[name]))
    else:
        owner[key] = VALUES[int(random.integers(len(VALUES)))]
    return json.dumps(whole).encode()


def in_a_chunk(data: bytes, random: Random) -> bytes:
    """Damage inside a PNG's chunk, with a checksum that is right again."""
    parts, at = [], 8
    while at + 12 <= len(data):
        (size,) = struct.unpack_from(">I", data, at)
        parts.append((data[at + 4 : at + 8], data[at + 8 : at + 8 + size]))
        at += size + 12
    if not parts:
        return data
    k = int(random.integers(len(parts)))
    kind, body = parts[k]
    try:
        unpacked = zlib.decompressobj().decompress(body) if kind == b"IDAT" and random.random() < 0.5 else b""
    except zlib.error:  # not the first of several
        unpacked = b""
    parts[k] = kind, zlib.compress(_bytes_only(unpacked, random), 1) if unpacked else _bytes_only(body, random)
    chunks = (
        struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body)) for kind, body in parts
    )
    return data[:8] + b"".join(chunks)


def in_a_member(data: bytes, random: Random) -> bytes:
    """Damage inside a file of an archive, which is packed again."""
    out = BytesIO()
    try:
        with zipfile.ZipFile(BytesIO(data)) as archive:
            members = [(one, archive.read(one)) for one in archive.infolist()]
    except (zipfile.BadZipFile, zlib.error, OSError, ValueError, NotImplementedError, RuntimeError, EOFError):
        return flipped(data, random)
    if not members:
        return data
    k = int(random.integers(len(members)))
    with zipfile.ZipFile(out, "w") as archive:
        for j, (one, body) in enumerate(members):
            archive.writestr(one.filename, damaged(body, random) if j == k else body, one.compress_type)
    return out.getvalue()


def _bytes_only(data: bytes, random: Random) -> bytes:
    return BYTES[int(random.integers(len(BYTES)))](data, random)


BYTES = [cut, emptied, flipped, zeroed, removed, doubled, swapped, inserted, limits, flipped, limits]
TEXTS = [other_number, other_lines, other_words, other_letters, other_number]
