#include "common/color.glsl"
#include "common/picture.glsl"
#include "common/splat_corners.glsl"

// A small copy of a frame, by which its pose is found: points that surely lie on a surface, and how bright they are.

const float FLATTEST_COSINE = 0.2;  // between the normal and the way to the eye: what is seen flatter is left out
const float DEPTH_STEP = 0.05;      // share of the depth; nearer to such a step pixels may fly
const int STEP_REACH = 2;           // pixels
const int TAPS = 5;                 // places across a cell where its brightness is read, at most

// Unit normal and depth at a pixel; depth 0 where the point is missing, seen flat, or beside a step in depth.
vec4 surface_away_from_steps(sampler2D surface_map, ivec2 pixel, vec4 source) {
    vec4 own = surface_at(surface_map, pixel);
    if (own.w == 0.0) return vec4(0.0);
    vec3 ray = pixel_ray(vec2(pixel), source);
    if (-dot(own.xyz, ray) < FLATTEST_COSINE * length(ray)) return vec4(0.0);
    ivec2 last = textureSize(surface_map, 0) - 1;
    float low = own.w, high = own.w;
    for (int v = -STEP_REACH; v <= STEP_REACH; ++v) {
        for (int u = -STEP_REACH; u <= STEP_REACH; ++u) {
            float z = surface_at(surface_map, clamp(pixel + ivec2(u, v), ivec2(0), last)).w;
            low = z > 0.0 ? min(low, z) : low;
            high = max(high, z);
        }
    }
    return high > (1.0 + DEPTH_STEP) * low ? vec4(0.0) : own;
}

// Square root of the mean linear luminance within half a cell of a pixel: noise is about the same everywhere in it, and
// another exposure is a factor on it. cell: pixels along a side.
float cell_brightness(sampler2D color_map, vec2 pixel, vec2 size, int cell) {
    int taps = min(cell, TAPS);
    float sum = 0.0;
    for (int v = 0; v < taps; ++v) {
        for (int u = 0; u < taps; ++u) {
            vec2 offset = ((vec2(u, v) + 0.5) / float(taps) - 0.5) * float(cell);
            sum += dot(srgb_to_linear(picture_at(color_map, pixel + offset, size)), vec3(0.2126, 0.7152, 0.0722));
        }
    }
    return sqrt(sum / float(taps * taps));
}
