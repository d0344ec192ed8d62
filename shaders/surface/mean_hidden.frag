#version 330 core
// What is hidden along the planes through neighbouring pixels -> what is hidden from their points.
#include "common/visibility.glsl"

uniform sampler2D surface_map;
uniform sampler2D plane_map;
uniform sampler2D weight_map;
uniform vec4 intrinsics;
uniform int stride;

out vec4 hidden;

void main() {
    hidden = mean_hidden(plane_map, weight_map, surface_map, ivec2(gl_FragCoord.xy), stride, intrinsics);
}
