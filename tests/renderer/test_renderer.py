"""The Renderer as an owner: what it frees, whose context it uses, where it may be used, what it refuses."""

import ctypes
import inspect
import multiprocessing
import threading
from concurrent.futures import ThreadPoolExecutor

import moderngl
import numpy as np
import pytest

import pointshade_gl as ps

from ..support import frames


@pytest.fixture
def own_context(renderer):
    """A context of the caller, as of a window."""
    context = moderngl.create_context(standalone=True, backend="egl")
    context.__exit__(None, None, None)  # not current
    yield context
    context.release()


KINDS = ("Texture", "Buffer", "Framebuffer", "VertexArray", "Program", "Shader")


def egl_address(name):
    egl = ctypes.CDLL("libEGL.so.1")
    egl.eglGetProcAddress.restype = ctypes.c_void_p
    return egl.eglGetProcAddress(name.encode())


def living_objects(context, find_address=egl_address):
    """How many objects of each kind a context holds, asked of GL itself.

    GL keeps the programs that drew and computed last until others do, so one of each runs here first.
    """
    bound = context.detect_framebuffer()
    program = context.program(vertex_shader=MINIMAL, fragment_shader="#version 330 core\nvoid main() {}")
    array, texture = context.vertex_array(program, []), context.texture((1, 1), 4)
    target = context.framebuffer([texture])
    target.use()
    array.render(moderngl.POINTS, 1)
    bound.use()
    if context.version_code >= 430:
        compute = context.compute_shader(MINIMAL_COMPUTE)
        compute.run()
        compute.release()
    for item in (target, texture, array, program):
        item.release()
    counts = {}
    for kind in KINDS:
        exists = ctypes.CFUNCTYPE(ctypes.c_ubyte, ctypes.c_uint)(find_address(f"glIs{kind}"))
        counts[kind] = sum(exists(name) for name in range(1, 2000))
    return counts


MINIMAL = "#version 330 core\nvoid main() { gl_Position = vec4(2); }"
MINIMAL_COMPUTE = "#version 430 core\nlayout(local_size_x = 1) in; void main() {}"
TALL = ps.Camera(9, 9, 3, 4, 7, 9)


def test_release_frees_everything_and_leaves_a_borrowed_context_usable(own_context):
    with own_context:
        before = living_objects(own_context)
    with ps.Renderer(own_context) as renderer:
        for frame in (frames.sphere(), frames.single_pixel(), ps.Frame(None, np.ones((9, 7)), TALL)):
            renderer.render(frame, point_size=np.ones(frame.depth.shape))
            renderer.render(frame, camera=frame.camera.fitted(50, 40))
            renderer.estimate_normals(frame)
    with own_context:
        assert own_context.error == "GL_NO_ERROR"
        assert living_objects(own_context) == before


def test_the_count_of_objects_sees_one_that_was_left(own_context):
    with own_context:
        before = living_objects(own_context)
        left = own_context.texture((1, 1), 4)
        assert living_objects(own_context) != before
        left.release()


def test_the_same_picture_comes_from_an_own_and_a_borrowed_context(renderer, own_context):
    with ps.Renderer(own_context) as other:
        assert (other.render(frames.sphere()) == renderer.render(frames.sphere())).all()


def test_two_renderers_in_one_thread_do_not_disturb_each_other(renderer):
    expected = renderer.render(frames.sphere())
    with ps.Renderer() as other:
        other.render(frames.step())
        assert (renderer.render(frames.sphere()) == expected).all()


def test_frames_of_other_sizes_and_colours_follow_each_other(renderer):
    expected = renderer.render(frames.sphere(), shading="none")
    renderer.render(ps.Frame(None, np.ones((9, 7)), TALL))
    rgba = np.concatenate([frames.sphere().color, np.full((120, 160, 1), 255, np.uint8)], -1)
    opaque = ps.Frame(rgba, frames.sphere().depth, frames.CAMERA)
    assert (renderer.render(opaque, shading="none") == expected).all()
    assert (renderer.render(frames.sphere(), shading="none") == expected).all()


def test_another_thread_is_refused(renderer):
    with ThreadPoolExecutor(1) as pool, pytest.raises(ps.ContextError, match="belongs to the thread"):
        pool.submit(renderer.render, frames.sphere()).result()


def test_the_module_functions_work_in_every_thread(renderer):
    expected = renderer.render(frames.sphere())
    results = {}

    def work():
        results["image"] = ps.render(frames.sphere())
        results["normals"] = ps.estimate_normals(frames.sphere(), "triangles-4")

    thread = threading.Thread(target=work)
    thread.start()
    thread.join()
    assert (results["image"] == expected).all()
    assert results["normals"].shape == (120, 160, 3)


def _render_in_child(renderer, answers):
    try:
        renderer.render(frames.sphere())
    except ps.ContextError as error:
        answers.put(str(error))


@pytest.mark.filterwarnings("ignore:.*fork.*:DeprecationWarning")
def test_a_forked_process_is_refused_instead_of_hanging(renderer):
    fork = multiprocessing.get_context("fork")
    answers = fork.Queue()
    child = fork.Process(target=_render_in_child, args=(renderer, answers), daemon=True)
    child.start()
    assert "before a fork" in answers.get(timeout=20)
    child.join()


def test_the_functions_carry_signature_and_help_of_the_methods():
    assert list(inspect.signature(ps.render).parameters)[:8] == [
        "frame", "light", "material", "camera", "pose", "normals", "shading", "point_size",
    ]  # fmt: skip
    assert "alpha is 0" in (ps.render.__doc__ or "")


@pytest.mark.parametrize(
    ("options", "error", "complaint"),
    [
        ({"shading": "toon"}, ValueError, "unknown shading 'toon': known are none, flat, gouraud, phong, edl"),
        ({"splat": "star"}, ValueError, "unknown splat 'star'"),
        ({"normals": "magic"}, ValueError, "unknown normals method 'magic'"),
        ({"normals": np.zeros((2, 2, 3))}, ValueError, "normals must be a method's name"),
        ({"point_size": (160, 120)}, ValueError, "size is the splats' size in source pixels"),
        ({"pose": np.full((4, 4), np.nan)}, ValueError, "pose must be finite"),
        ({"camera": ps.Camera(9, 9, 9, 9, 10**6, 4)}, ValueError, "larger than this GPU's textures"),
    ],
)
def test_wrong_arguments_are_named_and_the_renderer_lives_on(renderer, options, error, complaint):
    with pytest.raises(error, match=complaint):
        renderer.render(frames.sphere(), **options)
    assert renderer.render(frames.sphere()).any()


def test_a_device_that_does_not_exist_is_named():
    with pytest.raises(ps.ContextError, match="device 99"):
        ps.Renderer(device=99)


def test_normals_of_the_caller_are_used(renderer):
    frame = frames.tilted_plane()
    facing = np.zeros((120, 160, 3))
    facing[..., 2] = -1
    light = ps.Light(direction=(0, 0, 1))
    matt = ps.Material(ambient=0, diffuse=1, specular=0)
    assert (renderer.render(frame, light, matt, normals=facing)[..., :3] == frame.color).all()


def test_no_light_leaves_the_ambient_term(renderer):
    material = ps.Material(ambient=1)
    image = renderer.render(frames.sphere(), light=[], material=material, ambient_occlusion=False)
    known = frames.sphere().depth > 0
    assert np.abs(image[known][:, :3].astype(int) - frames.sphere().color[known]).max() <= 1


def test_a_hundred_lights_add_up(renderer):
    one = renderer.render(frames.sphere(), ps.Light(position=(-1, -1, 0)), ps.Material(specular=0))
    many = [ps.Light(position=(-1, -1, 0), intensity=0.01)] * 100
    assert np.abs(renderer.render(frames.sphere(), many, ps.Material(specular=0)).astype(int) - one).max() <= 1


@pytest.mark.parametrize(
    ("arguments", "complaint"),
    [
        (
            (b"my_frame",),
            "frame must be a Frame, a sequence of frames, a Scene, a PointCloud or a path, got b'my_frame'",
        ),
        ((frames.sphere(), (1, 2, 3)), "light must be a Light or several of them, got 1"),
        ((ps.Scene(), "sun"), "light must be a Light or several of them, got 's'"),
    ],
)
def test_what_is_no_frame_or_light_is_named(renderer, arguments, complaint):
    with pytest.raises(TypeError, match=complaint):
        renderer.render(*arguments)


def test_what_is_no_content_is_named():
    with pytest.raises(TypeError, match="node 'five': its content must be a PointObject"):
        ps.Node(5, "five")
