#version 430 core
#ifndef WINDOW
#define WINDOW 0  // 1: note how far the mesh comes
#endif
#define SET 0
// The mesh between the pixels of a frame: notes 1/z of its pieces at every target pixel that they cover; the nearest stays.
// A thread draws the pieces of a square. A place on a plane is linear in target pixels, times its depth in the view: so no
// piece has to be cut where it passes the viewer (homogeneous rasterisation: Olano, Greer 1997). Rims that the mesh ends at
// are put on a list for rims.comp.
#include "carried.glsl"
#include "squares.glsl"

layout(local_size_x = 32) in;

uniform ivec4 window_of_squares;  // first column and row, columns, rows
uniform int most_groups;          // of rims.comp

void draw_piece(Piece piece, ivec2 first) {
    mat3 carried = carry_plane(piece.plane, vec2(first), source, view, target);
    ivec4 box = piece_pixels(piece, carried, target_size, near);
    mat3 seen = invert_carried(carried);
#if WINDOW
    widen_window(box.xy, box.zw);
#endif
    ivec2 steps = max(box.zw - box.xy + 1, 0), q = box.xy;
    for (int k = 0; k < steps.x * steps.y; ++k) {
        float inverse_depth = piece_inverse_depth(piece, seen, vec2(q), near);
        if (inverse_depth > 0.0) atomicMax(nearest[q.y * target_size.x + q.x], floatBitsToUint(inverse_depth));
        q = q.x < box.z ? ivec2(q.x + 1, q.y) : ivec2(box.x, q.y + 1);
    }
}

void put_rim_on_list(ivec2 pixel) {
    uint place = atomicAdd(rim_count, 1u);
    atomicMax(rim_groups.x, min((place + 32u) / 32u, uint(most_groups)));
    if (place < uint(rims.length())) rims[place] = uint(pixel.y * textureSize(surface_map, 0).x + pixel.x);
}

void main() {
    ivec2 place = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(place, window_of_squares.zw))) return;
    Square square = square_at(window_of_squares.xy + place);
    if (ends_in_rim(square.first)) put_rim_on_list(square.first);
    for (int left = square.pieces; left != 0; left &= left - 1) {
        draw_piece(piece_of(square, left & -left), square.first);
    }
#if WINDOW
    note_window();
#endif
}
