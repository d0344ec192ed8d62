"""Programs for software drivers: their pictures are those of the shaders as they stand, bit by bit."""

import numpy as np
import pytest

import pointshade_gl as ps
from pointshade_gl.gpu.context.software_driver import by_copies, by_flat_inputs, by_images, is_software, reads_images
from pointshade_gl.gpu.core.programs import build_compute, build_program
from pointshade_gl.scene import shadow_cameras
from pointshade_gl.scene.appearance import SHADINGS

from ..support import frames
from ..support.drivers import need_compute
from .test_shaders_es import SEED, random_variants, variants

VERTEX = {
    "points/splats.frag": "points/splats.vert",
    "points/set_splats.frag": "points/splats.vert",
    "points/rims.frag": "points/rims.vert",
    "meshes/mesh.frag": "meshes/mesh.vert",
    "meshes/mesh_shadow.frag": "meshes/mesh.vert",
    "meshes/mesh_lit.frag": "meshes/mesh_lit.vert",
    "meshes/grid_depth.frag": "meshes/grid.vert",
}
LAMP = ps.Light(position=(-1, -1, 0))
LAMPS = [LAMP, ps.Light(direction=(1, 0, 1), color=(1, 0.5, 0.2))]
SHADOWS = [ps.Light(position=(-1, -1, 0), shadow=True), ps.Light(direction=(0.6, 0.5, 1), cone=(10, 40))]
MESH = ps.Mesh(np.array([[-0.5, -0.5, 1.2], [0.5, -0.5, 1.2], [0, 0.5, 1.2]]), np.array([[0, 1, 2]]))


@pytest.fixture(params=["software", "hardware"])
def told(monkeypatch, request):
    """The programs are built for this kind of driver, whatever draws."""
    monkeypatch.setenv("POINTSHADE_PROGRAMS", request.param)
    return request.param


DRAWN = [variant for variant in variants(page=False) if not variant[0].endswith(".vert")]


@pytest.mark.parametrize(("name", "constants"), DRAWN, ids=lambda value: str(value or "plain"))
def test_every_shader_compiles_for_a_software_driver(renderer, monkeypatch, name, constants):
    monkeypatch.setenv("POINTSHADE_PROGRAMS", "software")
    gl = renderer.context.gl
    if name.endswith(".comp") or constants.get("LOOK_UP"):
        need_compute(renderer)
    with gl:
        if name.endswith(".comp"):
            build_compute(gl, name, **constants).release()
        else:
            version = 430 if constants.get("LOOK_UP") else 330
            build_program(gl, VERTEX.get(name, "fullscreen.vert"), name, None, version, **constants).release()


@pytest.mark.parametrize("part", range(3, 5), ids=lambda part: f"POINTSHADE_SEED={SEED} {part}")
def test_random_variants_compile_for_a_software_driver(renderer, monkeypatch, part):
    for name, constants in random_variants(part, page=False):
        if not name.endswith(".vert"):
            print(name, constants)
            test_every_shader_compiles_for_a_software_driver(renderer, monkeypatch, name, constants)


def small(frame):
    return ps.Frame(frame.color[::2, ::2], frame.depth[::2, ::2], frame.camera.resized(80, 60))


def lit(draw, frame, shadings):
    """Pictures by the name of what they show: of these models of shading."""
    for shading in shadings:
        yield shading, draw(frame, LAMP, yaw=15, shading=shading)
        yield f"{shading} mesh", draw(frame, LAMP, yaw=15, shading=shading, splat="mesh")
        yield f"{shading} shadow", draw(frame, SHADOWS, yaw=15, shading=shading)


def others(draw, frame):
    """All kinds of frames and lights."""
    half = np.ascontiguousarray(frame.depth[::2, ::2])
    camera = frame.camera.fitted(half.shape[1], half.shape[0])
    several = [frame, ps.Frame(frame.color, frame.depth, frame.camera, ps.orbit_pose(None, frame.pivot, yaw=2))]
    parts = ps.PointObject(frame), ps.PointObject(frame, point_size=1.5, splat="round", shading="gouraud"), MESH
    parts += (ps.PointObject(frame, splat="mesh", shading="flat"),)
    scene = ps.Scene(tuple(map(ps.Node, parts)), camera=frame.camera)
    yield "another light", draw(frame, ps.Light(position=(1, 0, 0)), yaw=15)
    yield "two lights", draw(frame, LAMPS, yaw=-20)
    yield "two lights again", draw(frame, LAMPS[::-1], yaw=-20)
    yield "samples", draw(frame, samples=3, ground=True, background="white")
    yield "round", draw(frame, splat="round", point_size=1.5)
    yield "vote", draw(ps.Frame(frame.color, half, camera), yaw=5)
    yield "snap", draw(ps.Frame(frame.color, half, camera), yaw=5, flying="snap")
    yield "several", draw(several, yaw=5)
    yield "several, normals of the view", draw(several, SHADOWS, yaw=5, normals_at="target")
    yield "scene", draw(scene, SHADOWS)


def normals(renderer, frame):
    for method in ("star", "star-borrow", "adaptive", "triangles-8", "central", "plane-fit-5"):
        yield method, renderer.estimate_normals(frame, method)


MADE = {
    "shadings": lambda made, clean, noisy: lit(made.render, clean, SHADINGS),
    "flat": lambda made, clean, noisy: lit(made.render, clean, ["flat"]),
    "others": lambda made, clean, noisy: others(made.render, clean),
    "noisy": lambda made, clean, noisy: [("noisy", made.render(noisy, LAMP, yaw=15))],
    "normals": lambda made, clean, noisy: normals(made, noisy),
}


@pytest.mark.parametrize(
    ("rasterizer", "what"),
    [*(("auto", name) for name in MADE if name != "flat"), *(("points", name) for name in MADE if name != "shadings")],
)
def test_pictures_and_normals_are_those_of_the_plain_shaders(monkeypatch, rasterizer, what):
    monkeypatch.setattr(shadow_cameras, "SHADOW_SIDE", 128)
    clean, noisy, found = small(frames.sphere_before_wall()), frames.noisy(), {}
    for told in ("software", "hardware"):
        monkeypatch.setenv("POINTSHADE_PROGRAMS", told)
        with ps.Renderer(rasterizer=rasterizer) as made:
            found[told] = dict(MADE[what](made, clean, noisy))
    assert found["software"].keys() == found["hardware"].keys() != set()
    for name, picture in found["software"].items():
        np.testing.assert_array_equal(picture, found["hardware"][name], err_msg=name)


def test_the_drivers_kind_is_told_by_the_environment(renderer, told):
    assert reads_images(renderer.context.gl) == (told == "software" and renderer.context.gl.version_code >= 430)


def test_uniforms_of_a_full_screen_pass_become_flat_inputs():
    vertex = "#version 330 core\nvoid main() {\n}\n"
    fragment = "#version 330 core\nuniform vec4 k;\nuniform sampler2D map;\nuniform mat3 m;  // turns\n"
    vertex, fragment, before = by_flat_inputs(vertex, fragment)
    assert "uniform vec4 k; flat out vec4 flat_k; uniform mat3 m; flat out mat3 flat_m; void main() {" in vertex
    assert "flat_k = k; flat_m = m;" in vertex
    assert fragment.splitlines()[1:] == ["flat in vec4 k;", "uniform sampler2D map;", "flat in mat3 m;  // turns"]
    assert before == ["#define k flat_k", "#define m flat_m"]


def test_a_compute_shader_reads_each_uniform_once_and_no_line_moves():
    text = "#version 430 core\nuniform vec4 k;  // lens\nuniform mat3 m;\nuniform uvec2 n;\nfloat f() { return k.x; }"
    columns = [f"uintBitsToFloat(floatBitsToUint(m[{k}]))" for k in range(3)]
    assert by_copies(text).splitlines() == [
        "#version 430 core",
        "uniform vec4 k; vec4 own_k = vec4(uintBitsToFloat(floatBitsToUint(k)));  // lens",
        f"uniform mat3 m; mat3 own_m = mat3({', '.join(columns)});",
        "uniform uvec2 n; uvec2 own_n = uvec2(ivec2(n));",
        "float f() { return own_k.x; }",
    ]
    assert by_copies("#version 430 core\nvoid main() {}") == "#version 430 core\nvoid main() {}"


def test_pictures_of_known_format_become_images_and_no_line_moves():
    text = "uniform sampler2D depth_map;\nfloat f(sampler2D depth_map) { return texelFetch(depth_map, p, 0).r; }\n"
    images, before = by_images(text + "uniform sampler2D other;\n")
    assert images.splitlines() == [
        "layout(r32f) uniform readonly image2D depth_map;",
        "float f(readonly image2D depth_map) { return IMAGE_TEXEL(depth_map, p, 0).r; }",
        "uniform sampler2D other;",
    ]
    assert before
    assert by_images("uniform sampler2D other;\n") == ("uniform sampler2D other;\n", [])


@pytest.mark.parametrize(
    ("name", "answer"),
    [
        ("zink (SwiftShader Device (Subzero))", True), ("zink (llvmpipe (LLVM 15.0.6, 256 bits))", True),
        ("Apple Software Renderer", True), ("GDI Generic", True), ("Microsoft Basic Render Driver", True),
        ("zink (AMD Radeon RX 6600 (RADV NAVI23))", False), ("Apple M2", False),
    ],
)  # fmt: skip
def test_software_drivers_are_known_by_their_names(name, answer):
    assert is_software(name) == answer
