"""A caller's OpenGL context: nothing that is set in it changes our pictures, and all of it is afterwards as it was."""

import ctypes
import gc
import sys
from functools import cache

import moderngl
import numpy as np
import pytest

import pointshade_gl as ps
from pointshade_gl.gpu.context.caller_state import managed
from pointshade_gl.scene import shadow_cameras as shadow_views

from ..support import frames
from ..support.raw_gl import RawGL

MESH = ps.Mesh(np.array([[-0.5, -0.5, 1.2], [0.5, -0.5, 1.2], [0, 0.5, 1.2]]), np.array([[0, 1, 2]]))
LIGHTS = ps.Light(direction=(1, 1, 2), shadow=True), ps.Light(position=(-1, -1, 0), shadow=True)
UNITS = 8


SMALL = frames.CAMERA.resized(80, 60)


@cache
def noisy():
    frame = frames.noisy()
    return frame.color[::2, ::2], frame.depth[::2, ::2]


def frame():
    """Another one each time, so that it is uploaded."""
    return ps.Frame(*noisy(), SMALL)


def scene():
    parts = ps.PointObject(frame()), ps.PointObject(frame(), point_size=1.5, splat="round", shading="gouraud"), MESH
    parts += (ps.PointObject(frame(), splat="mesh", shading="flat"),)
    return ps.Scene(tuple(map(ps.Node, parts)), camera=SMALL)


def draw(renderer):
    texture = renderer.draw(frame(), shading="flat", pose=ps.orbit_pose(None, (0, 0, 1.5), yaw=15))
    with renderer._in_use():  # to read it sets state, too
        return np.frombuffer(texture.read(), np.uint8)


CALLS = {
    "render": lambda renderer: renderer.render(frame()),
    "draw": draw,
    "points": lambda renderer: renderer.render(frame(), point_size=np.full((60, 80), 1.5), splat="round"),
    "lit splats": lambda renderer: renderer.render(frame(), point_size=2, shading="flat"),
    "scene": lambda renderer: renderer.render(scene(), LIGHTS),
    "normals": lambda renderer: renderer.estimate_normals(frame(), "star-borrow"),
}


@pytest.fixture(scope="module", autouse=True)
def small_shadows():
    """Shadows are drawn by the same passes at any size."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(shadow_views, "SHADOW_SIDE", 64)
        yield


@pytest.fixture(scope="module")
def expected():
    with ps.Renderer() as renderer:
        return {name: call(renderer) for name, call in CALLS.items()}


@pytest.fixture
def context(renderer):
    context = moderngl.create_context(standalone=True, backend="egl")
    context.__exit__(None, None, None)  # not current
    yield context
    context.release()


@pytest.fixture
def gl(context):
    return RawGL(context)


class Things:
    """What a caller may have bound."""

    def __init__(self, context):
        self.texture = context.texture((20, 10), 4)
        self.depth = context.depth_texture((20, 10))
        self.framebuffer = context.framebuffer([self.texture, context.texture((20, 10), 4)], self.depth)
        self.other = context.simple_framebuffer((8, 8))
        self.buffer = context.buffer(reserve=4096)
        self.renderbuffer = context.renderbuffer((4, 4))
        vertex = "#version 330 core\nin vec2 at; void main() { gl_Position = vec4(at, 0, 1); }"
        fragment = "#version 330 core\nout vec4 color; void main() { color = vec4(1); }"
        self.program = context.program(vertex_shader=vertex, fragment_shader=fragment)
        self.array = context.vertex_array(self.program, self.buffer, "at")
        self.sampler = context.sampler(repeat_x=True, repeat_y=True, filter=(moderngl.LINEAR, moderngl.LINEAR))
        self.sampler.min_lod, self.sampler.compare_func = 3, ">"


def set_blending(context, gl, things):
    context.enable(moderngl.BLEND)
    context.blend_func, context.blend_equation = (moderngl.ONE, moderngl.ONE), moderngl.MIN
    gl.BlendColor(0.1, 0.2, 0.3, 0.4)


def set_blending_of_one_buffer(context, gl, things):
    gl.Enablei(0x0BE2, 1)
    gl.BlendFunc(0, 0)


def set_depth(context, gl, things):
    context.enable(moderngl.DEPTH_TEST)
    context.depth_func = ">"
    gl.DepthRange(ctypes.c_double(0.75), ctypes.c_double(0.25))
    gl.DepthMask(0)


def set_depth_never(context, gl, things):
    gl.DepthFunc(0x0200)


def set_stencil(context, gl, things):
    gl.Enable(0x0B90)
    gl.StencilFunc(0x0200, 1, 0xFF)
    gl.StencilMask(0)


def set_culling(context, gl, things):
    context.enable(moderngl.CULL_FACE)
    context.cull_face, context.front_face = "front_and_back", "cw"


def set_wireframe(context, gl, things):
    context.wireframe = True


def set_points(context, gl, things):
    gl.PolygonMode(0x0408, 0x1B00)
    context.enable(moderngl.PROGRAM_POINT_SIZE)


def set_discard(context, gl, things):
    context.enable(moderngl.RASTERIZER_DISCARD)


def set_scissor(context, gl, things):
    things.framebuffer.scissor = 1, 2, 3, 4
    things.framebuffer.use()


def set_scissor_by_gl(context, gl, things):
    gl.Enable(0x0C11)
    gl.Scissor(2, 2, 1, 1)


def set_viewport(context, gl, things):
    things.framebuffer.viewport = 1, 2, 3, 4
    things.framebuffer.use()
    gl.Viewport(0, 0, 2, 1)


def set_masks(context, gl, things):
    things.framebuffer.color_mask = ((False, True, False, True), (True, False, True, False))
    things.framebuffer.depth_mask = False
    things.framebuffer.use()


def set_all_masks(context, gl, things):
    gl.ColorMask(0, 0, 0, 0)
    gl.DepthMask(0)


def set_samplers(context, gl, things):
    for unit in range(UNITS):
        things.sampler.use(unit)


def set_pixel_store(context, gl, things):
    for first in (0x0CF0, 0x0D00):
        for name, value in ((0, 1), (1, 1), (2, 300), (3, 2), (4, 3), (5, 8)):
            gl.PixelStorei(first + name, value)


def set_pixel_buffers(context, gl, things):
    for target in (0x88EB, 0x88EC):
        gl.BindBuffer(target, things.buffer.glo)


def set_bound_objects(context, gl, things):
    things.framebuffer.use()
    gl.BindFramebuffer(0x8CA8, things.other.glo)
    gl.BindRenderbuffer(0x8D41, things.renderbuffer.glo)
    gl.UseProgram(things.program.glo)
    gl.BindVertexArray(things.array.glo)
    gl.BindBuffer(0x8892, things.buffer.glo)


def set_textures(context, gl, things):
    for unit in (*range(UNITS), context.default_texture_unit):
        things.texture.use(unit)
    context.texture3d((2, 2, 2), 4).use(1)
    gl.ActiveTexture(0x84C0 + 5)


def set_the_unit_of_uploads(context, gl, things):
    context.default_texture_unit = 9
    things.texture.use(9)


def set_storage_buffers(context, gl, things):
    things.buffer.bind_to_storage_buffer(0, 256, 512)
    things.buffer.bind_to_storage_buffer(1)
    gl.BindBufferBase(0x90D2, 2, things.buffer.glo)
    for target in (0x90D2, 0x90EE, 0x8A11):
        gl.BindBuffer(target, things.buffer.glo)


def set_images(context, gl, things):
    for unit in range(UNITS):
        things.texture.bind_to_image(unit, read=unit % 2 > 0, write=True)
    gl.BindImageTexture(1, things.texture.glo, 0, 0, 0, 0x88B8, 0x8058)


def set_logic(context, gl, things):
    gl.Enable(0x0BF2)
    gl.LogicOp(0x150A)


def set_clipping(context, gl, things):
    gl.ClipControl(0x8CA2, 0x935F)
    for k in range(8):
        gl.Enable(0x3000 + k)


def set_polygons(context, gl, things):
    context.polygon_offset = -900.0, -900.0
    gl.Enable(0x0B41)
    gl.Enable(0x864F)


def set_restart(context, gl, things):
    gl.Enable(0x8F9D)
    gl.PrimitiveRestartIndex(1)
    gl.Enable(0x8D69)


def set_samples(context, gl, things):
    gl.Enable(0x809E)
    gl.Enable(0x80A0)
    gl.SampleCoverage(0.0, 0)
    gl.Enable(0x8E51)
    gl.SampleMaski(0, 0)
    gl.Enable(0x8DB9)


def set_clear_values(context, gl, things):
    gl.ClearColor(0.1, 0.2, 0.3, 0.4)
    gl.ClearDepth(ctypes.c_double(0.25))


SETTERS = [setter for name, setter in list(globals().items()) if name.startswith("set_")]


def known_to_moderngl(context):
    return (
        context.fbo, context.mglo.fbo, context.viewport, context.scissor, context.wireframe, context.cull_face,
        context.front_face, context.default_texture_unit,
    )  # fmt: skip


@pytest.mark.parametrize("setter", SETTERS, ids=lambda setter: setter.__name__[4:])
def test_a_callers_state_changes_no_picture_and_is_kept(context, gl, expected, setter):
    with ps.Renderer(context) as renderer, context:
        things = Things(context)
        setter(context, gl, things)
        state, known = gl.state(), known_to_moderngl(context)
        for name, call in CALLS.items():
            np.testing.assert_array_equal(call(renderer), expected[name], err_msg=name)
            assert gl.state() == state
            assert known_to_moderngl(context) == known
        assert context.error == "GL_NO_ERROR"


def test_state_is_kept_when_a_renderer_comes_and_goes(context, gl, expected):
    with context:
        things = Things(context)
        for setter in SETTERS:
            setter(context, gl, things)
        context.clear_errors()  # a texture was uploaded from no such buffer
        state, known = gl.state(), known_to_moderngl(context)
        renderer = ps.Renderer(context)
        assert (gl.state(), known_to_moderngl(context)) == (state, known)
        np.testing.assert_array_equal(renderer.render(frame()), expected["render"])
        with pytest.raises(ValueError, match="larger than this GPU's textures"):
            renderer.render(frame(), camera=ps.Camera(9, 9, 9, 9, 10**6, 4))
        assert (gl.state(), known_to_moderngl(context)) == (state, known)
        renderer.release()
        assert (gl.state(), known_to_moderngl(context)) == (state, known)
        assert context.error == "GL_NO_ERROR"


def test_programs_of_gpus_keep_what_is_bound(context, gl, monkeypatch):
    """Their full-screen passes are compute shaders, which write images, and ask for the window themselves."""
    monkeypatch.setenv("POINTSHADE_PROGRAMS", "hardware")
    with ps.Renderer() as own:
        pictures = {name: call(own) for name, call in CALLS.items()}
    with context, ps.Renderer(context) as renderer:
        things = Things(context)
        for setter in (set_images, set_textures, set_scissor_by_gl, set_viewport, set_blending, set_discard):
            setter(context, gl, things)
        state, known = gl.state(), known_to_moderngl(context)
        for name, call in CALLS.items():
            np.testing.assert_array_equal(call(renderer), pictures[name], err_msg=name)
            assert (gl.state(), known_to_moderngl(context)) == (state, known)
        assert context.error == "GL_NO_ERROR"


def test_what_a_caller_draws_afterwards_goes_where_it_went_before(context, gl):
    with ps.Renderer(context) as renderer, context:
        things = Things(context)
        things.framebuffer.use()
        renderer.render(frame())
        context.clear(0.2, 0.4, 0.6, 0.8)
        assert things.texture.read()[:4] == bytes((51, 102, 153, 204))
        things.array.render(moderngl.TRIANGLES, 3)
        assert context.error == "GL_NO_ERROR"


def test_objects_that_were_deleted_while_bound_are_no_error(context, gl):
    with ps.Renderer(context) as renderer, context:
        things = Things(context)
        things.framebuffer.use()
        things.array.render(moderngl.TRIANGLES, 3)
        renderer.draw(frame()).use(3)
        things.array.release()
        things.program.release()
        renderer.render(frame(), camera=frames.CAMERA.fitted(50, 40))
        assert context.error == "GL_NO_ERROR"


@pytest.mark.parametrize(
    ("call", "error"),
    [
        (lambda gl: gl.Enable(1), "GL_INVALID_ENUM"),
        (lambda gl: gl.Scissor(0, 0, -1, -1), "GL_INVALID_VALUE"),
        (lambda gl: gl.UseProgram(999), "GL_INVALID_VALUE"),
        (lambda gl: gl.BindFramebuffer(0x8D40, 999), "GL_INVALID_OPERATION"),
    ],
)
def test_errors_that_gl_noted_before_are_not_taken_for_ours_and_wait_for_the_caller(context, gl, expected, call, error):
    with ps.Renderer(context) as renderer, context:
        call(gl)
        np.testing.assert_array_equal(renderer.render(frame()), expected["render"])
        assert context.error == error
        assert context.error == "GL_NO_ERROR"


def test_a_callers_want_of_memory_is_told_of_once_but_not_ours(context, gl, expected, capsys):
    with ps.Renderer(context) as renderer, context:
        gl.BindBuffer(0x8892, context.buffer(reserve=16).glo)
        for _ in range(2):
            gl.BufferData(0x8892, ctypes.c_int64(1 << 62), None, 0x88E4)
            np.testing.assert_array_equal(renderer.render(frame()), expected["render"])
    assert capsys.readouterr().err == "warning: OpenGL had noted error 0x0505 before this call\n"


def test_the_callers_context_stays_current(context, gl, expected):
    other = ps.Renderer()
    with ps.Renderer(context) as renderer, context:
        before = gl.state()
        for each in (renderer, other):
            np.testing.assert_array_equal(each.render(frame()), expected["render"])
            assert gl.state() == before
        assert context.texture((1, 1), 4, b"abcd").read() == b"abcd"
    other.release()


def test_moderngl_s_own_default_context_stays_the_callers(context):
    before = moderngl.get_context()
    with ps.Renderer():
        assert moderngl.get_context() is before is context
    assert moderngl.get_context() is context


def test_a_window_opens_and_draws_beside_a_context_that_is_current(display, context, gl, renderer):
    """On X11 GLX would end the process: the context is one of EGL."""
    from pointshade_gl.viewer import Viewer

    with context:
        before = gl.state()
        viewer = Viewer(frame(), window_size=(64, 48))
        viewer.step(wait=False)
        assert gl.state() == before
        renderer.render(frame())
        viewer.step(wait=False)
        viewer.release()
        assert gl.state() == before


def test_a_window_stays_current_beside_a_context_of_our_own(display, expected):
    """On X11 EGL cannot make ours current while GLX holds the window's: ours would draw into the window's."""
    from pointshade_gl.viewer.window import Window

    window = Window("pointshade", (64, 64), lambda _: None)
    try:
        with window:
            context = moderngl.create_context(context=window)
            gl, things = RawGL(context), Things(context)
            things.framebuffer.use()
            before, made = gl.state(), [gl.IsTexture(name) & 1 for name in range(1, 99)]
            with ps.Renderer() as renderer:
                np.testing.assert_array_equal(renderer.render(frame()), expected["render"])
                assert gl.state() == before
                assert [gl.IsTexture(name) & 1 for name in range(1, 99)] == made
            with ps.Renderer(context) as renderer:
                np.testing.assert_array_equal(renderer.render(frame()), expected["render"])
            assert gl.state() == before
    finally:
        window.release()


def test_what_was_never_left_does_nothing_later():
    """A signal's handler may raise inside `__enter__`: the collector must not run the end amid another call."""
    ended = []

    @managed
    def inside(name):
        try:
            yield name
        finally:
            ended.append(name)

    abandoned = inside("abandoned")
    assert abandoned.__enter__() == "abandoned"
    del abandoned
    gc.collect()
    assert ended == []
    with inside("left"):
        assert ended == []
    with pytest.raises(ValueError, match="failed"), inside("failed"):
        raise ValueError("failed")
    assert ended == ["left", "failed"]


def test_an_end_that_a_signal_comes_before_does_nothing_later():
    """It may raise at each line of `__exit__`, too: what has not ended by then never does."""
    interrupted, late = [], []

    @managed
    def inside(line):
        try:
            yield
        finally:
            late.extend([line] * (line in interrupted))

    for line in range(12):
        opened = inside(line)
        opened.__enter__()
        if _ends_with_a_signal(opened, line):
            interrupted.append(line)
        del opened
    gc.collect()
    assert late == []
    assert 2 < len(interrupted) < 12 and interrupted == list(range(len(interrupted)))


def _ends_with_a_signal(opened, line):
    """Leave a context, and raise before this line of its `__exit__`. Return whether it has so many."""
    code, left = type(opened).__exit__.__code__, [line]

    def trace(frame, event, arg):
        if event == "line":
            left[0] -= 1
            if left[0] < 0:
                raise KeyboardInterrupt
        return trace

    before = sys.gettrace()
    sys.settrace(lambda frame, event, arg: trace if frame.f_code is code else None)
    try:
        opened.__exit__(None, None, None)
    except KeyboardInterrupt:
        return True
    finally:
        sys.settrace(before)
    return False
