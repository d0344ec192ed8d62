#version 330 core
// Noise pass 1: one texel per 4x4 patch. At stride > 1 only the noise sample (x) and the mean depth (w) mean anything.
#include "common/noise_levels.glsl"

uniform sampler2D depth_map;
uniform int stride;   // odd
uniform ivec2 first;  // first pixel of the first patch

layout(location = 0) out vec4 patch_texel;
layout(location = 1) out vec2 patch_steps;

void main() {
    patch_texel = noise_patch(depth_map, patch_corner(ivec2(gl_FragCoord.xy), first, stride), stride, patch_steps);
}
