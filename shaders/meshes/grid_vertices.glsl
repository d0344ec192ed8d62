// Shared by odd_squares.comp and grid.vert, after their inputs: the pieces of the squares between the pixels of a frame.
#include "common/grid.glsl"
#include "common/rim_splat.glsl"

uniform sampler2D triangle_map;  // from grid_triangles.frag

struct Square {
    ivec2 first;  // its first pixel
    vec4 w;       // 1/z of its corners
    int triangles;
    int pieces;
};

// Is a pixel drawn as a rim in this view?
bool is_drawn_as_rim(ivec2 pixel) {
    vec4 marked = texel_or_zero(surface_map, pixel);
    bool is_rim = marked.w < 0.0, answer = false;
    for (int k = 0; k < (is_rim ? 1 : 0); ++k) {  // a loop that no pixel takes costs software drivers nothing
        Footprint splat = carry_footprint(vec2(pixel), -marked.w, marked.xyz, source, view, target);
        answer = splat_is_ahead(splat, near) && draws_rim(splat, -marked.w, source, target);
    }
    return answer;
}

// The first of a pixel's squares that triangles do not cover there, by the corner that the pixel is of it; -1 if all do.
int first_open_corner(ivec2 pixel) {
    int found = -1;
    for (int k = 3; k >= 0; --k) {
        int triangles = code_triangles(texel_or_zero(triangle_map, pixel - ivec2(k & 1, k >> 1)).r);
        if (!covers_corner(triangles, k)) found = k;
    }
    return found;
}

Square square_at(ivec2 first) {
    vec4 z = vec4(
        texel_or_zero(surface_map, first).w, texel_or_zero(surface_map, first + ivec2(1, 0)).w,
        texel_or_zero(surface_map, first + ivec2(0, 1)).w, texel_or_zero(surface_map, first + ivec2(1, 1)).w
    );
    vec4 w = mix(1.0 / abs(z), vec4(0.0), equal(z, vec4(0.0)));
    int triangles = code_triangles(texel_or_zero(triangle_map, first).r);
    int pieces = square_pieces(w, triangles);
    return Square(first, w, triangles, pieces);
}

// What a corner's own pixel covers of a square, 0 to 3. A rim covers what is its own: then it is only what goes on behind
// something nearer.
Piece outer_piece(Square square, int corner) {
    ivec2 pixel = square.first + ivec2(corner & 1, corner >> 1);
    vec4 surface = surface_at(surface_map, pixel), reach = code_reach(texel_at(triangle_map, pixel).r);
    vec2 side = vec2(reach[(corner & 1) == 0 ? 2 : 0], reach[corner < 2 ? 3 : 1]);
    if (max(side.x, side.y) < 1.0 && is_drawn_as_rim(pixel)) reach = vec4(-1.0);
    vec2 slope = edge_slope(surface, vec2(pixel), greaterThan(side, vec2(1.0)), source);
    return edge_piece(1.0 / surface.w, square.triangles, corner, slope, reach);
}
