#version 330 core
#ifndef FROM_DEPTH
#define FROM_DEPTH 0  // 1: the finest cells, from a depth picture
#endif
// Cells from 2x2 pixels, or from 2x2 finer cells.
#include "common/inverse_depth.glsl"
#include "common/sparse_cells.glsl"

uniform sampler2D finer;

out vec4 cell;

vec4 part(ivec2 at) {
    if (FROM_DEPTH == 1) return cell_of_pixel(depth_at(finer, at, ivec2(0)), vec2(at));
    return cell_at(finer, at);
}

void main() {
    ivec2 first = 2 * ivec2(gl_FragCoord.xy);
    cell = join_cells(part(first), part(first + ivec2(1, 0)), part(first + ivec2(0, 1)), part(first + 1));
}
