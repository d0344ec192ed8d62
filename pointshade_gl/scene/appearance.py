"""How a point object looks: its material, and how its normals, splats, their sizes and shading are made.

Plain frozen values.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import Any, Literal, TypedDict, get_args, get_origin, get_type_hints

import numpy as np
from numpy.typing import NDArray

from ..checks.arguments import LARGEST, as_array, check_choice, check_flag, check_float, check_number, check_type
from ..checks.foreign_arrays import Numbers, UnreadableError, as_numpy
from ..notes.words import option, shown
from .noise import (
    METHODS,
    SENSORS,
    Method,
    Step,
    check_method,
    check_noise,
    check_noise_text,
    check_normals,
    parse_max_depth_step,
    parse_noise,
)
from .option_fields import CAMERA, LIGHT, SETS, SHADING, SURFACE, Cli, keys_of, number_or_text, opt, option_class
from .values import Options, frozen

UNITS = "px", "x", "m"  # of a cloud's sizes that are texts; metres are world units
ONE = frozen(np.ones(1, np.float32))  # source pixel
_OF_CLOUD = "the radius of a point cloud's points, a number of world units, '3px' or '2x' (times their spacing)"


def check_sizes(size: float | Numbers | str | None, shape: tuple[int, ...]) -> NDArray[np.float32]:
    """Splat sizes in source pixels as (1,) or (h*w,) float32; None and "fill" are 1.

    Raises ValueError for an impossible size.
    """
    if size is None or isinstance(size, str):
        return ONE  # the same for every picture
    name = option("point_size")
    complaint = f"{name} is the splats' size in source pixels, one number or an array of {shape}"
    sizes = np.atleast_1d(as_array(size, complaint, np.float32))
    if sizes.shape not in ((1,), shape):
        raise ValueError(f"{complaint}, got {sizes.shape}")
    if not ((sizes >= 0) & (sizes <= LARGEST)).all():
        raise ValueError(f"{name} must be finite and not negative everywhere")
    return sizes.ravel()


def check_look_size(size: Any) -> Any:
    """Return the size of a look, a single number as a float. Raises ValueError for one that cannot be drawn."""
    name = option("point_size")
    if isinstance(size, str):
        if size != "fill" and not _is_cloud_size(size):
            others = "a point cloud takes '3px' and '2x' (times the spacing), too"
            raise ValueError(f"{name} must be a number of source pixels, or 'fill', got {shown(size)}: {others}")
    elif size is not None and is_single(size):
        size = check_float(size, f"{name} must be a number of source pixels, 0 or above", 0)
    return size


def check_cloud_size(size: Any) -> Any:
    """Return the size of a cloud's points. Raises ValueError or TypeError for one that is none."""
    name = option("point_size")
    if isinstance(size, str) and not _is_cloud_size(size):
        raise ValueError(f"{name} must be {_OF_CLOUD}, got {shown(size)}")
    return size if size is None or isinstance(size, str) else check_number(size, name, 0)


def parse_cloud_size(size: float | str) -> tuple[float, str]:
    """Return a size as a number and its unit: "" world units, "px" pixels, "x" spacings."""
    if not isinstance(size, str):
        return size, ""
    text = size.strip().lower()
    unit = next((one for one in UNITS if text.endswith(one)), "")
    return float(text.removesuffix(unit)), unit.replace("m", "")


def is_single(value: Any) -> bool:
    """Return whether a value is no array."""
    if type(value) in (int, float) or isinstance(value, list | tuple):
        return not isinstance(value, list | tuple)
    try:
        return not as_numpy(value).ndim
    except UnreadableError:  # `as_array` says why
        return False


def _is_cloud_size(text: str) -> bool:
    try:
        number, _ = parse_cloud_size(text)
    except ValueError:
        return False
    return 0 <= number <= LARGEST


Shading = Literal["none", "flat", "gouraud", "phong", "edl"]
Splat = Literal["footprint", "round", "mesh", "disc", "ball", "gaussian"]
Upsampling = Literal["vote", "none"]
NormalsAt = Literal["source", "target"]
Flying = Literal["keep", "snap"]
Missing = Literal["keep", "complete", "photo"]
SHADINGS: tuple[Shading, ...] = get_args(Shading)
SPLATS: tuple[Splat, ...] = get_args(Splat)
FRAME_SPLATS, CLOUD_SPLATS = SPLATS[:3], SPLATS[3:]
UPSAMPLINGS: tuple[Upsampling, ...] = get_args(Upsampling)
NORMALS_AT: tuple[NormalsAt, ...] = get_args(NormalsAt)
FLYING: tuple[Flying, ...] = get_args(Flying)
MISSING: tuple[Missing, ...] = get_args(Missing)
LIT_EARLY = ("flat", "gouraud")  # of the shadings: light points or corners, and mix that light
Strengths = tuple[float, float, float, float]  # ambient, diffuse, specular, shininess
NOT_LIT = ("none", "edl", "auto")  # of the shadings: show the objects' own colours; "auto" until light is asked for


@option_class
@dataclass(frozen=True)
class Material:
    """How the surface answers light (Phong 1975): strengths of the three terms and the highlight's exponent.

    Where "auto" or "adaptive" finds noise that neighbouring depths share, normals are uncertain: highlights are wider
    and dimmer there (Toksvig 2005). Not so where the noise is given, of the triangles of a mesh with flat shading, and
    of normals that are estimated in the view (normals_at).
    """

    ambient: float = opt(0.1, "strength of the ambient light", cli=Cli(SHADING, "N"))
    diffuse: float = opt(0.9, "strength of the diffuse reflection", cli=Cli(SHADING, "N"))
    specular: float = opt(0.3, "strength of the highlight; by default 0 with a `fill`", cli=Cli(SHADING, "N"))
    shininess: float = opt(32.0, "exponent of the highlight", cli=Cli(SHADING, "N"))

    def __post_init__(self) -> None:
        for name in ("ambient", "diffuse", "specular"):
            strength = check_number(getattr(self, name), option(name, of="material"), 0)
            object.__setattr__(self, name, strength)
        shininess = check_number(self.shininess, option("shininess", of="material"), 0.001, 10_000)
        object.__setattr__(self, "shininess", shininess)

    @property
    def strengths(self) -> Strengths:
        """(ambient, diffuse, specular, shininess), as the shaders take them."""
        return self.ambient, self.diffuse, self.specular, self.shininess


def strengths_in(material: Material, fill: float) -> Strengths:
    """Return the strengths of a material where so much of a photograph's own light is mixed in.

    A photograph has highlights of its own, and others, on noise, are the stains that are seen most: a material that
    nobody chose has none.
    """
    specular = 0.0 if fill and material == Material() else material.specular
    return material.ambient, material.diffuse, specular, material.shininess


@option_class
@dataclass(frozen=True, eq=False)
class Appearance(Options):
    """All choices about how one point object is drawn, except its place and the light.

    Arrays are copied, and read-only. Those of the same choices are equal, also with arrays.

    Raises
    ------
    ValueError, TypeError
        for unknown names, for impossible numbers, and for values of another kind. The shape of arrays is checked by
        `for_frame`.
    """

    material: Material = opt(Material(), "how the surface answers light; None is the default Material")
    normals: Method | Numbers = opt(
        "auto",
        "a method (see `Renderer.estimate_normals`), or (h, w, 3) floats in the frame's camera axes",
        f"How normals are estimated: {', '.join(METHODS)}.",
        Cli(SURFACE, "METHOD", METHODS),
    )
    shading: Shading = opt(
        "phong",
        'how surfaces are lit: "none" shows their own colours, "edl" (eye-dome lighting) darkens them beside what is '
        "nearer, without light or normals",
        f"How surfaces are lit: {', '.join(SHADINGS)} (eye-dome lighting: dark beside what is nearer, no light).",
        Cli(SHADING, "MODEL", SHADINGS),
    )
    point_size: float | Numbers | str | None = opt(
        None,
        "splat size in source pixels: a number, or (h, w); 1 = the point's own pixel, 0 hides it; None is 1. "
        '"fill" is 1, with missing="complete". Of a point cloud the radius, see `PointCloud`.',
        "Size of the points in pixels of the frame, or fill: 1, with --missing complete. Default: 1. Of a point cloud "
        "their radius: metres, '3px', or '2x' times the spacing.",
        Cli(SHADING, "N|fill", ("fill",), read=number_or_text),
    )
    splat: Splat = opt(
        "footprint",
        '"footprint" carries the pixel\'s square into the view; where a surface ends, footprints of size 1 bend '
        'with it and end at its outline. "round" carries the circle round the square. "mesh" draws the triangles '
        "between neighbouring pixels instead, which have no size. The mesh reaches to the outer edge of the last "
        "pixels of a surface. A surface ends where max_depth_step says, or without it where neither of two "
        'neighbours lies on the other\'s tangent plane, to 2 % of 1/z. "disc" and "ball" are of point clouds, '
        '"gaussian" of trained splats.',
        f"What is drawn of each point: {', '.join(FRAME_SPLATS)} (triangles between pixels); of a point cloud "
        f"{', '.join(CLOUD_SPLATS)}.",
        Cli(SHADING, "SHAPE", SPLATS),
    )
    max_depth_step: float | str | None = opt(
        None,
        'for triangles: a neighbour further in depth belongs to another surface. Metres, or "3%" of the pixel\'s '
        "depth; None is no limit. The other methods find edges by themselves.",
        "A larger depth step ends a surface: metres, or '3%'.",
        Cli(SURFACE, "M"),
    )
    noise: float | Numbers | str | None = opt(
        None,
        "for auto and adaptive: standard deviation of the depth in metres, a number or (h, w), or a sensor's name "
        '("kinect"); or what `describe` and --explain print, such as "1.5mm,shared=2,steps=1mm"; None measures it',
        f"Noise of the depth: metres, what --explain prints, or {', '.join(SENSORS)}. Default: measured.",
        Cli(SURFACE, "M|SENSOR", tuple(SENSORS), read=number_or_text),
    )
    upsample: Upsampling = opt(
        "vote",
        'where the colours are larger than the depth: "vote" brings the depth to their size, and lets them decide '
        'where surfaces end; "none" draws the depth\'s own points. Points of another size than 1 are never enlarged.',
        "Where color is larger than depth: vote (bring depth to its size) or none.",
        Cli(CAMERA, "METHOD", UPSAMPLINGS),
    )
    normals_at: NormalsAt = opt(
        "source",
        'of several frames of one thing: "source" estimates normals in each frame and mixes them in the view; "target" '
        "estimates them in the view, on the depth that the frames give together, in every new view. Only phong shading "
        "shows the difference, and of a single frame there is none.",
        "Of --views, normals are estimated in each view (source) or in the picture (target).",
        Cli(SETS, "PLACE", NORMALS_AT),
    )
    align: bool = opt(
        False,
        "True corrects the poses of several frames of one thing before they are drawn, so that depths and colours "
        "agree; the first keeps its own, and so does the camera that looks: a camera pose that belongs to the given "
        "poses of other frames is no longer exact, see `align_frames`. What nothing fixes stays as given, with a note. "
        "It takes some seconds, once; frames of streams (see `Frame.source`) whose cameras stand still share it.",
        "Correct the poses of several frames of one thing, so that they agree; the first keeps its own.",
        Cli(SETS),
    )
    flying: Flying = opt(
        "keep",
        'pixels that hang between two surfaces because the sensor mixed them: "keep" draws them there, "snap" '
        'puts them onto the nearer of the two (Sabov, Krueger 2008). Only "auto" and "adaptive" look for them, in'
        " noisy depth; clean depth does not change.",
        "Pixels that hang between two surfaces: keep, or snap (put them onto the nearer one).",
        Cli(SURFACE, "METHOD", FLYING),
    )
    missing: Missing = opt(
        "keep",
        'pixels that have a colour and no depth: "keep" leaves them empty; "complete" gives them the surface that the '
        "planes around them continue in: a vote of colours, of distance, and of what the sensor would have seen beside "
        "near objects. What is open to the picture's border and unlike all colours around stays empty, as sky does, "
        'and so does what lies round an object that was cut out. "photo" shows the photograph there, in ambient light '
        "only, as long as the frame's own camera sees it. Of several frames of one thing, completed points are "
        "seen only where no frame has measured one. Frames of more than 33 million points are not completed.",
        "Pixels without depth: keep (leave them empty), complete (continue the surfaces around), or photo (complete, "
        "and show the photograph elsewhere).",
        Cli(SURFACE, "METHOD", MISSING),
    )
    temporal: bool = opt(
        False,
        "True averages the depth and the normals of a stream over time: of the frames that are drawn one after "
        "another at the same place among a scene's point objects. Each pixel rests on up to 16 frames, as far as "
        "they agree within the measured noise; poses tell how the camera has moved. What moves or has just "
        "appeared is drawn as without it, and so is the first frame: a single picture does not change. The stream"
        " begins anew where the size or the camera's intrinsics change, and where the same frame is estimated "
        'again, otherwise. Only "auto" and "adaptive" filter, in noisy depth. It takes 64 bytes a pixel on the '
        "GPU, of several streams 40 for each more.",
        "Filter noisy depth of a sequence over time: less flicker.",
        Cli(SURFACE),
    )
    unlight: bool = opt(
        False,
        "True estimates the light in the picture, one direction and ambient light, and divides it out of the colours, "
        "so that surfaces are not shaded twice. What lies in shadow gets the brightness of lit surfaces of its hue. "
        "The less the picture tells its light, the less is changed. Frames of a stream share their light.",
        "Divide the light in the picture out of its colours, as far as the picture tells it.",
        Cli(LIGHT),
    )
    remove_highlights: bool = opt(
        False,
        "True takes highlights out of the colours of several frames of one object. A highlight moves when the eye "
        "does: where a frame is brighter than most others that see the same points, by more than noise, it gets their "
        "colours. It needs three views or more; a single frame keeps its colours.",
        "Take the highlights out of the colours of three or more views of one object.",
        Cli(SETS),
    )

    def __post_init__(self) -> None:
        check_type(self.material, Material, "material")
        for name, known in VOCABULARIES.items():
            check_choice(option(name), getattr(self, name), known)
        for name in SWITCHES:
            object.__setattr__(self, name, check_flag(getattr(self, name), option(name)))
        if isinstance(self.normals, str):
            check_method(self.normals)
        elif is_single(self.normals):
            raise TypeError(f"normals must be a method's name or have shape (h, w, 3), got {shown(self.normals)}")
        object.__setattr__(self, "point_size", check_look_size(self.point_size))
        is_plain_size = self.point_size is None or (is_single(self.point_size) and self.point_size in (1, "fill"))
        if self.splat == "mesh" and not is_plain_size:
            others = option("splat", *FRAME_SPLATS[:-1])
            raise ValueError(
                f"{option('point_size')} is that of splats, and a mesh has none: leave it out, or use {others}"
            )
        if isinstance(self.noise, str):
            check_noise_text(self.noise)
        elif self.noise is not None and is_single(self.noise):
            object.__setattr__(self, "noise", check_noise(self.noise))
        metres, _ = parse_max_depth_step(self.max_depth_step)
        if not isinstance(self.max_depth_step, str | None):
            object.__setattr__(self, "max_depth_step", metres)
        for name, complaint in _ARRAYS.items():
            value = getattr(self, name)
            if not isinstance(value, str | float | None):
                object.__setattr__(self, name, frozen(as_array(value, complaint, np.float32)))

    def for_frame(self, depth: NDArray[np.float32]) -> Appearance:
        """Return the look with its arrays checked against a depth picture.

        Parameters
        ----------
        depth : (h, w) float32
            Metres; 0 where it is unknown.

        Raises
        ------
        ValueError
            For arrays of another shape, and for sizes or noise that make no sense.
        """
        changes: dict[str, Any] = {}
        if self.splat in CLOUD_SPLATS:
            raise ValueError(
                f"{option('splat', self.splat)} is of point clouds: a frame takes {', '.join(FRAME_SPLATS)}"
            )
        if isinstance(self.point_size, str) and not self.fills:
            raise ValueError(
                f"{option('point_size', self.point_size)} is of point clouds: a frame takes a number of source pixels"
            )
        if not isinstance(self.normals, str):
            changes["normals"] = check_normals(self.normals, depth.shape)
        sizes = self.sizes_for(depth)
        if sizes.size > 1:
            changes["point_size"] = sizes.reshape(depth.shape)
        if self.noise is not None and not isinstance(self.noise, str):
            noise = parse_noise(self.noise, depth)
            if not is_single(self.noise):
                changes["noise"] = noise
        return replace(self, **changes) if changes else self

    def sizes_for(self, depth: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return the splats' sizes in source pixels: (1,) or (h * w,).

        Parameters
        ----------
        depth : (h, w) float32
            The depth picture that they belong to.
        """
        return check_sizes(self.point_size, depth.shape)

    @property
    def has_own_sizes(self) -> bool:
        """Some points have another size than 1."""
        return not (self.point_size is None or self.fills or np.all(np.asarray(self.point_size) == 1))

    @cached_property
    def is_uniform(self) -> bool:
        """No option is an array; each holds for every pixel."""
        return all(isinstance(value, str | int | float | None) for value in (self.normals, self.point_size, self.noise))

    @property
    def fills(self) -> bool:
        """The points have size 1, and no gaps between them."""
        return isinstance(self.point_size, str) and self.point_size == "fill"

    @property
    def completes(self) -> bool:
        """Surfaces are completed where depth is missing."""
        return self.missing != "keep" or self.fills

    @property
    def depth_step(self) -> Step | None:
        """(metres, share of the depth) by which neighbours of one surface may differ; None; their planes tell."""
        return None if self.max_depth_step is None else parse_max_depth_step(self.max_depth_step)

    @property
    def farthest_reach(self) -> float:
        """Source pixels that the largest splat reaches from its middle."""
        size = (
            1.0
            if self.point_size is None or isinstance(self.point_size, str)
            else float(np.max(np.asarray(self.point_size)))
        )
        return size * (0.5**0.5 if self.splat == "round" else 0.5)

    @property
    def options(self) -> dict[str, Any]:
        """By name, as arguments of `Renderer.render`."""
        return {one.name: getattr(self, one.name) for one in fields(self)}

    @property
    def is_plain(self) -> bool:
        """The frame's own camera sees its photograph, to the bit."""
        has_own_colors = self.shading == "none" and not self.unlight and not self.remove_highlights
        return has_own_colors and self.splat == "footprint" and self.is_uniform and self.point_size in (None, 1)

    @property
    def alone(self) -> Appearance:
        """The look of a single picture; nothing is filtered over time."""
        return replace(self, temporal=False)

    @property
    def finds_light(self) -> bool:
        """The light in the photograph is found before it is drawn, which takes long."""
        return self.unlight

    @property
    def as_taken(self) -> Appearance:
        """The look without light, in the photograph's own colours."""
        return replace(self, shading="none", unlight=False, remove_highlights=False)

    @property
    def of_points(self) -> Appearance:
        """The look of single points, each lit once; what only splats show has its default."""
        material = UNLIT if self.shading in NOT_LIT else self.material
        names = "normals", "align", *keys_of(SurfaceOptions), *keys_of(ColorOptions)
        kept = {name: getattr(self, name) for name in names}
        return Appearance(material, shading="flat", upsample="none", **kept)


class SurfaceOptions(TypedDict, total=False):
    """The options of an Appearance about the surface that is found in the depth."""

    max_depth_step: float | str | None
    noise: float | Numbers | str | None
    flying: Flying
    missing: Missing
    temporal: bool


class FormOptions(TypedDict, total=False):
    """The options of an Appearance about what is drawn of each point."""

    splat: Splat
    upsample: Upsampling
    align: bool


class ColorOptions(TypedDict, total=False):
    """The options of an Appearance about the colours in the picture."""

    unlight: bool
    remove_highlights: bool


class NamedOptions(FormOptions, SurfaceOptions, ColorOptions, total=False):
    """The options of an Appearance that functions take by name only."""

    normals_at: NormalsAt


class AppearanceOptions(NamedOptions, total=False):
    """The options of an Appearance, except its material."""

    normals: Method | Numbers
    shading: Shading
    point_size: float | Numbers | str | None


VOCABULARIES: dict[str, tuple[str, ...]] = {
    name: get_args(kind) for name, kind in get_type_hints(AppearanceOptions).items() if get_origin(kind) is Literal
}
SWITCHES = tuple(one.name for one in fields(Appearance) if one.default is False)
_ARRAYS = {
    "normals": "normals must be a method's name or have shape (h, w, 3)",
    "point_size": "point_size is the splats' size in source pixels, one number or an array of (h, w)",
    "noise": "noise must be one number or have the depth's shape (h, w)",
}
UNLIT = Material(ambient=1, diffuse=0, specular=0)  # shows a point's own colour


def shader_model(shading: str) -> int:
    """Return the number of a shading model in shaders; eye-dome lighting begins with an object's own colours."""
    return SHADINGS.index("none" if shading == "edl" else shading)  # pyright: ignore
