"""Reads and writes scenes as glTF 2.0 and GLB files. What a file says in `extras` under the name "pointshade":

node    "pointshade": "vase", or {"frame": "vase", ...}, makes it a point object: a built-in frame, a folder, or a depth
        picture, relative to the glTF file. Further keys: color, depth, intrinsics, fov, depth_scale, depth_kind,
        baseline, near, far, channel and pose of `load_frame`; the options of `Appearance` (the size of points is size;
        arrays as .npy files), and material, an object with values of `Material`.
        "frames": [...] makes it an object of several frames: each a text or an object like the above, up to pose.
        The node stands where the camera stood that took the frame, and looks as glTF cameras do, along -z with y up;
        pose, 4x4 from the frame's camera (OpenCV axes) to the node, changes that.
        {"visible": false}, {"shadow": false} are the switches of any `Node`.
        Of nodes that `save_scene` adds for other programs: {"fallback": true} is below a point object, and left out
        unless the object's files are missing; {"content": true} holds what belongs to the node above; {"turned": true}
        stands above a whole scene whose y points down, and does not turn it here; {"sheared": true} is one half of a
        sheared node, the other is below it.
light   {"shadow": false}, {"attenuation": [kc, kl, kq]}; {"radius": r} of a point or spot light, {"angle": degrees} of
        a directional one, as in `Light`; {"size": [w, h]} makes a spot an area light, which other programs see as a
        spot of 90 degrees; {"at": "viewer"} is the light at the viewer's upper left; {"cone": [inner, outer]} in
        degrees is that of a spot. {"units": "photometric"}: 683 lumens are a watt, as in Blender's files. {"reach": d}:
        at this distance the light that the file gives without extras is as bright as with its attenuation.
        Without extras a light casts shadows; point and spot lights fall with the square of the distance.
material  values of `Material`, and shading of `Mesh` or `PointCloud`.
primitive  of points, which is a `PointCloud`: {"splat": "ball"}, {"size": 0.02}, {"up": "z"} (without: y, as in glTF),
        {"front": "-y"} and {"seen_from": [x, y, z]}; further attributes of each point are _SIZE, _CONFIDENCE and
        _SEEN_FROM.
camera  fx, fy, cx, cy, width, height of `Camera`, all of them.
scene   {"ambient": [r, g, b]}, {"exposure": x}, a factor on all lights of the file; {"pose": 4x4} without a camera.

An object may also be JSON in a text, as in Blender's custom properties of type string.

Intensities, candela and lux, become `Light.intensity` by a factor of 1/pi: a Lambertian white surface under pi lux is
white. Blender (its exporter's default, "Standard") writes 683 lumens for each of its watts: files that name it as their
generator are divided by that as well, and look as they do in Blender. So do its spots: Blender blends their edge by
cosines, but writes an inner cone as if by angles; the one that it draws is computed back. What `save_scene` writes for
`light_units="photometric"` is what Blender's importer turns back into the same light. An extra "cone" counts in files
that Blender did not write.

A scene's EXT_lights_image_based is its environment, in the world's axes: the first level of its images, turned by its
rotation. Its faces lie as viewers show them (OpenGL's cube maps, whose x is glTF's -x), also where each is mirrored for
itself, as the extension's text has it. Written are RGBD images, blurred levels (GGX) and the irradiance.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ...notes.words import option
from ..access.content import MAX_PIXELS

if TYPE_CHECKING:
    from ...notes.notes import Note
    from ...scene.cloud import Up
    from ...scene.graph import Scene
    from ..access.content import FilePath
    from .cameras_and_lights import Units
    from .write_gltf import Fallback


def load_scene(
    path: FilePath, *, allow_outside: bool = False, max_pixels: float = MAX_PIXELS, notes: Note | None = None,
    up: Up | None = None,
) -> Scene:  # fmt: skip
    """Read a scene from a .gltf or .glb file, or a mesh from a .ply with faces.

    Parameters
    ----------
    path : path
        The file; "demo" is the built-in scene.
    allow_outside : bool
        Let the scene name files outside its folder.
    max_pixels : float
        Limit for one picture; all other limits follow from it, see files/access/content.py.
    notes : callable, optional
        Called with one sentence for everything that is left out; the default prints it to stderr.
    up : {"x", "y", "z", "-x", "-y", "-z"}, optional
        Of a .ply: which axis points up. The default is what its shape shows.

    Raises
    ------
    ValueError, OSError
        In one sentence that names the node or the part, for what cannot be read right.

    Notes
    -----
    Reads triangles with base colours, points as clouds with colours and normals, nodes, the first perspective camera,
    KHR_lights_punctual, EXT_lights_image_based, and point objects by `extras` (see the module's documentation). Files
    that the scene names must lie in its folder, also through links. Nothing is fetched or run.

    Of a .ply it reads faces and strips, normals, colours of vertices and faces, and pictures that MeshLab's comments
    name. Where normals are missing they are those of the faces around a vertex, up to a crease of 40 degrees.
    """
    from ..clouds.load_cloud import is_mesh, load_mesh

    if is_mesh(path):
        return load_mesh(path, allow_outside=allow_outside, max_pixels=max_pixels, notes=notes, up=up)
    if up is not None:
        raise ValueError(f"{path} is glTF, whose y points up: leave out {option('up')}")
    from .read_gltf import load_scene

    return load_scene(path, allow_outside, max_pixels, notes)


def save_scene(
    path: FilePath, scene: Scene, *, fallback: Fallback = "mesh", light_units: Units = "photometric"
) -> None:
    """Write a scene as .gltf (with .bin and pictures beside it) or .glb, completely or not at all.

    Parameters
    ----------
    path : path
        The file, .gltf or .glb.
    scene : Scene
        Its frames become folders beside the file, unless `load_scene` read them from where the new file can name them.
        Meshes without a triangle and clouds without a point are left out; a node that two parents share is written
        twice. Positions of clouds are float32, their origin becomes part of a node's transform. Its environment becomes
        the images of a cube map, 8 bits and a divisor for each pixel, with faces of 128 pixels at most.
    fallback : {"mesh", "points", None}
        What other programs show of a visible point object, which is an empty node to them: the triangles between
        neighbouring pixels that lie on one surface, with the colours as a texture; or points with colours, as also
        where depth is too sparse for triangles; or nothing. `load_scene` leaves it out unless the object's files are
        missing, as beside a .glb that was sent alone.
    light_units : {"photometric", "unitless"}
        "photometric" writes 683 lumens for a watt, and spots' cones, so that Blender's importer ("Standard") gives the
        same light. "unitless" is for viewers that take candela and lux as they are, as those in browsers do: a white
        matt surface under pi lux is white. `load_scene` reads both the same.

    Raises
    ------
    ValueError
        For another suffix, and for what glTF cannot hold.
    FileNotFoundError
        If there is no such folder.

    Notes
    -----
    A fallback shows the depth as it was measured, with simple normals: what is not measured, smoothed, aligned or
    unlit when it is drawn here is not so there. It has at most 400 000 vertices for an object: of larger frames every
    second pixel is left out, or more. In a .glb its picture is a JPEG, in a .gltf the frame's own file if it is written
    with it.

    Lights of another falloff than the square of the distance do not exist in glTF: other programs get one with it, as
    bright in the middle of what the scene draws. A light at the viewer's upper left stands still there. The default
    light of a scene without lights, and ambient light, are not written for them: `Scene.ambient` is in the scene's
    extras if it is not 1, and in other programs is a world of strength ambient * material.ambient / material.diffuse.
    They show the colours 1 / material.diffuse as bright as here.

    glTF's y points up. Where the world's y points down, as in a frame's own axes, a node above all turns the scene for
    other programs; `load_scene` leaves it out.
    """
    from .write_gltf import save_scene

    save_scene(path, scene, fallback, light_units)
