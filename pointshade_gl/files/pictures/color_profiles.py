"""Converts colours to sRGB: from an ICC profile, or from what PNG and HEIC hold in numbers (gAMA, cHRM, cICP, nclx).

Phones write Display P3, cameras Adobe RGB: taken for sRGB, their colours are pale.
"""

from __future__ import annotations

from collections.abc import Mapping
from io import BytesIO
from typing import TYPE_CHECKING, Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from ...notes.notes import Note
from ...notes.words import cut
from ...scene.values import linear_to_bytes, srgb_to_linear

if TYPE_CHECKING:
    from PIL import Image  # imported where it is used

Chromaticities = tuple[float, ...]  # x, y of white, red, green, blue

_D65 = (0.3127, 0.329)
_SRGB: Chromaticities = (*_D65, 0.64, 0.33, 0.3, 0.6, 0.15, 0.06)
_PRIMARIES: dict[int, tuple[str, Chromaticities]] = {  # by their numbers in ITU-T H.273
    1: ("sRGB", _SRGB),
    5: ("BT.601", (*_D65, 0.64, 0.33, 0.29, 0.6, 0.15, 0.06)),
    6: ("BT.601", (*_D65, 0.63, 0.34, 0.31, 0.595, 0.155, 0.07)),
    9: ("BT.2020", (*_D65, 0.708, 0.292, 0.17, 0.797, 0.131, 0.046)),
    11: ("DCI-P3", (0.314, 0.351, 0.68, 0.32, 0.265, 0.69, 0.15, 0.06)),
    12: ("Display P3", (*_D65, 0.68, 0.32, 0.265, 0.69, 0.15, 0.06)),
}
_GAMMAS = {4: 2.2, 5: 2.8, 8: 1.0}  # of the transfer functions that are powers
_LIKE_SRGB = (1, 6, 13, 14, 15)  # sRGB's; and those of video, which screens show as if they were
_HDR = {16: "PQ (HDR)", 18: "HLG (HDR)"}
_UNSTATED = 2  # in H.273
_SAME = 2  # of 255: rounding in tables; other colour spaces are further away
_GAMMA_OF_SRGB = 0.45455, 0.001  # as a PNG has it, and how far others may be away
_STEPS = 65535  # of the table that encodes linear light: a twentieth of a level where it is coarsest
_CHUNKS = 1000  # of a PNG that are looked at
_BRADFORD = np.array([[0.8951, 0.2664, -0.1614], [-0.7502, 1.7135, 0.0367], [0.0389, -0.0685, 1.0296]])


def in_srgb(
    image: Image.Image, info: Mapping[Any, Any], name: str, note: Note, cicp: tuple[int, int] | None = None
) -> Image.Image:
    """The picture of a file in sRGB, with a note if that changes it, and one if its colours cannot be converted. info
    is Pillow's of the file, cicp that of `read_cicp`."""
    if cicp is not None and _UNSTATED not in cicp:
        return _by_codes(image, cicp, name, note)
    if profile := info.get("icc_profile"):
        return _by_profile(image, profile, name, note)
    if nclx := info.get("nclx_profile"):
        found = int(nclx.get("color_primaries", _UNSTATED)), int(nclx.get("transfer_characteristics", _UNSTATED))
        return image if _UNSTATED in found else _by_codes(image, found, name, note)
    gamma = info.get("gamma")
    if gamma and "srgb" not in info:
        usual, near = _GAMMA_OF_SRGB
        power = None if abs(gamma - usual) < near else 1 / gamma
        label = "primaries of its own" if power is None else f"gamma {power:.3g}"
        return _by_numbers(image, info.get("chromaticity", _SRGB), power, label, name, note)
    return image


def read_cicp(file: BinaryIO) -> tuple[int, int] | None:
    """The numbers of primaries and transfer function that a PNG holds; None for one without, and other files."""
    file.seek(0)
    if not file.read(8).startswith(b"\x89PNG"):
        return None
    for _ in range(_CHUNKS):
        head = file.read(8)
        if head == b"\0\0\0\4cICP":
            primaries, transfer = file.read(2).ljust(2, b"\2")
            return primaries, transfer
        if len(head) < 8 or head[4:] == b"IDAT":
            return None
        file.seek(int.from_bytes(head[:4], "big") + 4, 1)
    return None


def _by_codes(image: Image.Image, coded: tuple[int, int], name: str, note: Note) -> Image.Image:
    """coded: numbers of primaries and transfer function."""
    primaries, transfer = coded
    label, places = _PRIMARIES.get(primaries, ("", _SRGB))
    gamma = _GAMMAS.get(transfer)
    if label and (gamma or transfer in _LIKE_SRGB):
        return _by_numbers(image, places, gamma, f"{label}, gamma {gamma:g}" if gamma else label, name, note)
    what = _HDR.get(transfer, f"the codes {primaries} and {transfer} of H.273")
    note(f"{name} has colours of {what}, which cannot be converted: they are taken as sRGB")
    return image


def _by_profile(image: Image.Image, profile: bytes, name: str, note: Note) -> Image.Image:
    from PIL import Image, ImageCms  # only here: few pictures have one

    try:
        source: Any = ImageCms.ImageCmsProfile(BytesIO(profile))
        space = source.profile.xcolor_space.strip()
        label = cut(ImageCms.getProfileDescription(source).strip() or space)
        mode = {"GRAY": "L", "RGB": "RGB", "CMYK": "CMYK"}.get(space, "")
        if image.mode not in ((mode, "LA") if mode == "L" else (mode, "P", "RGBA", "L", "LA")) or not mode:
            raise ValueError(f"it is for {space}")
        change = ImageCms.buildTransform(source, ImageCms.createProfile("sRGB"), mode, "RGB")

        def convert(colors: NDArray[np.uint8]) -> NDArray[np.uint8]:
            return np.asarray(ImageCms.applyTransform(Image.fromarray(colors), change))

        if mode == "RGB" and _is_same(convert):
            return image
        found: Any = ImageCms.applyTransform(image.convert(mode), change)
    except (ImageCms.PyCMSError, ValueError, TypeError, OSError) as error:
        note(f"{name} has a colour profile that cannot be used ({cut(error)}): its colours are taken as sRGB")
        return image
    return _converted(image, found, label, name, note)


def _converted(image: Image.Image, found: Image.Image, label: str, name: str, note: Note) -> Image.Image:
    """The picture in sRGB with the alpha that it had, and a note."""
    if image.mode in ("LA", "RGBA"):
        found.putalpha(image.getchannel("A"))
    note(f"{name} has colours of {label}: they are converted to sRGB")
    return found


def _by_numbers(
    image: Image.Image, places: Chromaticities, gamma: float | None, label: str, name: str, note: Note
) -> Image.Image:
    """gamma: None is the curve of sRGB."""
    from PIL import Image

    levels = np.arange(256, dtype=np.float32) / 255
    light = (srgb_to_linear(levels) if gamma is None else levels**gamma).astype(np.float32)
    try:
        matrix = (np.linalg.inv(_to_xyz(_SRGB)) @ _to_xyz(places)).T.astype(np.float32)
    except (ZeroDivisionError, np.linalg.LinAlgError):
        note(f"{name} says primaries that cannot be: its colours are taken as sRGB")
        return image
    encoded = linear_to_bytes(np.arange(_STEPS + 1, dtype=np.float32) / _STEPS)

    def convert(colors: NDArray[np.uint8]) -> NDArray[np.uint8]:
        result = np.empty_like(colors)
        for row, out in zip(colors, result, strict=True):  # a picture of 100 million pixels fits thrice, not tenfold
            out[:] = encoded[np.rint(np.clip(light[row] @ matrix, 0, 1) * _STEPS).astype(np.uint16)]
        return result

    if _is_same(convert):
        return image
    return _converted(image, Image.fromarray(convert(np.asarray(image.convert("RGB")))), label, name, note)


def _is_same(convert: Any) -> bool:
    levels = np.linspace(0, 255, 9).astype(np.uint8)
    probe = np.stack(np.meshgrid(levels, levels, levels), -1).reshape(27, 27, 3)
    return int(np.abs(convert(probe).astype(int) - probe).max()) <= _SAME


def _to_xyz(places: Chromaticities) -> NDArray[np.float64]:
    """(3, 3) from linear colours to XYZ under D65; another white is adapted by Bradford's transform."""
    white, *primaries = (np.array([x / y, 1, (1 - x - y) / y]) for x, y in zip(places[::2], places[1::2], strict=True))
    columns = np.stack(primaries, axis=1)
    matrix = columns * np.linalg.solve(columns, white)
    target = np.array([_D65[0] / _D65[1], 1, (1 - sum(_D65)) / _D65[1]])
    return np.linalg.inv(_BRADFORD) @ np.diag((_BRADFORD @ target) / (_BRADFORD @ white)) @ _BRADFORD @ matrix
