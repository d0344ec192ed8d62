"""Every shader also compiles as GLSL ES 3.00, the language of WebGL 2; those that need storage buffers as ES 3.10."""

import ctypes
import os
import random
import re
import sys
from itertools import product

import pytest

from pointshade_gl.gpu.core.programs import shader_folder, splice
from pointshade_gl.gpu.points.view_consensus import STRIDE
from pointshade_gl.scene.noise import PLANE_FITS

from ..renderer.test_renderer import egl_address

STAGES = {".vert": 0x8B31, ".frag": 0x8B30, ".comp": 0x91B9}
COMPILE_STATUS = 0x8B81
PRECISION = "".join(f"precision highp {kind};\n" for kind in ("float", "int", "sampler2D", "isampler2D"))
FLAG = (0, 1)
AROUND = 0, 1, 2  # no environment, one for matt surfaces, one that highlights show, too
CONSTANTS = {  # the values that the project builds each with
    "points/view_difference.frag": {"STRIDE": (STRIDE,)},
    "surface/depth_average.frag": {"MISPLACED": FLAG, "SNAP": FLAG},
    "output/surface_colors.frag": {"SHOW": (0, 1, 2), "LINEAR": FLAG},
    "output/resolve_samples.frag": {"GROUND": (0, 1, 2), "TONE": FLAG},
    "surface/flat_cells.frag": {"SPREAD": FLAG},
    "surface/bumpy_windows.frag": {"SPREAD": FLAG, "MEASURE": FLAG},
    "meshes/grid.comp": {"WINDOW": FLAG},
    "meshes/grid.frag": {
        "LOOK_UP": FLAG,
        "SHADING": (0, 2, 3),
        "CERTAINTY": FLAG,
        "VISIBILITY": FLAG,
        "SHARED": (0, 1, 2),
    },
    "meshes/grid_flat.frag": {
        "LOOK_UP": FLAG,
        "SHADOWS": (0, 1, 2),
        "VISIBILITY": (0,),
        "ENVIRONMENT": AROUND,
        "SPLATS": FLAG,
    },
    "meshes/grid_picture.frag": {
        "LOOK_UP": FLAG,
        "SHADING": (0, 2, 3),
        "LINEAR": FLAG,
        "ALONE": FLAG,
        "CERTAINTY": FLAG,
        "VISIBILITY": FLAG,
        "ENVIRONMENT": AROUND,
    },
    "meshes/odd_squares.comp": {"WINDOW": FLAG},
    "meshes/mesh.vert": {"COPIES": FLAG},
    "meshes/mesh_lit.vert": {"COPIES": FLAG, "SHADOWS": (1,), "SPLATS": (0,)},
    "shading/light.frag": dict.fromkeys(
        ("POINTS", "MATERIALS", "LINEAR", "ALONE", "CERTAINTY", "EDL", "TONE", "VISIBILITY", "SPLIT", "SPLATS"), FLAG
    )
    | {"SHADOWS": (0, 1, 2), "ENVIRONMENT": AROUND},
    "shading/ground.frag": {"SHADOWS": (1, 2), "VISIBILITY": FLAG, "ENVIRONMENT": AROUND, "SPLATS": FLAG},
    "splats/packed.vert": {"KIND": (0, 1, 2)},
    "splats/splat.vert": {"KIND": (0, 1, 2)},
    "splats/splat.frag": {"KIND": (0, 1, 2), "HIDDEN": FLAG},
    "splats/merge.frag": {"OPAQUE": (0, 1, 2)},
    "splats/compose.frag": dict.fromkeys(("LINEAR", "LIT", "BEHIND"), FLAG),
    "surface/hidden_in_plane.frag": {"OBJECTS": FLAG},
    "surface/calm_doubts.frag": {"STAGE": (0, 1, 2)},
    "surface/calm_levels.frag": {"SHARED": FLAG},
    "surface/calm_normals.frag": {"DOUBTED": FLAG},
    "surface/calm_witness.frag": {"SAME_SIZE": FLAG, "COMPLETED": FLAG},
    "surface/mean_hidden.frag": {"AGAIN": FLAG},
    "points/set_resolve.frag": dict.fromkeys(("LOOK_UP", "AT_TARGET", "CERTAINTY", "VISIBILITY", "MARKED"), FLAG),
    "points/set_resolve_depth.frag": {"LOOK_UP": FLAG},
    "surface/noise_blocks.frag": {"MEASURED": (0, 1, 2)},
    "surface/noise_patches.frag": {"COARSE": FLAG},
    "points/set_accumulate.frag": {
        "EXACT": FLAG,
        "LOOK_UP": FLAG,
        "SHADING": (0, 1, 2, 3),
        "CALM": FLAG,
        "VISIBILITY": FLAG,
    },
    "points/resolve_lit.frag": dict.fromkeys(
        ("LOOK_UP", "LINEAR", "ALONE", "CALM", "CERTAINTY", "VISIBILITY", "SAME_SIZE", "HIDDEN", "FILLED"), FLAG
    )
    | {"ENVIRONMENT": AROUND},
    "points/resolve_picture.frag": {
        "LOOK_UP": FLAG,
        "SHADING": (0, 1, 2),
        "LINEAR": FLAG,
        "HIDDEN": FLAG,
        "FILLED": FLAG,
    },
    "points/resolve_surfaces.frag": {
        "LOOK_UP": FLAG,
        "SHADING": (0, 1, 2, 3),
        "CALM": FLAG,
        "CERTAINTY": FLAG,
        "VISIBILITY": FLAG,
        "SHARED": (0, 1, 2),
        "HIDDEN": FLAG,
        "FILLED": (0,),
    },
    "points/set_shadow.frag": {"LOOK_UP": FLAG},
    "shading/shadow.frag": {"LOOK_UP": FLAG},
    "points/large_splats.comp": {"SET": FLAG, "EXACT": FLAG, "WINDOW": FLAG, "BLOCK": (4, 1)},
    "points/rims.comp": {"SET": FLAG, "EXACT": FLAG, "WINDOW": FLAG},
    "points/rims.frag": {"LIT": FLAG, "SET": FLAG, "EXACT": FLAG},
    "points/rims.vert": {"LIT": FLAG, "KNOWN": FLAG},
    "surface/sparse_cells.frag": {"FROM_DEPTH": FLAG},
    "points/splats.frag": {"LIT": FLAG},
    "points/splats.vert": {"LIT": FLAG, "EXACT": FLAG},
    "points/set_splats.frag": {"EXACT": FLAG},
    "points/few_splats.vert": {"VISIBILITY": FLAG},
    "points/splats.comp": {
        "SET": FLAG,
        "EXACT": FLAG,
        "WINDOW": FLAG,
        "MASKED": (0, 1, 2),
        "BLOCK": (4, 1),
        "GROUP": (32, 64),
    },
    "surface/normals_adaptive.frag": {"STAGE": (0, 1, 2, 3), "BUMPY": FLAG},
    "surface/normals_plane_fit.frag": {"WINDOW": tuple(PLANE_FITS.values())},
    "surface/normals_sparse.frag": {"REST": FLAG},
    "surface/normals_star.frag": {"RESIDUAL": FLAG},
    "surface/temporal_change.frag": {"MOVED": FLAG},
    "points/point_confidence.frag": {"STAGE": (0, 1, 2)},
    "points/highlights.frag": {"STAGE": (0, 1, 2, 3)},
    "points/lit_samples.frag": {"ALIGNED": FLAG},
    "surface/unlighting.frag": {"ALIGNED": FLAG},
    "surface/completion_cells.frag": {"SAME_SIZE": FLAG},
    "surface/completion_blocks.frag": {"SAME_SIZE": FLAG},
    "surface/completion_stops.frag": {"SAME_SIZE": FLAG},
    "surface/completion_rays.frag": {"SAME_SIZE": FLAG, "HIDDEN": FLAG},
    "surface/completion_settled.frag": {"SAME_SIZE": FLAG},
    "surface/completion_pixels.frag": {"SAME_SIZE": FLAG, "HIDDEN": FLAG},
    "surface/completed_surface.frag": {"SAME_SIZE": FLAG, "PHOTO": FLAG},
    "clouds/splat.vert": {"BALLS": FLAG, "QUADS": FLAG},
    "clouds/depth.frag": {"BALLS": FLAG},
    "clouds/blend.frag": {"BALLS": FLAG},
    "clouds/ball.frag": {"BALLS": FLAG},
    "clouds/resolve.frag": {"COARSE": FLAG, "MARKED": FLAG},
}
FOLDER = shader_folder()
ENTRIES = sorted(path.relative_to(FOLDER).as_posix() for path in FOLDER.rglob("*") if path.suffix in STAGES)


SEED = int(os.environ.get("POINTSHADE_SEED", "1"))  # other random variants


def variants(page=True):
    """[(entry, constants)] of all programs that can fail differently; with those that only pages build, or without.

    Each combination of the constants in `#if`, which choose inputs; and each value of the others once, as `if`
    compiles both sides.
    """
    found = []
    for name in ENTRIES:
        constants = asked_for(name, page)
        first = {key: values[0] for key, values in constants.items()}
        conditions = " ".join(re.findall(r"^\s*#(?:el)?if\b(.*)", splice(name)[0], re.MULTILINE))
        inputs = [key for key in constants if re.search(rf"\b{key}\b", conditions)]
        for values in product(*(constants[key] for key in inputs)):
            found.append((name, first | dict(zip(inputs, values, strict=True))))
        for key in constants.keys() - inputs:
            found += [(name, first | {key: value}) for value in constants[key][1:]]
    return sorted(found, key=str)


def asked_for(name, page):
    """The constants of an entry file, and their values. TONE is 1 on pages alone."""
    constants = CONSTANTS.get(name, {})
    return constants if page else {key: values for key, values in constants.items() if key != "TONE"}


def random_variants(part, page=True):
    """Ten (entry, constants) with random values for all constants, of those entries that have several."""
    rng = random.Random(f"{SEED} {part}")
    for name in rng.choices([name for name in ENTRIES if len(CONSTANTS.get(name, {})) > 1], k=10):
        yield name, {key: rng.choice(values) for key, values in asked_for(name, page).items()}


@pytest.fixture(scope="module")
def complaints(renderer):
    """complaints(kind of shader, text): the log of a shader that does not compile, else ''."""
    if not sys.platform.startswith("linux"):
        pytest.skip("asks GL through EGL")
    if missing := {"GL_ARB_ES3_compatibility", "GL_ARB_ES3_1_compatibility"} - renderer.context.gl.extensions:
        if os.environ.get("POINTSHADE_REQUIRE_GL") == "1":
            pytest.fail(f"no GLSL ES in this context: {missing}")
        pytest.skip(f"no GLSL ES in this context: {missing}")

    def gl(name, result, *arguments):
        return ctypes.CFUNCTYPE(result, *arguments)(egl_address(name))

    number, whole, at = ctypes.c_uint, ctypes.c_int, ctypes.c_void_p
    create, delete = gl("glCreateShader", number, number), gl("glDeleteShader", None, number)
    put, build = gl("glShaderSource", None, number, whole, at, at), gl("glCompileShader", None, number)
    ask, tell = gl("glGetShaderiv", None, number, number, at), gl("glGetShaderInfoLog", None, number, whole, at, at)

    def compile_shader(stage, text):
        with renderer.context.gl:
            shader, source = create(stage), ctypes.c_char_p(text.encode())
            put(shader, 1, ctypes.byref(source), None)
            build(shader)
            compiled, log = whole(), ctypes.create_string_buffer(4000)
            ask(shader, COMPILE_STATUS, ctypes.byref(compiled))
            tell(shader, len(log), None, log)
            delete(shader)
        return "" if compiled.value else log.value.decode() or "no reason given"

    return compile_shader


def as_es(text, version, **constants):
    defines = "".join(f"#define {name} {value}\n" for name, value in constants.items())
    assert re.match(r"#version (330 core|430 core)\n", text)
    return f"#version {version} es\n{PRECISION}{defines}{text.split(chr(10), 1)[1]}"


def test_the_constants_of_each_shader_are_all_tried():
    assert len(ENTRIES) > 50
    for name in ENTRIES:
        found = re.findall(r"^#ifndef (\w+)", splice(name)[0], re.MULTILINE)
        assert set(found) <= set(CONSTANTS.get(name, {})), name  # without those that have no default


@pytest.mark.parametrize(("name", "constants"), variants(), ids=lambda value: str(value or "plain"))
def test_every_shader_compiles_as_glsl_es(complaints, name, constants):
    buffers = name.endswith(".comp") or constants.get("LOOK_UP")
    text = as_es(splice(name)[0], "310" if buffers else "300", **constants)
    assert complaints(STAGES[name[-5:]], text) == ""


@pytest.mark.parametrize("part", range(3), ids=lambda part: f"POINTSHADE_SEED={SEED} {part}")
def test_random_variants_compile_as_glsl_es(complaints, part):
    for name, constants in random_variants(part):
        print(name, constants)
        test_every_shader_compiles_as_glsl_es(complaints, name, constants)


def test_each_value_of_a_constant_and_each_choice_of_inputs_is_built():
    found = [(name, CONSTANTS.get(name, {}), constants) for name, constants in variants()]
    assert {name for name, _, _ in found} == set(ENTRIES) and len(found) < 400
    for entry, possible in CONSTANTS.items():
        built = [constants for name, _, constants in found if name == entry]
        for key, values in possible.items():
            assert {constants[key] for constants in built} == set(values)
    masked = [constants for name, _, constants in found if name == "points/splats.comp"]
    assert len(masked) == 15 and all(len(constants) == 6 for constants in masked)


@pytest.mark.parametrize(
    ("line", "complaint"),
    [
        ("ivec2 size = textureSize(picture, 0);", "constant expression"),  # a global by a function call
        ("float half_of(float x) { return x / 2; }", "operator|type"),  # no int becomes a float by itself
        ("float of_volume(sampler3D x) { return 1.0; }", "precision"),  # a sampler without one
    ],
)
def test_what_only_desktops_know_is_found(complaints, line, complaint):
    main = "out vec4 color;\nvoid main() { color = vec4(1.0); }\n"
    text = f"#version 330 core\nuniform sampler2D picture;\n{line}\n{main}"
    assert complaints(STAGES[".frag"], text) == ""
    assert re.search(complaint, complaints(STAGES[".frag"], as_es(text, "300")))


def test_no_name_is_one_of_compute_shaders():
    """In GLSL ES `shared` is a kind of memory. Mesa accepts it as a name, other drivers do not."""
    texts = {path.name: path.read_text() for path in FOLDER.rglob("*.*") if path.suffix != ".md"}
    assert [name for name, text in texts.items() if re.search(r"\bshared\b", re.sub(r"//.*", "", text))] == []
