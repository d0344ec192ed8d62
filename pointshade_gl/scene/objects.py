"""What nodes hold: triangle meshes, and frames of one object drawn as splats, as immutable values."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..checks.arguments import as_given, check_choice, check_color, check_type, is_a, items_of
from ..checks.foreign_arrays import Numbers, way_to
from ..notes.words import counted, option, shown
from .appearance import FRAME_SPLATS, SHADINGS, Appearance, AppearanceOptions, Material, Shading
from .cloud import UPS, PointCloud, Up, direction_of
from .frame import Frame
from .values import DrawnValue, box_corners, floats_of, frozen, median

if TYPE_CHECKING:
    from typing_extensions import Unpack


@dataclass(frozen=True, eq=False)
class Mesh(DrawnValue):
    """A triangle mesh with normals, texture and material.

    Parameters
    ----------
    positions : (n, 3) float
        Vertices, node axes.
    faces : (m, 3) int
        Vertices of each triangle, counter-clockwise seen from the front; both sides are drawn.
    normals : (n, 3) float, optional
        One for each vertex; None gives every triangle its own (flat facets).
    uv : (n, 2) float, optional
        Texture coordinates, needed with a texture; (0, 0) is the texture's upper left corner, as in glTF.
    color : (3,) float
        Linear RGB, multiplied with the texture.
    texture : (h, w, 3|4) uint8, optional
        sRGB; None is white.
    material : Material
        How the surface answers light.
    shading : {"phong", "gouraud", "flat", "none", "edl"}
        Light for each pixel, for each vertex, for each triangle, or none; "edl" (eye-dome lighting) is none, and darker
        beside what is nearer.
    colors : (n, 3) uint8, optional
        sRGB of each position, multiplied with the colour and the texture; None is white.
    up : {"x", "y", "z", "-x", "-y", "-z"}, optional
        Which axis points up, node axes; None: nothing says so.

    Raises
    ------
    ValueError
        For shapes and numbers that do not fit.
    TypeError
        For values of another kind.

    Notes
    -----
    All arrays are copied and read-only.
    """

    positions: NDArray[np.float32]
    faces: NDArray[np.uint32]
    normals: NDArray[np.float32] | None = None
    uv: NDArray[np.float32] | None = None
    color: tuple[float, float, float] = (1.0, 1.0, 1.0)
    texture: NDArray[np.uint8] | None = None
    material: Material = field(default_factory=Material)
    shading: Shading = "phong"
    colors: NDArray[np.uint8] | None = None
    up: Up | None = None

    if TYPE_CHECKING:  # what may be passed is more than what is kept

        def __init__(
            self, positions: Numbers, faces: Numbers, normals: Numbers | None = None, uv: Numbers | None = None,
            color: Numbers = ..., texture: Numbers | None = None, material: Material = ..., shading: Shading = ...,
            colors: Numbers | None = None, up: Up | None = None,
        ) -> None: ...  # fmt: skip

    def __post_init__(self) -> None:
        points = frozen(floats_of(self.positions, "mesh positions", (None, 3), np.float32))
        faces = as_given(self.faces, "mesh faces must have shape (m, 3) and whole numbers")
        if faces.ndim != 2 or faces.shape[1] != 3 or faces.dtype.kind not in "iu":
            raise ValueError(f"mesh faces must have shape (m, 3) and whole numbers, got {faces.shape} {faces.dtype}")
        if faces.size and (faces.min() < 0 or faces.max() >= len(points)):
            expected = f"mesh faces must name one of the {len(points)} positions"
            raise ValueError(f"{expected}, got {faces.min()} to {faces.max()}")
        object.__setattr__(self, "positions", points)
        object.__setattr__(self, "faces", frozen(np.array(faces, dtype=np.uint32, order="C")))
        for name, width in (("normals", 3), ("uv", 2)):
            if getattr(self, name) is not None:
                values = floats_of(getattr(self, name), f"mesh {name}", (len(points), width), np.float32)
                object.__setattr__(self, name, frozen(values))
        if self.texture is not None:
            texture = as_given(self.texture, "mesh texture must be (h, w, 3|4) uint8")
            if texture.ndim != 3 or texture.shape[2] not in (3, 4) or texture.dtype != np.uint8 or 0 in texture.shape:
                way = way_to(texture.shape, "texture", self.texture, (3, 4))
                raise ValueError(f"mesh texture must be (h, w, 3|4) uint8, got {texture.shape} {texture.dtype}{way}")
            if self.uv is None:
                raise ValueError("a mesh with a texture needs uv, one (u, v) for each position")
            object.__setattr__(self, "texture", frozen(np.array(texture, order="C")))
        if self.colors is not None:
            colors = as_given(self.colors, "mesh colors must be uint8 of shape (n, 3)")
            if colors.shape != (len(points), 3) or colors.dtype != np.uint8:
                raise ValueError(
                    f"mesh colors must be uint8 of shape ({len(points)}, 3), got {colors.shape} {colors.dtype}"
                )
            object.__setattr__(self, "colors", frozen(np.array(colors, order="C")))
        if self.up is not None:
            check_choice(option("up"), self.up, UPS)
        object.__setattr__(self, "color", check_color(self.color, "mesh color"))
        check_type(self.material, Material, "mesh material")
        check_choice("shading", self.shading, SHADINGS)

    def __repr__(self) -> str:
        """`Mesh(24 positions, 12 triangles, texture 512x512)`."""
        texture = "" if self.texture is None else f", texture {self.texture.shape[1]}x{self.texture.shape[0]}"
        return f"Mesh({counted(len(self.positions), 'position')}, {counted(len(self.faces), 'triangle')}{texture})"

    def _shaded(self, shading: Shading) -> Mesh:
        return replace(self, shading=shading)

    @property
    def up_direction(self) -> NDArray[np.float64] | None:
        """Return the direction that is up, (3,) unit, node axes; None where nothing says so."""
        return None if self.up is None else direction_of(self.up)

    @cached_property
    def corners(self) -> NDArray[np.float64]:
        """Return the (8, 3) corners of the box around all triangles, node axes; (0, 3) without a triangle."""
        points = self.positions[np.unique(self.faces)]
        return frozen(box_corners(points.min(0), points.max(0)) if len(points) else np.zeros((0, 3)))


MOST_FRAMES = 200  # of one object


@dataclass(frozen=True, eq=False)
class PointObject(DrawnValue):
    """A frame as an object of a scene: each pixel with a depth is a splat, lit like everything else.

    Parameters
    ----------
    frame : Frame or sequence of Frame
        Its pose places it under the node's transform. Up to 200 frames of one thing are drawn as one object by their
        poses, each from the points of its own depth. The first is kept as `frame`, the rest as `others`.
    material : Material, optional
        How the surface answers light, in place of a look.
    look : Appearance, optional
        How the object is drawn.
    others : sequence of Frame
        Further frames of the same thing.
    **options
        Values of `Appearance` in place of a look: `PointObject(frame, splat="round")`.

    Raises
    ------
    TypeError, ValueError
        As `Appearance` and `Appearance.for_frame`.
    TypeError
        For a look together with its values.
    ValueError
        For no frames or more than 200, and for several frames with splat="mesh" or with options that are arrays.
    """

    frame: Frame
    look: Appearance
    others: tuple[Frame, ...] = ()

    def __init__(
        self, frame: Frame | Sequence[Frame], material: Material | None = None, *, look: Appearance | None = None,
        others: Sequence[Frame] = (), **options: Unpack[AppearanceOptions],
    ):  # fmt: skip
        if look is not None and (material is not None or options):
            raise TypeError("pass a look, or its values one by one, not both")
        if look is None:
            look = Appearance(Material() if material is None else material, **options)
        check_type(look, Appearance, "look")
        more = items_of(others)
        if more is None:
            raise TypeError(f"others must be a sequence of frames, got {shown(others)}")
        frame, *rest = check_frames((*check_frames(frame), *more) if more else frame)
        if rest:
            uniform(look)
        if rest and look.splat == "mesh":
            forms = option("splat", *FRAME_SPLATS[:-1])
            raise ValueError(f"a mesh is that of one frame, got {1 + len(rest)}: merge them with {forms}")
        object.__setattr__(self, "frame", frame)
        object.__setattr__(self, "look", look.for_frame(frame.depth))
        object.__setattr__(self, "others", tuple(rest))

    @property
    def up_direction(self) -> NDArray[np.float64] | None:
        """Return where up is, (3,) unit, axes of the first frame's camera; None where nothing says so."""
        return None if self.frame.up is None else np.array(self.frame.up)

    def __repr__(self) -> str:
        return f"PointObject({self.frame if self.is_single else counted(len(self.frames), 'frame')})"

    def _shaded(self, shading: Shading) -> PointObject:
        return replace(self, look=replace(self.look, shading=shading))

    @property
    def is_single(self) -> bool:
        """Return whether there is one frame, not several of one thing."""
        return not self.others

    @property
    def is_alike_from_everywhere(self) -> bool:
        """Return whether no point or colour of it depends on who looks."""
        return self.is_single and self.look.missing != "photo"

    @property
    def frames(self) -> tuple[Frame, ...]:
        """Return all frames."""
        return self.frame, *self.others

    @property
    def shading(self) -> Shading:
        """Return how it is lit, as its look has it."""
        return self.look.shading

    @property
    def material(self) -> Material:
        """Return how its surface reflects light."""
        return self.look.material

    @property
    def pose_in_node(self) -> NDArray[np.float64]:
        """Return the pose of the (first) frame, (4, 4)."""
        return self.frame.pose

    @cached_property
    def corners(self) -> NDArray[np.float64]:
        """Return the (n, 3) corners of a box around the splats of the (first) frame, its camera's axes."""
        reach = self.look.farthest_reach
        return self.frame.corners if reach <= 0.5 else self.frame.splat_corners(reach)

    @cached_property
    def main_corners(self) -> NDArray[np.float64]:
        """Return the same of all points but stray ones."""
        return self.frame.main_corners

    @property
    def members(self) -> tuple[PointObject, ...]:
        """Return each frame as a point object of its own."""
        return (self,) if self.is_single else self._members  # keeping itself, it would outlive its last use

    @cached_property
    def _members(self) -> tuple[PointObject, ...]:
        return tuple(PointObject(frame, look=self.look) for frame in self.frames)

    @property
    def points_known(self) -> int:
        """Return the number of points in the frames."""
        return sum(frame.points_known for frame in self.frames)

    @cached_property
    def scale(self) -> float:
        """Return the frame's scale; of several frames the median."""
        return median([frame.scale for frame in self.frames]) if self.others else self.frame.scale


def uniform(look: Appearance) -> Appearance:
    """Return the look of several frames. Raises ValueError for arrays."""
    if not look.is_uniform:
        raise ValueError("options of several frames hold for all of them: arrays belong to one frame")
    return look


def check_frames(frames: Frame | Sequence[Frame]) -> tuple[Frame, ...]:
    """One frame or several as a tuple. Raises TypeError for anything else, ValueError for none or too many."""
    if isinstance(frames, Frame):
        return (frames,)
    one: Any = frames
    if one.__class__ is tuple and one and type(one[0]) is Frame and not one[1:]:
        return (one[0],)
    if any(isinstance(one, PointCloud) for one in (frames if is_a(frames, Sequence) else [frames])):
        raise TypeError("a point cloud is no frame: draw it alone, or put it into a Node of a Scene as it is")
    if not is_a(frames, Sequence) or is_a(frames, str, bytes):
        raise TypeError(f"frame must be a Frame or a sequence of frames, got {shown(frames)}")
    if not 1 <= len(frames) <= MOST_FRAMES:
        raise ValueError(f"an object has 1 to {MOST_FRAMES} frames, got {len(frames)}")
    single = len(frames) == 1
    return tuple(check_type(item, Frame, "frame" if single else f"frame {k}") for k, item in enumerate(frames))


def check_photographs(frames: Sequence[Frame]) -> tuple[Frame, ...]:
    """Return the frames as a tuple. Raises TypeError for anything else, ValueError unless they show one view."""
    photos = check_frames(frames)
    if len(photos) < 2:
        raise ValueError("photographs of one view must be two or more, got 1")
    first = photos[0]
    for k, one in enumerate(photos):
        if one.color is None:
            raise ValueError(f"photographs must have colours, frame {k} has none")
        assert first.color is not None
        for what, own, other in (
            ("depth of the shape", one.depth.shape, first.depth.shape),
            ("colours of the shape", one.color.shape[:2], first.color.shape[:2]),
            ("the camera", one.camera, first.camera),
        ):
            if own != other:
                raise ValueError(f"photographs of one view must have {what} {other} of the first, frame {k} has {own}")
        if not np.allclose(one.pose, first.pose, atol=1e-4):
            raise ValueError(f"photographs of one view must have one pose, that of frame {k} is another")
    return photos
