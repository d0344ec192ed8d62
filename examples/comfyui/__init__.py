"""ComfyUI node.

A node that relights pictures: IMAGE and depth or geometry in; lit IMAGE, normals, masks and a page under the mouse out.

Install::

    pip install pointshade-gl

with ComfyUI's Python, copy this folder into ComfyUI/custom_nodes as pointshade, and restart: the node is then under
image/lighting. Depth is a picture, or what ComfyUI's own nodes of MoGe and Depth Anything 3 give, with their camera.
"""

import uuid
from pathlib import Path

import folder_paths
import numpy as np
import torch
from comfy_api.latest import ComfyExtension, io, ui

import pointshade_gl as ps

WEB_DIRECTORY = "./js"  # shows the page below the node
GEOMETRY = [io.Custom("MOGE_GEOMETRY"), io.Custom("DA3_GEOMETRY")]  # a dict of tensors each


def number(name, default, low, high, tip, step=0.05):
    return io.Float.Input(name, default=default, min=low, max=high, step=step, tooltip=tip)


def choice(name, *words, tip):
    return io.Combo.Input(name, options=list(words), default=words[0], tooltip=tip)


def switch(name, default=False, tip=None):
    return io.Boolean.Input(name, default=default, tooltip=tip)


class PointshadeRelight(io.ComfyNode):
    @classmethod
    def define_schema(cls):
        place = "where the light is, from the middle of the scene; 1 is as far as the camera"
        return io.Schema(
            node_id="PointshadeRelight",
            display_name="Relight (pointshade)",
            category="image/lighting",
            description="Relights pictures by their depth, or by the geometry of MoGe or Depth Anything 3.",
            is_output_node=True,
            inputs=[
                io.Image.Input("image"),
                io.Image.Input("depth", optional=True, tooltip="not needed beside geometry"),
                io.MultiType.Input(
                    "geometry", GEOMETRY, optional=True, tooltip="depth and camera; it goes before depth"
                ),
                choice("depth_kind", "white is near", "metres", tip="of depth; the first is what depth nodes give"),
                number("far", 3.0, 1.05, 100.0, "how many times farther black is than white; not for metres"),
                number("fov", 50.0, 5.0, 150.0, "vertical field of view, degrees, where geometry has no camera", 1.0),
                choice("light", "lamp", "sun", tip="the rays of a sun are parallel"),
                number("right", -0.6, -10.0, 10.0, place),
                number("up", 0.7, -10.0, 10.0, place),
                number("towards_viewer", 0.8, -10.0, 10.0, place),
                number("red", 1.0, 0.0, 1.0, "of the light, linear"),
                number("green", 1.0, 0.0, 1.0, "of the light, linear"),
                number("blue", 1.0, 0.0, 1.0, "of the light, linear"),
                number("intensity", 1.0, 0.0, 20.0, "of the light"),
                number("ambient", 0.1, 0.0, 5.0, "light from everywhere"),
                number("diffuse", 0.9, 0.0, 5.0, "matt reflection"),
                number("specular", 0.3, 0.0, 5.0, "strength of highlights"),
                number("shininess", 32.0, 1.0, 500.0, "the more, the smaller are highlights", 1.0),
                switch("shadow"),
                switch("unlight", tip="take out the light that the picture shows"),
                switch("page", True, "show the first picture below the node, lit from where the mouse is"),
            ],
            outputs=[
                io.Image.Output("lit", display_name="lit"),
                io.Image.Output("normals", display_name="normals", tooltip="as in OpenGL: green is up"),
                io.Mask.Output("surface", display_name="surface", tooltip="1 where there is a surface"),
                io.Mask.Output("shade", display_name="shadow", tooltip="1 where the light does not reach the surface"),
            ],
        )

    @classmethod
    def execute(cls, image, depth=None, geometry=None, page=True, **widgets):
        """(b, h, w, 3) images, and depths or a geometry of any size; a single depth serves all images."""
        frames = [frame_of(*one, **widgets) for one in zip(*of_each(image, depth, geometry), strict=True)]
        results = [relit(frame, **widgets) for frame in frames]
        outputs = [torch.from_numpy(np.stack(parts)).float() / 255 for parts in zip(*results, strict=True)]
        shown = ui.PreviewImage(outputs[0], cls=cls).as_dict()
        if page:
            name = f"pointshade_{uuid.uuid4().hex}.html"
            path = Path(folder_paths.get_temp_directory()) / name
            path.parent.mkdir(parents=True, exist_ok=True)
            ps.save_page(path, frames[0], quality="small", **look_of(frames[0], **widgets))
            shown["pointshade_page"] = [ui.SavedResult(name, "", io.FolderType.temp)]
        return io.NodeOutput(*outputs, ui=shown)


def of_each(image, depth, geometry):
    """For each image: its pixels, depth (h, w), and 3 x 3 matrix of the camera or None. Arrays."""
    if geometry is None and depth is None:
        raise ValueError("connect depth, or geometry of MoGe or Depth Anything 3: neither is there")
    matrices = None
    if geometry is None:
        depths = depth[..., 0]
    else:
        if "depth" not in geometry or not ("intrinsics" in geometry or "mode" in geometry):
            raise ValueError("geometry has no depth along a camera's axis: a panorama has none; use Run MoGe Inference")
        depths = geometry["depth"]
        keep = depths.isfinite()  # MoGe has inf where it masks
        if "mask" in geometry:
            keep = keep & geometry["mask"].bool()
        if "sky" in geometry:
            keep = keep & (geometry["sky"] < 0.5)
        depths = torch.where(keep, depths, 0)
        if "intrinsics" in geometry:
            matrices = geometry["intrinsics"].reshape(-1, 3, 3).cpu().float().numpy()
    if len(depths) not in (1, len(image)):
        raise ValueError(f"{len(image)} images need {len(image)} depths or 1, got {len(depths)}")
    depths = depths.expand(len(image), -1, -1)
    matrices = [None] * len(image) if matrices is None else np.broadcast_to(matrices, (len(image), 3, 3))
    return image.cpu().float().numpy(), depths.cpu().float().numpy(), matrices, [geometry is not None] * len(image)


def frame_of(image, depth, matrix, measured, depth_kind, far, fov, **_):
    """What one image shows; `measured` depth is along the axis already."""
    if not measured and depth_kind != "metres":
        depth = 1 / (1 / far + depth.clip(0, 1) * (1 - 1 / far))  # depth nodes give 1/z, from 0 to 1
    height, width = depth.shape
    camera = ps.Camera.from_fov(fov, width, height)
    if matrix is not None and matrix[0, 2] > 0:
        # MoGe counts in sides of the picture, Depth Anything 3 in pixels of the smaller one that its network saw:
        # of both the principal point is the middle
        fx, fy = matrix[0, 0] / matrix[0, 2] * width / 2, matrix[1, 1] / matrix[1, 2] * height / 2
        camera = ps.Camera(float(fx), float(fy), (width - 1) / 2, (height - 1) / 2, width, height)
    return ps.Frame((image[..., :3] * 255 + 0.5).clip(0, 255).astype(np.uint8), depth, camera)


def relit(frame, **widgets):
    """Lit picture, normals, surface and shadow, uint8."""
    lit = ps.render(frame, **look_of(frame, **widgets))
    return (
        lit[..., :3],
        ps.render(frame, show="normals")[..., :3],
        lit[..., 3],
        shadow_of(frame, lit[..., 3], **widgets),
    )


def look_of(frame, ambient, diffuse, specular, shininess, unlight, **widgets):
    material = ps.Material(ambient, diffuse, specular, shininess)
    return {"light": light_of(frame, **widgets), "material": material, "unlight": unlight}


def light_of(frame, light, right, up, towards_viewer, red, green, blue, intensity, shadow, **_):
    aside = np.array([right, -up, -towards_viewer])  # our axes: x right, y down, z forward
    place = {"direction": -aside} if light == "sun" else {"position": frame.pivot + frame.pivot[2] * aside}
    return ps.Light(**place, color=(red, green, blue), intensity=intensity, shadow=shadow)


def shadow_of(frame, surface, **widgets):
    """255 where the light does not arrive, as something is before it or the surface looks away from it: uint8."""
    white = ps.Frame(np.full_like(frame.color, 255), frame.depth, frame.camera)
    widgets |= {"red": 1, "green": 1, "blue": 1, "intensity": 1}
    bright, dark = (
        ps.render(white, light_of(frame, **widgets | {"shadow": shadow}), ps.Material(0, 1, 0), background="black")
        for shadow in (False, True)
    )
    bright, dark = (((picture[..., 0] / 255 + 0.055) / 1.055) ** 2.4 for picture in (bright, dark))  # linear
    arrives = dark / np.maximum(bright, 1e-3) * (bright > 2e-3)
    return ((1 - arrives.clip(0, 1)) * surface + 0.5).astype(np.uint8)


class PointshadeExtension(ComfyExtension):
    async def get_node_list(self):
        return [PointshadeRelight]


async def comfy_entrypoint():
    return PointshadeExtension()
