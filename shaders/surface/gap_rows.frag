#version 330 core
// How far each pixel of a surface is from the next known ones of its row, over 255.
#include "common/gap_filling.glsl"

uniform sampler2D surface_map;
uniform int reach;

out vec2 row;

void main() {
    row = known_in_row(surface_map, ivec2(gl_FragCoord.xy), reach) / 255.0;
}
