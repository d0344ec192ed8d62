#version 330 core
// Cells -> 1 for each block in which one of them has points.
#include "common/completion_rays.glsl"

uniform sampler2D near_planes;

out vec4 block;

void main() {
    block = vec4(has_points(near_planes, ivec2(gl_FragCoord.xy)));
}
