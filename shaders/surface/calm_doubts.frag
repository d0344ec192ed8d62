#version 330 core
#ifndef STAGE
#define STAGE 0  // 0: where normals scatter, and what is behind; 1: the witness that doubts these; 2: the certainty of calm ones
#endif
// Cells -> what they know beside their surface, where depth may be wrong over wide areas.
#include "common/calm_normals.glsl"

uniform sampler2D surface_map;
uniform sampler2D witness_map;
uniform sampler2D scatter_map;  // of stage 0
uniform sampler2D doubt_map;    // of stage 1

out vec4 witness;

void main() {
    ivec2 cell = ivec2(gl_FragCoord.xy);
    witness = vec4(0.0);
    if (STAGE == 0) witness.xy = vec2(scatter_at(surface_map, witness_map, cell), behind_at(surface_map, cell));
    if (STAGE == 1) witness = doubted_witness(witness_map, scatter_map, cell);
    if (STAGE == 2) witness.x = doubted_certainty(surface_map, witness_map, doubt_map, cell);
}
