#version 330 core
#ifndef SPREAD
#define SPREAD 0   // 1: the planes of the cells, from those of the windows
#endif
#ifndef MEASURE
#define MEASURE 0  // 1: how much the windows leave of planes
#endif
// Noisy depth -> one plane for each cell of 9x9 pixels, in two passes.
#include "common/bumpy_planes.glsl"

uniform sampler2D depth_map;
uniform sampler2D planes;  // of the windows
uniform ivec2 first;       // middle pixel of the first cell
uniform float bumps;       // standard deviation of 1/z about the planes of the frame

out vec4 plane;

void main() {
    ivec2 cell = ivec2(gl_FragCoord.xy);
#if SPREAD
    plane = bumpy_plane(planes, depth_map, cell, first, bumps);
#elif MEASURE
    plane = window_bumps(depth_map, flat_middle(cell, first));
#else
    plane = widest_bumpy_window(depth_map, flat_middle(cell, first), bumps);
#endif
}
