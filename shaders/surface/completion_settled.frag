#version 330 core
// The planes of cells -> the same without those that nothing speaks for.
#include "common/completion_rays.glsl"

uniform sampler2D plane_map;  // these two from completion_rays.frag
uniform sampler2D evidence_map;

out vec4 plane;

void main() {
    plane = settle_cell(plane_map, evidence_map, ivec2(gl_FragCoord.xy));
}
