"""In your own OpenGL context.

A Renderer draws in the moderngl context of your application, and leaves its state as it was: here a program draws a
sky, and lays the texture that `draw` returns over it. The picture never leaves the GPU. The argument is a
folder of your own.
"""

import sys

import moderngl
import numpy as np

import pointshade_gl as ps

SKY = "void main() { color = vec4(mix(vec3(.1, .2, .5), vec3(1, .7, .5), at.y), 1); }"
LAID = "uniform sampler2D picture; void main() { color = texture(picture, at); }"
gl = moderngl.create_standalone_context(backend="egl")
target = gl.simple_framebuffer((480, 360))


def fill(main):
    """Draw over the whole target, upside down, as rows of pictures come."""
    corners = "const vec2 c[4] = vec2[](vec2(0), vec2(1, 0), vec2(0, 1), vec2(1)); out vec2 at;"
    vertex = f"#version 330\n{corners} void main() {{ at = c[gl_VertexID]; gl_Position = vec4(at * 2 - 1, 0, 1); }}"
    program = gl.program(vertex_shader=vertex, fragment_shader=f"#version 330\nin vec2 at; out vec4 color; {main}")
    target.use()
    gl.vertex_array(program, []).render(moderngl.TRIANGLE_STRIP, vertices=4)


frame = ps.load_frame(*sys.argv[1:2] or ["vase"])
with ps.Renderer(gl) as renderer:
    fill(SKY)
    renderer.draw(frame, camera=frame.camera.fitted(480, 360), samples=16).use()
    gl.enable(moderngl.BLEND)
    fill(LAID)
picture = np.frombuffer(target.read(), np.uint8).reshape(360, 480, 3)
ps.save_image("own_context.png", picture)
