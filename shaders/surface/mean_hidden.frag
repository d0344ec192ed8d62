#version 330 core
// What is hidden along the planes through neighbouring pixels -> what is hidden from their points.
#include "common/visibility.glsl"

uniform sampler2D surface_map;
uniform sampler2D plane_map;
uniform sampler2D weight_map;
uniform vec4 intrinsics;
uniform int stride;
uniform int first;  // of the square, from the pixel

layout(location = 0) out vec4 hidden;
layout(location = 1) out float weight;

void main() {
    weight = 1.0;
    hidden = mean_hidden(plane_map, weight_map, surface_map, ivec2(gl_FragCoord.xy), first, stride, intrinsics);
}
