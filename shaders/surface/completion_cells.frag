#version 330 core
// A surface -> its cells: see common/completion_cells.glsl.
#include "common/completion_cells.glsl"

uniform sampler2D surface_map;
uniform sampler2D color_map;
uniform vec4 source;

layout(location = 0) out vec4 near_plane;
layout(location = 1) out vec4 other_plane;
layout(location = 2) out vec4 colors;

void main() {
    Cell cell = join_points(surface_map, color_map, ivec2(gl_FragCoord.xy), source);
    near_plane = cell.planes[0];
    other_plane = cell.planes[1];
    colors = cell.colors;
}
