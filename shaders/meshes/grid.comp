#version 430 core
#ifndef WINDOW
#define WINDOW 0  // 1: note how far the mesh comes
#endif
#define SET 0
// The mesh between the pixels of a frame: notes 1/z of its pieces at every target pixel that they cover; the nearest stays.
// Squares on planes are drawn here, most of them 2x2 together; the others are put on a list for odd_squares.comp.
#include "meshes/grid_pieces.glsl"

layout(local_size_x = 32) in;

uniform sampler2D plane_map;  // from grid_planes.frag
uniform ivec4 squares;        // first column and row of plane_map, columns, rows

const int ROWS = 16;  // of a thread

void put_on_list(ivec2 place) {
    uint index = atomicAdd(odd_count, 1u);
    atomicMax(odd_groups.x, min(index / 32u + 1u, uint(most_groups)));
    if (index < uint(odd.length())) odd[index] = uint(place.y * textureSize(plane_map, 0).x + place.x);
}

// The squares of a block of 2x2: all at once, or one by one.
void draw_block(ivec2 block) {
    int k = 0, count = 4;
    do {
        ivec2 place = block + ivec2(k & 1, k >> 1);
        vec4 plane = texel_or_zero(plane_map, place);
        if (plane.w == PAIRS) count = 1;
        if (plane.w == SINGLE || plane.w == PAIRS) draw_piece(plane_piece(plane.xyz, plane.w), place - FIRST_SQUARE);
        if (plane.w == IN_PIECES) put_on_list(place);
    } while (++k < count);
}

void main() {
    ivec2 block = squares.xy + 2 * ivec2(1, ROWS / 2) * ivec2(gl_GlobalInvocationID.xy);
    if (block.x >= squares.x + squares.z) return;
    for (int row = 0; row < ROWS; row += 2) draw_block(block + ivec2(0, row));
#if WINDOW
    note_window();
#endif
}
