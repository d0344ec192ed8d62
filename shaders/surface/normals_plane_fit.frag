#version 330 core
#ifndef WINDOW
#define WINDOW 7  // pixels, odd; one program for each size, so that the loops have a fixed length
#endif
// Depth -> surface (unit normal, depth, negative at rims) by a least-squares plane of 1/z over a window.
#include "common/normals_plane_fit.glsl"
#include "common/rim_marks.glsl"

uniform sampler2D depth_map;
uniform vec4 intrinsics;

out vec4 surface;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    vec3 normal = estimate_plane_fit(depth_map, pixel, intrinsics, WINDOW);
    surface = vec4(normal, mark_rim(depth_map, pixel, intrinsics, 0.0));
}
