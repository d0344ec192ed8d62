#version 330 core
// Noise pass 2: one texel per block of patches. The CPU reads them back and chooses the estimator.
#include "common/noise_levels.glsl"

uniform sampler2D patches;
uniform sampler2D patch_steps;

layout(location = 0) out vec4 levels;  // quartile of the noise in w and in z, median isolated jump in w, lattice step in z
layout(location = 1) out vec4 counts;

void main() {
    ivec2 block = ivec2(gl_FragCoord.xy);
    levels = vec4(block_quantile(patches, block, 0, 0.25), block_quantile(patches, block, 1, 0.25),
                  block_quantile(patches, block, 2, 0.5), block_quantile(patches, block, 3, 0.25));
    counts = block_counts(patches, patch_steps, block);
}
