#version 330 core
// Depth -> surface (unit normal, depth) by the smaller one-sided differences of 1/z.
#include "common/normals_differences.glsl"

uniform sampler2D depth_map;
uniform vec4 intrinsics;

out vec4 surface;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    surface = vec4(estimate_one_sided(depth_map, pixel, intrinsics), depth_at(depth_map, pixel, ivec2(0)));
}
