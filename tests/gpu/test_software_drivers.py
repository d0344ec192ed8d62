"""Programs for software drivers and for GPUs: their pictures are those of the shaders as they stand, bit by bit."""

import re

import moderngl
import numpy as np
import pytest

import pointshade_gl as ps
from pointshade_gl.gpu.context.software_driver import by_copies, by_flat_inputs, by_images, is_software, reads_images
from pointshade_gl.gpu.core.frame_textures import FrameTextures
from pointshade_gl.gpu.core.images import read_texture
from pointshade_gl.gpu.core.programs import (
    AdditiveBlend,
    ComputedPass,
    FullscreenPass,
    build_compute,
    build_program,
    by_compute,
    splice,
)
from pointshade_gl.pipeline import accumulation
from pointshade_gl.scene import shadow_cameras
from pointshade_gl.scene.appearance import SHADINGS

from ..support import frames
from ..support.compare import compare_images
from ..support.drivers import need_compute
from .test_shaders_es import SEED, random_variants, variants

VERTEX = {
    "points/splats.frag": "points/splats.vert",
    "points/set_splats.frag": "points/splats.vert",
    "points/few_splats.frag": "points/few_splats.vert",
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
    yield "near", draw(frame, dolly=0.5)  # large splats
    yield "hidden light", draw(frame, SHADOWS, yaw=5, samples=2, ambient_occlusion=True, ground=True)


def shared(draw, frame):
    """Of most pixels all samples share what they show; the splats of the others are listed."""
    return [(f"{samples} samples", draw(frame, samples=samples)) for samples in (2, 4)]


def normals(renderer, frame):
    for method in ("star", "star-borrow", "adaptive", "triangles-8", "central", "plane-fit-5"):
        yield method, renderer.estimate_normals(frame, method)


MADE = {
    "shadings": lambda made, clean, noisy: lit(made.render, clean, SHADINGS),
    "shared": lambda made, clean, noisy: shared(made.render, clean),
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
    monkeypatch.setattr(accumulation, "WORTH", 1 if what == "shared" else accumulation.WORTH)
    clean, noisy, found = small(frames.sphere_before_wall()), frames.noisy(), {}
    for told in ("software", "hardware"):
        monkeypatch.setenv("POINTSHADE_PROGRAMS", told)
        with ps.Renderer(rasterizer=rasterizer, merge=0) as made:  # GPUs merge no splats
            found[told] = dict(MADE[what](made, clean, noisy))
    assert found["software"].keys() == found["hardware"].keys() != set()
    for name, picture in found["software"].items():
        np.testing.assert_array_equal(picture, found["hardware"][name], err_msg=name)


SIZE, BEFORE = (24, 20), 7.0  # of targets, and what they hold
WINDOW = 3, 2, 17, 13  # of a target, smaller than its viewport on some sides
VIEWPORT = 0, 4, 20, 16
_OUT = re.compile(r"^(?:layout.*\) )?out (\w+) \w+;", re.MULTILINE)
COMPONENTS = {"float": 1, "vec2": 2, "vec4": 4}
SAMPLERS, WHOLE = {0x8B5E: "f4", 0x8DCA: "i4"}, (0x1404, 0x8B53, 0x8B54, 0x8B55, 0x8B56)  # types: 2D; int, ivec, bool


def why_fragment(name):
    """Why a full-screen pass is never a compute shader; '' if it is one wherever its target has images and no depth."""
    outs = _OUT.findall(splice(name)[0])
    return "" if set(outs) and set(outs) <= set(COMPONENTS) else "draws integers" if outs else "draws depth alone"


FULLSCREEN = [
    (name, constants)
    for name, constants in DRAWN
    if name.endswith(".frag") and not re.search(r"^(flat )?in ", splice(name)[0], re.MULTILINE)
]
STORED = [
    one for one in FULLSCREEN if not why_fragment(one[0])
]  # of each file the last variant, or both ways to look up
STORED = list({(name, constants.get("LOOK_UP")): (name, constants) for name, constants in STORED}.values())
ADDED = "shading/light.frag", "points/resolve_lit.frag", "points/resolve_picture.frag", "points/set_accumulate.frag"


def values(gl, program, rng):
    """Inputs for all that a program asks for: a quarter of each picture is 0."""
    found = {}
    for name in (name for name in program if not name.startswith("gl_")):
        kind = getattr(program[name], "gl_type", None)
        if kind in SAMPLERS:
            numbers = rng.uniform(0, 2, (SIZE[1], SIZE[0], 4)) * (rng.random((SIZE[1], SIZE[0], 1)) > 0.25)
            found[name] = gl.texture(SIZE, 4, numbers.astype(SAMPLERS[kind]).tobytes(), dtype=SAMPLERS[kind])
            found[name].filter = moderngl.NEAREST, moderngl.NEAREST
        elif kind in WHOLE:
            numbers = [int(value) for value in rng.integers(1, 4, program[name].dimension)]
            found[name] = numbers[0] if len(numbers) == 1 else tuple(numbers)
        elif kind is not None:
            found[name] = rng.uniform(0.5, 1.5, program[name].dimension).astype("f4").tobytes()
    return found


def target_of(gl, *parts, dtype="f4", depth=False):
    """A target of pictures with so many components, with a window, in which all is BEFORE."""
    content = (np.full((SIZE[1], SIZE[0], part), BEFORE, "f4").tobytes() for part in parts)
    pictures = [
        gl.texture(SIZE, part, data if dtype == "f4" else None, dtype=dtype, alignment=1)
        for part, data in zip(parts, content, strict=True)
    ]
    target = gl.framebuffer(pictures, gl.depth_renderbuffer(SIZE) if depth else None)
    target.viewport, target.scissor = VIEWPORT, WINDOW
    return target


def bits(texture):
    """Its values, bit by bit; all NaN are one."""
    numbers = np.frombuffer(texture.read(), "f4").reshape(SIZE[1], SIZE[0], -1)
    return np.where(np.isnan(numbers), np.float32(np.nan), numbers).view("u4")


@pytest.fixture
def hardware(renderer, monkeypatch):
    """A context whose programs are those of a GPU, and in which splats have been drawn."""
    monkeypatch.setenv("POINTSHADE_PROGRAMS", "hardware")
    need_compute(renderer)
    with renderer.context.gl as gl:
        nearest = np.random.default_rng(5).uniform(0.5, 2, SIZE).astype("f4") * np.random.default_rng(6).choice(2, SIZE)
        gl.buffer(nearest.tobytes()).bind_to_storage_buffer(0)
        yield gl


def drawn(gl, name, constants, adds=False):
    """What a pass draws as a fragment shader, and as a compute shader."""
    parts = [COMPONENTS[kind] for kind in _OUT.findall(splice(name)[0])][: 1 + constants.get("SPLIT", 9)]
    kinds, version = (FullscreenPass, ComputedPass), 430 if constants.get("LOOK_UP") else 330
    made = [kind(gl, name, version, **constants) for kind in kinds]
    inputs, found = values(gl, made[0]._program, np.random.default_rng(1)), []
    for one in made:
        target = target_of(gl, *parts)
        blend = AdditiveBlend(gl)
        if adds:
            with blend.on():
                one.draw(target, {}, **inputs)
        else:
            one.draw(target, {}, **inputs)
        found.append([bits(texture) for texture in target.color_attachments])
    assert [type(one._program) for one in made] == [moderngl.Program, moderngl.ComputeShader]
    return found


@pytest.mark.parametrize(("name", "constants"), STORED, ids=lambda value: str(value or "plain"))
def test_a_full_screen_pass_stores_what_it_would_draw(hardware, name, constants):
    """Inside the window and the viewport, where it discards nothing."""
    by_fragments, by_compute = drawn(hardware, name, constants)
    for one, other in zip(by_fragments, by_compute, strict=True):
        np.testing.assert_array_equal(one, other)


@pytest.mark.parametrize("name", ADDED)
def test_what_is_added_is_added_by_compute_shaders(hardware, name):
    constants = {key: 1 for key in ("LINEAR", "LOOK_UP") if key in dict(FULLSCREEN)[name]}
    for one, other in zip(*drawn(hardware, name, dict(FULLSCREEN)[name] | constants, adds=True), strict=True):
        np.testing.assert_array_equal(one, other)


def test_each_line_of_a_compute_shader_has_its_place_in_a_file():
    for name in dict(STORED):
        text, origin = by_compute(name, splice(name))
        own = splice(name)[0].splitlines()
        assert len(text.splitlines()) == sum(len(numbers) for _, numbers in origin)
        assert text.splitlines()[len(own) - 1] == own[-1] == "}"


def test_most_full_screen_passes_can_be_compute_shaders():
    reasons = {name: why_fragment(name) for name, _ in FULLSCREEN}
    assert len(dict(STORED)) > 0.9 * len(reasons)
    assert set(reasons.values()) == {"", "draws integers", "draws depth alone"}
    assert not [name for name in reasons if re.search(r"\b(dFd[xy]|fwidth)\b", splice(name)[0])], "compute has none"


@pytest.mark.parametrize(
    ("target", "adds", "stored"),
    [
        ({}, False, True), ({"dtype": "f2"}, False, True), ({"dtype": "f1"}, False, True),
        ({"dtype": "nu2"}, False, True), ({}, True, True), ({"dtype": "f2"}, True, False),
        ({"dtype": "f1"}, True, False), ({"depth": True}, False, False), ({"parts": 3}, False, False),
    ],
    ids=str,
)  # fmt: skip
def test_which_targets_compute_shaders_write(hardware, target, adds, stored):
    """None that is depth tested, none whose sums are rounded, and none that has no format of images."""
    passed, target = (
        ComputedPass(hardware, "output/present.frag"),
        target_of(hardware, target.pop("parts", 4), **target),
    )
    with AdditiveBlend(hardware).on() if adds else hardware:
        passed.draw(target, {}, picture=hardware.texture(SIZE, 4))
    assert (type(passed._program) is moderngl.ComputeShader) == stored
    assert hardware.error == "GL_NO_ERROR"


def test_nothing_is_drawn_outside_of_the_window(hardware):
    target, passed = target_of(hardware, 4), ComputedPass(hardware, "output/present.frag")
    passed.draw(target, {}, picture=hardware.texture(SIZE, 4))
    before = bits(target.color_attachments[0])
    is_drawn = (before.view("f4") != BEFORE).any(-1)
    assert is_drawn[4:15, 3:20].all() and is_drawn.sum() == 11 * 17
    for target.scissor in ((0, 0, 0, 0), (0, 0, 24, 4)):
        passed.draw_again(target)
    np.testing.assert_array_equal(bits(target.color_attachments[0]), before)


def test_gpus_draw_each_pixel_by_itself_and_the_picture_is_that_of_merged_pixels(monkeypatch):
    pictures = []
    for told in ("software", "hardware"):
        monkeypatch.setenv("POINTSHADE_PROGRAMS", told)
        with ps.Renderer() as made:
            pictures.append(made.render(frames.sphere_before_wall(), LAMP, yaw=15))
    assert compare_images(*pictures) == ""
    assert (pictures[0][..., 3] == pictures[1][..., 3]).mean() > 1 - 1e-4


def test_the_drivers_kind_is_told_by_the_environment(renderer, told):
    assert reads_images(renderer.context.gl) == (told == "software" and renderer.context.gl.version_code >= 430)


@pytest.mark.parametrize("channels", [3, 4])
def test_colours_reach_the_gpu_bit_by_bit_through_its_buffer_and_without(renderer, told, channels):
    colors = np.random.default_rng(0).integers(0, 256, (4, 7, 2 * 13, channels), np.uint8)[:, :, ::2]  # with gaps
    shown = [ps.Frame(color, np.ones((7, 13)), ps.Camera(9, 9, 6, 3, 13, 7)) for color in colors]
    with renderer.context.in_use():
        textures = FrameTextures(renderer.context.gl, shown[0])
        for frame in shown:
            textures.upload(frame)
            np.testing.assert_array_equal(read_texture(renderer.context.gl, textures.color), frame.color)
        assert ("_pixels" in vars(textures)) == (told == "hardware")
        textures.release()


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
