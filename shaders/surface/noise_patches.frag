#version 330 core
#ifndef COARSE
#define COARSE 0  // 1: stride > 1
#endif
// Noise pass 1: one texel per 4x4 patch. At stride > 1 only the noise sample (x), the mean depth (w) and the copied
// lines are valid. Copied lines are not counted at stride 1: that is for noisy frames only.
#include "common/upsampling_artifacts.glsl"
#include "common/noise_levels.glsl"

uniform sampler2D depth_map;
uniform int stride;   // odd
uniform ivec2 first;  // first pixel of the first patch

layout(location = 0) out vec4 patch_texel;
layout(location = 1) out vec4 patch_steps;  // xy: steps along u and v, zw: copied lines and lines that could be copies

void main() {
    ivec2 corner = patch_corner(ivec2(gl_FragCoord.xy), first, stride);
    patch_texel = noise_patch(depth_map, corner, stride, patch_steps.xy);
#if COARSE
    patch_steps.zw = count_copies(depth_map, corner, ivec2(1, 0)) + count_copies(depth_map, corner, ivec2(0, 1));
#else
    patch_steps.zw = vec2(0.0);
#endif
}
