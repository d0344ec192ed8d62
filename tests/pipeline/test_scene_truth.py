"""Scenes against ray-traced truth: sphere and wall as a point object, a board and a floor as meshes, two lights."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import pointshade_gl as ps
from pointshade_gl.bench.tracing import as_frame, decode, encode, patch, sphere_and_wall, trace

from ..benchmarks.traced_light import co_visible, near_edge, shade
from ..support.drivers import need_compute
from ..truth.measures import occluder

CAMERA = ps.Camera(394, 394, 239.5, 179.5, 480, 360)
GREY = (0.5, 0.45, 0.4)
SPOT = ps.Light(
    position=(-0.9, -1.1, 0.1), direction=(0.8, 1.1, 1.7), cone=(25, 35), color=(0.8, 0.7, 0.6), shadow=True
)
SUN = ps.Light(direction=(-0.5, 0.6, 1), color=(0.3, 0.4, 0.6), shadow=True)
POINT = ps.Light(position=(-0.9, -1.1, 0.1), color=(0.8, 0.7, 0.6), shadow=True)
MATT = ps.Material(ambient=0.1, diffuse=0.9, specular=0.2)
BOARD = (0.75, -0.1, 1.2), (0.0, 0.35, 0.0), (0.08, 0.0, 0.1)
FLOOR = (0.0, 0.65, 1.6), (1.2, 0.0, 0.0), (0.0, 0.0, 0.8)


def surface_of(place):
    return patch(*place, lambda points: np.broadcast_to(GREY, points.shape))


def mesh_of(place):
    centre, u, v = map(np.array, place)
    corners = [centre + a * u + b * v for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
    return ps.Mesh(corners, [(0, 1, 2), (0, 2, 3)], color=GREY, material=MATT)


SURFACES = [*sphere_and_wall(), surface_of(BOARD), surface_of(FLOOR)]


@cache
def taken():
    """What the depth camera took: the sphere and the wall, without the meshes, which are only in the scene."""
    return trace(sphere_and_wall(), CAMERA)


@pytest.fixture(scope="module", params=["compute", "points"])
def rasterizer(request, renderer):
    if request.param == "compute":
        need_compute(renderer)
    with ps.Renderer(rasterizer=request.param) as made:
        yield made


@cache
def things():
    return ps.PointObject(as_frame(taken(), CAMERA), MATT), mesh_of(BOARD), mesh_of(FLOOR)


def scene_of(lights):
    return ps.Scene(tuple(map(ps.Node, (*things(), *lights))), camera=CAMERA)


@cache
def known_shadow(yaw, light):
    """Shadows (h, w) in a view, and the pixels where they are cast by what the scene contains, or by nothing.

    The frame has only what its camera saw: the sphere's back shades nothing.
    """
    seen = view(yaw)[1]
    shaded, by = occluder(seen, light, SURFACES)
    z = np.maximum(by[..., 2], 0.1)
    u, v = (np.round(c).astype(int) for c in CAMERA.pixel_at(by[..., 0], by[..., 1], z))
    inside = (u >= 0) & (u < CAMERA.width) & (v >= 0) & (v < CAMERA.height)
    depth = taken().depth[np.clip(v, 0, CAMERA.height - 1), np.clip(u, 0, CAMERA.width - 1)]
    in_frame = inside & (abs(depth - by[..., 2]) < 0.01)
    by_mesh = occluder(seen, light, SURFACES[2:])[0]
    by_all = occluder(seen, light, SURFACES[:2])[0]
    return shaded, ~by_all | in_frame | by_mesh


@cache
def view(yaw):
    """A pose, what is seen from there, and the pixels (h, w) that are judged: of what the frame saw, and of meshes."""
    pose = ps.orbit_pose(None, (0, 0, 1.8), yaw)
    seen = trace(SURFACES, CAMERA, pose)
    of_meshes = seen.surface >= 2
    return pose, seen, co_visible(seen, taken(), CAMERA, np.eye(4)) | of_meshes


def edges_of(mask, reach):
    """Pixels within reach of a border of the mask."""
    grown = np.pad(mask, reach, mode="edge")
    some, every = grown, grown
    for axis in (0, 1):
        windows = [np.lib.stride_tricks.sliding_window_view(one, 2 * reach + 1, axis) for one in (some, every)]
        some, every = windows[0].any(-1), windows[1].all(-1)
    return some & ~every


@pytest.mark.parametrize("light", [SPOT, SUN, POINT], ids=["spot", "sun", "point"])
def test_the_shadow_lies_where_the_rays_say(rasterizer, light):
    assert overlap(rasterizer, light) >= 0.97


def overlap(rasterizer, light):
    """At 15 degrees, by how much darker the picture is with the shadow than without: the IoU with traced shadows."""
    pose, seen, visible = view(15)
    shaded, known = known_shadow(15, light)
    lit, dark = (
        rasterizer.render(scene_of([replace(light, shadow=shadow)]), pose=pose)[..., :3] for shadow in (False, True)
    )
    arriving = shade(seen, light, ps.Material(ambient=0, specular=0), pose[:3, 3]).sum(-1)
    judged = visible & known & (arriving > 0.05) & ~near_edge(seen)
    missing = (decode(lit.astype(float)) - decode(dark.astype(float))).sum(-1)
    darker = missing > 0.5 * arriving
    union, both = (darker | shaded) & judged, darker & shaded & judged
    assert (shaded & judged).mean() > 0.01
    iou = both.sum() / union.sum()
    print(f"IoU {iou:.4f}")
    return iou


AWAY = np.array((-0.55, -0.65, -0.5)) / np.linalg.norm((-0.55, -0.65, -0.5))  # from the scene's middle to the lights


@pytest.mark.parametrize(
    ("kind", "radii"),
    [
        *(("point", 1.2), ("point", 12), ("spot", 12), ("wide spot", 50)),
        *(pytest.param("point", radii, marks=pytest.mark.system) for radii in (2.5, 4, 50)),
        pytest.param("wide spot", 1.2, marks=pytest.mark.system),
    ],
)
def test_shadows_of_lights_outside_the_scene_stay_sharp_however_far(renderer, kind, radii):
    centre, radius = scene_of([]).bounds
    position = centre + radii * radius * AWAY
    cone = {"point": None, "spot": (50, 60), "wide spot": (70, 85)}[kind]
    aim = {} if cone is None else {"direction": tuple(-AWAY), "cone": cone}
    light = ps.Light(position=tuple(position), color=(0.8, 0.7, 0.6), shadow=True, **aim)
    assert overlap(renderer, light) >= 0.97


@pytest.mark.parametrize("yaw", [0, 15])
def test_two_lights_with_shadows_look_as_traced(rasterizer, yaw):
    """PSNR off edges of objects and shadows: >= 38 dB."""
    pose, seen, visible = view(yaw)
    image = rasterizer.render(scene_of([SPOT, SUN]), pose=pose)
    total, judged = np.zeros((CAMERA.height, CAMERA.width, 3)), visible & ~near_edge(seen)
    for k, light in enumerate((SPOT, SUN)):
        shaded, known = known_shadow(yaw, light)
        material = ps.Material(0.1 if k == 0 else 0, 0.9, 0.2)
        total += shade(seen, light, material, pose[:3, 3], shaded)
        judged &= known & ~edges_of(shaded, 4)
    truth = np.round(encode(np.clip(total, 0, 1)))
    assert judged.mean() > 0.4 and (image[..., 3] > 0)[judged].mean() > 0.9999
    error = (image[..., :3].astype(float) - truth)[judged & (image[..., 3] > 0)]
    psnr = 10 * np.log10(255**2 / (error**2).mean())
    print(f"PSNR {psnr:.1f} dB")
    assert psnr >= 38


@pytest.mark.parametrize("light", [SPOT, SUN, POINT], ids=["spot", "sun", "point"])
def test_nothing_shades_itself(rasterizer, light):
    """From the source camera: where no ray is blocked, the light with a shadow gives the picture of the one without."""
    _, seen, visible = view(0)
    shaded, known = known_shadow(0, light)
    free = visible & known & ~edges_of(shaded, 4) & ~shaded & ~near_edge(seen)
    lit, dark = (
        rasterizer.render(scene_of([replace(light, shadow=shadow)]))[..., :3].astype(int) for shadow in (False, True)
    )
    wrong = np.abs(lit - dark).max(-1)[free] > 2
    print(f"acne {100 * wrong.mean():.4f} %")
    assert wrong.mean() < 0.001
