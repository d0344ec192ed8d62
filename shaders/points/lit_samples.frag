#version 330 core
#ifndef ALIGNED
#define ALIGNED 0  // whether each pixel of the picture is one of the surface
#endif
// A small copy of a frame, for the search of its light.
#include "common/lit_sample.glsl"

uniform sampler2D color_map;    // sRGB, of any size
uniform sampler2D surface_map;  // unit normal, depth
uniform float stride;           // pixels of the surface between samples

layout(location = 0) out vec4 color_sample;    // linear, and 1; 0.5 where it is cut off, 0 where it is not known
layout(location = 1) out vec4 surface_sample;

void main() {
    ivec2 pixel = min(ivec2(gl_FragCoord.xy * stride), textureSize(surface_map, 0) - 1);
    surface_sample = surface_at(surface_map, pixel);
    color_sample = mean_lit_color(color_map, surface_map, pixel, stride, ALIGNED == 1);
}
