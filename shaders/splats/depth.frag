#version 330 core
// The blended splats of a view -> the depth of one surface in each pixel, and how much of it is covered: a mean of a
// near surface and one behind it would lie in mid-air. The rim of an object has the depth of what is solid beside it.
#include "common/trained_splats.glsl"

uniform sampler2D depths_sum;
uniform float reference;
uniform float thickness;  // of a surface of splats

out vec2 seen;

const float LEAST_COVER = 0.004;  // less is not seen
const float IN_FRONT = 0.85;      // share of the nearer surface, from which it is taken: its rim is fuzzy
const float SOLID = 0.9;          // cover of what is no rim
const int REACH = 3;              // pixels
const float NEAR = 2.0;           // pixels: deviation of the weights

float depth_of(vec4 sums) {
    vec3 both = two_depths(sums);
    if (both.y - both.x > APART * thickness) return both.z >= IN_FRONT ? both.x : both.y;
    return sums.x / sums.a;
}

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy), last = textureSize(depths_sum, 0) - 1;
    vec4 own = texelFetch(depths_sum, pixel, 0), best = own;
    if (own.a < LEAST_COVER) discard;
    float weight = own.a;
    int reach = own.a < SOLID ? REACH : -1;
    for (int y = -reach; y <= reach; ++y) {
        for (int x = -reach; x <= reach; ++x) {
            vec4 beside = texelFetch(depths_sum, clamp(pixel + ivec2(x, y), ivec2(0), last), 0);
            float other = beside.a * exp(-0.5 * float(x * x + y * y) / (NEAR * NEAR));
            if (other > weight) {
                weight = other;
                best = beside;
            }
        }
    }
    seen = vec2(max(depth_of(best) + reference, 1e-6), min(own.a, 1.0));
}
