"""Reads and writes OpenEXR, and reads environments: pictures of the whole sphere, of Radiance, EXR or any format."""

from __future__ import annotations

import math
import re
import struct
import zlib
from collections.abc import Iterable, Mapping
from functools import lru_cache
from importlib.util import find_spec
from io import BufferedReader
from os import PathLike
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...checks.arguments import LARGEST, check_path, is_a
from ...notes.notes import print_note
from ...notes.words import cut, did_you_mean, near_path, option, shown
from ...scene.environment import NAMES, Environment, check_environment
from ...scene.values import linear_to_bytes, srgb_to_linear
from ..access import content
from ..access.atomic_write import error_of
from ..access.content import FILE_BYTES, MAX_PIXELS, FilePath
from .picture_files import read_image

RADIANCE = b"#?"  # the first bytes
_SIZE = re.compile(rb"([-+])([XY]) (\d{1,9}) ([-+])([XY]) (\d{1,9})\n")
_HEADER = 2**16  # bytes, at most
_REPEATED = b"\1\1\1"  # a colour that states how often the one before is repeated


def read_radiance(path: FilePath, max_pixels: float = MAX_PIXELS) -> NDArray[np.float32]:
    """Return (h, w, 3) linear RGB; EXPOSURE is not undone, as in most programs. Raises OSError if the path is not a
    file, ValueError for a broken or too large picture, and for colours in XYZ."""
    data = content.read_bytes(path, max_pixels)
    header, end, _ = data[:_HEADER].partition(b"\n\n")
    size = _SIZE.match(data, len(header) + 2)
    with content.naming(path, "is a broken or truncated Radiance picture"):
        if not end or not size or size[2] == size[5]:
            raise ValueError("its header has no size")
        if b"\nFORMAT=32-bit_rle_xyze" in header:
            raise ValueError(f"{path} has its colours in XYZ, expected RGB: convert it")
        count, length = int(size[3]), int(size[6])
        if not (count and length):
            raise ValueError("it has 0 pixels")
        content.check_pixels(length, count, str(path), max_pixels)
        pixels = _decoded(data, size.end(), count, length)
    rising, falling = (size[1], size[4]) if size[2] == b"Y" else (size[4], size[1])
    if size[2] == b"X":
        pixels = pixels.swapaxes(0, 1)
    pixels = pixels[:: 1 if rising == b"-" else -1, :: 1 if falling == b"+" else -1]
    return np.ldexp(pixels[..., :3].astype(np.float32), pixels[..., 3:].astype(np.int32) - 136)


def _decoded(data: bytes, at: int, count: int, length: int) -> NDArray[np.uint8]:
    """Return the (count, length, 4) mantissas and exponents of the lines."""
    lines = np.empty((count, length, 4), np.uint8)
    for number, line in enumerate(lines):
        try:
            if 8 <= length < 2**15 and data[at : at + 2] == b"\2\2" and data[at + 2] < 128:
                if length != int.from_bytes(data[at + 2 : at + 4], "big"):
                    raise ValueError
                at += 4
                for channel in range(4):
                    part, at = _run_lengths(data, at, length)
                    line[:, channel] = np.frombuffer(part, np.uint8)
            else:
                part, at = _repeats(data, at, length)
                line[:] = np.frombuffer(part, np.uint8).reshape(length, 4)
        except (IndexError, ValueError):
            raise ValueError(f"line {number} of {count} ends too early or too late") from None
    return lines


def _run_lengths(data: bytes, at: int, length: int) -> tuple[bytes | bytearray, int]:
    """Return one channel of a line, and where it ends: runs of one value, or values one by one."""
    line = bytearray()
    while len(line) < length:
        count = data[at]
        if count > 128:
            line += data[at + 1 : at + 2] * (count - 128)
            at += 2
        else:
            line += data[at + 1 : at + 1 + count]
            at += 1 + count
    return line, at


def _repeats(data: bytes, at: int, length: int) -> tuple[bytes | bytearray, int]:
    """Return a line of whole colours, some of which may repeat the one before; and where it ends."""
    flat = data[at : at + 4 * length]
    if len(flat) == 4 * length and _REPEATED not in flat:
        return flat, at + 4 * length
    line, shift = bytearray(), 0
    while len(line) < 4 * length:
        color = data[at : at + 4]
        at += 4
        if len(color) < 4:
            raise IndexError
        if not color.startswith(_REPEATED):
            line += color
            shift = 0
            continue
        times = color[3] << shift
        if times > length or not line:
            raise ValueError
        line += line[-4:] * times
        shift += 8
    return line, at


EXR = b"\x76\x2f\x31\x01"
_DEEP, _PARTS = 0x800, 0x1000  # flags in the version
_LONGEST = 2**20  # bytes of the list of channels
_ATTRIBUTE = re.compile(rb"([^\0]{1,255})\0[^\0]{1,255}\0(.{4})", re.DOTALL)  # its name, its kind, its size
_CHANNEL = re.compile(rb"([^\0]{1,255})\0[\0-\2]\0{3}[\0\1]\0{3}.{8}", re.DOTALL)  # of that list: name, type, sampling


def read_exr(path: FilePath, max_pixels: float = MAX_PIXELS, channel: str | None = None) -> NDArray[Any]:
    """(h, w) depth from an EXR picture. Raises ValueError for a broken or too large one, and without the extra."""
    channels = _read_channels(path, max_pixels)
    return channels[_pick_channel(channels, str(path), channel)]


def read_rgbd_exr(
    path: FilePath, max_pixels: float = MAX_PIXELS, channel: str | None = None
) -> tuple[NDArray[Any], NDArray[np.uint8] | None]:
    """(h, w) depth, and the colours in the same file, sRGB from 0 to 1; None for these if it has none."""
    channels = _read_channels(path, max_pixels)
    depth = _pick_channel(channels, str(path), channel)
    others = {key: values for key, values in channels.items() if key != depth}
    layer = _color_layer(others)
    # grey, or of depth's own layer: no colours
    if layer is None or depth in (f"{layer}{one}" for one in "RGBYV") or _depth_layer(layer):
        return channels[depth], None
    linear = np.stack([channels[f"{layer}{one}"] for one in "RGB"], -1).astype(np.float32)
    return channels[depth], linear_to_bytes(np.nan_to_num(linear, posinf=1).clip(0, 1))


class ExrFacts(NamedTuple):
    """What the head of an EXR picture tells."""

    has_colors: bool  # beside a depth
    has_alpha: bool
    is_unreal: bool  # Unreal Engine wrote it


def exr_facts(path: FilePath) -> ExrFacts:
    """What the head of a picture tells, without the extra that reads it."""
    found = _attributes(content.read_head(path, _HEADER))
    listing = found.get(b"channels", b"")
    named = {match[1].decode("latin-1") for match in _CHANNEL.finditer(listing)}
    has_alpha = any(one.rpartition(".")[2] == "A" for one in named)
    has_colors = len(named) > 3 + has_alpha and _color_layer(named) is not None
    return ExrFacts(has_colors, has_alpha, any(map(_UNREAL.search, (*found, listing))))


def _attributes(head: bytes) -> dict[bytes, bytes]:
    """The attributes of the first part, as far as these bytes go."""
    found, at = {}, 8
    while match := _ATTRIBUTE.match(head, at):
        at = match.end() + int.from_bytes(match[2], "little")
        found[match[1]] = head[match.end() : at]
    return found


def _color_layer(channels: Iterable[str]) -> str | None:
    """What stands before R, G and B of the colours: "", or such as "ViewLayer.Combined."; None without any."""
    layers = sorted((key[:-1] for key in channels if key.endswith("R")), key=len)
    whole = (one for one in layers if one[-1:] in ("", ".") and {f"{one}G", f"{one}B"} <= set(channels))
    return next((one for one in whole if not _depth_layer(one)), None)


def _depth_layer(layer: str) -> bool:
    return "depth" in layer.lower()


def read_exr_colors(path: FilePath, max_pixels: float = MAX_PIXELS) -> NDArray[np.float32]:
    """(h, w, 3) linear RGB from an EXR picture; grey is repeated. Raises ValueError as `read_exr`, and without both."""
    channels = _read_channels(path, max_pixels)
    layer = _color_layer(channels)
    if layer is not None:
        return np.stack([channels[f"{layer}{one}"] for one in "RGB"], -1).astype(np.float32)
    if len(channels) != 1:
        raise ValueError(f"{path} has the channels {', '.join(channels)}: expected R, G and B")
    return np.repeat(next(iter(channels.values()))[..., None], 3, -1).astype(np.float32)


def _read_channels(path: FilePath, max_pixels: float) -> dict[str, NDArray[Any]]:
    """The arrays of a picture, by the names of its channels. Raises ValueError."""
    library = content.import_extra("OpenEXR", "exr", f"{path} is an EXR picture")
    _check_header(path, max_pixels)
    broken = content.naming(path, "is a broken or truncated EXR picture")  # for RuntimeError, ValueError and TypeError
    with broken, library.File(str(path), separate_channels=True) as file:
        return {name: np.array(channel.pixels) for name, channel in file.channels().items()}


def check_exr(path: FilePath) -> None:
    """Raises ValueError without the extra that writes EXR pictures."""
    if find_spec("OpenEXR") is None:
        raise ValueError(f"cannot write {path}: pip install '.[exr]' in the clone for .exr; .npy works without")


def write_exr(
    path: FilePath, channels: Mapping[str, NDArray[Any]], attributes: Mapping[str, Any] | None = None
) -> None:
    """Writes arrays by the names of their channels: (h, w), or (h, w, 4) for RGBA. Raises OSError if it cannot. float16
    stays so, all else becomes float32. attributes: further ones of the header"""
    import OpenEXR  # only here: an optional extra

    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    for name, value in (attributes or {}).items():  # it takes memory as it lies
        header[name] = np.ascontiguousarray(value) if isinstance(value, np.ndarray) else value
    kinds = {name: np.float16 if values.dtype == np.float16 else np.float32 for name, values in channels.items()}
    arrays = {name: np.ascontiguousarray(values, kinds[name]) for name, values in channels.items()}
    try:
        with OpenEXR.File(header, arrays) as file:
            file.write(str(path))
    except RuntimeError as error:
        raise error_of(cut(error)) from None


def _check_header(path: FilePath, max_pixels: float) -> None:
    """Raises ValueError for too many pixels, in all channels and parts together, and for deep pictures."""
    with content.open_regular(path) as file:
        try:
            _, version = struct.unpack("<4si", file.read(8))
            parts = [_read_part(file)]
            while version & _PARTS and (part := _read_part(file)):
                parts.append(part)
            sizes = [_size_of(part) for part in parts]
        except (ValueError, KeyError, struct.error) as error:
            raise ValueError(f"{path} is a broken or truncated EXR picture: its header has no {error}") from None
    if version & _DEEP:
        raise ValueError(f"{path} is a deep EXR picture, with several depths a pixel: expected one")
    for width, height, _ in sizes:
        content.check_pixels(width, height, str(path), max_pixels)
    total = sum(width * height * depth for width, height, depth in sizes)
    content.check_limit(total, f"{path} has {total} bytes in all channels", max_pixels, FILE_BYTES)


def _read_part(file: BufferedReader) -> dict[bytes, bytes]:
    """The attributes of a part that state how large it is; none at the end of all parts."""
    found: dict[bytes, bytes] = {}
    while name := _read_name(file):
        _read_name(file)
        (size,) = struct.unpack("<i", file.read(4))
        if size < 0 or (name == b"channels" and size > _LONGEST):
            raise ValueError("end")
        if name in (b"dataWindow", b"channels"):
            found[name] = file.read(size)
        else:
            file.seek(size, 1)
    return found


def _read_name(file: BufferedReader) -> bytes:
    name = b""
    while (letter := file.read(1)) != b"\0":
        if not letter or len(name) > 255:
            raise ValueError("end")
        name += letter
    return name


def _size_of(part: dict[bytes, bytes]) -> tuple[int, int, int]:
    """Width, height, and bytes of a pixel in all channels."""
    left, top, right, bottom = struct.unpack("<4i", part[b"dataWindow"])
    if right < left or bottom < top:
        raise ValueError("pixels")
    rest, depth = part[b"channels"], 0
    while rest[:1] != b"\0":
        _, _, rest = rest.partition(b"\0")
        depth += 2 if struct.unpack_from("<i", rest)[0] == 1 else 4
        rest = rest[16:]
    return right - left + 1, bottom - top + 1, depth


_ALPHA = ("a", "alpha")
_UNREAL = re.compile(rb"(?i)unreal|worlddepth|scenedepth|moviepipeline|movierenderqueue")  # in its attributes or layers


def _pick_channel(channels: dict[str, NDArray[Any]], name: str, wanted: str | None = None) -> str:
    """Depth among EXR channels: the only one, one called depth or Z (not beside X: those are normals), Y or V, grey.
    Alpha is none, nor is what has one value everywhere beside another that varies. wanted: a channel, or its layer"""
    if wanted is not None:
        return _wanted_channel(channels, wanted, name)
    keys = [key for key in channels if key.rpartition(".")[2].lower() not in _ALPHA] or list(channels)
    if len(keys) == 1:
        return keys[0]
    varied = [key for key in keys if _varies(channels[key])] or keys
    named = [key for key in varied if _is_called_depth(key, channels)]
    colors = [key for key in varied if key.rpartition(".")[2] in ("R", "G", "B")]
    # Y comes after all others: it is luminance in a picture with Z, or the same as Z in ours
    named.sort(key=lambda key: key.endswith("Y"))
    layer = [key for key in named if key.rpartition(".")[::2][0] == named[0].rpartition(".")[0]] if named else []
    same = [key for key in layer if key in colors] if layer and layer[0] in colors else layer[:1] or colors
    if same and all(np.array_equal(channels[same[0]], channels[key], equal_nan=True) for key in same):
        return same[0]
    expected = f"expected one, or one called Z or depth: pass {option('channel', 'NAME')}"
    raise ValueError(f"{name} has the channels {', '.join(channels)}, which differ: {expected}")


def _is_called_depth(key: str, channels: dict[str, NDArray[Any]]) -> bool:
    layer, _, last = key.rpartition(".")
    beside = f"{layer}.X" if layer else "X"
    return "depth" in key.lower() or (last in ("Z", "Y") and beside not in channels) or key == "V"


def _wanted_channel(channels: dict[str, NDArray[Any]], wanted: str, name: str) -> str:
    """The channel of this name, or the depth of the layer of this name; letters' case does not count."""
    named = {key.lower(): key for key in channels}
    if wanted.lower() in named:
        return named[wanted.lower()]
    layer = {key: values for key, values in channels.items() if key.lower().startswith(f"{wanted.lower()}.")}
    if not layer:
        known = ", ".join(channels)
        raise ValueError(f"{name} has no {option('channel', wanted)}{did_you_mean(wanted, channels)}, only {known}")
    return _pick_channel(layer, name)


def _varies(values: NDArray[Any]) -> bool:
    first = values.flat[0]
    return not bool((values == first).all() or (first != first and np.isnan(values).all()))


_SLACK = 0.02  # of the width by which a picture may miss that it is twice as wide as high


def load_environment(path: FilePath, *, max_pixels: float = MAX_PIXELS) -> Environment:
    """Read light from all around from a picture of the whole sphere.

    Parameters
    ----------
    path : path
        .hdr (Radiance), .exr (needs the extra `exr`), or a picture such as .png or .jpg, whose colours are taken for
        sRGB: its light ends at 1, and a note says so. It is twice as wide as high; see `Environment` for its axes.
    max_pixels : float
        Limit for its pixels.

    Raises
    ------
    ValueError
        For a broken picture, one of another shape, and one that is too large.
    OSError
        If the path is not a file.
    """
    path = check_path(path)
    head = content.read_head(path)
    if head.startswith(RADIANCE):
        picture: NDArray[Any] = read_radiance(path, max_pixels)
    elif head.startswith(EXR):
        picture = read_exr_colors(path, max_pixels)
    else:
        picture = _linear(read_image(path, max_pixels, print_note), path)
    height, width = picture.shape[:2]
    if abs(width - 2 * height) > _SLACK * width:
        expected = "a picture of the whole sphere (equirectangular), twice as wide as high"
        raise ValueError(f"{path} has {width}x{height} pixels: expected {expected}")
    return Environment(_repaired(picture, path), str(path))


def find_environment(value: Any) -> Environment | None:
    """Return the environment of an option: a name, a file, or what `Environment` takes; None stays. Else it raises."""
    if not is_a(value, str, PathLike) or value in NAMES:
        return check_environment(value)
    path = check_path(value)
    if not path.exists():
        near = did_you_mean(value, NAMES) or near_path(path)
        expected = f"{option('environment')} must be {' or '.join(NAMES)}, or a file such as studio.hdr"
        raise FileNotFoundError(f"{expected}: {shown(str(value))} does not exist{near}")
    seen = path.stat()
    return _loaded(path, seen.st_mtime_ns, seen.st_size)


@lru_cache(2)
def _loaded(path: Path, *changed: int) -> Environment:
    """The same object again while the file stays as it is: the pipeline sees that nothing has changed."""
    return load_environment(path)


def _linear(picture: NDArray[Any], path: Path) -> NDArray[np.float32]:
    """(h, w, 3) linear light of colours of 8 or 16 bits."""
    if picture.dtype.kind == "f":
        raise ValueError(f"{path} holds numbers of one channel, expected colours: write them as .hdr or .exr")
    print_note(f"{path} is read as sRGB: its light ends at 1, so sun and lamps are dimmer than in an .hdr or .exr")
    most = 255 if picture.dtype == np.uint8 else 65535
    values = srgb_to_linear(np.arange(most + 1, dtype=np.float32) / most)
    grey = picture if picture.ndim == 3 else picture[..., None]
    return np.broadcast_to(values[np.clip(grey[..., :3], 0, most)], (*grey.shape[:2], 3))


def _repaired(picture: NDArray[Any], path: Path) -> NDArray[Any]:
    """Without numbers that are no light: filters leave negative ones, and the sun may be infinite in 16 bits."""
    is_light = (picture >= 0) & (picture <= LARGEST)
    if is_light.all():
        return picture
    most = picture[is_light].max(initial=0)
    count = int((~is_light).any(-1).sum())
    print_note(f"{path}: {count} pixels are negative or not finite: they are taken for 0, or for the brightest other")
    return np.where(is_light, picture, np.where(picture > LARGEST, most, 0))


_WIDTH, _HEIGHT, _BITS, _COMPRESSION, _OFFSETS, _CHANNELS, _ROWS, _SIZES = 256, 257, 258, 259, 273, 277, 278, 279
_PLANES, _PREDICTOR, _TILE_WIDTH, _TILE_HEIGHT, _TILES, _TILE_SIZES, _FORMAT = 284, 317, 322, 323, 324, 325, 339
_PLAIN, _DEFLATED = (1,), (8, 32946)
_TYPES = {1: "B", 3: "H", 4: "I"}  # of a tag's numbers
_FLOATS = 3
_MOST_TAGS, _MOST_NUMBERS = 256, 2**20


def read_float_tiff(path: FilePath, max_pixels: float = MAX_PIXELS) -> NDArray[Any] | None:
    """(h, w) or (h, w, n) floats of the first picture; None for one of another kind. Raises ValueError if broken."""
    data = content.read_bytes(path, max_pixels)
    with content.naming(path, "is a broken TIFF", (struct.error, KeyError, IndexError, zlib.error, ValueError)):
        order = {b"II*\0": "<", b"MM\0*": ">"}.get(data[:4])
        tags = _read_tags(data, order) if order else {}
        if tags.get(_FORMAT, (0,))[0] != _FLOATS:
            return None
        return _read_picture(data, order or "<", tags, str(path), max_pixels)


def _read_tags(data: bytes, order: str) -> dict[int, tuple[int, ...]]:
    """The numbers of the first directory."""
    (start,) = struct.unpack_from(f"{order}I", data, 4)
    (count,) = struct.unpack_from(f"{order}H", data, start)
    found = {}
    for k in range(min(count, _MOST_TAGS)):
        at = start + 2 + 12 * k
        tag, kind, many = struct.unpack_from(f"{order}HHI", data, at)
        if kind not in _TYPES or many > _MOST_NUMBERS:
            continue
        form = f"{order}{many}{_TYPES[kind]}"
        place = at + 8 if struct.calcsize(form) <= 4 else struct.unpack_from(f"{order}I", data, at + 8)[0]
        found[tag] = struct.unpack_from(form, data, place)
    return found


def _read_picture(
    data: bytes, order: str, tags: dict[int, tuple[int, ...]], name: str, max_pixels: float
) -> NDArray[Any]:
    (width,), (height,), bits = tags[_WIDTH], tags[_HEIGHT], set(tags[_BITS])
    channels, packing = tags.get(_CHANNELS, (1,))[0], tags.get(_COMPRESSION, _PLAIN)[0]
    predictor = tags.get(_PREDICTOR, (1,))[0]
    content.check_pixels(width, height, name, max_pixels)
    if not width or not height or len(bits) != 1 or not bits <= {16, 32, 64} or not 0 < channels < 9:
        raise ValueError(f"it has {width}x{height} pixels of {channels} channels of {bits} bits")
    if packing not in (*_PLAIN, *_DEFLATED) or predictor not in (1, 3) or (tags.get(_PLANES, (1,))[0] != 1 < channels):
        raise ValueError("it is packed in an unusual way: save it without compression, or as .npy")
    dtype = np.dtype(f"{order}f{bits.pop() // 8}")
    size = width * height * channels * dtype.itemsize
    content.check_limit(size, f"{name} has {size} bytes", max_pixels, FILE_BYTES)
    is_tiled = _TILES in tags
    across = tags[_TILE_WIDTH][0] if is_tiled else width
    down = tags[_TILE_HEIGHT][0] if is_tiled else min(height, tags.get(_ROWS, (height,))[0])
    content.check_pixels(across, down, name, max_pixels)
    if min(across, down) < 1:
        raise ValueError(f"its parts have {across}x{down} pixels")
    starts, sizes = (tags[_TILES], tags[_TILE_SIZES]) if is_tiled else (tags[_OFFSETS], tags[_SIZES])
    columns, result = math.ceil(width / across), np.zeros((height, width, channels), dtype.newbyteorder("="))
    for k in range(columns * math.ceil(height / down)):
        top, left = k // columns * down, k % columns * across
        rows = down if is_tiled else min(down, height - top)
        part = data[starts[k] : starts[k] + sizes[k]]
        length = rows * across * channels * dtype.itemsize
        if packing in _DEFLATED:
            part = zlib.decompressobj().decompress(part, length)
        values = np.frombuffer(part[:length], np.uint8).reshape(rows, -1)
        values = _summed(values, channels, dtype) if predictor == 3 else values
        block = np.ascontiguousarray(values).view(dtype).reshape(rows, across, channels)
        result[top : top + rows, left : left + across] = block[: height - top, : width - left]
    return result[..., 0] if channels == 1 else result


def _summed(rows: NDArray[np.uint8], channels: int, dtype: np.dtype) -> NDArray[np.uint8]:
    """Undoes the predictor of floats: sums of bytes, the highest bytes of a row first."""
    sums = np.cumsum(rows.reshape(len(rows), -1, channels), axis=1, dtype=np.uint8).reshape(
        len(rows), dtype.itemsize, -1
    )
    sums = sums if dtype.byteorder == ">" else sums[:, ::-1]
    return np.ascontiguousarray(sums.transpose(0, 2, 1)).reshape(len(rows), -1)
