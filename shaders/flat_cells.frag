#version 330 core
#ifndef SPREAD
#define SPREAD 0  // 1: planes without a plane take that of their neighbours
#endif
// Rounded depth -> one plane for each cell of 8x8 pixels.
#include "common/flat_cells.glsl"

uniform sampler2D depth_map;
#if SPREAD
uniform sampler2D planes;
#endif
uniform vec2 rounding;

out vec4 plane;

void main() {
    ivec2 cell = ivec2(gl_FragCoord.xy);
#if SPREAD
    plane = flat_plane(planes, depth_map, cell, rounding);
#else
    plane = flat_window(depth_map, flat_middle(cell), rounding);
#endif
}
