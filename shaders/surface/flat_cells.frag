#version 330 core
#ifndef SPREAD
#define SPREAD 0  // 1: cells without a plane take that of windows beside them
#endif
// Rounded depth -> one plane for each cell of 9x9 pixels, in two passes.
#include "common/flat_cells.glsl"

uniform sampler2D depth_map;
#if SPREAD
uniform sampler2D planes;
#endif
uniform ivec2 first;  // middle pixel of the first cell
uniform vec2 rounding;

out vec4 plane;

void main() {
    ivec2 cell = ivec2(gl_FragCoord.xy);
#if SPREAD
    plane = flat_plane(planes, depth_map, cell, first, rounding);
#else
    plane = widest_window(depth_map, flat_middle(cell, first), rounding);
#endif
}
