#version 330 core
// Depth -> surface (unit normal, depth, negative at rims) by the smaller one-sided differences of 1/z.
#include "common/normals_differences.glsl"
#include "common/rim_marks.glsl"

uniform sampler2D depth_map;
uniform vec4 intrinsics;

out vec4 surface;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    surface = vec4(estimate_one_sided(depth_map, pixel, intrinsics), mark_rim(depth_map, pixel, intrinsics, 0.0));
}
