#include "common/inverse_depth.glsl"

// What one 4x4 patch of a depth picture shows about its noise and its rounding.

const float NOTHING = -1.0;     // no value
const float JUMP_LIMIT = 0.05;  // a larger relative step between plateaus is a depth edge, not a rounding step
const float ULPS = 1e-6;        // rounding error of float32 in a second difference of depths, over depth
const float EXACT = 0.06;       // error allowed for a multiple of the lattice step, in steps

// Step of 1/z in a run of four depths that are equal, step, equal; 1e30 for other runs. Smooth surfaces have no such
// runs, rounded ones have many.
float isolated_jump(float a, float b, float c, float d) {
    float jump = abs(c - b);
    bool isolated = a == b && c == d && jump > 0.0 && min(a, d) > 0.0 && jump < JUMP_LIMIT * min(b, c);
    return isolated ? jump / (b * c) : 1e30;
}

float third_difference(float a, float b, float c, float d) {
    return (d - a) + 3.0 * (b - c);
}

// Whether a second difference is zero or a multiple of step. Large multiples prove nothing.
bool is_lattice(float second, float step) {
    float ratio = abs(second) / step;
    return ratio > 20.5 || abs(ratio - floor(ratio + 0.5)) < EXACT;
}

// The findings of one patch; `corner` is its first pixel, `stride` the distance of its samples.
// x: |third difference along u of the third difference along v| of w = 1/z, over its gain 20: one sample of the
// noise. Differences of high order in both directions at once cancel every f(u) + g(v) and everything smoother than
// a few pixels, but keep white noise (Immerkaer 1996, with third instead of second differences).
// y: smallest isolated jump in w. z: step of the lattice on which the depths lie: 16-bit pictures hold k * step, so
// second differences along rows and columns are small multiples of the step even on steep surfaces. The smallest one
// counts if all others are multiples of it, and if both signs or a zero occur, as rounding makes them.
// w: mean depth, 0 where nothing is known. steps: unequal neighbours along u and along v, of 4 each.
// NOTHING stands for a value that cannot be measured.
vec4 noise_patch(sampler2D depth_map, ivec2 corner, int stride, out vec2 steps) {
    float z[16];
    float w[16];
    float known = 0.0, sum = 0.0;
    for (int k = 0; k < 16; ++k) {
        z[k] = depth_at(depth_map, corner, ivec2(k % 4, k / 4) * stride);
        w[k] = 1.0 / max(z[k], 1e-30);
        known += z[k] > 0.0 ? 1.0 : 0.0;
        sum += z[k];
    }
    steps = vec2(0.0);
    float pairs = 0.0, jump = 1e30, smallest = 1e30, zeros = 0.0, signs = 0.0, rounding = ULPS * sum / max(known, 1.0);
    float second[16];
    float third[4];
    for (int k = 0; k < 4; ++k) {
        float a = z[4 * k], b = z[4 * k + 1], c = z[4 * k + 2], d = z[4 * k + 3];
        second[4 * k] = min(a, min(b, c)) > 0.0 ? (c - b) - (b - a) : 0.0;
        second[4 * k + 1] = min(b, min(c, d)) > 0.0 ? (d - c) - (c - b) : 0.0;
        jump = min(jump, isolated_jump(a, b, c, d));
        pairs += min(b, c) > 0.0 ? 1.0 : 0.0;
        steps.x += b == c ? 0.0 : 1.0;
        third[k] = third_difference(w[4 * k], w[4 * k + 1], w[4 * k + 2], w[4 * k + 3]);
        a = z[k], b = z[k + 4], c = z[k + 8], d = z[k + 12];
        second[4 * k + 2] = min(a, min(b, c)) > 0.0 ? (c - b) - (b - a) : 0.0;
        second[4 * k + 3] = min(b, min(c, d)) > 0.0 ? (d - c) - (c - b) : 0.0;
        jump = min(jump, isolated_jump(a, b, c, d));
        pairs += min(b, c) > 0.0 ? 1.0 : 0.0;
        steps.y += b == c ? 0.0 : 1.0;
    }
    for (int k = 0; k < 16; ++k) {
        float size = abs(second[k]);
        smallest = size > rounding ? min(smallest, size) : smallest;
        zeros += size > rounding ? 0.0 : 1.0;
        signs += size > rounding ? sign(second[k]) : 0.0;
    }
    bool lattice = smallest < 1e29 && smallest > 8.0 * rounding && zeros < 13.5 && (zeros > 0.5 || abs(signs) < 15.5);
    for (int k = 0; k < 16; ++k) lattice = lattice && (abs(second[k]) <= rounding || is_lattice(second[k], smallest));
    if (pairs < 7.5) steps = vec2(NOTHING);
    float noise = abs(third_difference(third[0], third[1], third[2], third[3])) / 20.0;
    return vec4(known > 15.5 ? noise : NOTHING, jump < 1e29 ? jump : NOTHING, lattice ? smallest : NOTHING,
                known > 0.0 ? sum / known : 0.0);
}
