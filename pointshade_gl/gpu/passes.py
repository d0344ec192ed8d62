"""One full-screen pass: textures in, a framebuffer out."""

from __future__ import annotations

from typing import Any

import moderngl

from .programs import build_program, set_uniforms


class FullscreenPass:
    """A fragment shader drawn over a whole target."""

    def __init__(self, context: moderngl.Context, fragment: str, version: int = 330, **constants: int):
        self._program = build_program(context, "fullscreen.vert", fragment, None, version, **constants)
        self._array = context.vertex_array(self._program, [])

    def draw(self, target: moderngl.Framebuffer, textures: dict[str, moderngl.Texture], /, **uniforms: Any) -> None:
        """textures by the names of their samplers; they may also stand among the uniforms."""
        inputs = textures | uniforms
        bind_textures(inputs)
        set_uniforms(self._program, **inputs)
        target.use()
        self._array.render(moderngl.TRIANGLES, 3)

    def release(self) -> None:
        self._array.release()
        self._program.release()


def bind_textures(inputs: dict[str, Any]) -> None:
    """Binds every texture among the inputs and puts the number of its unit in its place."""
    names = [name for name, value in inputs.items() if isinstance(value, moderngl.Texture)]
    for unit, name in enumerate(names):
        inputs[name].use(unit)
        inputs[name] = unit


def data_texture(context: moderngl.Context, width: int, height: int, components: int) -> moderngl.Texture:
    """A float32 texture that is read texel by texel."""
    texture = context.texture((width, height), components, dtype="f4")
    texture.filter = (moderngl.NEAREST, moderngl.NEAREST)
    return texture
