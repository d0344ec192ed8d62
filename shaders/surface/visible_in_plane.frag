#version 330 core
// A surface (unit normal, depth) -> what one plane through each pixel sees of the light from all around.
#ifndef OBJECTS
#define OBJECTS 0  // 1: pixels of a view, of which some know already what their own object hides
#endif
#include "common/visibility.glsl"

uniform sampler2D surface_map;
uniform vec4 intrinsics;
uniform int stride;    // pixels of the surface for each of the smaller picture
#if OBJECTS
uniform sampler2D visibility_map;
uniform sampler2D numbers_map;
uniform ivec2 shift;
#endif
uniform float radius;  // how far things may be that hide light

out vec4 plane_sum;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy), last = textureSize(surface_map, 0) - 1;
    ivec2 texel = min(pixel * stride, last);
    vec4 own = texel_at(surface_map, texel);
#if OBJECTS
    float known = texelFetch(visibility_map, texel, 0).w < 0.0 ? 0.0 : texel_at(numbers_map, texel).w;
    plane_sum = visible_among(surface_map, numbers_map, known, pixel + shift, texel, own, intrinsics, radius);
#else
    plane_sum = visible_in_plane(surface_map, pixel, texel, own, intrinsics, radius);
#endif
}
