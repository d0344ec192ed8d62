#version 330 core
#ifndef AGAIN
#define AGAIN 0  // 1: what is read are such means already
#endif
// What is hidden along the planes through neighbouring pixels -> what is hidden from their points.
#include "common/visibility.glsl"

uniform sampler2D surface_map;
uniform sampler2D plane_map;
#if !AGAIN
uniform sampler2D weight_map;
#endif
uniform vec4 intrinsics;
uniform int stride;
uniform int first;  // of the square, from the pixel

out vec4 hidden;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
#if AGAIN
    hidden = mean_hidden(plane_map, plane_map, false, surface_map, pixel, first, stride, intrinsics);
#else
    hidden = mean_hidden(plane_map, weight_map, true, surface_map, pixel, first, stride, intrinsics);
#endif
}
