#version 330 core
#ifndef STRUCTURE
#define STRUCTURE 0  // 1: patches of noise_structure.frag
#endif
// Noise pass 2: one texel per block of patches. The CPU reads them back and chooses the estimator.
#include "common/noise_levels.glsl"

uniform sampler2D patches;
uniform sampler2D patch_steps;

// Quartile of the noise in w and in z, median isolated jump in w, lattice step in z; of STRUCTURE: quartile of the noise
// in w, 0, and the medians of the two ring residuals.
layout(location = 0) out vec4 levels;
layout(location = 1) out vec4 counts;

void main() {
    ivec2 block = ivec2(gl_FragCoord.xy);
#if STRUCTURE
    levels = vec4(block_quantile(patches, block, 0, 0.25), 0.0, block_quantile(patches, block, 2, 0.5),
                  block_quantile(patches, block, 3, 0.5));
    counts = vec4(0.0);
#else
    levels = vec4(block_quantile(patches, block, 0, 0.25), block_quantile(patches, block, 1, 0.25),
                  block_quantile(patches, block, 2, 0.5), block_quantile(patches, block, 3, 0.25));
    counts = block_counts(patches, patch_steps, block);
#endif
}
