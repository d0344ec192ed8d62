#version 330 core
// The blended splats of a view -> the depth of one surface in each pixel, and how much of it is covered: a mean of a
// near surface and one behind it would lie in mid-air. The rim of an object has the depth of what is solid beside it.
#include "common/camera.glsl"
#include "common/trained_splats.glsl"

uniform sampler2D depths_sum;
uniform vec4 target;      // intrinsics
uniform float reference;
uniform float thickness;  // of a surface of splats

out vec2 seen;

const float STEP = 0.28;          // thicknesses between the places round a pixel that are asked
const int SPAN = 2;               // of them on each side: 25 in all
const float THIN = 0.8;           // share of the nearer surface below which it may end there,
const float BARE = 0.25;          // and below which it has ended
const float MANY_THIN = 9.0;      // so many places make a rim; where fewer are thin it is a leak,
const float SOME_BARE = 3.0;      // and where none is bare, one surface behind a translucent one
const float SURE = 0.995;         // share of the nearer surface, from which on it is seen
const float SOLID = 0.9;          // cover of what is no rim
const int REACH = 3;              // pixels
const float NEAR = 2.0;           // pixels: deviation of the weights

bool is_apart(vec3 both) {
    return both.y - both.x > APART * thickness;
}

// Whether a pixel shows what is behind the rim of the nearer of two surfaces.
bool is_beside(ivec2 pixel, vec3 both, ivec2 last) {
    float thin = 0.0, bare = 0.0, middle = 0.5 * (both.x + both.y);
    int wide = max(int(STEP * thickness * mean_focal_length(target) / max(both.x + reference, 1e-6) + 0.5), 1);
    for (int y = -SPAN; y <= SPAN; ++y) {
        for (int x = -SPAN; x <= SPAN; ++x) {
            vec4 sums = texelFetch(depths_sum, clamp(pixel + wide * ivec2(x, y), ivec2(0), last), 0);
            vec3 there = two_depths(sums);
            float share = sums.a > 0.0 && is_apart(there) ? there.z : float(sums.x < middle * sums.a);
            thin += float(share < THIN);
            bare += float(share < BARE);
        }
    }
    return thin >= MANY_THIN && bare >= SOME_BARE;
}

float depth_of(vec4 sums, ivec2 pixel, ivec2 last) {
    vec3 both = two_depths(sums);
    if (is_apart(both)) return both.z < SURE && is_beside(pixel, both, last) ? both.y : both.x;
    return sums.x / sums.a;
}

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy), last = textureSize(depths_sum, 0) - 1;
    vec4 own = texelFetch(depths_sum, pixel, 0), best = own;
    if (own.a == 0.0) discard;
    ivec2 place = pixel;
    float weight = own.a;
    int reach = own.a < SOLID ? REACH : -1;
    for (int y = -reach; y <= reach; ++y) {
        for (int x = -reach; x <= reach; ++x) {
            vec4 beside = texelFetch(depths_sum, clamp(pixel + ivec2(x, y), ivec2(0), last), 0);
            float other = beside.a * exp(-0.5 * float(x * x + y * y) / (NEAR * NEAR));
            if (other > weight) {
                weight = other;
                best = beside;
                place = clamp(pixel + ivec2(x, y), ivec2(0), last);
            }
        }
    }
    seen = vec2(max(depth_of(best, place, last) + reference, 1e-6), min(own.a, 1.0));
}
