#version 330 core
// A filled surface -> the same where whole gaps were filled; of those that were filled in part nothing stays.
#include "common/gap_filling.glsl"

uniform sampler2D surface_map;   // before
uniform sampler2D filled_map;    // these two from gap_filling.frag
uniform sampler2D filled_depth;
uniform int reach;

layout(location = 0) out vec4 normal;
layout(location = 1) out float depth;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    normal = texelFetch(filled_map, pixel, 0);
    depth = texelFetch(filled_depth, pixel, 0).x;
    bool was_gap = depth != 0.0 && texelFetch(surface_map, pixel, 0).w == 0.0;
    if (was_gap && is_left_open(surface_map, filled_map, filled_depth, pixel, reach)) {
        normal = vec4(0.0);
        depth = 0.0;
    }
}
