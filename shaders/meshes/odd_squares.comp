#version 430 core
#ifndef WINDOW
#define WINDOW 0  // 1: note how far the mesh comes
#endif
#define SET 0
// The squares of a mesh that grid.comp has put on its list: one thread draws each, triangle by triangle, and what belongs to
// the pixels of its corners where there are none. Rims that the mesh ends at are put on a list for rims.comp.
#include "meshes/grid_pieces.glsl"
#include "meshes/grid_vertices.glsl"

layout(local_size_x = 32) in;

void put_rim_on_list(ivec2 pixel) {
    uint place = atomicAdd(rim_count, 1u);
    atomicMax(rim_groups.x, min(place / 32u + 1u, uint(most_groups)));
    if (place < uint(rims.length())) rims[place] = uint(pixel.y * textureSize(surface_map, 0).x + pixel.x);
}

void draw_square(ivec2 first) {
    Square square = square_at(first);
    for (int left = square.pieces & (FIRST + SECOND); left != 0; left &= left - 1) {
        draw_piece(triangle_piece(square.w, square.triangles, (left & FIRST) == 0), first);
    }
    for (int left = square.pieces / QUARTER; left != 0; left &= left - 1) {
        int corner = findLSB(left);
        draw_piece(outer_piece(square, corner), first);
        ivec2 pixel = first + ivec2(corner & 1, corner >> 1);
        if (first_open_corner(pixel) == corner && is_drawn_as_rim(pixel)) put_rim_on_list(pixel);
    }
}

void main() {
    int columns = textureSize(surface_map, 0).x + FIRST_SQUARE;
    for (uint k = gl_GlobalInvocationID.x; k < odd_count; k += 32u * gl_NumWorkGroups.x) {
        draw_square(pixel_of(int(odd[k]), columns) - FIRST_SQUARE);
    }
#if WINDOW
    note_window();
#endif
}
