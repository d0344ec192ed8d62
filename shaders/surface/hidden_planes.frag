#version 330 core
// A surface (unit normal, depth) -> a smaller picture of what it hides, which casts shadows, too.
#include "common/hidden_planes.glsl"

uniform sampler2D surface_map;
uniform vec4 source;
uniform int stride;  // pixels of the surface for each of the smaller picture

out vec4 surface;

void main() {
    ivec2 last = textureSize(surface_map, 0) - 1;
    surface = hidden_at(surface_map, min(ivec2(gl_FragCoord.xy) * stride + stride / 2, last), stride, source);
}
