#version 330 core
#ifndef RESIDUAL
#define RESIDUAL 0  // 1: the residual instead of the depth in w, for normals_borrow.frag
#endif
// Depth -> surface (unit normal, depth, negative at rims) by the edge-exact star of 16 neighbours, for depth without
// noise.
#include "common/normals_star.glsl"
#include "common/rim_marks.glsl"

uniform sampler2D depth_map;
uniform vec4 intrinsics;

out vec4 surface;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    vec4 beside;
    vec4 star = estimate_star(depth_map, pixel, intrinsics, 0.0, beside);
    float here = depth_at(depth_map, pixel, ivec2(0));
    float marked = is_rim(beside, pixel, textureSize(depth_map, 0), intrinsics, 0.0) ? -here : here;
    surface = vec4(star.xyz, RESIDUAL == 1 ? star.w : marked);
}
