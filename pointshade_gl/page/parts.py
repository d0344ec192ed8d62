"""The parts of a page, clouds too: each a description for the JSON, and bytes that decode.js reads. And the one file
that they fill: page.html with its places, shaders and scripts."""

from __future__ import annotations

import base64
import html
import io
import json
import re
import zlib
from collections.abc import Iterable, Sequence
from dataclasses import replace
from functools import singledispatch
from pathlib import Path
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..estimation.splat_projection import splat_normals
from ..gpu.clouds import cloud_objects as drawing
from ..gpu.clouds.cloud_objects import PlacedCloud
from ..gpu.clouds.splat_layer import PlacedSplats
from ..gpu.core.programs import splice
from ..gpu.core.view_images import Drawable
from ..gpu.meshes.mesh_objects import PlacedMesh, mesh_tints, mesh_vertices
from ..gpu.points.point_objects import ShownSet
from ..notes.notes import print_note
from ..notes.words import printable
from ..scene.gaussians import palette_of
from .page_surfaces import MISSING, PageSurface, surfaces_of

Whole = NDArray[np.int64]
Known = NDArray[np.bool_]


def code_depth(depth: NDArray[np.floating], step: float, nearest: float | None = None) -> tuple[Whole, float]:
    """Depths above 0 as multiples of a step of their logarithm, counted from the nearest: and that one's depth.

    nearest  what is counted from; None: the least depth

    The logarithm, as an error by a share of the depth moves a point by the same share of its distance everywhere.
    """
    depth = np.asarray(depth, np.float64)
    if nearest is None:
        nearest = float(depth.min()) if depth.size else 1.0
    return np.rint(np.log(depth / nearest) / step).astype(np.int64), nearest


def code_normals(normals: NDArray[np.floating], bits: int) -> Whole:
    """Unit normals (n, 3) as places on an octahedron, (n, 2) whole numbers (Meyer et al. 2010).

    It is unfolded so that normals towards the camera lie in the middle, away from its seams.
    """
    n = np.asarray(normals, np.float64)
    x, y, z = (n / np.abs(n).sum(1, keepdims=True)).T
    sign = [np.where(v >= 0, 1.0, -1.0) for v in (x, y)]
    away = z > 0
    u = np.where(away, (1 - np.abs(y)) * sign[0], x)
    v = np.where(away, (1 - np.abs(x)) * sign[1], y)
    return np.rint((np.stack([u, v], -1) * 0.5 + 0.5) * (2**bits - 1)).astype(np.int64)


def repeated(values: Whole, known: Known) -> Whole:
    """The plane, (h, w), where pixels that are not known repeat what is before them."""
    height, width = values.shape
    rows = np.maximum.accumulate(np.where(known[:, 0], np.arange(height), -1))
    filled = np.where(known, values, 0)
    filled[:, 0] = np.where(rows >= 0, values[np.maximum(rows, 0), 0], 0)
    columns = np.maximum.accumulate(np.where(known, np.arange(width), 0), axis=1)
    return np.take_along_axis(filled, columns, 1)


def predicted(plane: Whole) -> Whole:
    """Each pixel by those on its left (a), above (b) and before that (c); the first one is 0."""
    a, b, c = (np.zeros_like(plane) for _ in range(3))
    a[:, 1:], b[1:], c[1:, 1:] = plane[:, :-1], plane[:-1], plane[:-1, :-1]
    b[0] = c[0] = a[0]
    a[1:, 0] = c[1:, 0] = b[1:, 0]
    return np.clip(a + b - c, np.minimum(a, b), np.maximum(a, b))


def code_plane(values: Whole, known: Known) -> tuple[bytes, int]:
    """The errors of the known pixels as `code_errors` codes them."""
    plane = repeated(values, known)
    return code_errors((plane - predicted(plane))[known])


def code_errors(error: Whole) -> tuple[bytes, int]:
    """Numbers that are mostly small: all low bytes first; and how many bytes each has.

    0, -1, 1, -2, 2 ... become 0, 1, 2, 3, 4, so that high bytes are seldom other than 0.
    """
    zigzag = np.where(error < 0, -2 * error - 1, 2 * error)
    count = max((int(zigzag.max(initial=0)).bit_length() + 7) // 8, 1)
    return b"".join(((zigzag >> (8 * k)) & 255).astype(np.uint8).tobytes() for k in range(count)), count


def code_colors(colors: NDArray[np.uint8], known: Known) -> bytes:
    """Colours (h, w, 3) without loss: green, and by how much red and blue differ from it, modulo 256."""
    red, green, blue = np.moveaxis(colors.astype(np.int64), -1, 0)
    parts = []
    for plane in (green, (red - green) & 255, (blue - green) & 255):
        filled = repeated(plane, known)
        parts.append(((filled - predicted(filled))[known] & 255).astype(np.uint8).tobytes())
    return b"".join(parts)


def pack(data: bytes) -> bytes:
    """As DecompressionStream("deflate") unpacks it. The highest level takes five times as long to save 2 %."""
    packer = zlib.compressobj(6, zlib.DEFLATED, zlib.MAX_WBITS, 9, zlib.Z_FILTERED)
    return packer.compress(data) + packer.flush()


Part = tuple[dict[str, Any], bytes]


class Quality(NamedTuple):
    """How exactly a page keeps what it shows.

    depth_step   depths are kept to half of this share of them
    normal_bits  of each of two coordinates
    jpeg         quality of the colours of frames and meshes; None keeps them without loss
    points       of all clouds together, at most
    splats       trained ones, at most
    """

    depth_step: float
    normal_bits: int
    jpeg: int | None
    points: int
    splats: int


QualityName = Literal["exact", "small"]
BAND_STEPS = 200  # steps of depth in what several frames of one thing may differ by
QUALITIES = {
    "exact": Quality(1e-6, 14, None, 250_000, 1_000_000), "small": Quality(2e-5, 10, 95, 125_000, 125_000),
}  # fmt: skip


@singledispatch
def parts_of(thing: Drawable, quality: Quality) -> Iterable[Part]:
    """The parts of what shows points; meshes and clouds have their own functions."""
    return (surface_part(surface, quality) for surface in surfaces_of(thing))


@parts_of.register
def _(thing: ShownSet, quality: Quality) -> Iterable[Part]:
    step = max(quality.depth_step, thing.consensus.fine_band / BAND_STEPS)
    coarse = quality._replace(depth_step=step, normal_bits=min(quality.normal_bits, 12))
    views = [surface_part(surface, coarse) for surface in surfaces_of(thing)]
    head: dict[str, Any] = {
        "kind": "set", "views": [view for view, _ in views], "isExact": thing.consensus.is_exact,
        "band": thing.consensus.fine_band, "differ": thing.points.differ, "scale": thing.points.scale,
        "axes": np.eye(4),
    }  # fmt: skip
    return [(head, b"".join(body for _, body in views))]


def surface_part(surface: PageSurface, quality: Quality) -> Part:
    """The points of a frame."""
    depth = surface.depth
    kinds, certainty = surface.kinds, surface.certainty_codes
    known = kinds != MISSING
    codes = np.zeros(depth.shape, np.int64)
    codes[known], nearest = code_depth(np.abs(depth[known]), quality.depth_step)
    normals = [surface.normals, *([] if surface.light_normals is None else [surface.light_normals])]
    planes = [code_plane(codes, known)]
    for one in normals:
        places = np.zeros((*depth.shape, 2), np.int64)
        places[known] = code_normals(one[known], quality.normal_bits)
        planes += [code_plane(places[..., k], known) for k in (0, 1)]
    color, color_bytes = _color_part(surface.colors, known, quality)
    sizes = surface.sizes.astype("<f4")
    head = {
        "kind": "points", "width": depth.shape[1], "height": depth.shape[0], "count": int(known.sum()),
        "nearest": nearest, "depthStep": quality.depth_step, "normalBits": quality.normal_bits,
        "depthBytes": planes[0][1], "normalBytes": [size for _, size in planes[1:]], "color": color,
        "certainty": None if certainty is None else list(certainty.shape[::-1]),
        "size": float(sizes[0]) if sizes.size == 1 else None,
        "hasRims": surface.has_rims, "isRound": surface.is_round, "stride": surface.stride,
        "source": list(surface.intrinsics), "axes": surface.axes, "scale": surface.scale, "gain": list(surface.gain),
    }  # fmt: skip
    body = [kinds.tobytes(), *(data for data, _ in planes), color_bytes]
    body += [certainty.tobytes()] if certainty is not None else []
    body += [sizes.tobytes()] if sizes.size > 1 else []
    if surface.trust is not None:
        body += [surface.trust[known, k].tobytes() for k in (0, 1)] + [surface.trust[depth < 0, 2:].tobytes()]
    return head, b"".join(body)


TINT_STEPS = 32767  # of a colour less white


@parts_of.register
def mesh_part(placed: PlacedMesh, quality: Quality) -> Iterable[Part]:
    """A mesh, its corners as the renderer takes them."""
    mesh = placed.mesh
    vertices, faces = mesh_vertices(mesh)
    head: dict[str, Any] = {
        "kind": "mesh", "vertices": len(vertices), "corners": faces.size, "baseColor": list(mesh.color),
        "texture": None, "axes": placed.worlds[0], "scale": 1,
    }  # fmt: skip
    body = vertices.T.astype("<f4").tobytes() + faces.astype("<u4").tobytes()
    if (tints := mesh_tints(mesh)) is not None:
        head["tinted"] = True
        body += np.rint(tints * TINT_STEPS).astype("<i2").tobytes()
    if mesh.texture is not None:
        every = np.ones(mesh.texture.shape[:2], np.bool_)
        head["texture"], colors = _color_part(mesh.texture[..., :3], every, quality)
        body += colors
    return [(head, body)]


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


STEPS_PER_SPACING = 256  # of positions, in the typical distance of two points
MAX_STEPS = 2**30  # more are no whole number of a browser
SIZE_STEP = 0.002  # share of a size: sizes are kept to half of it
EDGE_BITS = 8  # of each of two coordinates of a direction
RULES = {
    "core": drawing.CORE, "band": drawing.BAND, "stepBack": drawing.STEP_BACK, "ring": drawing.RING,
    "shadowShare": drawing.SHADOW_SHARE, "shadowPush": drawing.SHADOW_PUSH, "ballShare": drawing.BALL_SHARE,
}  # fmt: skip


@parts_of.register
def cloud_part(placed: PlacedCloud, quality: Quality) -> Iterable[Part]:
    """The points of a cloud, all of them: `placed` may have those that one view needs."""
    with placed.points.complete(placed.cloud) as points:
        grown = placed.grown if points is placed.points else 1.0
        return [_coded(replace(placed, points=points, grown=grown), quality)]


def _coded(placed: PlacedCloud, quality: Quality) -> Part:
    vertices, discs = _in_order(placed)
    count, has_sizes = len(vertices), placed.radius[1] > 0
    low, step = _grid(vertices["position"], placed.points.spacing)
    codes = np.rint((vertices["position"].astype(np.float64) - low) / step).astype(np.int64)
    planes = [_line(codes[:, axis]) for axis in range(3)]
    smallest = 0.0
    if has_sizes:
        sizes, smallest = code_depth(vertices["spacing"], SIZE_STEP)
        planes.append(_line(sizes))
    flat, edges = vertices["normal"][:discs], vertices["edge"][:discs, :3].astype(np.float64)
    planes += [_line(code) for code in code_normals(flat, quality.normal_bits).T]
    border = np.asarray(edges.any(-1))
    directions = np.zeros((discs, 2), np.int64)
    directions[border] = code_normals(edges[border], EDGE_BITS)
    planes += [_line(code, border) for code in directions.T]
    has_colors = placed.cloud.colors is not None and count > 0
    colors = code_colors(vertices["color"][None, :, :3], np.ones((1, count), np.bool_)) if has_colors else b""
    axes = placed.pose.copy()
    axes[:3, 3] += axes[:3, :3] @ (placed.scale * placed.points.middle)
    head: dict[str, Any] = {
        "kind": "cloud", "count": count, "discs": discs, "isBlended": placed.is_blended,
        "low": low.tolist(), "high": (low + step * codes.max(0, initial=0)).tolist(), "step": step,
        "smallest": smallest, "sizeStep": SIZE_STEP, "hasSizes": has_sizes, "hasColors": has_colors,
        "normalBits": quality.normal_bits, "edgeBits": EDGE_BITS, "edges": int(border.sum()),
        "bytes": [size for _, size in planes], "radius": list(placed.radius),
        "spacing": placed.points.spacing, "largest": placed.points.largest, "rules": RULES,
        "axes": axes, "scale": placed.scale,
    }  # fmt: skip
    return head, b"".join([border.astype(np.uint8).tobytes(), *(data for data, _ in planes), colors])


def _line(codes: NDArray[np.int64], known: NDArray[np.bool_] | None = None) -> tuple[bytes, int]:
    """Numbers as a picture of one row."""
    if not len(codes):
        return b"", 1
    return code_plane(codes[None], np.ones((1, len(codes)), np.bool_) if known is None else known[None])


def _grid(
    at: NDArray[np.floating], spacing: float, steps: int = STEPS_PER_SPACING
) -> tuple[NDArray[np.float64], float]:
    """Where positions are counted from, and the step in which they are."""
    if not len(at):
        return np.zeros(3), 1.0
    low = at.min(0).astype(np.float64)
    extent = float((at.max(0) - low).max())
    typical = spacing if 0 < spacing < extent else extent / np.sqrt(len(at))
    return low, max(typical / steps, extent / MAX_STEPS) or 1.0


def _in_order(placed: PlacedCloud) -> tuple[NDArray[Any], int]:
    """The points that are drawn, discs first, both along a curve that fills space (Morton 1966); how many discs."""
    vertices = placed.points.read()
    is_disc = vertices["normal"].any(-1) if placed.is_blended else np.zeros(len(vertices), np.bool_)
    drawn = vertices["spacing"] > 0 if placed.radius[1] > 0 else np.ones(len(vertices), np.bool_)
    order = np.lexsort((_curve(vertices["position"]), ~is_disc))
    order = order[drawn[order]]
    return vertices[order], int((is_disc & drawn).sum())


def _curve(at: NDArray[np.float32]) -> NDArray[np.int64]:
    """(n,) places of points (n, 3) on the curve."""
    if not len(at):
        return np.zeros(0, np.int64)
    low, high = np.quantile(at, (0.001, 0.999), axis=0)
    cells = np.clip((at - low) / max(float((high - low).max()), 1e-30) * 1024, 0, 1023).astype(np.int64)
    bits = [(cells[:, axis] >> bit & 1) << (3 * bit + axis) for bit in range(10) for axis in range(3)]
    return np.sum(bits, axis=0)


PLACE_STEPS = 64  # in the length of a small splat
SMALL = 0.1  # quantile of the lengths: that of a small one
FLATTEST = 1e-3  # of the median length: thinner is as thin
BASES = 1e-4  # quantile of colours and harmonics beyond which they are cut off
ANTIALIASED, SURFACE = 1, 2  # marks of shaders/splats/packed.vert
ROOT_TWO = 2**0.5


def splats_part(things: Sequence[tuple[PlacedSplats, bool]], to_home: NDArray[np.float64], is_exact: bool) -> Part:
    """All trained splats of a scene, in home axes: they are sorted together. things: each with whether it is lit."""
    most = max(0 if one.held.harmonics is None else one.held.harmonics.shape[1] for one, _ in things)
    moved = zip(*(_moved(*one, most, to_home) for one in things), strict=True)
    places, *others = map(np.concatenate, moved)
    order, count = np.argsort(_curve(places.astype(np.float32)), kind="stable"), len(places)
    places = places[order]
    scales, rotations, opacities, base, normals, marks, harmonics = (one[order] for one in others)
    lengths = scales.max(1, initial=0)
    low, step = _grid(places, float(np.quantile(lengths, SMALL)) if count else 0.0, PLACE_STEPS)
    planes = [_line(np.rint((places[:, axis] - low[axis]) / step).astype(np.int64)) for axis in range(3)]
    thinnest = FLATTEST * float(np.median(lengths)) if count else 0.0
    deviations, scales = _in_bytes(np.log(np.maximum(scales, thinnest + 1e-20)))
    ends = np.quantile(base, (BASES, 1 - BASES)) if count else (0, 1)
    bases, colors = _in_bytes(base.clip(min(ends[0], 0), max(ends[1], 1)))
    columns = [np.rint(255 * opacities).clip(1), *scales.T, *rotation_bytes(rotations).T]
    columns += [*code_normals(normals, 8).T, marks]
    head: dict[str, Any] = {
        "kind": "splats", "count": count, "low": low.tolist(), "step": step, "bytes": [size for _, size in planes],
        "deviations": deviations, "bases": bases, "harmonics": most, "shine": 0.0, "entries": 0,
        "centre": np.mean([_middle(thing, to_home) for thing, _ in things], 0).tolist(),
        "thickness": max(thing.thickness for thing, _ in things), "axes": np.eye(4).tolist(), "scale": 1,
        "isMixed": not all(is_lit for _, is_lit in things),
    }  # fmt: skip
    stored = b""
    if most:
        shine = max(float(np.quantile(np.abs(harmonics), 1 - BASES)), 1e-6) if count else 1.0
        codes = np.rint(harmonics.reshape(count, -1) * (127 / shine)).clip(-127, 127).astype(np.int64)
        entries, labels = palette_of(codes, is_exact)
        columns += [labels & 255, labels >> 8]
        stored = (entries + 128).astype(np.uint8).tobytes()
        head |= {"shine": shine, "entries": len(entries)}
    body = [data for data, _ in planes] + [code_colors(colors[None], np.ones((1, count), np.bool_)) if count else b""]
    return head, b"".join([*body, *(one.astype(np.uint8).tobytes() for one in columns), stored])


def _moved(thing: PlacedSplats, is_lit: bool, most: int, to_home: NDArray[np.float64]) -> tuple[NDArray[Any], ...]:
    """A cloud's splats in home axes: places, and what they are. most: harmonics of each."""
    cloud, held, way = thing.cloud, thing.held, to_home @ thing.pose
    turn, mark = way[:3, :3], ANTIALIASED * held.antialiased + SURFACE * is_lit
    places = thing.scale * (cloud.positions.astype(np.float64) + cloud.origin) @ turn.T + way[:3, 3]
    normals = splat_normals(cloud.positions, held, cloud.up_direction) @ turn.T
    held = held if np.allclose(turn, np.eye(3), 0, 1e-9) else held.turned(turn)
    shine = np.zeros((len(held), most, 3), np.float32)
    if held.harmonics is not None:
        shine[:, : held.harmonics.shape[1]] = held.harmonics
    own = held.scales * thing.scale, held.rotations, held.opacities, held.base
    normals = np.where(np.any(normals, axis=1, keepdims=True), normals, (0, 0, -1))
    return places, *own, normals, np.full(len(held), mark), shine


def _middle(thing: PlacedSplats, to_home: NDArray[np.float64]) -> NDArray[np.float64]:
    way, corners = to_home @ thing.pose, thing.cloud.main_corners
    return way[:3, 3] + thing.scale * way[:3, :3] @ (corners.mean(0) if len(corners) else np.zeros(3))


def _in_bytes(values: NDArray[np.floating]) -> tuple[list[float], NDArray[np.uint8]]:
    """Numbers in 256 steps: the least, and how far they reach."""
    low, high = (float(values.min()), float(values.max())) if values.size else (0.0, 1.0)
    reach = max(high - low, 1e-6)
    return [low, reach], np.rint((values - low) * (255 / reach)).astype(np.uint8)


def rotation_bytes(turns: NDArray[np.float32]) -> NDArray[np.uint8]:
    """Quaternions (n, 4) in four bytes: which part is largest, and the other three in ten bits each."""
    length = np.linalg.norm(turns, axis=1, keepdims=True)
    units = np.where(length > 0, turns, np.array([0, 0, 0, 1], np.float32)) / np.where(length > 0, length, 1)
    largest = np.abs(units).argmax(1)
    units = units * np.where(np.take_along_axis(units, largest[:, None], 1) < 0, -1, 1)
    rest = units[np.arange(4) != largest[:, None]].reshape(-1, 3)
    codes = np.rint((rest / ROOT_TWO + 0.5) * 1023).clip(0, 1023).astype(np.uint32)
    bits = codes @ np.array([1 << 20, 1 << 10, 1], np.uint32) + (largest.astype(np.uint32) << 30)
    return bits.astype("<u4")[:, None].view(np.uint8)


ENTRIES = (
    "fullscreen.vert", "points/splats.vert", "points/splats.frag", "points/rims.vert", "points/rims.frag",
    "points/known_rims.frag", "points/resolve_surfaces.frag", "shading/light.frag", "surface/hidden_in_plane.frag",
    "surface/mean_hidden.frag", "surface/visibility.frag", "shading/view_visibility.frag", "shading/shadow.frag",
    "surface/hidden_planes.frag", "meshes/mesh.vert", "meshes/mesh.frag", "meshes/mesh_lit.vert",
    "meshes/mesh_lit.frag", "meshes/mesh_shadow.frag", "surface/film_surface.frag",
    "surface/film_colors.frag", "surface/film_change.frag", "output/resolve_samples.frag", "points/view_insides.frag",
    "points/outline_points.frag", "points/kept_points.frag",
)  # fmt: skip
ENTRIES_OF = {  # only where there are such things, as their scripts
    "cloud": (
        "clouds/splat.vert", "clouds/depth.frag", "clouds/front.frag", "clouds/blend.frag", "clouds/resolve.frag",
        "clouds/ball.frag",
    ),
    "set": (
        "points/set_splats.frag", "points/set_accumulate.frag", "points/set_resolve.frag", "points/set_shadow.frag",
        "points/few_splats.vert", "points/few_splats.frag",
    ),
    "splats": (
        "splats/packed.vert", "splats/splat.frag", "splats/depth.frag", "splats/surface.frag", "splats/merge.frag",
        "splats/compose.frag", "splats/shadow.frag",
    ),
}  # fmt: skip
PRECISION = "".join(f"precision highp {kind};\n" for kind in ("float", "int", "sampler2D", "isampler2D"))
_COMMENT = re.compile(r"[ \t]*//[^\n]*")


def shader_texts(kinds: Iterable[str] = ()) -> dict[str, str]:
    """The text of each shader by its name. `#version 300 es` and constants go before it. kinds: of things"""
    names = ENTRIES + sum((ENTRIES_OF.get(kind, ()) for kind in kinds), ())
    return {name: as_es(splice(name)[0]) for name in names}


def as_es(text: str) -> str:
    """A shader without its first line, its comments and empty lines, with the precision that GLSL ES asks for."""
    body = _COMMENT.sub("", text.split("\n", 1)[1])
    return PRECISION + re.sub(r"\n+", "\n", body)


FOLDER = Path(__file__).resolve().parent
SCRIPTS = (
    "state.js", "decode.js", "programs.js", "lights.js", "shadows.js", "samples.js", "upload.js", "paint.js",
    "around.js", "outlines.js", "draw.js", "film.js", "player.js", "pointers.js", "lamp_box.js",
    "command.js", "controls.js",
)  # fmt: skip
SCRIPTS_OF = {"cloud": "clouds.js", "set": "sets.js", "splats": "splats.js"}
STILL = 85  # quality of the still's WebP


def filled(
    title: str, still: NDArray[np.uint8], data: dict[str, Any], body: bytes, frames: Sequence[bytes] = ()
) -> str:
    """The template with its places filled, which look like {{title}}. A note names each thing that the page leaves out.

    body    of all things
    frames  of a film: each frame's, which the page decodes when it comes to it
    """
    for sentence in data["leftOut"]:
        print_note(f"in the page {sentence}")
    kinds = sorted({head["kind"] for head in data["things"]})
    scripts = *SCRIPTS[:-1], *(SCRIPTS_OF[kind] for kind in kinds if kind in SCRIPTS_OF), SCRIPTS[-1]  # the last begins
    places = {
        "title": html.escape(printable(title.encode("utf-8", "backslashreplace").decode())),  # it may be no text
        "still": f"data:image/webp;base64,{_base64(encoded(still, 'WEBP', quality=STILL))}",
        # no HTML parser takes it for the end of its script
        "data": json.dumps(data, allow_nan=False, separators=(",", ":")).replace("<", "\\u003c"),
        "shaders": _base64(pack(json.dumps(shader_texts(kinds)).encode())),
        "parts": _base64(pack(body)),
        "frames": "\n".join(f'<script type="text/plain" class="frame">{_base64(one)}</script>' for one in frames),
        "script": "\n".join((FOLDER / name).read_text(encoding="utf-8") for name in scripts),
        "workers": " worker-src blob:;" if "splats" in kinds else "",
    }
    text = (FOLDER / "page.html").read_text(encoding="utf-8")
    return re.sub(r"{{(.*?)}}", lambda place: places[place[1]], text, flags=re.DOTALL)


def _base64(data: bytes) -> str:
    return base64.b64encode(data).decode()
