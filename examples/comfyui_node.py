"""ComfyUI node.

A node that relights pictures: IMAGE and depth in, lit IMAGE, normals IMAGE and MASK out.

Install::

    pip install pointshade-gl torch

Copy this file into ComfyUI/custom_nodes and restart ComfyUI, whose Python needs pointshade-gl: the node is then under
image/lighting. `python comfyui_node.py` relights the built-in vase, and writes comfyui_node.png.
"""

import numpy as np
import torch

import pointshade_gl as ps


def number(default, low, high, tip, step=0.05):
    return "FLOAT", {"default": default, "min": low, "max": high, "step": step, "tooltip": tip}


def choice(*words, tip):
    return list(words), {"default": words[0], "tooltip": tip}


class PointshadeRelight:
    CATEGORY, FUNCTION = "image/lighting", "relight"
    RETURN_TYPES, RETURN_NAMES = ("IMAGE", "IMAGE", "MASK"), ("lit", "normals", "surface")
    DESCRIPTION = "Relights pictures by their depth. Normals are as in OpenGL; the mask is 1 where there is a surface."

    @classmethod
    def INPUT_TYPES(cls):
        place = "where the light is, from the middle of the scene; 1 is as far as the camera"
        return {
            "required": {
                "image": ("IMAGE",),
                "depth": ("IMAGE",),
                "depth_kind": choice("white is near", "metres", tip="the first is what depth nodes give"),
                "far": number(3.0, 1.05, 100.0, "how many times farther black is than white; not for metres"),
                "fov": number(50.0, 5.0, 150.0, "vertical field of view of the photograph, degrees", 1.0),
                "light": choice("lamp", "sun", tip="the rays of a sun are parallel"),
                "right": number(-0.6, -10.0, 10.0, place),
                "up": number(0.7, -10.0, 10.0, place),
                "towards_viewer": number(0.8, -10.0, 10.0, place),
                "red": number(1.0, 0.0, 1.0, "of the light, linear"),
                "green": number(1.0, 0.0, 1.0, "of the light, linear"),
                "blue": number(1.0, 0.0, 1.0, "of the light, linear"),
                "intensity": number(1.0, 0.0, 20.0, "of the light"),
                "ambient": number(0.1, 0.0, 5.0, "light from everywhere"),
                "diffuse": number(0.9, 0.0, 5.0, "matt reflection"),
                "specular": number(0.3, 0.0, 5.0, "strength of highlights"),
                "shininess": number(32.0, 1.0, 500.0, "the more, the smaller are highlights", 1.0),
                "shadow": ("BOOLEAN", {"default": False}),
                "unlight": ("BOOLEAN", {"default": False, "tooltip": "take out the light that the picture shows"}),
            }
        }

    def relight(self, image, depth, **widgets):
        """(b, h, w, 3) images and depths, of any two sizes; a single depth serves all images."""
        if len(depth) not in (1, len(image)):
            raise ValueError(f"{len(image)} images need {len(image)} depths or 1, got {len(depth)}")
        depth = depth.expand(len(image), -1, -1, -1)
        results = [relit(*pair, **widgets) for pair in zip(image.cpu().numpy(), depth.cpu().numpy(), strict=True)]
        return tuple(torch.from_numpy(np.stack(parts)).float() / 255 for parts in zip(*results, strict=True))


def relit(image, depth, depth_kind, far, fov, unlight, **widgets):
    """Lit picture, normals and mask, uint8."""
    depth = depth[..., 0]
    if depth_kind != "metres":
        depth = 1 / (1 / far + depth.clip(0, 1) * (1 - 1 / far))  # depth nodes give 1/z, from 0 to 1
    colors = (image[..., :3] * 255 + 0.5).clip(0, 255).astype(np.uint8)
    frame = ps.Frame(colors, depth, ps.Camera.from_fov(fov, depth.shape[1], depth.shape[0]))
    material = ps.Material(*(widgets[name] for name in ("ambient", "diffuse", "specular", "shininess")))
    lit = ps.render(frame, light=light_of(frame, **widgets), material=material, unlight=unlight)
    return lit[..., :3], ps.render(frame, show="normals")[..., :3], lit[..., 3]


def light_of(frame, light, right, up, towards_viewer, red, green, blue, intensity, shadow, **_):
    aside = np.array([right, -up, -towards_viewer])  # our axes: x right, y down, z forward
    place = {"direction": -aside} if light == "sun" else {"position": frame.pivot + frame.pivot[2] * aside}
    return ps.Light(**place, color=(red, green, blue), intensity=intensity, shadow=shadow)


NODE_CLASS_MAPPINGS = {"PointshadeRelight": PointshadeRelight}
NODE_DISPLAY_NAME_MAPPINGS = {"PointshadeRelight": "Relight (pointshade)"}

if __name__ == "__main__":  # without ComfyUI: picture, lit, normals, mask
    vase = ps.load_frame("vase")
    image = torch.from_numpy(vase.color[None, ..., :3] / np.float32(255))
    metres = torch.tensor(vase.depth[None, ..., None])
    inputs = PointshadeRelight.INPUT_TYPES()["required"].items()
    widgets = {name: kind[1]["default"] for name, kind in inputs if len(kind) > 1} | {"depth_kind": "metres"}
    lit, normals, surface = PointshadeRelight().relight(image, metres, **widgets)
    beside = torch.cat([image, lit, normals, surface[..., None].expand(-1, -1, -1, 3)], dim=2)
    half = torch.nn.functional.avg_pool2d(beside.permute(0, 3, 1, 2), 2)[0].permute(1, 2, 0)
    ps.save_image("comfyui_node.png", (half.numpy() * 255 + 0.5).astype(np.uint8), small=True)
