#include "common/depth_average.glsl"
#include "common/robust_plane.glsl"
#include "common/normals_star.glsl"

// estimate_adaptive: normal from noisy depth; a robust plane through 5x5 samples, set as far apart as the noise asks.

const float TILT = 0.006;      // radians of tilt noise that the fit aims at
const float FIT_GAIN = 7.07;   // sqrt(50), the spread of 5x5 samples: sum of u u
const int WIDEST = 12;         // pixels between samples
const float BOWL_FIT = 2.0;    // chi square per sample for a quadratic surface through all samples
const float PLANE_FIT = 1.3;   // chi square per sample for a plane through some
const float FOOTING = 4.0;     // least spread of the weighted samples across their narrowest direction

// Slope of w per pixel relative to w (xy) from samples `stride` pixels apart, and 1 if the fit holds (z).
vec3 slope_at_stride(sampler2D picture, ivec2 pixel, vec2 here, int stride) {
    float d[25];
    float m[25];
    float known = 0.0, variance = here.y * here.y;
    for (int k = 0; k < 25; ++k) {
        float there = depth_at(picture, pixel, ivec2(k % 5 - 2, k / 5 - 2) * stride);
        m[k] = there > 0.0 ? 1.0 : 0.0;
        d[k] = there > 0.0 ? relative_step(here.x, there) : 0.0;
        known += m[k];
    }
    vec3 bowl = bowl_slope(d);
    if (known > 24.5 && bowl.z < BOWL_FIT * 19.0 * variance) return vec3(bowl.xy / float(stride), 1.0);
    vec2 fit;
    vec3 plane = refine_plane(d, m, best_corner(d, m, variance), variance, fit);
    plane = refine_plane(d, m, plane, variance, fit);
    bool holds = fit.x < PLANE_FIT && fit.y > FOOTING && abs(plane.x) < GATE * here.y;
    return vec3(plane.yz / float(stride), holds ? 1.0 : 0.0);
}

// Slope of w per pixel relative to w. The tilt of a plane through 25 samples is off by noise * focal length /
// (FIT_GAIN * stride): samples lie as far apart as that needs, nearer where no plane holds, and where none holds at
// all, or hardly any noise is left, the edge-exact estimator answers.
vec2 adaptive_slope(sampler2D picture, ivec2 pixel, vec2 here, vec4 intrinsics) {
    float focal = 0.5 * (abs(intrinsics.x) + abs(intrinsics.y));
    float wanted = here.y * focal / (FIT_GAIN * TILT);
    for (int stride = int(min(wanted + 0.7, float(WIDEST))); stride > 0; stride = stride * 2 / 5) {
        vec3 slope = slope_at_stride(picture, pixel, here, stride);
        if (slope.z > 0.5) return slope.xy;
    }
    return star_slope(picture, pixel, here.x, intrinsics, here.y).xy;
}

// Unit normal of `pixel` towards the camera, vec3(0) where its depth is missing. picture: depth and noise over depth
// after average_pairs.
vec3 estimate_adaptive(sampler2D picture, ivec2 pixel, vec4 intrinsics) {
    vec2 here = depth_and_noise_at(picture, pixel, ivec2(0));
    if (!(here.x > 0.0)) return vec3(0.0);
    vec2 ray = (vec2(pixel) - intrinsics.zw) / intrinsics.xy;
    return normal_of_slope(adaptive_slope(picture, pixel, here, intrinsics), ray, intrinsics);
}
