"""Wrong types and impossible numbers: each is refused where it is passed, by an error of one sentence that names it."""

import math
from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest

import pointshade_gl as ps
from pointshade_gl.files.writing.film import Film
from pointshade_gl.scene.orbit import State
from pointshade_gl.scene.viewpoint import View
from pointshade_gl.viewer import Viewer

from ..support import frames

SIZE = "size must be a number of source pixels"
HUGE, GIANT = 10**400, 10**5000  # beyond float; beyond what Python writes out
FRAME = frames.sphere()
CORNERS, FACES = np.array([(0, 0, 1), (1, 0, 1), (0, 1, 1)], float), np.array([(0, 1, 2)])
RAGGED = [[1, 2, 3], [4, 5]]
EYE = np.eye(4)


def camera(**changes):
    return ps.Camera(**({"fx": 500, "fy": 500, "cx": 3, "cy": 3, "width": 8, "height": 8} | changes))


def mesh(**changes):
    return ps.Mesh(**({"positions": CORNERS, "faces": FACES} | changes))


def orbit(**changes):
    return ps.orbit_pose(**({"pose": None, "pivot": (0, 0, 1)} | changes))


def depth(value):
    return ps.Frame(None, value, frames.CAMERA)


def masked(array):
    return np.ma.masked_array(array, mask=np.indices(np.shape(array)).sum(0) == 0)


def moved(x):
    pose = np.eye(4)
    pose[0, 3] = x
    return pose


VALUES = {
    # Camera
    "camera, text": (lambda: camera(fx="500"), TypeError, "camera fx must be a finite number of pixels, got '500'"),
    "camera, None": (lambda: camera(cy=None), TypeError, "camera cy must be a finite number of pixels, got None"),
    "camera, complex": (lambda: camera(cx=1j), TypeError, "camera cx must be a finite number of pixels"),
    "camera, beyond float": (lambda: camera(fx=HUGE), ValueError, "camera fx must be a finite number of pixels"),
    "camera, too many digits": (lambda: camera(cx=-GIANT), ValueError, "camera cx must be a finite number of pixels"),
    "camera, infinite size": (lambda: camera(width=math.inf), ValueError, "camera width must be a whole number"),
    "camera, NaN size": (lambda: camera(height=math.nan), ValueError, "camera height must be a whole number"),
    "camera, huge size": (lambda: camera(height=HUGE), ValueError, "camera height must be a whole number"),
    "camera, text size": (lambda: camera(width="8"), TypeError, "camera width must be a whole number"),
    "camera, list size": (lambda: camera(width=[8]), TypeError, "camera width must be a whole number"),
    "camera, flag": (lambda: camera(fx=True), TypeError, "camera fx must be a finite number of pixels, got True"),
    "camera, flag size": (lambda: camera(width=np.bool_(True)), TypeError, "camera width must be a whole number"),
    "camera, flag in an array": (lambda: camera(cx=np.array(True)), TypeError, "camera cx must be a finite number"),
    "camera, masked": (lambda: camera(fx=np.ma.masked), ValueError, "camera fx must be a finite number of pixels"),
    "fov, text": (lambda: ps.Camera.from_fov("60", 8, 8), TypeError, "fov must lie between"),
    "fov, beyond float": (lambda: ps.Camera.from_fov(HUGE, 8, 8), ValueError, "fov must lie between"),
    "fov, almost 0": (lambda: ps.Camera.from_fov(1e-320, 8, 8), ValueError, "fov must be at least 1e-06"),
    "fov, size": (lambda: ps.Camera.from_fov(60, "8", 8), TypeError, "camera width must be a whole number"),
    "fov, huge size": (lambda: ps.Camera.from_fov(60, 8, HUGE), ValueError, "camera height must be a whole number"),
    "resized, text": (lambda: camera().resized("8", 8), TypeError, "camera width must be a whole number"),
    "resized, 0": (lambda: camera().resized(0, 8), ValueError, "camera width must be a whole number"),
    "fitted, 0": (lambda: camera().fitted(8, 0), ValueError, "camera height must be a whole number"),
    "fitted, infinite": (lambda: camera().fitted(math.inf, 8), ValueError, "camera width must be a whole number"),
    # orbit_pose
    "orbit, pose text": (lambda: orbit(pose="eye"), TypeError, "pose must be numbers of shape"),
    "orbit, pose None": (lambda: orbit(pose=[[None] * 4] * 4), ValueError, "pose must be finite"),
    "orbit, pose object": (lambda: orbit(pose=object()), TypeError, "pose must be numbers of shape"),
    "orbit, pose ragged": (lambda: orbit(pose=RAGGED), ValueError, "pose must be numbers of shape"),
    "orbit, pose complex": (lambda: orbit(pose=EYE * 1j), TypeError, "pose must be numbers of shape"),
    "orbit, pose huge": (lambda: orbit(pose=[[HUGE] * 4] * 4), ValueError, "pose must be numbers of shape"),
    "orbit, pose far": (lambda: orbit(pose=moved(1e300)), ValueError, "pose must be finite, its translation below"),
    "orbit, yaw text": (lambda: orbit(yaw="20"), TypeError, "yaw and pitch must be finite and dolly below 1"),
    "orbit, yaw huge": (lambda: orbit(yaw=HUGE), ValueError, "yaw and pitch must be finite and dolly below 1"),
    "orbit, dolly": (lambda: orbit(dolly=GIANT), ValueError, "yaw and pitch must be finite and dolly below 1"),
    "orbit, pitch": (lambda: orbit(pitch=[1, 2]), TypeError, "yaw and pitch must be finite and dolly below 1"),
    "orbit, pivot": (lambda: orbit(pivot=(0, 1)), ValueError, "pivot must be three finite numbers"),
    "orbit, pivot text": (lambda: orbit(pivot="pivot"), TypeError, "pivot must be three finite numbers"),
    "orbit, pivot NaN": (lambda: orbit(pivot=(0, 0, math.nan)), ValueError, "pivot must be three finite numbers"),
    "orbit, upright 0": (lambda: orbit(upright=(0, 0, 0)), ValueError, r"upright must not be \(0, 0, 0\)"),
    "orbit, upright": (lambda: orbit(upright=5), ValueError, "upright must be three finite numbers"),
    # Frame
    "frame, camera": (lambda: ps.Frame(None, np.ones((8, 8)), (5, 5, 3, 3)), TypeError, "camera must be a Camera, got"),
    "frame, no camera": (lambda: ps.Frame(None, np.ones((8, 8)), None), TypeError, "camera must be a Camera, got None"),
    "frame, depth None": (lambda: depth(None), TypeError, "depth must be floating point metres"),
    "frame, depth text": (lambda: depth("depth.png"), TypeError, "depth must be floating point metres"),
    "frame, depth ragged": (lambda: depth(RAGGED), ValueError, r"depth must have shape \(h, w\)"),
    "frame, depth of objects": (lambda: depth([[HUGE]]), TypeError, "depth must be floating point metres, got object"),
    "frame, depth complex": (lambda: depth(np.ones((8, 8), complex)), TypeError, "depth must be floating point metres"),
    "frame, color text": (lambda: ps.Frame("red", FRAME.depth, FRAME.camera), ValueError, "color must have shape"),
    "frame, color ragged": (lambda: ps.Frame(RAGGED, FRAME.depth, FRAME.camera), ValueError, "color must have shape"),
    "frame, pose": (lambda: ps.Frame(None, FRAME.depth, FRAME.camera, "x"), TypeError, "pose must be numbers"),
    # Mesh
    "mesh, text": (lambda: mesh(positions="corners"), TypeError, "mesh positions must be numbers of shape"),
    "mesh, ragged": (lambda: mesh(positions=RAGGED), ValueError, "mesh positions must be numbers of shape"),
    "mesh, None": (lambda: mesh(positions=None), TypeError, "mesh positions must be numbers of shape"),
    "mesh, far": (lambda: mesh(positions=CORNERS * 1e300), ValueError, "mesh positions must be finite"),
    "mesh, faces text": (lambda: mesh(faces="012"), ValueError, "mesh faces must have shape"),
    "mesh, faces ragged": (lambda: mesh(faces=RAGGED), ValueError, "mesh faces must have shape"),
    "mesh, faces huge": (lambda: mesh(faces=[[0, 1, HUGE]]), ValueError, "mesh faces must have shape"),
    "mesh, normals": (lambda: mesh(normals=CORNERS + math.inf), ValueError, "mesh normals must be finite"),
    "mesh, long normals": (lambda: mesh(normals=CORNERS * 1e20), ValueError, "mesh normals must be finite and below"),
    "mesh, uv": (lambda: mesh(uv={}), TypeError, "mesh uv must be numbers of shape"),
    "mesh, color": (lambda: mesh(color=(1, 1)), ValueError, "mesh color must be three numbers"),
    "mesh, color name": (lambda: mesh(color="red"), TypeError, "mesh color must be three numbers"),
    "mesh, color NaN": (lambda: mesh(color=(1, math.nan, 1)), ValueError, "mesh color must be three numbers"),
    "mesh, color below 0": (lambda: mesh(color=(1, -0.1, 1)), ValueError, "mesh color must be three numbers"),
    "mesh, color None": (lambda: mesh(color=None), TypeError, "mesh color must be three numbers"),
    "mesh, texture": (lambda: mesh(texture="wood.png", uv=CORNERS[:, :2]), ValueError, "mesh texture must be"),
    "mesh, ragged texture": (lambda: mesh(texture=RAGGED, uv=CORNERS[:, :2]), ValueError, "mesh texture must be"),
    "mesh, material": (lambda: mesh(material="gold"), TypeError, "mesh material must be a Material, got 'gold'"),
    "mesh, no material": (lambda: mesh(material=None), TypeError, "mesh material must be a Material, got None"),
    "mesh, shading": (lambda: mesh(shading=np.zeros(3)), ValueError, "unknown shading"),
    # Light
    "light, text": (lambda: ps.Light(position="here"), TypeError, "light position must be three finite numbers"),
    "light, two": (lambda: ps.Light(position=(1, 2)), ValueError, "light position must be three finite numbers"),
    "light, far": (lambda: ps.Light(position=(1e30, 0, 0)), ValueError, "light position must be three finite numbers"),
    "light, huge": (lambda: ps.Light(position=(HUGE, 0, 0)), ValueError, "light position must be three finite numbers"),
    "light, direction": (lambda: ps.Light(direction={}), TypeError, "light direction must be three finite numbers"),
    "light, color": (lambda: ps.Light(color="white"), TypeError, "light color must be three numbers"),
    "light, no color": (lambda: ps.Light(color=None), TypeError, "light color must be three numbers"),
    "light, intensity": (lambda: ps.Light(intensity="1"), TypeError, "light intensity must be a number from 0"),
    "light, bright": (lambda: ps.Light(intensity=HUGE), ValueError, "light intensity must be a number from 0"),
    "light, attenuation": (lambda: ps.Light(attenuation="none"), TypeError, "light attenuation must be three"),
    "light, cone": (lambda: ps.Light(cone=30), ValueError, "light cone must be two half angles"),
    "light, cone text": (lambda: ps.Light(cone="30"), TypeError, "light cone must be two half angles"),
    "light, cone NaN": (lambda: ps.Light(cone=(math.nan, 30)), ValueError, "light cone must be two half angles"),
    "light, shadow": (lambda: ps.Light(shadow="no"), TypeError, "light shadow must be True or False, got 'no'"),
    # Material, Appearance, PointObject
    "material, text": (lambda: ps.Material(ambient="0.1"), TypeError, "material ambient must be a number from 0"),
    "material, None": (lambda: ps.Material(specular=None), TypeError, "material specular must be a number from 0"),
    "material, array": (lambda: ps.Material(diffuse=np.ones(3)), TypeError, "material diffuse must be a number from 0"),
    "material, huge": (lambda: ps.Material(shininess=HUGE), ValueError, "material shininess must be a number from"),
    "look, material": (lambda: ps.Appearance(0.5), TypeError, "material must be a Material, got 0.5"),
    "look, size text": (lambda: ps.Appearance(point_size="big"), ValueError, SIZE),
    "look, size huge": (lambda: ps.Appearance(point_size=HUGE), ValueError, SIZE),
    "look, size NaN": (lambda: ps.Appearance(point_size=math.nan), ValueError, SIZE),
    "look, size below 0": (lambda: ps.Appearance(point_size=-1), ValueError, SIZE),
    "look, size list": (lambda: ps.Appearance(point_size=RAGGED).for_frame(FRAME.depth), ValueError, "splats' size"),
    "look, size object": (lambda: ps.Appearance(point_size={}), TypeError, SIZE),
    "look, noise": (lambda: ps.Appearance(noise=-1), ValueError, "noise must be metres above 0"),
    "look, noise huge": (lambda: ps.Appearance(noise=HUGE), ValueError, "noise must be metres above 0"),
    "look, noise object": (lambda: ps.Appearance(noise=object()), TypeError, "noise must be metres above 0"),
    "look, step": (lambda: ps.Appearance(max_depth_step=[1, 2]), ValueError, "max_depth_step must be metres above 0"),
    "look, step huge": (lambda: ps.Appearance(max_depth_step=GIANT), ValueError, "max_depth_step must be metres"),
    "look, shading": (lambda: ps.Appearance(shading=["flat"]), ValueError, r"unknown shading \['flat'\]"),
    "look, splat": (lambda: ps.Appearance(splat=np.zeros(2)), ValueError, "unknown splat"),
    "look, normals": (lambda: ps.Appearance(normals=None), TypeError, "normals must be a method's name"),
    "object, frame": (lambda: ps.PointObject("vase"), TypeError, "a Frame or a sequence of frames, got 'vase'"),
    "look, flag": (lambda: ps.Appearance(point_size=True), TypeError, SIZE),
    "light, flag": (lambda: ps.Light(position=(0, True, 1)), TypeError, "light position must be three finite numbers"),
    "light, flags": (lambda: ps.Light(position=EYE[0] > 0), TypeError, "light position must be three finite numbers"),
    "object, look": (lambda: ps.PointObject(FRAME, look="flat"), TypeError, "look must be an Appearance, got 'flat'"),
    "object, material": (lambda: ps.PointObject(FRAME, 0), TypeError, "material must be a Material, got 0"),
    "object, normals": (lambda: ps.PointObject(FRAME, normals={}), TypeError, "normals must be a method's name"),
    "object, option": (lambda: ps.PointObject(FRAME, colour=1), TypeError, "unexpected keyword argument 'colour'"),
    # Node and Scene
    "node, content": (lambda: ps.Node([5]), TypeError, "node '': its content must be a PointObject"),
    "node, name": (lambda: ps.Node(name=5), TypeError, "node 5: its name must be a text"),
    "node, transform": (lambda: ps.Node(name="a", transform="x"), TypeError, "node 'a': its transform must be numbers"),
    "node, far": (lambda: ps.Node(transform=np.diag([1e300] * 3 + [1])), ValueError, "node '': its transform"),
    "node, one child": (lambda: ps.Node(children=ps.Node()), TypeError, "node '': its children must be Nodes"),
    "node, children": (lambda: ps.Node(children=5), TypeError, "node '': its children must be Nodes"),
    "node, child": (lambda: ps.Node(children=(mesh(),)), TypeError, "must be Nodes in .*, got a Mesh"),
    "node, visible": (lambda: ps.Node(visible="no"), TypeError, "node '': visible must be True or False"),
    "node, shadow": (lambda: ps.Node(shadow=None), TypeError, "node '': shadow must be True or False"),
    "scene, nodes": (lambda: ps.Scene(5), TypeError, "scene nodes must be Nodes"),
    "scene, one node": (lambda: ps.Scene(ps.Node()), TypeError, "scene nodes must be Nodes"),
    "scene, content": (lambda: ps.Scene((mesh(),)), TypeError, "scene nodes must be Nodes in .*, got a Mesh"),
    "scene, camera": (lambda: ps.Scene(camera=60), TypeError, "scene camera must be a Camera, got 60"),
    "scene, pose": (lambda: ps.Scene(pose="x"), TypeError, "scene pose must be numbers of shape"),
    "scene, ambient": (lambda: ps.Scene(ambient=0.1), ValueError, "scene ambient must be three numbers"),
    "scene, ambient text": (lambda: ps.Scene(ambient="grey"), TypeError, "scene ambient must be three numbers"),
    "scene, ambient inf": (lambda: ps.Scene(ambient=(1, 1, math.inf)), ValueError, "scene ambient must be three"),
    "scene, dark ambient": (lambda: ps.Scene(ambient=(-1, 0, 0)), ValueError, "scene ambient must be three numbers"),
    "scene, path": (lambda: ps.Scene().with_node((0,), visible=False), ValueError, r"no node at the path \(0,\)"),
    "scene, negative path": (lambda: ps.Scene((ps.Node(),)).with_node((-1,), name="a"), ValueError, "no node at the"),
    "scene, no path": (lambda: ps.Scene().with_node((), visible=False), ValueError, r"no node at the path \(\)"),
    # View
    "view, lights": (lambda: View(lights=5), TypeError, "light must be a Light or several of them, got 5"),
    "view, light": (lambda: View(lights=[5]), TypeError, "light must be a Light or several of them, got 5"),
    "view, pose": (lambda: View(pose=np.eye(3)), ValueError, "pose must have shape"),
    "view, yaw": (lambda: View(yaw="20"), TypeError, "yaw and pitch must be finite"),
    "view, dolly": (lambda: View(dolly=1), ValueError, "yaw and pitch must be finite and dolly below 1"),
    "view, size": (lambda: View(picture_size=640), TypeError, "size must be a width and a height in whole pixels"),
    "view, no size": (lambda: View(picture_size=(0, 9)), ValueError, "picture_size must be a width and a height"),
    "view, look": (lambda: View(look="flat"), TypeError, "look must be an Appearance, got 'flat'"),
    # State of the viewer
    "state, yaw": (lambda: State(yaw=math.nan), ValueError, "state yaw must be a number from"),
    "state, distance": (lambda: State(distance=0), ValueError, "state distance must be a number from 1e-06"),
    "state, pan": (lambda: State(pan=1), ValueError, "state pan must be two finite numbers"),
    "state, light_at": (lambda: State(light_at="left"), TypeError, "state light_at must be two finite numbers"),
    "state, color": (lambda: State(light_color=(1, 2)), ValueError, "state light_color must be three numbers"),
    "state, intensity": (lambda: State(light_intensity=HUGE), ValueError, "state light_intensity must be a number"),
    "state, look": (lambda: State(look={}), TypeError, "state look must be an Appearance"),
    "state, direction": (lambda: State().with_light_direction((1, 0)), ValueError, "direction must be three finite"),
    # Files
    "save, path": (lambda: ps.save_image(5, np.zeros((4, 4), np.uint8)), TypeError, "path must be a text or a Path"),
    "save, bytes": (lambda: ps.save_image(b"a.png", np.zeros((4, 4), np.uint8)), TypeError, "path must be a text"),
    "save, NUL": (lambda: ps.save_image("a\0.png", np.zeros((4, 4), np.uint8)), ValueError, "path must be a text"),
    "save, half a character": (lambda: ps.save_image("\ud800.png", np.zeros((4, 4), np.uint8)), ValueError, "of valid"),
    "save, None": (lambda: ps.save_image("a.png", None), ValueError, "image must have shape"),
    "save, ragged": (lambda: ps.save_image("a.png", RAGGED), ValueError, "image must have shape"),
    "save, text": (lambda: ps.save_image("a.npy", "text"), TypeError, "image must be an array of numbers"),
    "film, slow": (lambda: Film("a.gif", 1e-5), ValueError, "fps must be pictures per second, from 0.01 to 1000"),
    "film, text": (lambda: Film("a.gif", "25"), TypeError, "fps must be pictures per second"),
    "film, huge": (lambda: Film("a.gif", HUGE), ValueError, "fps must be pictures per second"),
    "film, NaN": (lambda: Film("a.gif", math.nan), ValueError, "fps must be pictures per second"),
    "film, None": (lambda: Film("a.gif", None), TypeError, "fps must be pictures per second"),
    "film, path": (lambda: Film(None), TypeError, "path must be a text or a Path, got None"),
    "film, ragged": (lambda: Film("a.gif").add(RAGGED), ValueError, "image must have shape"),
    "load, path": (lambda: ps.load_frame(5), TypeError, "path must be a text or a Path, got 5"),
    "load, NUL": (lambda: ps.load_frame(depth="a\0.png"), ValueError, "path must be a text or a Path of valid"),
    "load, depth": (lambda: ps.load_frame(depth=RAGGED, fov=60), ValueError, r"depth must have shape \(h, w\)"),
    "load, color": (lambda: ps.load_frame(depth=np.ones((8, 8)), color=RAGGED, fov=60), ValueError, "color must have"),
    "load, kind": (lambda: ps.load_frame("vase", depth_kind=np.zeros(3)), ValueError, "unknown depth_kind"),
    "load, camera": (lambda: ps.load_frame("vase", intrinsics=[HUGE] * 4), ValueError, "intrinsics must be a file"),
    "open": (lambda: ps.open_source(5), TypeError, "path must be a text or a Path, got 5"),
    "load scene": (lambda: ps.load_scene(None), TypeError, "path must be a text or a Path, got None"),
    "save scene, path": (lambda: ps.save_scene(5, ps.Scene()), TypeError, "path must be a text or a Path, got 5"),
    "save scene": (lambda: ps.save_scene("a.glb", FRAME), TypeError, "scene must be a Scene, got a Frame"),
    "source": (lambda: next(ps.prefetched(5, print)), TypeError, "source must be an iterable of frames, got 5"),
}  # fmt: skip

HIDDEN = {
    "color": lambda: ps.Frame(masked(FRAME.color), FRAME.depth, FRAME.camera),
    "pose": lambda: ps.Frame(None, FRAME.depth, FRAME.camera, masked(EYE)),
    "scene pose": lambda: ps.Scene(pose=masked(EYE)),
    "light position": lambda: ps.Light(position=masked((1, 2, 3))),
    "light direction": lambda: ps.Light(direction=[np.ma.masked, 2, 3]),
    "mesh positions": lambda: mesh(positions=masked(CORNERS)),
    "mesh faces": lambda: mesh(faces=masked(FACES)),
    "mesh normals": lambda: mesh(normals=list(masked(CORNERS))),
    "mesh texture": lambda: mesh(texture=masked(np.zeros((2, 2, 3), np.uint8)), uv=CORNERS[:, :2]),
    "cloud positions": lambda: ps.PointCloud(masked(CORNERS)),
    "colors": lambda: ps.PointCloud(CORNERS, CORNERS, masked(np.zeros((3, 3), np.uint8))),
    "normals": lambda: ps.PointObject(FRAME, normals=masked(np.ones((120, 160, 3)))),
    "noise": lambda: ps.PointObject(FRAME, noise=masked(np.ones((120, 160)))),
    "point_size": lambda: ps.PointObject(FRAME, point_size=masked(np.ones((120, 160)))),
    "intrinsics": lambda: ps.load_frame(depth=FRAME.depth, intrinsics=masked(np.array([9.0, 9, 80, 60]))),
    "load pose": lambda: ps.load_frame(depth=FRAME.depth, fov=60, pose=masked(EYE)),
    "load color": lambda: ps.load_frame(depth=FRAME.depth, fov=60, color=masked(FRAME.color)),
    "points": lambda: FRAME.camera.project(masked(CORNERS)),
    "image": lambda: ps.save_image("a.png", masked(FRAME.color)),
    "numbers": lambda: ps.save_image("a.npy", masked(FRAME.depth)),
    "save normals": lambda: ps.save_normals("a.npy", masked(np.ones((4, 4, 3)))),
    "film": lambda: Film("a.gif").add(masked(FRAME.color)),
}

DRAWN = {
    "frame": (
        lambda r: r.render(None),
        TypeError,
        "frame must be a Frame, a sequence of frames, a Scene, a PointCloud or a path, got None",
    ),
    "camera": (lambda r: r.render(FRAME, camera=(5, 5)), TypeError, r"camera must be a Camera, got \(5, 5\)"),
    "camera 0": (lambda r: r.render(FRAME, camera=0), TypeError, "camera must be a Camera, got 0"),
    "pose": (lambda r: r.render(FRAME, pose="above"), TypeError, "pose must be numbers of shape"),
    "light": (lambda r: r.render(FRAME, light=5), TypeError, "light must be a Light or several of them, got 5"),
    "light 0": (lambda r: r.render(FRAME, light=0), TypeError, "light must be a Light or several of them, got 0"),
    "material": (lambda r: r.render(FRAME, material="gold"), TypeError, "material must be a Material, got 'gold'"),
    "material 0": (lambda r: r.render(FRAME, material=0), TypeError, "material must be a Material, got 0"),
    "size": (lambda r: r.render(FRAME, point_size="big"), ValueError, SIZE),
    "sizes": (lambda r: r.render(FRAME, point_size=np.full((120, 160), 1e300)), ValueError, "size must be finite"),
    "normals inf": (lambda r: r.render(FRAME, normals=np.full((120, 160, 3), math.inf)), ValueError, "normals must be"),
    "normals 1e20": (lambda r: r.render(FRAME, normals=np.full((120, 160, 3), 1e20)), ValueError, "normals must be"),
    "normals 1e300": (lambda r: r.render(FRAME, normals=np.full((120, 160, 3), 1e300)), ValueError, "normals must be"),
    "method": (lambda r: r.estimate_normals(FRAME, 5), ValueError, "unknown normals method 5"),
    "array": (lambda r: r.estimate_normals(FRAME, np.zeros(3)), ValueError, "unknown normals method"),
    "no frame": (lambda r: r.estimate_normals(7), TypeError, "frame must be a Frame, got 7"),
    "noise": (lambda r: r.estimate_normals(FRAME, noise=[[1]]), ValueError, "noise must be one number or have"),
    "noises": (lambda r: r.estimate_normals(FRAME, noise=RAGGED), ValueError, "noise must be one number or have"),
    "scene's camera": (lambda r: r.render(ps.Scene(), camera="front"), TypeError, "camera must be a Camera"),
    "scene's look": (lambda r: r.render(ps.Scene(), shading="flat"), ValueError, "have a look of their own: leave out"),
    "rasterizer": (lambda _: ps.Renderer(rasterizer=5), ValueError, "unknown rasterizer 5"),
    "merge": (lambda _: ps.Renderer(merge="no"), TypeError, "merge must be a share of the inverse depth"),
    "merge, huge": (lambda _: ps.Renderer(merge=HUGE), ValueError, "merge must be a share of the inverse depth"),
    "device": (lambda _: ps.Renderer(device="gpu"), TypeError, "device must be a whole number from 0"),
    "device -1": (lambda _: ps.Renderer(device=-1), ValueError, "device must be a whole number from 0"),
    "device, huge": (lambda _: ps.Renderer(device=HUGE), ValueError, "device must be a whole number from 0"),
    "device 0.5": (lambda _: ps.Renderer(device=0.5), ValueError, "device must be a whole number from 0"),
    "context": (lambda _: ps.Renderer("egl"), TypeError, "context must be a moderngl.Context, got 'egl'"),
    "moderngl's": (lambda r: ps.Renderer(r), TypeError, "context must be a moderngl.Context, got a Renderer"),
}

SHOWN = {
    "nothing": (
        lambda: Viewer(None),
        TypeError,
        "source must be a Frame, a Scene, a PointCloud or an iterable of frames, got None",
    ),
    "name": (
        lambda: Viewer("vase"),
        TypeError,
        "source must be a Frame, a Scene, a PointCloud or an iterable of frames, got 'vase'",
    ),
    "numbers": (lambda: Viewer([1, 2]), TypeError, "source must give Frames, got 1"),
    "empty": (lambda: Viewer([]), ValueError, "source has no frames|none of the 0 frames"),
    "title": (lambda: Viewer(FRAME, title=5), TypeError, "title must be a text, got 5"),
    "size": (lambda: Viewer(FRAME, window_size=640), TypeError, "size must be a width and a height in whole pixels"),
    "no size": (
        lambda: Viewer(FRAME, window_size=(0, 0)),
        ValueError,
        "size must be a width and a height in whole pixels",
    ),
    "state": (lambda: Viewer(FRAME, state="lit"), TypeError, "state must be a State, got 'lit'"),
    "lights": (lambda: Viewer(FRAME, lights=["sun"]), TypeError, "light must be a Light or several of them"),
    "fps": (lambda: Viewer(FRAME, fps=0), ValueError, "fps must be frames per second, from 0.01 to 1000, got 0"),
    "fps, text": (lambda: Viewer([FRAME], fps="30"), TypeError, "fps must be frames per second"),
    "fps, slow": (lambda: Viewer([FRAME], fps=1e-5), ValueError, "fps must be frames per second"),
    "record": (lambda: Viewer(FRAME, record=5), TypeError, "path must be a text or a Path, got 5"),
    "panel": (lambda: Viewer(FRAME, panel="open"), TypeError, "panel must be True or False, got 'open'"),
    "line": (lambda: Viewer(FRAME, command_line="P"), TypeError, "command_line must be a function, got 'P'"),
}


def cases(table):
    return pytest.mark.parametrize(("call", "error", "says"), table.values(), ids=table.keys())


def refused(call, error, says):
    with pytest.raises(error, match=says) as caught:
        call()
    assert type(caught.value) is error
    text = str(caught.value)
    assert "\n" not in text and len(text) < 250


@cases(VALUES)
def test_a_value_is_checked_when_it_is_made(call, error, says, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    refused(call, error, says)
    assert not list(Path().iterdir())


@pytest.mark.parametrize("call", HIDDEN.values(), ids=HIDDEN.keys())
def test_masked_values_are_refused_where_nothing_can_stand_for_them(call, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    refused(call, ValueError, r"got masked values: give them numbers with array\.filled")
    assert not list(Path().iterdir())


@cases(DRAWN)
def test_a_renderer_refuses_and_goes_on(renderer, call, error, says):
    refused(lambda: call(renderer), error, says)
    assert renderer.render(FRAME).any()


@cases(SHOWN)
def test_a_viewer_refuses_before_it_opens_a_window(display, call, error, says):
    refused(call, error, says)


def test_values_become_what_they_claim():
    made = ps.Mesh(CORNERS.tolist(), FACES.tolist(), color=np.array([1, 0, 0.5]))
    assert made.color == (1.0, 0.0, 0.5) and all(type(x) is float for x in made.color)
    scene = ps.Scene([ps.Node(children=[ps.Node([made, ps.Light()])])], ambient=[0, 1, np.float32(0.5)])
    assert scene.ambient == (0.0, 1.0, 0.5) and all(type(x) is float for x in scene.ambient)
    assert type(scene.nodes) is tuple and type(scene.nodes[0].children) is tuple
    assert scene.nodes[0].children[0].content == (made, scene.nodes[0].children[0].content[1])
    material = ps.Material(*map(np.float32, (0, 1, 0.5, 8)))
    assert all(type(getattr(material, field.name)) is float for field in fields(material))
    look = ps.Appearance(point_size=np.float32(2), noise=np.array(0.5))
    assert (look.point_size, look.noise, look.is_uniform) == (2.0, 0.5, True)
    assert type(ps.Light(intensity=np.float32(2)).intensity) is float
    assert type(ps.Light(shadow=np.bool_(True)).shadow) is bool
    assert type(ps.Camera(5, 5, 3, 3, np.int64(8), 8.0).height) is int


def test_meshes_keep_their_own_copies_and_leave_the_caller_s_arrays_alone():
    own = {
        "positions": CORNERS.astype(np.float32), "faces": FACES.astype(np.uint32),
        "normals": np.ones((3, 3), np.float32), "uv": np.ones((3, 2), np.float32),
        "texture": np.full((2, 2, 3), 9, np.uint8),
    }  # fmt: skip
    before = {name: array.copy() for name, array in own.items()}
    made = ps.Mesh(**own)
    for name, array in own.items():
        array[:] = 7
        assert (getattr(made, name) == before[name]).all()
        with pytest.raises(ValueError, match="read-only"):
            getattr(made, name)[0] = 1


def test_normals_may_have_any_length_and_be_missing(renderer):
    normals = np.zeros((120, 160, 3))
    normals[..., 2] = -1
    expected = renderer.render(FRAME, normals=normals)
    assert (renderer.render(FRAME, normals=normals * 1e18) == expected).all()
    normals[5] = math.nan
    assert renderer.render(FRAME, normals=normals).any()
