#version 330 core
// Noise pass 1: one texel per 4x4 patch. At stride > 1 only the noise sample (x), the mean depth (w) and the copied
// lines are valid. Copied lines are not counted at stride 1.
#include "common/line_copies.glsl"
#include "common/noise_levels.glsl"

uniform sampler2D depth_map;
uniform int stride;   // odd
uniform ivec2 first;  // first pixel of the first patch

layout(location = 0) out vec4 patch_texel;
layout(location = 1) out vec4 patch_steps;  // xy: steps along u and v, zw: copied lines and lines that could be copies

void main() {
    ivec2 corner = patch_corner(ivec2(gl_FragCoord.xy), first, stride);
    patch_texel = noise_patch(depth_map, corner, stride, patch_steps.xy);
    patch_steps.zw = vec2(0.0);
    if (stride == 1) return;  // copied lines are counted for noisy frames only
    patch_steps.zw = count_copies(depth_map, corner, ivec2(1, 0)) + count_copies(depth_map, corner, ivec2(0, 1));
}
