"""OpenGL itself, as PyOpenGL or imgui would call it behind moderngl's back; and all of its state that matters here."""

import ctypes

SWITCHES = {
    "BLEND": 0x0BE2, "COLOR_LOGIC_OP": 0x0BF2, "CULL_FACE": 0x0B44, "DEPTH_CLAMP": 0x864F, "DEPTH_TEST": 0x0B71,
    "DITHER": 0x0BD0, "FRAMEBUFFER_SRGB": 0x8DB9, "LINE_SMOOTH": 0x0B20, "MULTISAMPLE": 0x809D,
    "POLYGON_OFFSET_FILL": 0x8037, "POLYGON_OFFSET_LINE": 0x2A02, "POLYGON_OFFSET_POINT": 0x2A01,
    "POLYGON_SMOOTH": 0x0B41, "PRIMITIVE_RESTART": 0x8F9D, "PRIMITIVE_RESTART_FIXED_INDEX": 0x8D69,
    "PROGRAM_POINT_SIZE": 0x8642, "RASTERIZER_DISCARD": 0x8C89, "SAMPLE_ALPHA_TO_COVERAGE": 0x809E,
    "SAMPLE_ALPHA_TO_ONE": 0x809F, "SAMPLE_COVERAGE": 0x80A0, "SAMPLE_MASK": 0x8E51, "SCISSOR_TEST": 0x0C11,
    "STENCIL_TEST": 0x0B90, "TEXTURE_CUBE_MAP_SEAMLESS": 0x884F, **{f"CLIP_DISTANCE{k}": 0x3000 + k for k in range(8)},
}  # fmt: skip
NUMBERS = {
    "ACTIVE_TEXTURE": 0x84E0, "ARRAY_BUFFER": 0x8894, "BLEND_DST_ALPHA": 0x80CA, "BLEND_DST_RGB": 0x80C8,
    "BLEND_EQUATION_ALPHA": 0x883D, "BLEND_EQUATION_RGB": 0x8009, "BLEND_SRC_ALPHA": 0x80CB, "BLEND_SRC_RGB": 0x80C9,
    "CLIP_DEPTH_MODE": 0x935D, "CLIP_ORIGIN": 0x935C, "COPY_READ_BUFFER": 0x8F36, "COPY_WRITE_BUFFER": 0x8F37,
    "CULL_FACE_MODE": 0x0B45, "CURRENT_PROGRAM": 0x8B8D, "DEPTH_FUNC": 0x0B74, "DEPTH_WRITEMASK": 0x0B72,
    "DISPATCH_INDIRECT_BUFFER": 0x90EF, "DRAW_FRAMEBUFFER": 0x8CA6, "ELEMENT_ARRAY_BUFFER": 0x8895,
    "FRONT_FACE": 0x0B46, "LOGIC_OP_MODE": 0x0BF0, "PIXEL_PACK_BUFFER": 0x88ED, "PIXEL_UNPACK_BUFFER": 0x88EF,
    "POLYGON_MODE": 0x0B40, "PRIMITIVE_RESTART_INDEX": 0x8F9E, "PROVOKING_VERTEX": 0x8E4F, "READ_BUFFER": 0x0C02,
    "READ_FRAMEBUFFER": 0x8CAA, "RENDERBUFFER": 0x8CA7, "SCISSOR_BOX": 0x0C10, "SHADER_STORAGE_BUFFER": 0x90D3,
    "STENCIL_FUNC": 0x0B92, "STENCIL_REF": 0x0B97, "STENCIL_VALUE_MASK": 0x0B93, "STENCIL_WRITEMASK": 0x0B98,
    "UNIFORM_BUFFER": 0x8A28, "VERTEX_ARRAY": 0x85B5, "VIEWPORT": 0x0BA2,
    **{f"PIXEL_STORE_{name:x}": name for first in (0x0CF0, 0x0D00) for name in range(first, first + 6)},
    **{f"DRAW_BUFFER{k}": 0x8825 + k for k in range(8)},
}  # fmt: skip
FLOATS = {
    "BLEND_COLOR": 0x8005, "COLOR_CLEAR_VALUE": 0x0C22, "DEPTH_CLEAR_VALUE": 0x0B73, "DEPTH_RANGE": 0x0B70,
    "LINE_WIDTH": 0x0B21, "POINT_SIZE": 0x0B11, "POLYGON_OFFSET_FACTOR": 0x8038, "POLYGON_OFFSET_UNITS": 0x2A00,
    "SAMPLE_COVERAGE_VALUE": 0x80AA,
}  # fmt: skip
UNITS, TARGETS = 10, {"2D": 0x8069, "3D": 0x806A, "ARRAY": 0x8C1D, "SAMPLER": 0x8919}


class RawGL:
    """gl.Enable(...) calls glEnable: Python's floats go as float, others by ctypes."""

    def __init__(self, context):
        self._load = context.mglo._context.load_opengl_function

    def __getattr__(self, name):
        function = ctypes.CFUNCTYPE(ctypes.c_uint)(self._load(f"gl{name}"))
        function.argtypes = None
        return lambda *args: function(*[ctypes.c_float(a) if isinstance(a, float) else a for a in args])

    def numbers(self, name, *index):
        answer = (ctypes.c_int64 * 4)()
        (self.GetInteger64i_v if index else self.GetInteger64v)(name, *index, answer)
        return tuple(answer)

    def floats(self, name):
        answer = (ctypes.c_float * 4)()
        self.GetFloatv(name, answer)
        return tuple(answer)

    def state(self):
        """All of it, by name."""
        found = {name: self.IsEnabled(value) & 1 for name, value in SWITCHES.items()}
        found |= {name: self.numbers(value) for name, value in NUMBERS.items()}
        found |= {name: self.floats(value) for name, value in FLOATS.items()}
        for k in range(8):
            found[f"BLEND{k}"], found[f"COLOR_MASK{k}"] = self.IsEnabledi(0x0BE2, k) & 1, self.numbers(0x0C23, k)
        for k in range(4):
            for name in (0x90D3, 0x90D4, 0x90D5):
                found[f"STORAGE{k}_{name:x}"] = self.numbers(name, k)
            for name in (0x8F3A, 0x8F3B, 0x8F3C, 0x8F3D, 0x8F3E, 0x906E):
                found[f"IMAGE{k}_{name:x}"] = self.numbers(name, k)
        active = self.numbers(0x84E0)[0]
        for unit in (*range(UNITS), self.numbers(0x8872)[0] - 1):
            self.ActiveTexture(0x84C0 + unit)
            found |= {f"UNIT{unit}_{name}": self.numbers(value)[0] for name, value in TARGETS.items()}
        self.ActiveTexture(active)
        return found
