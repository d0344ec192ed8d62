#version 330 core
// Surface and witness of the pixels -> of cells.
#include "common/calm_normals.glsl"

uniform sampler2D surface_map;
uniform sampler2D witness_map;
uniform float noise;
uniform vec4 intrinsics;

layout(location = 0) out vec4 facet;
layout(location = 1) out vec4 witness;

void main() {
    facet = join_facets(surface_map, witness_map, ivec2(gl_FragCoord.xy), noise, intrinsics, witness);
}
