#version 330 core
#ifndef DOUBTED
#define DOUBTED 0  // 1: depth may be wrong over wide areas
#endif
// Surface, and cells whose normals are calm -> the surface with calm normals.
#include "common/calm_normals.glsl"

uniform sampler2D surface_map;
uniform sampler2D witness_map;
uniform sampler2D other_map;    // of the cells
uniform sampler2D joined_map;   // their witness
uniform sampler2D doubt_map;    // of calm_doubts.frag
uniform float noise;
uniform float own_share;
uniform vec4 intrinsics;

out vec4 surface;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    surface = texel_at(surface_map, pixel);
    if (surface.w != 0.0) {
        float doubt = DOUBTED == 1 ? abs(texel_at(doubt_map, pixel / SIDE).y) : 0.0;
        surface.xyz =
            calm_normal(surface_map, witness_map, other_map, joined_map, pixel, noise, own_share, doubt, intrinsics);
    }
}
