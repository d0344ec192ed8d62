#version 330 core
// Cells -> the planes of those in which points are missing.
#include "common/completion_rays.glsl"

uniform sampler2D near_planes;  // these three from completion_cells.frag
uniform sampler2D other_planes;
uniform sampler2D colors_map;
uniform sampler2D stops_map;    // from completion_stops.frag
uniform sampler2D surface_map;
uniform sampler2D hidden_map;
uniform bool is_alone;

layout(location = 0) out vec4 plane;
layout(location = 1) out vec4 evidence;

void main() {
    ivec2 cell = ivec2(gl_FragCoord.xy);
    vec2 found;
    float hidden_below = HIDDEN == 1 ? cell_hidden_below(surface_map, hidden_map, cell) : 0.0;
    plane = cast_rays(near_planes, other_planes, colors_map, stops_map, cell, hidden_below, is_alone, found);
    evidence = vec4(found, 0.0, 0.0);
}
