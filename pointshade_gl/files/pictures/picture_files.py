"""Reads and writes images, and encodes normals as colours. Any defect of a file becomes an error of one sentence."""

from __future__ import annotations

import re
import struct
import warnings
import zlib
from collections.abc import Generator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager, suppress
from importlib import import_module
from io import BytesIO
from pathlib import Path
from threading import Lock
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any, BinaryIO, Literal

import numpy as np
from numpy.typing import NDArray

from ...checks.arguments import as_given
from ...checks.foreign_arrays import AnyArray, way_to
from ...notes.notes import Note
from ...notes.words import cut
from ..access.atomic_write import check_place, written_whole
from ..access.content import MAX_PIXELS, FilePath, check_pixels, check_size, open_regular, read_head
from ..access.known_names import IMAGES, PICTURES, check_suffix, what_else
from .color_profiles import in_srgb, read_cicp

if TYPE_CHECKING:
    from PIL import Image  # imported where it is used: a PNG is written without it

_FORMATS: dict[str, str] = dict(zip(PICTURES, ("PNG", "JPEG", "JPEG", "WEBP", "TIFF", "TIFF"), strict=True))
_OPTIONS: dict[str, dict[str, Any]] = {
    "PNG": {"optimize": True},
    "JPEG": {"quality": 95},
    "WEBP": {"lossless": True, "exact": True},  # exact keeps the colours under alpha 0
}
_BANDS, _LARGE = 4, 1 << 19  # of a picture of so many bytes
_OURS = b"Software\0pointshade_gl"  # what our PNGs hold right behind their header
_LONGEST = {"JPEG": 65500, "WEBP": 16383}  # pixels a side that the formats can hold
# Formats whose header states how large the decoded picture is. In others, such as ICO, a second picture may hide.
_READ = ("PNG", "JPEG", "BMP", "DIB", "PPM", "GIF", "TIFF", "WEBP", "TGA", "JPEG2000")
_READ_IF_KNOWN = ("AVIF", "HEIF")  # Pillow's from version 11.3, and a plug-in's
_POSTSCRIPT = (b"%!PS", b"\xc5\xd0\xd3\xc6")  # Pillow hands it to Ghostscript
TURNED = 0x0112  # the EXIF tag of how a camera was held
_MOST_PROFILE = 1 << 24  # bytes of a colour profile in a PNG: Pillow takes no more than one million
_TILE = (322, 323)  # the TIFF tags of a tile's width and height
# Signs of a normal's x, y and z (camera axes: right, down, forward) in other axes, by the names that normal maps have.
# The surface that faces the viewer is blue in OpenGL's and in DirectX's; their green points up and down.
AxesName = Literal["opencv", "opengl", "directx"]
AXES: dict[AxesName, tuple[int, int, int]] = {"opencv": (1, 1, 1), "opengl": (1, -1, -1), "directx": (1, 1, -1)}
_pillow = Lock()  # its limit and Python's filters for warnings belong to the whole process: one thread at a time


class NotAPictureError(ValueError):
    """The bytes are those of no known format."""


def check_writable(path: FilePath) -> Path:
    """The path, for a check before long work. Raises ValueError or OSError if `save_image` cannot write there."""
    return check_place(check_suffix(path, IMAGES))


def save_image(path: FilePath, image: AnyArray, small: bool = False) -> None:
    """Write a picture in the format of the path's suffix, completely or not at all.

    Parameters
    ----------
    path : path
        .png, .jpg, .jpeg, .webp, .tif, .tiff or .npy.
    image : (h, w, 3|4) or (h, w) uint8
        For .png also uint16, for .npy any array of numbers. JPEG has no alpha: it gets the picture over black.
    small : bool
        Spend ten times as long on a slightly smaller PNG of 8 bits.

    Raises
    ------
    ValueError
        For an unknown suffix or shape.
    TypeError
        For values of another type.
    FileNotFoundError
        If the folder does not exist.
    """
    path = check_writable(path)
    if path.suffix.lower() == ".npy":
        array = as_given(image, "image must be an array of numbers")
        if array.dtype.kind not in "biufc":
            raise TypeError(f"image must be an array of numbers, got {array.dtype}")
    else:
        array = check_picture(image, _FORMATS[path.suffix.lower()])
    with written_whole(path) as temporary, temporary.open("xb") as file:
        _encode(file, array, path.suffix.lower(), small)


def check_picture(image: AnyArray, kind: str) -> NDArray[Any]:
    """The picture as an array. Raises ValueError or TypeError unless the format can hold it: 8 bits, a PNG also 16."""
    expected = "image must have shape (h, w), (h, w, 3) or (h, w, 4)"
    array = as_given(image, expected)
    if array.ndim not in (2, 3) or (array.ndim == 3 and array.shape[2] not in (3, 4)) or 0 in array.shape:
        raise ValueError(f"{expected}, got {array.shape}{way_to(array.shape, 'image', image, (3, 4))}")
    if array.dtype != np.uint8 and not (array.dtype == np.uint16 and kind == "PNG"):
        raise TypeError(f"image must be uint8, got {array.dtype}: scale it to 0..255, or save it as .npy")
    if max(array.shape) > _LONGEST.get(kind, np.inf):
        raise ValueError(f"image may have up to {_LONGEST[kind]} pixels a side in {kind}, got {array.shape}")
    return array


def _encode(file: BinaryIO, array: NDArray[Any], suffix: str, small: bool) -> None:
    if suffix == ".npy":
        plain: Any = SimpleNamespace(write=file.write)  # into a file NumPy would write without saying why it cannot
        np.save(plain, array, allow_pickle=False)
        return
    kind = _FORMATS[suffix]
    if kind == "PNG" and (array.dtype == np.uint16 or not small):
        file.write(encode_png(array))
        return
    from PIL import Image

    if kind == "JPEG" and array.shape[2:] == (4,):
        array = (array[..., :3] * (array[..., 3:] / 255) + 0.5).astype(np.uint8)
    write_by_pillow(file, Image.fromarray(np.ascontiguousarray(array)), kind)


def write_by_pillow(file: BinaryIO, image: Image.Image, kind: str) -> None:
    """Write a picture in a format of Pillow. Into a file Pillow would write without saying why it cannot."""
    encoded = BytesIO()
    image.save(encoded, kind, **_OPTIONS.get(kind, {}))
    file.write(encoded.getbuffer())


def encode_png(array: NDArray[Any]) -> bytes:
    """A PNG of (h, w), (h, w, 3) or (h, w, 4), uint8 or uint16: rows less those above, run lengths, Huffman codes."""
    # Pillow tries five filters a row: this takes 0.4 of the time of its quickest level, for files of the same size
    height, width = array.shape[:2]
    plain = np.ascontiguousarray(array.astype(array.dtype.newbyteorder(">"), copy=False))
    plain = plain.reshape(height, -1).view(np.uint8)
    rows = np.full((height, plain.shape[1] + 1), 2, np.uint8)  # each begins with its filter's number: 2 is "up"
    rows[0, 1:] = plain[0]
    np.subtract(plain[1:], plain[:-1], out=rows[1:, 1:])
    kind = {1: 0, 3: 2, 4: 6}[1 if array.ndim == 2 else array.shape[2]]  # grey, RGB, RGBA
    header = struct.pack(">2I5B", width, height, 8 * array.itemsize, kind, 0, 0, 0)
    encoded = b"\x89PNG\r\n\x1a\n"
    for name, data in ((b"IHDR", header), (b"tEXt", _OURS), (b"IDAT", _packed(rows)), (b"IEND", b"")):
        encoded += struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))
    return encoded


def _packed(rows: NDArray[np.uint8]) -> bytes:
    """The zlib stream of rows. Of large pictures threads pack bands: most of a PNG's time is spent here."""
    count = _BANDS if rows.size >= _LARGE else 1
    work = _packed_band, np.array_split(rows, count), [zlib.Z_SYNC_FLUSH] * (count - 1) + [zlib.Z_FINISH]
    try:
        with ThreadPoolExecutor(count) as pool:
            packed = list((pool.map if count > 1 else map)(*work))
    except RuntimeError:  # no more threads can be started: Python is about to end, or the system has a limit
        packed = list(map(*work))
    return b"\x78\x01" + b"".join(packed) + struct.pack(">I", zlib.adler32(rows.data))


def _packed_band(rows: NDArray[np.uint8], end: int) -> bytes:
    packer = zlib.compressobj(1, zlib.DEFLATED, -zlib.MAX_WBITS, 9, zlib.Z_RLE)
    return packer.compress(rows.data) + packer.flush(end)


def is_ours(path: FilePath) -> bool:
    """Whether it is a PNG that `encode_png` made: a rendering, not a photograph."""
    return _OURS in read_head(path)


def read_image(
    path: FilePath, max_pixels: float = MAX_PIXELS, to_srgb: Note | None = None, upright: bool = True
) -> NDArray[Any]:
    """A picture's own values: (h, w), (h, w, 3) or (h, w, 4), uint8; deep grey pictures uint16, int32 or float32.

    Palettes and other colour models become RGB or RGBA, turned by EXIF; it may be read-only. Raises OSError if the
    path is not a file, ValueError if it is not a complete picture of up to max_pixels pixels.

    to_srgb  convert colours of other colour spaces, with a note: for photographs, not for depth or for textures
    upright  turned by EXIF
    """
    read_head(path)
    with open_regular(path) as file:
        check_size(file, path, max_pixels)
        return decode_image(file, str(path), max_pixels, to_srgb, upright)


def read_deep_colors(path: FilePath, max_pixels: float = MAX_PIXELS) -> NDArray[np.uint16]:
    """(h, w, 3|4) uint16 of a PNG of three or four channels of 16 bits. Raises ValueError as `read_image` does."""
    halves: list[NDArray[np.uint16]] = []
    for rest in ("B", "L"):  # Pillow keeps the high bytes; read as if in the other order, they are the low ones
        with open_regular(path) as file:
            image = _open_image(file, str(path), max_pixels, order=f";16{rest}")
            if image.mode not in ("RGB", "RGBA"):
                raise ValueError(f"{path} has grey and alpha of 16 bits, expected depth of one channel")
            halves.append(np.asarray(image).astype(np.uint16))
    return np.uint16(256) * halves[0] + halves[1]


def decode_image(
    file: BinaryIO, name: str, max_pixels: float = MAX_PIXELS, to_srgb: Note | None = None, upright: bool = True
) -> NDArray[Any]:
    """What `read_image` gives, from an open file. Raises ValueError, with the name, as it does."""
    image = _open_image(file, name, max_pixels, upright)
    if to_srgb is not None and image.mode != "F":
        image = in_srgb(_with_alpha(image), image.info, name, to_srgb, read_cicp(file))
    if image.mode in ("I", "F") or image.mode.startswith("I;16"):
        array = np.asarray(image)
        return array.astype(array.dtype.newbyteorder("="), copy=False)  # I;16B is big-endian
    if image.mode == "1":
        image = image.convert("L")
    elif image.mode not in ("L", "RGB", "RGBA") or image.has_transparency_data:
        image = image.convert("RGBA" if image.has_transparency_data else "RGB")
    return np.asarray(image)


def _with_alpha(image: Image.Image) -> Image.Image:
    """A picture of colours in 8 bits, whose transparency is a channel."""
    if image.mode == "I" or image.mode.startswith("I;16"):
        from PIL import Image

        deep = np.clip(np.asarray(image), 0, 65535).astype(np.uint32)
        return Image.fromarray(((deep * 255 + 32767) // 65535).astype(np.uint8))
    return image.convert("RGBA") if image.has_transparency_data and image.mode not in ("LA", "RGBA") else image


def _open_image(file: BinaryIO, name: str, max_pixels: float, upright: bool = True, order: str = "") -> Image.Image:
    """The decoded picture. Its size is checked first. order: in which 16 bits are read, else its own"""
    from PIL import UnidentifiedImageError

    head = file.read(64)
    file.seek(0)
    if head.startswith(_POSTSCRIPT):
        raise ValueError(f"{name} is PostScript, a program that would have to run: convert it to PNG")
    _check_webp(head, name, max_pixels)
    try:
        with opened_picture(file, head) as image:
            check_pixels(*image.size, name, max_pixels)
            tile = [getattr(image, "tag_v2", {}).get(tag, 0) for tag in _TILE]
            check_pixels(tile[0], tile[1], f"{name} is a TIFF whose tile", max_pixels)
            if order and image.mode in ("RGB", "RGBA"):
                tiled: Any = image
                tiled.tile = [(*one[:3], image.mode + order) for one in tiled.tile]
            image.load()
            with _pillow, warnings.catch_warnings():
                warnings.simplefilter("ignore")
                is_turned = upright and image.getexif().get(TURNED, 1) != 1
        if is_turned:
            from PIL import ImageOps

            return ImageOps.exif_transpose(image)
        return image
    except UnidentifiedImageError:
        if found := what_else(Path(name)):
            raise ValueError(f"{name} is {found}") from None
        if head[4:8] == b"ftyp":
            way_out = "pip install '.[heic]' in the clone, or a newer Pillow for AVIF"
            raise ValueError(f"{name} is an HEIC or AVIF picture: {way_out}") from None
        raise NotAPictureError(f"{name} is not a picture, or its format is none of {', '.join(_READ)}") from None
    except MemoryError:
        raise MemoryError(f"{name}: there is not enough memory to decode it") from None
    except Exception as error:  # broken bytes make decoders raise of everything: SyntaxError, struct.error, OSError
        if str(error).startswith(f"{name} "):
            raise
        raise ValueError(f"{name} is a broken or truncated picture: {cut(error)}") from None


@contextmanager
def opened_picture(file: BinaryIO, head: bytes) -> Generator[Image.Image, None, None]:
    """The picture with its header read, without Pillow's own limit and its remarks about metadata."""
    from PIL import Image

    if head[:2] in (b"II", b"MM"):
        import_module("PIL.TiffImagePlugin")  # to find it, Pillow would import all of its 40 formats
    formats: tuple[str, ...] = _READ
    if head[4:8] == b"ftyp":
        with suppress(ImportError):
            import_module("pillow_heif.HeifImagePlugin")  # the extra heic
        Image.init()
        formats = tuple(name for name in _READ_IF_KNOWN if name in Image.OPEN)
    with _pillow, warnings.catch_warnings():
        warnings.simplefilter("ignore")
        from PIL import PngImagePlugin

        usual, Image.MAX_IMAGE_PIXELS = Image.MAX_IMAGE_PIXELS, None
        largest, PngImagePlugin.MAX_TEXT_CHUNK = PngImagePlugin.MAX_TEXT_CHUNK, _MOST_PROFILE
        try:
            image = Image.open(file, formats=formats)
        finally:
            Image.MAX_IMAGE_PIXELS, PngImagePlugin.MAX_TEXT_CHUNK = usual, largest
    with image:
        yield image


def _check_webp(head: bytes, name: str, max_pixels: float) -> None:
    """Checks the size of a WebP, for which Pillow reserves memory when it opens it. Raises ValueError."""
    if head[:4] != b"RIFF" or head[8:12] != b"WEBP" or len(head) < 30:
        return
    kind = head[12:16]
    if kind == b"VP8X":
        sides = int.from_bytes(head[24:27], "little") + 1, int.from_bytes(head[27:30], "little") + 1
    elif kind == b"VP8L":
        bits = int.from_bytes(head[21:25], "little")
        sides = (bits & 0x3FFF) + 1, (bits >> 14 & 0x3FFF) + 1
    else:
        sides = int.from_bytes(head[26:28], "little") & 0x3FFF, int.from_bytes(head[28:30], "little") & 0x3FFF
    check_pixels(*sides, name, max_pixels)


def normals_to_rgb(normals: AnyArray, axes: AxesName = "opengl", bits: int = 8) -> NDArray[Any]:
    """Normals (h, w, 3), unit, camera axes, NaN where missing, in colours that point along these axes, see AXES.
    Returns (h, w, 4) uint8 or uint16 with alpha 0 where missing: n = (0, 0, -1) gives (128, 128, 255, 255)."""
    shown, known = turned_normals(normals, axes)
    most = 2**bits - 1
    image = np.zeros((*known.shape, 4), np.uint8 if bits == 8 else np.uint16)
    image[..., :3] = np.clip(np.rint(shown * (most / 2) + most / 2), 0, most) * known[..., None]
    image[..., 3] = known * image.dtype.type(most)
    return image


def turned_normals(normals: AnyArray, axes: AxesName) -> tuple[NDArray[Any], NDArray[np.bool_]]:
    """Normals of the camera's axes in others, (h, w, 3) float and 0 where missing, and (h, w) where they are known."""
    array = as_given(normals, "normals must have shape (h, w, 3)")
    if array.ndim != 3 or array.shape[2] != 3:
        way = way_to(array.shape, "normals", normals, (3,))
        raise ValueError(f"normals must have shape (h, w, 3), got {array.shape}{way}")
    if array.dtype.kind != "f":
        raise TypeError(f"normals must be floating point, got {array.dtype}")
    known = np.all(np.isfinite(array), axis=2)
    return np.where(known[..., None], array, 0) * np.array(AXES[axes], np.float32), known


_PNG = b"\x89PNG"
_DEEP = re.compile(rb"P[25](?:\s|#[^\n]*\n)+\d+\s+\d+\s+(\d+)\s")  # a PGM's largest value
_LOSSY = (".jpg", ".jpeg", ".webp", ".bmp")


def shallowness(path: Path) -> int:
    """Return how little of the depth a picture keeps: 0 for 16 bits or floats, 1 for 8 bits, 2 for colours."""
    if path.suffix.lower() in _LOSSY:
        return 2
    head = _head(path)
    if not head.startswith(_PNG):
        return 0
    bits, kind = head[24:26].ljust(2, b"\0")
    return 2 if kind else int(bits < 16)


def is_deep_grey(path: Path) -> bool:
    """Whether it is a PNG or PGM of one channel of 16 bits, which is depth and nothing else."""
    head = _head(path)
    if head.startswith(_PNG):
        return head[24:26] == b"\x10\x00"
    found = _DEEP.match(head)
    return found is not None and int(found[1]) > 255


def is_picture(path: Path) -> bool:
    """Whether it begins as a PNG, JPEG, TIFF, BMP, WEBP or PNM does."""
    return _head(path).startswith((_PNG, b"\xff\xd8", b"II*\0", b"MM\0*", b"BM", b"RIFF", b"P2", b"P3", b"P5", b"P6"))


def has_turn(path: FilePath) -> bool:
    """Whether a picture has an EXIF tag that turns or mirrors it."""
    head = read_head(path)
    with open_regular(path) as file, suppress(Exception), opened_picture(file, head) as image:  # of broken bytes: none
        return image.getexif().get(TURNED, 1) in range(2, 9)
    return False


def png_size(path: Path) -> tuple[int, int] | None:
    """(width, height) of a PNG; None for any other file."""
    head = _head(path)
    if not head.startswith(_PNG) or len(head) < 24:
        return None
    width, height = struct.unpack(">2I", head[16:24])
    return width, height


def _head(path: Path) -> bytes:
    with path.open("rb") as file:
        return file.read(512)
