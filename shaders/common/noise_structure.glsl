#include "common/noise_patch.glsl"

// Tells structure from noise: noise is as large between near pixels as between distant ones, structure grows.

const int APART = 3;         // pixels between the samples of a patch; odd, so that patches keep their centre
const int WIDE_RING = 2;     // pixels from the middle to the wider ring
const float NO_RING = 1e30;  // beside a hole

// |w - mean of the 8 pixels `reach` around it|: every slope cancels. White noise gives the same for every reach.
float ring_residual(sampler2D depth_map, ivec2 pixel, int reach) {
    float here = depth_at(depth_map, pixel, ivec2(0));
    float least = here, sum = 0.0;
    for (int k = 0; k < 9; ++k) {
        float there = depth_at(depth_map, pixel, ivec2(k % 3 - 1, k / 3 - 1) * reach);
        least = min(least, there);
        sum += k == 4 ? 0.0 : relative_step(here, there);
    }
    return least > 0.0 ? abs(sum) / (8.0 * here) : NO_RING;
}

// Of the patch around 2x2 pixels of which `first` is the first. x: noise as in noise_patch, of samples that lie APART; y
// and z: ring residuals of reach 1 and WIDE_RING, summed over the pairs of the four pixels: the lesser of each pair,
// because one may lie on an edge. NOTHING stands for what cannot be measured.
vec4 structure_patch(sampler2D depth_map, ivec2 first) {
    float third[4];
    float least = 1e30;
    for (int k = 0; k < 4; ++k) {
        float w[4];
        for (int i = 0; i < 4; ++i) {
            float z = depth_at(depth_map, first, ivec2(i, k) * APART - APART);
            least = min(least, z);
            w[i] = 1.0 / max(z, 1e-30);
        }
        third[k] = third_difference(w[0], w[1], w[2], w[3]);
    }
    float noise = abs(third_difference(third[0], third[1], third[2], third[3])) / 20.0;
    vec2 ring[4];
    for (int k = 0; k < 4; ++k) {
        ivec2 pixel = first + ivec2(k % 2, k / 2);
        ring[k] = vec2(ring_residual(depth_map, pixel, 1), ring_residual(depth_map, pixel, WIDE_RING));
    }
    vec2 rings = min(ring[0], ring[1]) + min(ring[2], ring[3]) + min(ring[0], ring[2]) + min(ring[1], ring[3]);
    if (max(rings.x, rings.y) >= NO_RING) rings = vec2(NOTHING);
    return vec4(least > 0.0 ? noise : NOTHING, rings, 0.0);
}
