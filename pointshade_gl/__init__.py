"""Depth and colour pictures become lit objects on the GPU. The public names are the ones listed here."""

from .camera import Camera, orbit_pose
from .errors import ContextError, ShaderError
from .frame import Frame
from .gltf import load_scene, save_scene
from .images import save_image
from .readers import load_frame
from .renderer import Renderer, estimate_normals, render
from .scene import Mesh, Node, PointObject, Scene
from .shading import Light, Material

__version__ = "0.1.0"
__all__ = [
    "Camera",
    "ContextError",
    "Frame",
    "Light",
    "Material",
    "Mesh",
    "Node",
    "PointObject",
    "Renderer",
    "Scene",
    "ShaderError",
    "estimate_normals",
    "load_frame",
    "load_scene",
    "orbit_pose",
    "render",
    "save_image",
    "save_scene",
]
