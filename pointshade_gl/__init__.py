"""Depth and colour pictures become lit objects on the GPU. The public names are the ones listed here."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from .camera import Camera, orbit_pose
from .errors import ContextError, ShaderError
from .finish import Finish
from .frame import Frame
from .light import Light
from .look import Look, Material
from .mesh import Mesh
from .node import Node
from .point_cloud import PointCloud
from .point_object import PointObject
from .renderer import Renderer
from .scene import Scene
from .shared_renderer import estimate_normals, render, render_depth, render_points
from .view import View

if TYPE_CHECKING:
    from .files.film import Film
    from .files.frames import load_frame
    from .files.maps import save_depth, save_normals
    from .files.pictures import save_image
    from .files.points import save_points
    from .files.realsense import RealSenseSource
    from .gltf import load_scene, save_scene
    from .live import live_set
    from .page import save_page, show
    from .sources import open_source, prefetched

__version__ = "0.1.0"
__all__ = [
    "Camera",
    "ContextError",
    "Film",
    "Finish",
    "Frame",
    "Light",
    "Look",
    "Material",
    "Mesh",
    "Node",
    "PointCloud",
    "PointObject",
    "RealSenseSource",
    "Renderer",
    "Scene",
    "ShaderError",
    "View",
    "estimate_normals",
    "live_set",
    "load_frame",
    "load_scene",
    "open_source",
    "orbit_pose",
    "prefetched",
    "render",
    "render_depth",
    "render_points",
    "save_depth",
    "save_image",
    "save_normals",
    "save_page",
    "save_points",
    "save_scene",
    "show",
]

# Files are half of the package, and not every program reads or writes each kind: these are imported when first used.
_LATER = {
    "Film": ".files.film",
    "RealSenseSource": ".files.realsense",
    "live_set": ".live",
    "load_frame": ".files.frames",
    "load_scene": ".gltf",
    "open_source": ".sources",
    "prefetched": ".sources",
    "save_depth": ".files.maps",
    "save_image": ".files.pictures",
    "save_normals": ".files.maps",
    "save_page": ".page",
    "save_points": ".files.points",
    "save_scene": ".gltf",
    "show": ".page",
}
_MODULES = ("batch", "files", "gltf", "live", "sources")  # of these too: help(pointshade_gl.gltf)


def __getattr__(name: str) -> Any:
    if name in _MODULES:
        return import_module(f".{name}", __name__)
    if name not in _LATER:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    found = getattr(import_module(_LATER[name], __name__), name)
    globals()[name] = found  # the next time without us
    return found


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
