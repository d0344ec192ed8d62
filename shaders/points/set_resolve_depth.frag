#version 330 core
#ifndef LOOK_UP
#define LOOK_UP 0
#endif
// The sums of set_accumulate.frag over all frames -> a depth picture, in which normals are estimated as in a frame's own.
#include "common/parts.glsl"
#include "points/set_visibility.glsl"

uniform sampler2D geometry_map;
uniform sampler2D albedo_map;

out float depth;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    float weight = texelFetch(albedo_map, pixel, 0).w;
    if (weight == 0.0) discard;
    depth = 1.0 / merged_inverse_depth(key_at(pixel), texelFetch(geometry_map, pixel, 0).w, weight);
}
