"""Reads trained Gaussian splats: .ply as it is trained and compressed, .splat, .spz and .sog."""

from __future__ import annotations

import json
import struct
import zlib
from collections.abc import Callable, Mapping
from io import BytesIO
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...notes.notes import Note
from ...scene.cloud import PointCloud, Up
from ...scene.gaussians import CONSTANT, FAINT, Gaussians
from ..access.content import FILE_BYTES, FilePath, import_extra, naming, read_bytes
from ..arrays.compression import Archive
from .cloud_columns import CloudOptions, FoundPoints, check_points, side_by_side

_COLOR, _SCALE = ("f_dc_0", "f_dc_1", "f_dc_2"), ("scale_0", "scale_1", "scale_2")
_TURN = ("rot_1", "rot_2", "rot_3", "rot_0")  # x, y, z, w
_THIN = 1e-3  # of the shorter axis is the thickness of splats that have two axes (Huang et al. 2024)
_STEEPEST = 40.0  # exponents beyond overflow float32
_COUNTS = 0, 3, 8, 15  # harmonics above degree 0, by degree
_DOWN: Up = "-y"  # is up, of what is trained on photographs
_ROOT2 = np.float32(2**0.5)


def _logistic(values: NDArray[Any]) -> NDArray[Any]:
    return 1 / (1 + np.exp(-values.astype(np.float32).clip(-_STEEPEST, _STEEPEST)))


def _exp(values: NDArray[Any]) -> NDArray[np.float32]:
    return np.exp(values.astype(np.float32).clip(-_STEEPEST, _STEEPEST))


def splats(
    form: str, positions: NDArray[Any], scales: NDArray[Any], rotations: NDArray[Any], opacities: NDArray[Any],
    base: NDArray[Any], harmonics: NDArray[Any] | None, name: object, note: Note, antialiased: bool = False,
    up: Up = _DOWN,
) -> FoundPoints:  # fmt: skip
    """The splats of a file but those that show nothing: faint ones, and rows with numbers that are not finite."""
    arrays = [positions, scales, rotations, opacities[:, None], base]
    good = np.logical_and.reduce([np.isfinite(one).all(1) for one in arrays]) & (scales >= 0).all(1)
    if harmonics is not None:
        good &= np.isfinite(harmonics.sum((1, 2), dtype=np.float32))
        harmonics = harmonics.astype(np.float16)
        good &= np.isfinite(harmonics.reshape(len(good), -1)).all(1)
    if lost := int(np.count_nonzero(~good)):
        note(f"{name}: {lost} of {len(good)} splats have numbers that are not finite: left out")
    good &= opacities >= FAINT * (1 - 1e-4)
    if not good.all():
        positions, scales, rotations, opacities, base = (one[good] for one in (*arrays[:3], opacities, base))
        harmonics = None if harmonics is None else harmonics[good]
    held = Gaussians(scales, rotations, opacities.clip(0, 1), base, harmonics, antialiased)
    is_certain = up != _DOWN
    front: Up | None = "z" if is_certain else None
    why = f"always so in {form}" if is_certain else "usual of reconstructions"
    return FoundPoints(
        f"{form}, harmonics of degree {held.degree}", np.asarray(positions, np.float32), colors=held.colors,
        gaussians=held, up=up, up_from=why, up_is_guessed=not is_certain, front=front,
    )  # fmt: skip


def is_trained(columns: Mapping[str, Any]) -> bool:
    """Whether these are the columns of trained splats, of two axes or three."""
    return {"x", "y", "z", "opacity", *_COLOR, *_SCALE[:2], *_TURN} <= columns.keys()


def splats_in(
    columns: Mapping[str, NDArray[Any]], form: str, comments: list[str], name: object, note: Note
) -> FoundPoints:
    scales = np.stack([_exp(columns[one]) for one in _SCALE if one in columns], -1)
    if scales.shape[1] == 2:
        scales = np.concatenate([scales, _THIN * scales.min(1, keepdims=True)], 1)
        form = f"{form}, trained 2-D Gaussians"
    else:
        form = f"{form}, trained 3-D Gaussians"
    opacities = _logistic(columns["opacity"])
    base = 0.5 + np.float32(CONSTANT) * side_by_side([columns[one] for one in _COLOR]).astype(np.float32)
    turns = np.stack([columns[one].astype(np.float32) for one in _TURN], -1)
    rest = sorted((one for one in columns if one.startswith("f_rest_")), key=lambda one: int(one[7:]))
    count = next((one for one in _COUNTS[::-1] if 3 * one <= len(rest)), 0)
    if 3 * count != len(rest):
        raise ValueError(f"it has {len(rest)} columns f_rest_*, expected 9, 24 or 45")
    harmonics = None
    if count:
        table = side_by_side([columns[one] for one in rest])
        harmonics = table.reshape(-1, 3, count).transpose(0, 2, 1).astype(np.float16)
    is_smooth = any("splatrendermode: mip" in one.lower() for one in comments)
    at = side_by_side([columns[one] for one in "xyz"])
    return splats(form, at, scales, turns, opacities, base, harmonics, name, note, is_smooth)


def trained_columns(cloud: PointCloud) -> NDArray[np.void]:
    """(n,) structured, as 3DGS writes a cloud of trained splats, with its normals in place of zeros."""
    held = cloud.gaussians
    assert held is not None, "a cloud of trained splats"
    opacities = held.opacities.clip(1e-6, 1 - 1e-6)
    nothing = np.zeros((len(cloud), 3), np.float32)
    rest = nothing[:, :0] if held.harmonics is None else held.harmonics.transpose(0, 2, 1).reshape(len(cloud), -1)
    parts: dict[str, NDArray[Any]] = {
        "x y z": cloud.positions + cloud.origin,
        "nx ny nz": nothing if cloud.normals is None else cloud.normals,
        " ".join(_COLOR): (held.base - 0.5) / CONSTANT,
        " ".join(f"f_rest_{k}" for k in range(rest.shape[1])): rest,
        "opacity": np.log(opacities / (1 - opacities))[:, None],
        " ".join(_SCALE): np.log(np.maximum(held.scales, 1e-12)),
        " ".join(_TURN): held.rotations,
    }
    columns = [(name, values[:, k]) for names, values in parts.items() for k, name in enumerate(names.split())]
    order = [one for one in columns if one[0] != _TURN[3]]
    order.insert(len(order) - 3, next(one for one in columns if one[0] == _TURN[3]))
    rows = np.empty(len(cloud), [(name, "<f4") for name, _ in order])
    for name, values in order:
        rows[name] = values
    return rows


_ELEVEN, _TEN = ((21, 11), (11, 10), (0, 11)), ((20, 10), (10, 10), (0, 10))
_OF_CHUNK = (
    "min_x min_y min_z max_x max_y max_z min_scale_x min_scale_y min_scale_z max_scale_x max_scale_y max_scale_z"
)
_COLORS_OF_CHUNK = "min_r min_g min_b max_r max_g max_b"
PACKED = ("packed_position", "packed_rotation", "packed_scale", "packed_color")
_CHUNK = 256  # splats


def packed_splats(elements: Mapping[str, NDArray[Any]], name: object, note: Note) -> FoundPoints:
    """The splats of a compressed .ply. Raises ValueError for one that is broken."""
    rows, chunks = elements["vertex"], elements["chunk"]
    if len(chunks) != -(-len(rows) // _CHUNK):
        raise ValueError(f"it has {len(chunks)} chunks for {len(rows)} splats, expected one for each {_CHUNK}")
    of = np.arange(len(rows)) // _CHUNK

    def limits(names: str) -> NDArray[np.float32]:
        if lost := [one for one in names.split() if one not in (chunks.dtype.names or ())]:
            raise ValueError(f"its chunks have no {', '.join(lost)}")
        return (
            np.stack([chunks[one] for one in names.split()], -1)
            .astype(np.float32)
            .reshape(-1, 2, len(names.split()) // 2)
        )

    def between(packed: NDArray[Any], ends: NDArray[np.float32]) -> NDArray[np.float32]:
        share = _bits(packed, _ELEVEN)
        low, high = ends[of, 0], ends[of, 1]
        return low + share * (high - low)

    names = _OF_CHUNK.split()
    at = between(rows["packed_position"], limits(" ".join(names[:6])))
    scales = _exp(between(rows["packed_scale"], limits(" ".join(names[6:]))))
    turns = _smallest_three(rows["packed_rotation"] >> 30, _bits(rows["packed_rotation"], _TEN), (3, 0, 1, 2))
    color = np.stack([rows["packed_color"] >> shift & 255 for shift in (24, 16, 8, 0)], -1).astype(np.float32) / 255
    base = color[:, :3]
    if "min_r" in (chunks.dtype.names or ()):
        ends = limits(_COLORS_OF_CHUNK)
        base = ends[of, 0] + base * (ends[of, 1] - ends[of, 0])
    harmonics = None
    if "sh" in elements:
        rest = sorted(elements["sh"].dtype.names or (), key=lambda one: int(one.rpartition("_")[2]))
        if len(rest) // 3 not in _COUNTS or len(elements["sh"]) != len(rows):
            raise ValueError(f"it has {len(rest)} harmonics for {len(elements['sh'])} of {len(rows)} splats")
        table = side_by_side([elements["sh"][one] for one in rest])
        harmonics = (table * np.float32(8 / 255) - 4).reshape(len(rows), 3, -1).transpose(0, 2, 1)
    return splats("compressed PLY of 3-D Gaussians", at, scales, turns, color[:, 3], base, harmonics, name, note)


def _bits(packed: NDArray[Any], parts: tuple[tuple[int, int], ...]) -> NDArray[Any]:
    """(n, 3) of 0 to 1. parts: where each begins, and how many bits it has."""
    every = [(packed >> shift & (1 << width) - 1).astype(np.float32) / ((1 << width) - 1) for shift, width in parts]
    return np.stack(every, -1)


def _smallest_three(
    largest: NDArray[Any], shares: NDArray[Any], order: tuple[int, ...], signed: bool = False
) -> NDArray[np.float32]:
    """(n, 4) quaternions x, y, z, w of all but their largest number.

    largest  which one that is, counted in an order; shares: (n, 3) of 0 to 1, or of -1 to 1 if signed; order: for each
    of those that are counted, which of x, y, z, w it is
    """
    rest = shares * np.float32(0.5**0.5) if signed else (shares - np.float32(0.5)) * _ROOT2
    found = np.zeros((len(rest), 4), np.float32)
    filled = np.sqrt(np.maximum(0, 1 - np.einsum("nk,nk->n", rest, rest)))
    for k in range(4):
        some = largest == k
        others = [order[j] for j in range(4) if j != k]
        found[np.ix_(some, others)] = rest[some]
        found[some, order[k]] = filled[some]
    return found


_SPLAT = np.dtype([("at", "<f4", 3), ("scale", "<f4", 3), ("color", "u1", 4), ("turn", "u1", 4)])
_FARTHEST, _LONGEST, _OFF = 1e6, 1e5, 0.1  # units; and by how much a quaternion's length is off


def is_splat(head: bytes, size: int) -> bool:
    """Whether the first bytes of a file of that size are those of a .splat, which has no header."""
    some = np.frombuffer(head[: len(head) // _SPLAT.itemsize * _SPLAT.itemsize], _SPLAT)
    if size % _SPLAT.itemsize or not len(some) or not np.isfinite(some["at"]).all():
        return False
    lengths = np.linalg.norm((some["turn"].astype(np.float32) - 128) / 128, axis=1)
    scales = some["scale"]
    is_sized = np.isfinite(scales).all() and scales.min() >= 0 and scales.max() < _LONGEST and scales.any()
    return bool(is_sized and np.abs(some["at"]).max() < _FARTHEST and np.abs(lengths - 1).max() < _OFF)


def read_splat_points(path: FilePath, note: Note, options: CloudOptions) -> FoundPoints:
    """The splats of a .splat file: 32 bytes for each, without a header."""
    data = read_bytes(path, options.max_pixels)
    if not is_splat(data[: 1 << 16], len(data)):
        expected = "places, sizes, colours and turns, 32 for each"
        raise ValueError(f"{path} is no .splat of {len(data)} bytes: expected {expected}")
    rows = np.frombuffer(data, _SPLAT)
    check_points(len(rows), path, options.max_pixels)
    turns = (rows["turn"].astype(np.float32) - 128)[:, [1, 2, 3, 0]] / 128
    color = rows["color"].astype(np.float32) / 255
    return splats(".splat", rows["at"], rows["scale"], turns, color[:, 3], color[:, :3], None, path, note)


GZIP, SPZ = b"\x1f\x8b", b"NGSP"
_SPZ_FULL = 16, 32  # bytes of the header: packed as a whole; with a table of streams
_SMOOTH = 1  # flag: trained with antialiasing
_MOST_UNPACKED = 200  # bytes for one that is packed: gzip gives up to 1000, splats never so many


def is_spz(head: bytes) -> bool:
    """Whether the first bytes of a file are those of an .spz."""
    if head.startswith(GZIP):
        try:
            head = zlib.decompressobj(31).decompress(head, 4)
        except zlib.error:
            return False
    return head.startswith(SPZ)


def read_spz_points(path: FilePath, note: Note, options: CloudOptions) -> FoundPoints:
    """The splats of an .spz file of version 1 to 4. Raises ValueError for one that is broken."""
    data = read_bytes(path, options.max_pixels)
    with naming(path, "is a broken .spz file", (ValueError, zlib.error, struct.error, IndexError)):
        if data.startswith(GZIP):
            most = min(_MOST_UNPACKED * len(data), int(options.max_pixels * FILE_BYTES))
            unpacker = zlib.decompressobj(31)
            data = unpacker.decompress(data, most)
            if not unpacker.eof:
                raise ValueError("it is cut off, or unpacks to more than splats do")
        magic, version, count, degree, bits, flags, streams = struct.unpack("<4sII4B", data[:16])
        if magic != SPZ or not 1 <= version <= 4:
            raise ValueError(f"it has version {version}, expected 1 to 4")
        check_points(count, path, options.max_pixels)
        if degree > 4:
            raise ValueError(f"its harmonics have degree {degree}, expected 0 to 3")
        widths = [6 if version == 1 else 9, 1, 3, 3, 3 if version < 3 else 4, 3 * (*_COUNTS, 24)[degree]]
        parts = _streams(data, streams, path) if version == 4 else _cut(data[16:], [count * one for one in widths])
        arrays = [np.frombuffer(part, np.uint8) for part in parts]
        if [one.size for one in arrays if one.size] != [count * one for one in widths if count * one]:
            raise ValueError(f"its parts do not have the sizes of {count} splats")
        at, alpha, color, scale, turn, *rest = (one.reshape(count, -1) for one in arrays if one.size or not count)
        harmonics = None
        if degree and count:
            harmonics = (rest[0].reshape(count, -1, 3)[:, :15].astype(np.float32) - 128) / 128
        base = 0.5 + np.float32(CONSTANT / 0.15) * (color.astype(np.float32) / 255 - np.float32(0.5))
        return splats(
            f"SPZ {version}", _fixed_point(at, bits, version), _exp(scale.astype(np.float32) / 16 - 10),
            _spz_turns(turn, version), alpha[:, 0].astype(np.float32) / 255, base, harmonics, path, note,
            bool(flags & _SMOOTH), "y",
        )  # fmt: skip


def _cut(data: bytes, sizes: list[int]) -> list[bytes]:
    ends = np.cumsum([0, *sizes])
    return [data[a:b] for a, b in pairwise(ends.tolist())]


def _streams(data: bytes, count: int, name: FilePath) -> list[bytes]:
    zstandard = import_extra("zstandard", "spz", f"{name} is an .spz of version 4")
    (table,) = struct.unpack("<I", data[16:20])
    sizes = struct.unpack(f"<{2 * count}Q", data[table : table + 16 * count])
    found, at = list[bytes](), table + 16 * count
    for packed, plain in zip(sizes[::2], sizes[1::2], strict=True):
        if plain > _MOST_UNPACKED * max(packed, 64):
            raise ValueError(f"{packed} bytes of it unpack to {plain}")
        try:
            found.append(zstandard.ZstdDecompressor().decompress(data[at : at + packed], max_output_size=plain))
        except zstandard.ZstdError as error:
            raise ValueError(str(error)) from None
        at += packed
    return found


def _fixed_point(rows: NDArray[np.uint8], bits: int, version: int) -> NDArray[np.float32]:
    if version == 1:
        return np.ascontiguousarray(rows).view("<f2").astype(np.float32)
    parts = rows.reshape(-1, 3, 3).astype(np.int32)
    whole = parts[..., 0] | parts[..., 1] << 8 | parts[..., 2] << 16
    return ((whole ^ 0x800000) - 0x800000).astype(np.float32) * np.float32(2.0**-bits)


def _spz_turns(rows: NDArray[np.uint8], version: int) -> NDArray[np.float32]:
    """(n, 4) x, y, z, w."""
    if version < 3:
        turns = rows.astype(np.float32) / np.float32(127.5) - 1
        w = np.sqrt(np.maximum(0, 1 - np.einsum("nk,nk->n", turns, turns)))
        return np.concatenate([turns, w[:, None]], 1)
    packed = np.ascontiguousarray(rows).view("<u4")[:, 0]
    parts = np.stack([packed >> shift for shift in (20, 10, 0)], -1)
    sizes = (parts & 511).astype(np.float32) / 511
    return _smallest_three(packed >> 30, np.where(parts & 512, -sizes, sizes), (0, 1, 2, 3), signed=True)


META = "meta.json"
_SOG_PARTS = "means", "scales", "quats", "sh0"
_ROW = 64  # entries of a palette's row
_FIRST_OF_QUATS = 252


def is_sog(archive: Archive) -> bool:
    return META in archive.names


def read_sog_points(path: FilePath, note: Note, options: CloudOptions) -> FoundPoints:
    """The splats of a .sog file, or of the meta.json of an unpacked one. Raises ValueError for one that is broken."""
    read: Callable[[str], bytes]
    if Path(path).suffix.lower() == ".json":
        read = lambda name: read_bytes(Path(path).parent / Path(name).name, options.max_pixels)  # noqa: E731
        text = read_bytes(path, options.max_pixels)
    else:
        read = Archive(path, options.max_pixels).read
        text = read(META)
    kinds = ValueError, KeyError, TypeError, IndexError, AttributeError, RecursionError
    with naming(path, "is a broken .sog file", kinds):
        meta = json.loads(text)
        if lost := [one for one in _SOG_PARTS if one not in meta]:
            raise ValueError(f"its {META} has no {', '.join(lost)}")
        count = int(meta["count"] if "count" in meta else meta["means"]["shape"][0])
        check_points(count, path, options.max_pixels)

        def pixels(name: str) -> NDArray[Any]:
            from ..pictures.picture_files import decode_image  # only here: it imports Pillow's parts

            picture = decode_image(BytesIO(read(name)), f"{path}/{name}", options.max_pixels, upright=False)
            return picture.reshape(-1, picture.shape[-1])

        return _splats_of_pictures(meta, count, pixels, path, note)


def _splats_of_pictures(
    meta: dict[str, Any], count: int, pixels: Callable[[str], NDArray[Any]], name: FilePath, note: Note
) -> FoundPoints:
    def table(part: str, k: int = 0) -> NDArray[Any]:
        found = pixels(meta[part]["files"][k])
        if part != "shN" and len(found) < count:
            raise ValueError(f"its {meta[part]['files'][k]} has {len(found)} pixels for {count} splats")
        return found[:count] if part != "shN" or k == 1 else found

    def values(part: str, codes: NDArray[Any]) -> NDArray[Any]:
        own = meta[part]
        if "codebook" in own:
            return np.array(own["codebook"], np.float32)[codes]
        low, high = (np.array(own[end], np.float32) for end in ("mins", "maxs"))
        return low + (high - low) * codes.astype(np.float32) / 255

    low, high = table("means", 0)[:, :3], table("means", 1)[:, :3]
    share = (low + high.astype(np.float32) * 256) / 65535
    ends = [np.array(meta["means"][end], np.float32) for end in ("mins", "maxs")]
    at = ends[0] + (ends[1] - ends[0]) * share
    at = np.sign(at) * np.expm1(np.abs(at))
    quats, sh0 = table("quats"), table("sh0")
    turns = _smallest_three(quats[:, 3] - _FIRST_OF_QUATS, quats[:, :3].astype(np.float32) / 255, (3, 0, 1, 2))
    if "codebook" in meta["sh0"]:
        dc, opacities = values("sh0", sh0[:, :3]), sh0[:, 3].astype(np.float32) / 255
    else:
        every = values("sh0", sh0)
        dc, opacities = every[:, :3], _logistic(every[:, 3])
    harmonics = None
    if "shN" in meta:
        labels, palette = table("shN", 1).astype(np.int64), table("shN", 0)
        own = meta["shN"]  # of version 1 the shape of its palette shows how many harmonics a splat has
        each = _COUNTS[own["bands"]] if "bands" in own else int(own["shape"][1]) // 3
        label = labels[:, 0] + (labels[:, 1] << 8)
        start = (label // _ROW * _ROW + label % _ROW) * each
        harmonics = values("shN", palette[start[:, None] + np.arange(each), :3])
    form, is_smooth = f"SOG {meta.get('version', 1)}", bool(meta.get("antialias"))
    scales = _exp(values("scales", table("scales")[:, :3]))
    return splats(form, at, scales, turns, opacities, 0.5 + np.float32(CONSTANT) * dc, harmonics, name, note, is_smooth)
