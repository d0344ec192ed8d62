#version 330 core
// The depth of the nearest splats, without the holes between them: 0 where there is nothing.
#include "common/cloud_front.glsl"

uniform sampler2D cores;  // 1 - near/z
uniform float near;
uniform float step_back;      // world units by which a hole shows what lies behind
uniform vec2 ring;            // how far apart splats are: pixels at depth 1, and in most of the picture

out float front;

void main() {
    front = closed_depth(cores, ivec2(gl_FragCoord.xy), near, step_back, ring);
}
