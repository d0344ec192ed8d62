#version 330 core
#ifndef OBJECTS
#define OBJECTS 0  // 1: pixels of a view, of which some know already what their own object hides
#endif
// A surface (unit normal, depth) -> what is hidden along one plane through each pixel of the light from all around.
#include "common/visibility.glsl"

uniform sampler2D surface_map;
uniform vec4 intrinsics;
uniform int stride;    // pixels of the surface for each of the smaller picture
#if OBJECTS
uniform sampler2D visibility_map;
uniform sampler2D numbers_map;
uniform ivec2 shift;   // of the planes
#endif
uniform float radius;  // how far things may be that hide light

layout(location = 0) out vec4 hidden;
layout(location = 1) out float weight;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy), last = textureSize(surface_map, 0) - 1;
    ivec2 texel = min(pixel * stride, last);
    vec4 own = texel_at(surface_map, texel);
#if OBJECTS
    float known = texelFetch(visibility_map, texel, 0).w < 0.0 ? 0.0 : texel_at(numbers_map, texel).w;
    ivec2 along = pixel + shift;
    Plane plane = look_among(surface_map, numbers_map, true, known, along, texel, own, intrinsics, radius, 0.0);
#else
    Plane plane = look_along(surface_map, pixel, texel, own, intrinsics, radius, 0.0);
#endif
    hidden = sum_of_sectors(plane, plane.hidden);
    weight = weight_of_plane(plane);
}
