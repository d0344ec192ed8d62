#version 330 core
#ifndef SHARED
#define SHARED 0  // 1: neighbours this near share their noise
#endif
// Cells -> cells whose normals are means of those around.
#include "common/calm_normals.glsl"

uniform sampler2D surface_map;
uniform sampler2D witness_map;
uniform int stride;
uniform float noise;
uniform vec4 intrinsics;

layout(location = 0) out vec4 facet;
layout(location = 1) out vec4 witness;

void main() {
    ivec2 cell = ivec2(gl_FragCoord.xy);
    facet = calm_facet(surface_map, witness_map, cell, stride, noise, intrinsics, SHARED == 1, witness);
}
