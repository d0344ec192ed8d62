#version 330 core
// One pixel of each cell of a frame: its surface, and how bright the cell is.
#include "common/frame_reduction.glsl"

uniform sampler2D surface_map;
uniform sampler2D color_map;
uniform vec4 source;
uniform int cell;  // pixels along a side

layout(location = 0) out vec4 surface;
layout(location = 1) out float brightness;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy) * cell + cell / 2;
    surface = surface_away_from_steps(surface_map, pixel, source);
    brightness = cell_brightness(color_map, vec2(pixel), vec2(textureSize(surface_map, 0)), cell);
}
