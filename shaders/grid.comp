#version 430 core
// The mesh between the pixels of a frame: notes 1/z of its pieces at every target pixel that they cover; the nearest stays.
// A thread draws the pieces of a square. A place on a plane is linear in target pixels, times its depth in the view: so no
// piece has to be cut where it passes the viewer (homogeneous rasterisation: Olano, Greer 1997).
#include "squares.glsl"

layout(local_size_x = 32) in;

layout(std430, binding = 0) restrict buffer Nearest { uint nearest[]; };  // bits of 1/z; 0 is nothing

void draw_piece(Piece piece, ivec2 first) {
    mat3 carried = carry_plane(piece.plane, vec2(first), source, view, target);
    ivec4 box = piece_pixels(piece, carried, target_size, near);
    mat3 seen = invert_carried(carried);
    ivec2 steps = max(box.zw - box.xy + 1, 0), q = box.xy;
    for (int k = 0; k < steps.x * steps.y; ++k) {
        float inverse_depth = piece_inverse_depth(piece, seen, vec2(q), near);
        if (inverse_depth > 0.0) atomicMax(nearest[q.y * target_size.x + q.x], floatBitsToUint(inverse_depth));
        q = q.x < box.z ? ivec2(q.x + 1, q.y) : ivec2(box.x, q.y + 1);
    }
}

void main() {
    ivec2 place = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(place, window.zw))) return;
    Square square = square_at(window.xy + place);
    for (int left = square.pieces; left != 0; left &= left - 1) {
        draw_piece(piece_of(square, left & -left), square.first);
    }
}
