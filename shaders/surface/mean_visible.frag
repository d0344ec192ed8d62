#version 330 core
// What the planes through neighbouring pixels see -> what their points see.
#include "common/visibility.glsl"

uniform sampler2D surface_map;
uniform sampler2D plane_map;
uniform vec4 intrinsics;
uniform int stride;

out vec4 visible;

void main() {
    visible = mean_visible(plane_map, surface_map, ivec2(gl_FragCoord.xy), stride, intrinsics);
}
