"""Full-screen passes: a fragment shader that reads textures and fills a framebuffer."""

from __future__ import annotations

from typing import Any

import moderngl

from ..context.software_driver import IMAGE_2D, IMAGES
from ..context.state_parts import UNITS
from .memory import Owner, allocate
from .programs import build_program, set_uniforms


class FullscreenPass(Owner):
    """A fragment shader drawn over a whole target."""

    def __init__(self, context: moderngl.Context, fragment: str, version: int = 330, **constants: int):
        super().__init__(context)
        with self._all_or_nothing():
            program = build_program(context, "fullscreen.vert", fragment, None, version, **constants)
            self._program = self._keep(program)
            self._array = self._allocate(context.vertex_array, program, [])

    def draw(self, target: moderngl.Framebuffer, textures: dict[str, moderngl.Texture], /, **uniforms: Any) -> None:
        """Draw onto the target. textures: by the names of their samplers; they may also be among the uniforms."""
        set_inputs(self._program, textures | uniforms)
        target.use()
        self._array.render(moderngl.TRIANGLES, 3)


class FullscreenPasses(Owner):
    """Whatever draws full-screen passes: each is made when it is first asked for."""

    def __init__(self, context: moderngl.Context):
        super().__init__(context)
        self._passes: dict[Any, FullscreenPass] = {}

    def fullscreen(self, fragment: str, look_up: bool | None = None, **constants: int) -> FullscreenPass:
        """Return a pass. look_up: for shaders that find splats, whether compute shaders drew them (OpenGL 4.3)."""
        constants |= {} if look_up is None else {"LOOK_UP": int(look_up)}
        key = fragment, *constants.items()
        if key not in self._passes:
            version = 430 if look_up else 330
            self._passes[key] = self._keep(FullscreenPass(self._context, fragment, version, **constants))
        return self._passes[key]


def set_inputs(program: moderngl.Program | moderngl.ComputeShader, inputs: dict[str, Any]) -> None:
    """Set uniforms by name. Every texture among them is bound, and the number of its unit put in its place."""
    names = [name for name, value in inputs.items() if isinstance(value, moderngl.Texture)]
    assert len(names) <= UNITS, "more textures than a caller's state is kept for"
    for unit, name in enumerate(names):
        bind_texture(program, name, inputs[name], unit)
        inputs[name] = unit
    set_uniforms(program, **inputs)


def bind_texture(
    program: moderngl.Program | moderngl.ComputeShader, name: str, texture: moderngl.Texture, unit: int
) -> None:
    """Bind a texture as the program reads it: as a sampler, or as an image."""
    if program[name].gl_type == IMAGE_2D:  # type: ignore[union-attr]
        is_as_said = IMAGES[name] == "rgba"[: texture.components] + {"f4": "32f", "f2": "16f"}.get(texture.dtype, "")
        assert is_as_said, f"{name} must be {IMAGES[name]}: software drivers read it as an image"
        texture.bind_to_image(unit, read=True, write=False)
    else:
        texture.use(unit)


def data_texture(context: moderngl.Context, width: int, height: int, components: int) -> moderngl.Texture:
    """Return a float32 texture that is read texel by texel. Raises MemoryError where it does not fit."""
    texture = allocate(context, context.texture, (width, height), components, dtype="f4")
    texture.filter = (moderngl.NEAREST, moderngl.NEAREST)
    return texture
