"""Pages in which the frames of a sequence play, and how these become few bytes. film.js reads them."""

from __future__ import annotations

import io
from collections.abc import Callable, Sequence
from dataclasses import replace
from os import PathLike
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..checks.arguments import Count, check_fps, is_a
from ..files.frame_sources import open_source
from ..gpu.points.point_objects import ShownPoints
from ..notes.notes import print_note
from ..notes.words import option, shown
from ..pipeline.light_setup import roughness_of
from ..renderer.renderer import Renderer
from ..renderer.requests import RenderRequest
from ..renderer.series import sequence_jobs
from ..scene.camera import Camera
from ..scene.frame import Frame
from ..scene.viewpoint import View
from .page_contents import Showing, arranged, look_of, reduced
from .page_surfaces import MISSING, PageSurface, surfaces_of
from .parts import Part, QualityName, code_depth, code_errors, code_normals, code_plane, encoded, filled, pack, repeated

KEY_EVERY = 12  # frames: so many are decoded at most when the slider jumps
DEPTH_STEPS = 2e-5, 2e-3  # of depth: least and most, shares of it
STEP_OF_NOISE = 1 / 3  # of the noise, is one step
STAYING_DEPTH = 1  # by so many a depth may change and stay what it was
STAYING_COLOR = 4  # of 255: by so much a colour
MAX_BYTES = 300_000 / (640 * 480)  # of a page for each pixel of a frame: else pictures are coded less exactly
QUALITY_STEPS = 4, 5  # by which the qualities of normals and colours are lowered then
MIN_COLOR_QUALITY = 40
MIDDLE = 128  # of 255: no difference
LUMA = np.array([[0.299, 0.587, 0.114], [-0.168736, -0.331264, 0.5], [0.5, -0.418688, -0.081312]])  # JFIF

Planes = NDArray[np.uint8]


class FilmQuality(NamedTuple):
    """Qualities of WebP pictures, of 100."""

    normals: int
    colors: int


FILM_QUALITIES = {"exact": FilmQuality(95, 85), "small": FilmQuality(88, 75)}


class Kept(NamedTuple):
    """What the page has of the last frame, as it has decoded it."""

    codes: NDArray[np.int64]  # of depth, where it is not known as before it
    kinds: NDArray[np.uint8]
    normals: Planes
    colors: Planes


class FilmCoder:
    """Codes one frame after another.

    noise  of the depth, as a share of it; 0 if none was found
    """

    def __init__(self, quality: FilmQuality, noise: float, nearest: float):
        self._quality, self._nearest = quality, nearest
        self.step = float(np.clip(STEP_OF_NOISE * noise, *DEPTH_STEPS))
        self._kept: Kept | None = None
        self._since_key = 0

    def code(self, surface: PageSurface) -> tuple[dict[str, Any], bytes]:
        """The frame's description, and its bytes, packed. If they are too many it and later ones are coded less
        exactly."""
        while True:
            head, body, kept = self._coded(surface)
            packed = pack(body)
            if len(packed) * 4 / 3 <= MAX_BYTES * surface.depth.size or self._quality.colors <= MIN_COLOR_QUALITY:
                break
            pairs = zip(self._quality, QUALITY_STEPS, strict=True)
            self._quality = FilmQuality(*(quality - by for quality, by in pairs))
        self._kept, self._since_key = kept, self._since_key + 1 if any(head["changes"]) else 0
        return head, packed

    def _coded(self, surface: PageSurface) -> tuple[dict[str, Any], bytes, Kept]:
        """The frame's description, its bytes, and what the page will have of it."""
        kept = self._kept if self._since_key < KEY_EVERY - 1 else None
        kinds, certainty = surface.kinds, surface.certainty_codes
        known = kinds != MISSING
        codes = np.zeros(kinds.shape, np.int64)
        codes[known], _ = code_depth(np.abs(surface.depth[known]), self.step, self._nearest)
        kind_part, is_kind_change = _fewer(kinds.tobytes(), kept and (kinds ^ kept.kinds).tobytes())
        codes, depth_part, size, is_depth_change = _coded_depth(codes, known, kept)
        lit = surface.normals if surface.light_normals is None else surface.light_normals
        normals, normal_part, is_normal_change = _coded_picture(
            normal_planes(lit, known), kept and kept.normals, self._quality.normals, 0
        )
        colors, color_part, is_color_change = _coded_picture(
            color_planes(surface.colors, known), kept and kept.colors, self._quality.colors, STAYING_COLOR
        )
        head = {
            "count": int(known.sum()),
            "changes": [is_kind_change, is_depth_change, is_normal_change, is_color_change],
            "depthBytes": size, "normalBytes": len(normal_part), "colorBytes": len(color_part),
            "certainty": None if certainty is None else list(certainty.shape[::-1]),
            "source": list(surface.intrinsics),
        }  # fmt: skip
        body = [kind_part, depth_part, normal_part, color_part]
        body += [] if certainty is None else [certainty.tobytes()]
        return head, b"".join(body), Kept(codes, kinds, normals, colors)


def normal_planes(normals: NDArray[np.floating], known: NDArray[np.bool_]) -> Planes:
    """(2h, w): the places of unit normals on an octahedron, one coordinate below the other."""
    places = np.zeros((2, *known.shape), np.int64)
    places[:, known] = code_normals(normals[known], 8).T
    return np.concatenate([repeated(places[k], known) for k in (0, 1)]).astype(np.uint8)


def color_planes(colors: NDArray[np.uint8], known: NDArray[np.bool_]) -> Planes:
    """(3h, w): luma and two chromas, one below the other; of the frame's size, what no point shows repeats others."""
    planes = np.einsum("kc,hwc->khw", LUMA, colors.astype(np.float64)) + np.array([0, 128, 128])[:, None, None]
    whole = np.rint(planes).clip(0, 255).astype(np.int64)
    filled = [repeated(plane, known) for plane in whole] if colors.shape[:2] == known.shape else whole
    return np.concatenate(list(filled)).astype(np.uint8)


def _coded_depth(
    codes: NDArray[np.int64], known: NDArray[np.bool_], kept: Kept | None
) -> tuple[NDArray[np.int64], bytes, int, bool]:
    """What the page will have, the bytes, how many each code takes, and whether they are differences."""
    key, key_size = code_plane(codes, known)
    plane = repeated(codes, known)
    if kept is None:
        return plane, key, key_size, False
    change = codes - kept.codes
    change[np.abs(change) <= STAYING_DEPTH] = 0
    changed, size = code_errors(change[known])
    if len(pack(changed)) >= len(pack(key)):
        return plane, key, key_size, False
    return np.where(known, kept.codes + change, kept.codes), changed, size, True


def _coded_picture(planes: Planes, kept: Planes | None, quality: int, stays: int) -> tuple[Planes, bytes, bool]:
    """What the page will have, the bytes, and whether they are differences."""
    key, decoded = _webp(planes, quality)
    if kept is None or kept.shape != planes.shape:
        return decoded, key, False
    change = planes.astype(np.int64) - kept
    change[np.abs(change) <= stays] = 0
    changed, decoded_change = _webp((change.clip(-MIDDLE, 255 - MIDDLE) + MIDDLE).astype(np.uint8), quality)
    summed = (kept.astype(np.int64) + decoded_change - MIDDLE).clip(0, 255).astype(np.uint8)
    errors = [np.square(planes - one.astype(np.float64)).mean() for one in (summed, decoded)]
    if len(changed) >= len(key) or errors[0] > max(2 * errors[1], stays**2):
        return decoded, key, False
    return summed, changed, True


def _fewer(key: bytes, change: bytes | None) -> tuple[bytes, bool]:
    """Those that pack better, and whether they are the second."""
    is_change = change is not None and len(pack(change)) < len(pack(key))
    return (change or key, True) if is_change else (key, False)


def _webp(planes: Planes, quality: int) -> tuple[bytes, Planes]:
    """A grey picture, and how browsers decode it."""
    from PIL import Image

    data = encoded(planes, "WEBP", quality=quality, method=4)
    return data, np.asarray(Image.open(io.BytesIO(data)).convert("RGB"))[..., 1]


MAX_FRAMES = 300  # that a page takes unless more are asked for


def frames_of(source: Any, count: int | None = None) -> Sequence[Frame]:
    """Return the frames that play: of a path those of its sequence. count: only so many.

    Raises TypeError or ValueError for what has no frames to play, and what `open_source` raises.
    """
    if is_a(source, str, PathLike):
        source = open_source(source)
    if isinstance(source, Frame):
        raise ValueError(f"a single frame does not play: leave out {option('fps')}")
    if not is_a(source, Sequence):
        raise TypeError(f"what plays must be a sequence of frames, got {shown(source)}")
    if count is None and len(source) > MAX_FRAMES:
        more = f"the page has the first {MAX_FRAMES} of {len(source)} frames; {option('frames', 'N')} takes N"
        print_note(more)
    return source[: count or MAX_FRAMES]


def draw_film(
    renderer: Renderer, frames: Sequence[Frame], view: View, fps: float, *, camera: Camera | None = None,
    quality: QualityName, largest: int, title: str, count: Count,
    skipped: Callable[[str], None] = lambda text: print_note(f"skipped {text}"),
) -> str:  # fmt: skip
    """The text of a page in which frames play, `fps` a second, again and again.

    They are seen as in a film of `view`: each from its own camera, all in the exposure of the first.

    camera  who looks; None: that of the view, or of the frames
    """
    fps, count.all = check_fps(fps, option("fps"), "frames"), len(frames) + 1
    film, bodies = _Film(renderer, FILM_QUALITIES[quality], count), []
    for _, request in sequence_jobs(frames, view, skipped, renderer):
        smaller = reduced(request, largest, largest**2)
        bodies.append(film.add(replace(smaller, camera=camera or request.camera)))
    if film.first is None:
        raise ValueError("the page has nothing to show: no frame could be read")
    data: dict[str, Any] = film.values | {"film": {"fps": fps, "frames": film.heads}}
    return filled(title, film.still, data, b"", bodies)


class _Film:
    """What the page of a film is filled with, frame by frame.

    first  what the page shows first, once there is something; then there are its `still` and its `values`, too
    heads  of the frames
    """

    def __init__(self, renderer: Renderer, quality: FilmQuality, count: Count):
        self._renderer, self._quality, self._count = renderer, quality, count
        self._coder: FilmCoder | None = None
        self.first: Showing | None = None
        self.heads: list[dict[str, Any]] = []

    def add(self, request: RenderRequest) -> bytes:
        """The packed bytes of the next frame."""
        showing = arranged(request)
        if self.first is None:
            self.still = self._renderer.render(request)
            self._count.step()
            renderer = self._renderer
            showing = replace(showing, environment_light=renderer.surroundings, fill=renderer.fill)
            self.first, self.values = showing, showing.values() | {"exposure": 2.0**renderer.exposure}
        head, body = self._part(showing, self.first)
        self.heads.append(head)
        self._count.step()
        return body

    def _part(self, showing: Showing, first: Showing) -> Part:
        home = np.linalg.inv(first.home)
        with self._renderer.prepared(showing.scene, showing.camera, showing.home) as things:
            ((placed, thing),) = things.items()
            (surface,) = surfaces_of(thing, is_cut=False)
            roughness = roughness_of(things)
            noise = thing.textures.choice.noise if isinstance(thing, ShownPoints) else None
        if self._coder is None:
            known = surface.depth[surface.depth != 0]
            nearest = float(np.abs(known).min()) if known.size else 1.0
            self._coder = FilmCoder(self._quality, noise.relative if noise else 0.0, nearest)
            more = {"lobe": first.lobe_of(placed), "depthStep": self._coder.step, "nearest": nearest}
            self._thing = _thing_of(surface) | look_of(placed, showing) | more
            self.values["things"] = [self._thing]
        size = surface.depth.shape[::-1]
        if size != (self._thing["width"], self._thing["height"]):
            raise ValueError(
                f"the frames of a page have one size: frame {len(self.heads)} has {size[0]}x{size[1]} pixels, the "
                f"first {self._thing['width']}x{self._thing['height']}"
            )
        head, body = self._coder.code(surface)
        seen_from_first = replace(showing, home=first.home, roughness=roughness)
        return head | {
            "axes": (home @ surface.axes).tolist(),
            "way": (home @ showing.home).tolist(),
            "middle": placed.content.frame.scale,
            "bounds": seen_from_first.bounds,
            "distance": seen_from_first.distance,
        }, body


def _thing_of(surface: PageSurface) -> dict[str, Any]:
    """What all frames of a film have in common."""
    height, width = surface.depth.shape
    if surface.sizes.size > 1:
        raise ValueError(f"sizes of each point are of one frame, here many play: leave out {option('point_size')}")
    return {
        "kind": "points", "isFilm": True, "width": width, "height": height,
        "color": {"width": surface.colors.shape[1], "height": surface.colors.shape[0]},
        "size": float(surface.sizes[0]), "hasRims": surface.has_rims, "isRound": surface.is_round,
        "stride": surface.stride, "scale": surface.scale,
    }  # fmt: skip
