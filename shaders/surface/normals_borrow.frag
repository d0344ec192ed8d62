#version 330 core
// Second pass after normals_star.frag: pixels without a good plane of their own take a neighbour's.
#include "common/normals_borrow.glsl"
#include "common/rim_marks.glsl"

uniform sampler2D depth_map;
uniform sampler2D normal_map;  // unit normal, residual
uniform vec4 intrinsics;

out vec4 surface;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    surface = vec4(borrow(depth_map, normal_map, pixel, intrinsics).xyz, mark_rim(depth_map, pixel, intrinsics, 0.0));
}
