"""Depth and colour pictures become lit objects on the GPU. The public names are the ones listed here."""

from .camera import Camera, orbit_pose
from .errors import ContextError, ShaderError
from .files.film import Film
from .files.frames import load_frame
from .files.maps import save_depth, save_normals
from .files.pictures import save_image
from .files.points import save_points
from .files.realsense import RealSenseSource
from .frame import Frame
from .gltf import load_scene, save_scene
from .light import Light
from .live import live_set
from .look import Look, Material
from .mesh import Mesh
from .point_cloud import PointCloud
from .renderer import Renderer
from .scene import Node, PointObject, Scene
from .shared_renderer import estimate_normals, render, render_depth, render_points
from .sources import open_source, prefetched

__version__ = "0.1.0"
__all__ = [
    "Camera",
    "ContextError",
    "Film",
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
    "save_points",
    "save_scene",
]
