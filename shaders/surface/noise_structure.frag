#version 330 core
// Noise pass 1 of noisy frames only: one texel per patch, by which noise_blocks.frag tells structure from noise.
#include "common/noise_levels.glsl"
#include "common/noise_structure.glsl"

uniform sampler2D depth_map;
uniform ivec2 first;  // first pixel of the first patch

layout(location = 0) out vec4 patch_texel;
layout(location = 1) out vec4 patch_steps;  // not used

void main() {
    patch_texel = structure_patch(depth_map, patch_corner(ivec2(gl_FragCoord.xy), first, 1) + 1);
    patch_steps = vec4(0.0);
}
