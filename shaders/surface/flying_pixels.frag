#version 330 core
// Depth -> which samples lie between two surfaces or beside a step (common/flying_pixel_mixing.glsl), and depth without the first.
#include "common/flying_pixel_mixing.glsl"

uniform sampler2D depth_map;

layout(location = 0) out vec2 mixing;
layout(location = 1) out float unmixed;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    mixing = find_mixing(depth_map, pixel);
    unmixed = mixing.x > 0.0 ? 0.0 : depth_at(depth_map, pixel, ivec2(0));
}
