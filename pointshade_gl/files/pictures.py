"""Pictures to files and back, and normals as colours. Whatever is wrong with a file is told in one sentence."""

from __future__ import annotations

import struct
import warnings
import zlib
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..checks import as_given, check_path
from .content import FilePath, read_head
from .whole import check_place, written_whole

if TYPE_CHECKING:
    from PIL import Image  # imported where it is used: a PNG is written without it

_FORMATS = {".png": "PNG", ".jpg": "JPEG", ".jpeg": "JPEG", ".webp": "WEBP", ".tif": "TIFF", ".tiff": "TIFF"}
_OPTIONS: dict[str, dict[str, Any]] = {
    "PNG": {"optimize": True},
    "JPEG": {"quality": 95},
    "WEBP": {"lossless": True, "exact": True},  # exact keeps the colours under alpha 0
}
_LONGEST = {"JPEG": 65500, "WEBP": 16383}  # pixels a side that the formats can hold
_POSTSCRIPT = (b"%!PS", b"\xc5\xd0\xd3\xc6")  # Pillow hands it to Ghostscript


def check_writable(path: FilePath) -> Path:
    """The path, if `save_image` can write there; ask before a long computation.

    Raises ValueError for a suffix that names no format, FileNotFoundError when the folder does not exist.
    """
    path = check_path(path)
    if path.suffix.lower() not in (*_FORMATS, ".npy"):
        raise ValueError(f"cannot write {path}: its suffix must be one of {', '.join(_FORMATS)}, .npy")
    return check_place(path)


def save_image(path: FilePath, image: ArrayLike, small: bool = False) -> None:
    """Writes a picture in the format of the path's suffix, completely or not at all.

    image   (h, w, 3|4) or (h, w) uint8; for .npy any array of numbers. JPEG knows no alpha: it gets the picture
            over black.
    small   take ten times as long over a PNG that is a little smaller

    Raises ValueError for an unknown suffix or shape, TypeError for values that are not uint8,
    FileNotFoundError when the folder does not exist.
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


def check_picture(image: ArrayLike, kind: str) -> NDArray[np.uint8]:
    """The picture as an array. Raises ValueError or TypeError unless it has 8 bits and the format can hold it."""
    expected = "image must have shape (h, w), (h, w, 3) or (h, w, 4)"
    array = as_given(image, expected)
    if array.ndim not in (2, 3) or (array.ndim == 3 and array.shape[2] not in (3, 4)) or 0 in array.shape:
        raise ValueError(f"{expected}, got {array.shape}")
    if array.dtype != np.uint8:
        raise TypeError(f"image must be uint8, got {array.dtype}: scale it to 0..255, or save it as .npy")
    if max(array.shape) > _LONGEST.get(kind, np.inf):
        raise ValueError(f"image may have up to {_LONGEST[kind]} pixels a side in {kind}, got {array.shape}")
    return array


def _encode(file: BinaryIO, array: NDArray[Any], suffix: str, small: bool) -> None:
    if suffix == ".npy":
        np.save(file, array, allow_pickle=False)
        return
    kind = _FORMATS[suffix]
    if kind == "PNG" and not small:
        file.write(encode_png(array))
        return
    from PIL import Image

    if kind == "JPEG" and array.shape[2:] == (4,):
        array = (array[..., :3] * (array[..., 3:] / 255) + 0.5).astype(np.uint8)
    Image.fromarray(np.ascontiguousarray(array)).save(file, kind, **_OPTIONS.get(kind, {}))


def encode_png(array: NDArray[np.uint8]) -> bytes:
    """A PNG of (h, w), (h, w, 3) or (h, w, 4): each row less the one above, packed by run lengths and Huffman codes.

    Encoding was the largest stage of a rendering. Pillow tries five filters a row: this takes 0.4 of the time of its
    quickest level, for files of the same size.
    """
    height, width = array.shape[:2]
    plain = np.ascontiguousarray(array).reshape(height, -1)
    rows = np.full((height, plain.shape[1] + 1), 2, np.uint8)  # each begins with its filter's number: 2 is "up"
    rows[0, 1:] = plain[0]
    np.subtract(plain[1:], plain[:-1], out=rows[1:, 1:])
    packer = zlib.compressobj(1, zlib.DEFLATED, zlib.MAX_WBITS, 9, zlib.Z_RLE)
    kind = {1: 0, 3: 2, 4: 6}[1 if array.ndim == 2 else array.shape[2]]  # grey, RGB, RGBA
    header = struct.pack(">2I5B", width, height, 8, kind, 0, 0, 0)
    parts = [(b"IHDR", header), (b"IDAT", packer.compress(rows.tobytes()) + packer.flush()), (b"IEND", b"")]
    chunks = [
        struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data)) for name, data in parts
    ]
    return b"\x89PNG\r\n\x1a\n" + b"".join(chunks)


def read_image(path: FilePath) -> NDArray[Any]:
    """A picture's own values: (h, w), (h, w, 3) or (h, w, 4), uint8; deep grey pictures uint16, int32 or float32.

    Palettes and other colour models become RGB or RGBA; the turn that a camera noted in EXIF is done.

    Raises FileNotFoundError and other OSErrors for what is no file, ValueError for what is no complete picture.
    """
    read_head(path)
    return decode_image(Path(path).read_bytes(), str(path))


def decode_image(data: bytes, name: str) -> NDArray[Any]:
    """What `read_image` gives, from the bytes of a file. Raises ValueError, with the name, for no complete picture."""
    image = _open_image(data, name)
    if image.mode in ("I", "F") or image.mode.startswith("I;16"):
        array = np.asarray(image)
        return array.astype(array.dtype.newbyteorder("="))  # I;16B is big-endian
    if image.mode == "1":
        image = image.convert("L")
    elif image.mode not in ("L", "RGB", "RGBA") or image.has_transparency_data:
        image = image.convert("RGBA" if image.has_transparency_data else "RGB")
    return np.array(image)


def _open_image(data: bytes, path: str) -> Image.Image:
    from PIL import Image, ImageOps, UnidentifiedImageError

    if data.startswith(_POSTSCRIPT):
        raise ValueError(f"{path} is PostScript, a program that would have to run: convert it to PNG")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # Pillow's remarks about metadata and 100 megapixels help nobody here
            with Image.open(BytesIO(data)) as image:
                image.load()
                return ImageOps.exif_transpose(image)
    except UnidentifiedImageError:
        raise ValueError(f"{path} is not a picture, or one in a format that Pillow cannot read") from None
    except Image.DecompressionBombError:
        limit = 2 * (Image.MAX_IMAGE_PIXELS or 0)
        raise ValueError(f"{path} is too large: pictures may have up to {limit} pixels") from None
    except Exception as error:  # broken bytes make decoders raise of everything: SyntaxError, struct.error, OSError
        raise ValueError(f"{path} is a broken or truncated picture: {error}") from None


def normals_to_rgb(normals: ArrayLike) -> NDArray[np.uint8]:
    """Normals in the usual colours: red = right, green = up, blue = towards the viewer.

    normals  (h, w, 3) float, unit, camera axes (x right, y down, z forward), NaN where missing
    Returns (h, w, 4) uint8 with alpha 0 where missing: n = (0, 0, -1) gives (128, 128, 255, 255).
    """
    array = np.asarray(normals)
    if array.ndim != 3 or array.shape[2] != 3:
        raise ValueError(f"normals must have shape (h, w, 3), got {array.shape}")
    if array.dtype.kind != "f":
        raise TypeError(f"normals must be floating point, got {array.dtype}")
    known = np.all(np.isfinite(array), axis=2)
    shown = np.where(known[..., None], array, 0) * np.array((1, -1, -1), np.float32)
    image = np.zeros((*known.shape, 4), np.uint8)
    image[..., :3] = np.clip(np.rint(shown * 127.5 + 127.5), 0, 255) * known[..., None]
    image[..., 3] = known * np.uint8(255)
    return image
