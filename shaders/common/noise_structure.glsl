#include "common/noise_patch.glsl"

// Tells structure from noise: noise is as large between near pixels as between distant ones, structure grows.

const int APART = 2;  // pixels between the samples of a patch

// |w - mean of w at the 8 pixels around it|, as far away as `reach`: every slope cancels. Divided by its gain for white
// noise, so that noise without structure gives the same for every reach. NOTHING beside a hole.
float ring_residual(sampler2D depth_map, ivec2 pixel, int reach) {
    float here = depth_at(depth_map, pixel, ivec2(0));
    float least = here, sum = 0.0;
    for (int k = 0; k < 9; ++k) {
        float z = depth_at(depth_map, pixel, ivec2(k % 3 - 1, k / 3 - 1) * reach);
        least = min(least, z);
        sum += k == 4 ? 0.0 : relative_step(here, z);
    }
    return least > 0.0 ? abs(sum) / (8.0 * sqrt(1.125) * here) : 1e30;
}

// x: the noise sample of noise_patch, of pixels that are APART; y and z: ring residuals of reach 1 and APART around one
// of them; w: 0. `corner` is the first pixel of the patch.
vec4 structure_patch(sampler2D depth_map, ivec2 corner) {
    float third[4];
    float least = 1e30;
    for (int k = 0; k < 4; ++k) {
        float w[4];
        for (int i = 0; i < 4; ++i) {
            float z = depth_at(depth_map, corner, ivec2(i, k) * APART);
            least = min(least, z);
            w[i] = 1.0 / max(z, 1e-30);
        }
        third[k] = third_difference(w[0], w[1], w[2], w[3]);
    }
    float noise = abs(third_difference(third[0], third[1], third[2], third[3])) / 20.0;
    vec2 rings = vec2(0.0);
    for (int v = 0; v < 2; ++v) {
        vec2 least_here = vec2(1e30);
        for (int u = 0; u < 2; ++u) {
            ivec2 pixel = corner + ivec2(u, v) * APART + APART;
            least_here = min(least_here, vec2(ring_residual(depth_map, pixel, 1), ring_residual(depth_map, pixel, APART)));
        }
        rings += least_here;
    }
    return vec4(least > 0.0 ? noise : NOTHING, max(rings.x, rings.y) < 1e29 ? rings : vec2(NOTHING), 0.0);
}
