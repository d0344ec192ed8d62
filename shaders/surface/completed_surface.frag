#version 330 core
// A surface and what was completed of it -> both as one.
#include "common/completion_pixels.glsl"

uniform sampler2D surface_map;
uniform sampler2D completed_map;  // from completion_pixels.frag
uniform sampler2D color_map;
uniform vec4 source;
uniform float beyond;

out vec4 surface;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    bool is_seen = PHOTO == 1 && guide_at(color_map, pixel, textureSize(surface_map, 0)).a > 0.0;
    surface = join_completed(surface_map, completed_map, pixel, source, is_seen ? beyond : 0.0);
}
