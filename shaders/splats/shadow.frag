#version 330 core
// The blended splats of a light's view -> a tile of the map of their shadows: two depths, what the nearer surface hides,
// and what both hide.
#include "common/trained_splats.glsl"

uniform sampler2D depths_sum;
uniform ivec2 first;      // pixel of the tile
uniform float reference;  // depth from which those of the sums count
uniform float thickness;  // of a surface of splats
uniform int stride;       // pixels between those that are averaged: light leaks through a surface of splats

out vec4 seen;

const int REACH = 2;  // of them on each side

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy) - first, last = textureSize(depths_sum, 0) - 1;
    vec4 sums = vec4(0.0);
    for (int y = -REACH; y <= REACH; ++y) {
        for (int x = -REACH; x <= REACH; ++x) sums += texelFetch(depths_sum, clamp(pixel + stride * ivec2(x, y), ivec2(0), last), 0);
    }
    float cover = min(sums.a / float((2 * REACH + 1) * (2 * REACH + 1)), 1.0);
    seen = vec4(0.0);
    if (cover <= 0.0) return;
    vec3 both = two_depths(sums);
    if (both.y - both.x < APART * thickness) both = vec3(vec2(sums.x / sums.a), 1.0);
    seen = vec4(both.xy + reference, cover * both.z, cover);
}
