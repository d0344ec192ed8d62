#version 330 core
// Which triangles there are between each pixel of a frame and its neighbours on the right and below, and how far the pixel
// itself reaches where there are none.
#include "common/grid.glsl"

uniform sampler2D surface_map;  // unit normal, depth, whose sign does not count
uniform vec4 intrinsics;
uniform vec2 max_step;

out float code;  // from grid_code

vec4 corner_at(ivec2 pixel) {
    vec4 surface = texel_or_zero(surface_map, pixel);
    return vec4(surface.xyz, abs(surface.w));
}

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    vec4 a = corner_at(pixel), b = corner_at(pixel + ivec2(1, 0));
    vec4 c = corner_at(pixel + ivec2(0, 1)), d = corner_at(pixel + ivec2(1, 1));
    int triangles = square_triangles(a, b, c, d, vec2(pixel), intrinsics, max_step);
    code = grid_code(triangles, a.w > 0.0 ? edge_reach(surface_map, pixel, intrinsics) : vec4(0.5));
}
