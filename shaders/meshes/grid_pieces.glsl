// Shared by grid.comp and odd_squares.comp: how a piece of a mesh is drawn. A place on a plane is linear in target pixels,
// times its depth in the view: so no piece has to be cut where it passes the viewer (homogeneous rasterisation: Olano, Greer
// 1997).
#include "points/compute_raster.glsl"
#include "common/grid.glsl"

layout(std430, binding = 3) restrict buffer Odd {
    uvec4 odd_groups;  // of odd_squares.comp
    uint odd_count;
    uint odd[];        // the numbers of the squares that are drawn in pieces, row by row
};

uniform int most_groups;  // of rims.comp and odd_squares.comp

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
