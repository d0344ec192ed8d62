#version 330 core
// Which triangles there are between each pixel of a frame and its neighbours on the right and below.
#include "common/grid.glsl"

uniform sampler2D surface_map;  // unit normal, depth, whose sign does not count
uniform vec4 intrinsics;
uniform vec2 max_step;

out float triangles;  // their number over 255

vec4 corner_at(ivec2 pixel) {
    if (any(greaterThanEqual(pixel, textureSize(surface_map, 0)))) return vec4(0.0);
    vec4 surface = texelFetch(surface_map, pixel, 0);
    return vec4(surface.xyz, abs(surface.w));
}

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    vec4 a = corner_at(pixel), b = corner_at(pixel + ivec2(1, 0));
    vec4 c = corner_at(pixel + ivec2(0, 1)), d = corner_at(pixel + ivec2(1, 1));
    triangles = float(square_triangles(a, b, c, d, vec2(pixel), intrinsics, max_step)) / 255.0;
}
