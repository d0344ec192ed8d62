#version 330 core
// Cells -> where their rays stop: in one small loop, which costs a third of what it would beside the planes.
#include "common/completion_rays.glsl"

uniform sampler2D near_planes;  // these two from completion_cells.frag
uniform sampler2D colors_map;
uniform sampler2D block_map;    // from completion_blocks.frag
uniform bool is_alone;

out vec4 stops;

void main() {
    ivec2 place = ivec2(gl_FragCoord.xy), cells = textureSize(colors_map, 0), tile = place / cells;
    vec2 direction = ray_direction(tile.x + SIDE * tile.y);
    vec2 steps = stops_of(near_planes, colors_map, block_map, place - cells * tile, direction, is_alone);
    stops = vec4(steps / MOST_STEPS, 0.0, 0.0);
}
