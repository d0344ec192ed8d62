#version 330 core
#ifndef MEASURED
#define MEASURED 0  // patches of noise_patches.frag, 0 at stride 1, 1 at another; 2: of noise_structure.frag
#endif
// Noise pass 2: one texel per block of patches. The CPU reads them back and chooses the estimator.
#include "common/noise_levels.glsl"

uniform sampler2D patches;
uniform sampler2D patch_steps;

// Quartile of the noise in w and in z, median isolated jump in w, lattice step in z. At other
// strides only the first; of structure: quartile of the noise in w, 0, and the medians of the two ring residuals.
layout(location = 0) out vec4 levels;
layout(location = 1) out vec4 counts;

void main() {
    ivec2 block = ivec2(gl_FragCoord.xy);
    levels = vec4(0.0);
    for (int which = 0; which < (MEASURED == 1 ? 1 : 4); ++which) {  // a loop compiles faster than four calls
        float share = which < 2 || (which == 3 && MEASURED == 0) ? 0.25 : 0.5;
        levels[which] = block_quantile(patches, block, which, share);
    }
#if MEASURED == 2
    levels.y = 0.0;
    counts = vec4(0.0);
#else
    counts = block_counts(patches, patch_steps, block);
#endif
}
