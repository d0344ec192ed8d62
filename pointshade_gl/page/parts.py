"""The parts of a page: each a description for the JSON, and bytes that decode.js reads."""

from __future__ import annotations

import io
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..gpu.meshes.mesh_objects import PlacedMesh, mesh_vertices
from .contents import Surface
from .picture_coding import MISSING, POINT, RIM, code_colors, code_depth, code_normals, code_plane, repeated

Part = tuple[dict[str, Any], bytes]


class Quality(NamedTuple):
    """How exactly a page keeps what it shows.

    depth_step   depths are kept to half of this share of them
    normal_bits  of each of two coordinates
    jpeg         quality of the colours of frames and meshes; None keeps them without loss
    points       of all clouds together, at most
    """

    depth_step: float
    normal_bits: int
    jpeg: int | None
    points: int


QualityName = Literal["exact", "small"]
QUALITIES = {"exact": Quality(1e-6, 14, None, 250_000), "small": Quality(2e-5, 10, 95, 125_000)}


def surface_part(surface: Surface, quality: Quality) -> Part:
    """The points of a frame."""
    depth = surface.depth
    kinds = np.where(depth == 0, MISSING, np.where(depth < 0, RIM, POINT)).astype(np.uint8)
    known = kinds != MISSING
    codes = np.zeros(depth.shape, np.int64)
    codes[known], nearest = code_depth(np.abs(depth[known]), quality.depth_step)
    places = np.zeros((*depth.shape, 2), np.int64)
    places[known] = code_normals(surface.normals[known], quality.normal_bits)
    planes = [code_plane(plane, known) for plane in (codes, places[..., 0], places[..., 1])]
    color, color_bytes = _color_part(surface.colors, known, quality)
    certainty = None if surface.certainty is None else np.rint(surface.certainty * 65535).astype("<u2")
    sizes = surface.sizes.astype("<f4")
    head = {
        "kind": "points",
        "width": depth.shape[1],
        "height": depth.shape[0],
        "count": int(known.sum()),
        "nearest": nearest,
        "depthStep": quality.depth_step,
        "normalBits": quality.normal_bits,
        "depthBytes": planes[0][1],
        "normalBytes": [planes[1][1], planes[2][1]],
        "color": color,
        "certainty": None if certainty is None else list(certainty.shape[::-1]),
        "size": float(sizes[0]) if sizes.size == 1 else None,
        "hasRims": not surface.is_round and bool((sizes == 1).all()),
        "isRound": surface.is_round,
        "stride": surface.stride,
        "source": list(surface.intrinsics),
        "axes": surface.axes,
        "scale": surface.scale,
        "behind": surface.behind,
    }
    body = [kinds.tobytes(), *(data for data, _ in planes), color_bytes]
    body += [certainty.tobytes()] if certainty is not None else []
    body += [sizes.tobytes()] if sizes.size > 1 else []
    return head, b"".join(body)


def mesh_part(placed: PlacedMesh, quality: Quality) -> Part:
    """A mesh, its corners as the renderer takes them."""
    mesh = placed.mesh
    vertices, faces = mesh_vertices(mesh)
    head: dict[str, Any] = {
        "kind": "mesh",
        "vertices": len(vertices),
        "corners": faces.size,
        "baseColor": list(mesh.color),
        "texture": None,
        "axes": placed.worlds[0],
        "scale": 1,
    }
    body = vertices.T.astype("<f4").tobytes() + faces.astype("<u4").tobytes()
    if mesh.texture is not None:
        every = np.ones(mesh.texture.shape[:2], np.bool_)
        head["texture"], colors = _color_part(mesh.texture[..., :3], every, quality)
        body += colors
    return head, body


def _color_part(colors: NDArray[np.uint8], known: NDArray[np.bool_], quality: Quality) -> Part:
    """The picture: without loss, of the points alone where each has its own pixel; or as a JPEG."""
    height, width = colors.shape[:2]
    head: dict[str, Any] = {"width": width, "height": height}
    is_cut = colors.shape[:2] == known.shape
    if quality.jpeg is not None:
        if is_cut:  # what nobody sees must not blur what is beside it
            planes = [repeated(plane.astype(np.int64), known) for plane in np.moveaxis(colors, -1, 0)]
            colors = np.stack(planes, -1).astype(np.uint8)
        # 4:4:4: every pixel keeps its own colour
        options = {"quality": quality.jpeg, "subsampling": 0}
        try:
            data = encoded(colors, "JPEG", **options, optimize=True)
        except OSError:  # Pillow gives the optimizer a byte a pixel, which noise exceeds
            data = encoded(colors, "JPEG", **options)
        return head | {"jpeg": len(data)}, data
    kept = known if is_cut else np.ones((height, width), np.bool_)
    return head | {"ofPoints": is_cut}, code_colors(colors, kept)


def encoded(image: NDArray[np.uint8], kind: str, **options: int) -> bytes:
    """A picture as a file of this kind, as Pillow calls it."""
    from PIL import Image

    file = io.BytesIO()
    Image.fromarray(np.ascontiguousarray(image)).save(file, kind, **options)
    return file.getvalue()
