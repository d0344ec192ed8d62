#include "common/depth_average.glsl"
#include "common/robust_plane.glsl"
#include "common/normals_star.glsl"

// Surfaces from noisy depth, through 5x5 samples as far apart as the noise requires. Four methods in turn, each for the
// pixels that those before could not answer: calm_surface, robust_surface, nearer_surface, and star_slope of
// normals_star.glsl.

const float TILT = 0.006;      // radians of tilt noise that the fit is meant to reach
const float FIT_GAIN = 7.07;   // sqrt(50), the spread of 5x5 samples: sum of u u
const int WIDEST = 12;         // pixels between samples
const float BOWL_FIT = 2.0;    // chi square per sample for a quadratic surface through all samples
const float PLANE_FIT = 1.3;   // chi square per sample for a plane through some
const float FOOTING = 4.0;     // least spread of the weighted samples across their narrowest direction
const float AMID = 11.0;       // the same of samples on both sides of the pixel: it is 10 if they end there
const float BOWL_MOVE = 1.0;   // by so many times the noise a surface moves a point, at most: farther moves of
const float PLANE_MOVE = 0.5;  // neighbours that different fits answer would open pinholes

// Pixels between the samples: the tilt of a plane through 25 of them has an error of noise * focal length / (FIT_GAIN *
// stride). 0 if hardly any noise is left.
int widest_stride(vec2 here, vec4 intrinsics) {
    float focal = 0.5 * (abs(intrinsics.x) + abs(intrinsics.y));
    return int(min(here.y * focal / (FIT_GAIN * TILT) + 0.7, float(WIDEST)));
}

// A quadratic surface through samples `stride` pixels apart: by which share its w differs from the pixel's (x), and its
// slope per pixel relative to w (yz); w is 1 if all samples are known and lie on it, otherwise 0.
vec4 calm_surface(sampler2D calm_depth, ivec2 pixel, vec2 here, int stride) {
    float d[25];
    float known = 0.0;
    for (int k = 0; k < 25; ++k) {
        float there = depth_at(calm_depth, pixel, ivec2(k % 5 - 2, k / 5 - 2) * stride);
        d[k] = there > 0.0 ? relative_step(here.x, there) : 0.0;
        known += there > 0.0 ? 1.0 : 0.0;
    }
    vec4 bowl = fit_bowl(d, here.y * here.y);
    bool holds = stride > 0 && known > 24.5 && bowl.w < BOWL_FIT * 19.0 * here.y * here.y;
    float value = clamp(bowl.x, -BOWL_MOVE * here.y, BOWL_MOVE * here.y);
    return vec4(value, bowl.yz / float(max(stride, 1)), holds ? 1.0 : 0.0);
}

// The same for a robust plane through the known samples that lie on the pixel's own surface. Where this ends, x is 0: the
// plane would bend outlines.
vec4 robust_surface(sampler2D calm_depth, ivec2 pixel, vec2 here, int stride) {
    float d[25];
    float m[25];
    float variance = here.y * here.y;
    for (int k = 0; k < 25; ++k) {
        float there = depth_at(calm_depth, pixel, ivec2(k % 5 - 2, k / 5 - 2) * stride);
        m[k] = there > 0.0 ? 1.0 : 0.0;
        d[k] = there > 0.0 ? relative_step(here.x, there) : 0.0;
    }
    vec2 fit;
    vec3 plane = refine_plane(d, m, best_corner(d, m, variance), variance, fit);
    plane = refine_plane(d, m, plane, variance, fit);
    bool holds = stride > 0 && fit.x < PLANE_FIT && fit.y > FOOTING && abs(plane.x) < GATE * here.y;
    float value = fit.y > AMID ? clamp(plane.x, -PLANE_MOVE * here.y, PLANE_MOVE * here.y) : 0.0;
    return vec4(value, plane.yz / float(max(stride, 1)), holds ? 1.0 : 0.0);
}

// The same for pixels where neither fits at this stride: tries both with samples closer and closer. w is 0 if none fits
// at all.
vec4 nearer_surface(sampler2D calm_depth, ivec2 pixel, vec2 here, int stride) {
    vec4 found = vec4(0.0);
    for (int near = stride * 2 / 5; near > 0 && found.w < 0.5; near = near * 2 / 5) {
        found = calm_surface(calm_depth, pixel, here, near);
        if (found.w < 0.5) found = robust_surface(calm_depth, pixel, here, near);
    }
    return found;
}
