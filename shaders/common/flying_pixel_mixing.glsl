#include "common/inverse_depth.glsl"

// Depth samples that lie between two surfaces: a sensor whose beams are wider than its pixels mixes both.

const float LEAST_JUMP = 0.05;  // share of 1/z by which two surfaces differ at least
const float INSIDE = 0.03;      // share of the jump by which a mixed sample lies within it
const float LEVEL = 0.17;       // share of the jump by which either surface may change from sample to sample
const int FARTHEST = 2;         // samples to each side, between which both surfaces are looked for
const int COUNTED = 16;         // samples along a block whose sums are read back

// By how much 1/z differs between two samples, 0 if one is missing.
float known_change(float z_a, float z_b) {
    return z_a > 0.0 && z_b > 0.0 ? abs(1.0 / z_a - 1.0 / z_b) : 0.0;
}

// What a sample is along one direction, between samples so far to both sides: x is 1 if it is mixed, y if it lies at a
// step without being mixed.
vec2 mixing_along(sampler2D depth_map, ivec2 pixel, ivec2 along, int reach) {
    float here = depth_at(depth_map, pixel, ivec2(0));
    float before = depth_at(depth_map, pixel, -reach * along);
    float after = depth_at(depth_map, pixel, reach * along);
    if (!(here > 0.0 && before > 0.0 && after > 0.0)) return vec2(0.0);
    float w = 1.0 / here, w_before = 1.0 / before, w_after = 1.0 / after;
    float jump = abs(w_after - w_before);
    float beside = max(
        known_change(after, depth_at(depth_map, pixel, (reach + 1) * along)),
        known_change(before, depth_at(depth_map, pixel, -(reach + 1) * along))
    );
    if (jump <= LEAST_JUMP * w || beside >= LEVEL * jump) return vec2(0.0);
    float inside = min(w - min(w_before, w_after), max(w_before, w_after) - w);
    return inside > INSIDE * jump ? vec2(1.0, 0.0) : vec2(0.0, 1.0);
}

// The same for all directions: whether a sample is mixed, or else lies at a step of its row or column.
vec2 find_mixing(sampler2D depth_map, ivec2 pixel) {
    float mixed = 0.0;
    for (int reach = 1; reach <= FARTHEST; ++reach) {
        mixed = max(mixed, mixing_along(depth_map, pixel, ivec2(1, 0), reach).x);
        mixed = max(mixed, mixing_along(depth_map, pixel, ivec2(0, 1), reach).x);
        mixed = max(mixed, mixing_along(depth_map, pixel, ivec2(1, 1), reach).x);
        mixed = max(mixed, mixing_along(depth_map, pixel, ivec2(1, -1), reach).x);
    }
    vec2 steps = vec2(
        mixing_along(depth_map, pixel, ivec2(1, 0), 1).y, mixing_along(depth_map, pixel, ivec2(0, 1), 1).y
    );
    return vec2(mixed, (1.0 - mixed) * max(steps.x, steps.y));
}

// How many samples of a block are mixed, and how many lie at a step.
vec2 count_mixing(sampler2D mixing_map, ivec2 block) {
    ivec2 size = textureSize(mixing_map, 0);
    vec2 sum = vec2(0.0);
    for (int k = 0; k < COUNTED * COUNTED; ++k) {
        ivec2 pixel = block * COUNTED + ivec2(k % COUNTED, k / COUNTED);
        if (pixel.x < size.x && pixel.y < size.y) sum += texelFetch(mixing_map, pixel, 0).rg;
    }
    return sum;
}
