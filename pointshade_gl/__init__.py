"""Depth and colour pictures become lit objects on the GPU. The public names are the ones listed here."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from .notes.version import __version__ as __version__

if TYPE_CHECKING:
    from . import batch as batch
    from . import files as files
    from .files import frame_sources as _sources
    from .files import gltf as gltf
    from .files import live as _live
    from .files.clouds.load_cloud import load_cloud
    from .files.frame_sources import open_source, prefetched
    from .files.frames.frame_files import load_frame
    from .files.gltf import load_scene, save_scene
    from .files.live import RealSenseSource, live_set
    from .files.pictures.hdr_files import load_environment
    from .files.pictures.picture_files import save_image
    from .files.writing.film import Film
    from .files.writing.maps_and_points import save_depth, save_normals, save_passes, save_points, save_poses
    from .notes.errors import Cancelled, ContextError, ShaderError
    from .page import save_page, show
    from .renderer.functions import (
        RendererPool,
        align_frames,
        estimate_albedo,
        estimate_normals,
        release,
        render,
        render_depth,
        render_mesh,
        render_normals,
        render_passes,
        render_points,
        use_device,
    )
    from .renderer.renderer import Renderer
    from .scene.appearance import Appearance, Material
    from .scene.camera import Camera, orbit_pose
    from .scene.cloud import PointCloud
    from .scene.environment import Environment
    from .scene.frame import Frame
    from .scene.gaussians import Gaussians
    from .scene.graph import Scene
    from .scene.light import Light
    from .scene.node import Node
    from .scene.objects import Mesh, PointObject
    from .scene.settings import OutputSettings
    from .scene.viewpoint import View
    from .viewer.canvas import canvas

    live = _live
    sources = _sources

__all__ = [
    "Appearance",
    "Camera",
    "Cancelled",
    "ContextError",
    "Environment",
    "Film",
    "Frame",
    "Gaussians",
    "Light",
    "Material",
    "Mesh",
    "Node",
    "OutputSettings",
    "PointCloud",
    "PointObject",
    "RealSenseSource",
    "Renderer",
    "RendererPool",
    "Scene",
    "ShaderError",
    "View",
    "align_frames",
    "canvas",
    "estimate_albedo",
    "estimate_normals",
    "live_set",
    "load_cloud",
    "load_environment",
    "load_frame",
    "load_scene",
    "open_source",
    "orbit_pose",
    "prefetched",
    "release",
    "render",
    "render_depth",
    "render_mesh",
    "render_normals",
    "render_passes",
    "render_points",
    "save_depth",
    "save_image",
    "save_normals",
    "save_page",
    "save_passes",
    "save_points",
    "save_poses",
    "save_scene",
    "show",
    "use_device",
]

# Each name is imported when it is first used: no program needs all of them, and the command line can answer Ctrl+C
# before the rest is imported.
_LATER = {
    "Appearance": ".scene.appearance",
    "Camera": ".scene.camera",
    "Cancelled": ".notes.errors",
    "ContextError": ".notes.errors",
    "Environment": ".scene.environment",
    "Film": ".files.writing.film",
    "Frame": ".scene.frame",
    "Gaussians": ".scene.gaussians",
    "Light": ".scene.light",
    "Material": ".scene.appearance",
    "Mesh": ".scene.objects",
    "Node": ".scene.node",
    "OutputSettings": ".scene.settings",
    "PointCloud": ".scene.cloud",
    "PointObject": ".scene.objects",
    "RealSenseSource": ".files.live",
    "Renderer": ".renderer.renderer",
    "RendererPool": ".renderer.functions",
    "Scene": ".scene.graph",
    "ShaderError": ".notes.errors",
    "View": ".scene.viewpoint",
    "align_frames": ".renderer.functions",
    "canvas": ".viewer.canvas",
    "estimate_albedo": ".renderer.functions",
    "estimate_normals": ".renderer.functions",
    "live_set": ".files.live",
    "load_cloud": ".files.clouds.load_cloud",
    "load_environment": ".files.pictures.hdr_files",
    "load_frame": ".files.frames.frame_files",
    "load_scene": ".files.gltf",
    "open_source": ".files.frame_sources",
    "orbit_pose": ".scene.camera",
    "prefetched": ".files.frame_sources",
    "release": ".renderer.functions",
    "render": ".renderer.functions",
    "render_depth": ".renderer.functions",
    "render_mesh": ".renderer.functions",
    "render_normals": ".renderer.functions",
    "render_passes": ".renderer.functions",
    "render_points": ".renderer.functions",
    "save_depth": ".files.writing.maps_and_points",
    "save_image": ".files.pictures.picture_files",
    "save_normals": ".files.writing.maps_and_points",
    "save_page": ".page",
    "save_passes": ".files.writing.maps_and_points",
    "save_points": ".files.writing.maps_and_points",
    "save_poses": ".files.writing.maps_and_points",
    "save_scene": ".files.gltf",
    "show": ".page",
    "use_device": ".renderer.functions",
}
# of these too: help(pointshade_gl.gltf)
_MODULES = {
    "batch": ".batch",
    "files": ".files",
    "gltf": ".files.gltf",
    "live": ".files.live",
    "sources": ".files.frame_sources",
}

_OLDER = {"Finish": "OutputSettings", "Look": "Appearance"}

if not TYPE_CHECKING:  # a type checker knows the names above, and no others

    def __getattr__(name: str) -> Any:
        if name in _MODULES:
            return import_module(_MODULES[name], __name__)
        if name in _OLDER:
            import_module(".notes.notes", __name__).note_new_name(name, _OLDER[name])
            return getattr(import_module(__name__), _OLDER[name])
        if name not in _LATER:
            raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
        found = getattr(import_module(_LATER[name], __name__), name)
        globals()[name] = found  # the next time without us
        return found


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
