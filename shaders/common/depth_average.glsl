#include "common/inverse_depth.glsl"

// average_pairs: removes most of the noise of depth by point-symmetric pairs, in which every slope cancels.

const float PAIR_GATE = 4.0;   // standard deviations by which a pair may miss the pixel
const float PAIR_CHI2 = 2.2;   // spread of the pairs, in variances, above which the surface counts as curved
const float BOWL_CHI2 = 2.0;   // spread that a quadratic surface may leave
const float NEGLIGIBLE = 1e-7; // noise over depth that float32 rounding hides

// Depth and its relative noise after averaging w = 1/z over the 12 pairs of a 5x5 window. On every plane the mean of a
// pair is w of the pixel: so only pairs that agree with the pixel count, and a plane does not change.
// If the pairs differ from each other, but a quadratic surface explains them, its value in the centre replaces the mean
// (Savitzky, Golay 1964): this averages less, but does not flatten crests. `correlation` is noise that neighbours share
// over noise that they do not share; averaging does not reduce it.
vec2 average_pairs(sampler2D depth_map, ivec2 pixel, float noise, float correlation) {
    float here = depth_at(depth_map, pixel, ivec2(0));
    if (!(here > 0.0) || noise < NEGLIGIBLE) return vec2(here, noise);
    float variance = noise * noise;
    float wide = variance * (1.0 + 0.25 * correlation * correlation);
    float gate = PAIR_GATE * sqrt(wide);
    float pairs = 0.0, sum = 0.0, squares = 0.0, all = 0.0, all_squares = 0.0, uu = 0.0, uv = 0.0, vv = 0.0;
    for (int k = 13; k < 25; ++k) {
        ivec2 offset = ivec2(k % 5 - 2, k / 5 - 2);
        float before = relative_step(here, depth_at(depth_map, pixel, -offset));
        float after = relative_step(here, depth_at(depth_map, pixel, offset));
        float middle = 0.5 * (before + after);
        float inside = abs(middle) < gate ? 1.0 : 0.0;
        pairs += inside;
        sum += inside * middle;
        squares += inside * middle * middle;
        all += middle;
        all_squares += middle * middle;
        uu += middle * float(offset.x * offset.x - 2);
        vv += middle * float(offset.y * offset.y - 2);
        uv += middle * float(offset.x * offset.y);
    }
    float step = sum / (pairs + 0.5);
    float left = 1.0 / (1.0 + 2.0 * pairs);
    // A mean of two has half the variance. The quadratic is fitted to 25 samples, two per pair: sums over the
    // window of (u u - 2)^2, (v v - 2)^2 and (u v)^2 are 70, 70 and 100, and 13 - 4 samples remain.
    float spread = (squares - sum * sum / max(pairs, 1.0)) * 2.0 / (wide * max(pairs - 1.0, 1.0));
    float mean = all / 12.5;
    float bend_u = uu / 35.0, bend_v = vv / 35.0, bend_uv = uv / 50.0;
    float rest = 2.0 * all_squares - 25.0 * mean * mean
        - 70.0 * (bend_u * bend_u + bend_v * bend_v) - 100.0 * bend_uv * bend_uv;
    if (spread > PAIR_CHI2 && rest < BOWL_CHI2 * 9.0 * wide) {
        step = mean - 2.0 * (bend_u + bend_v);
        left = 27.0 / 175.0;
    }
    if (step < -0.5) return vec2(here, noise);  // noise as large as the depth itself
    return vec2(here / (1.0 + step), noise * sqrt(left + correlation * correlation));
}
