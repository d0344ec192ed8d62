// Shared by grid.comp and grid.vert: their inputs, and the pieces of the squares between the pixels of a frame.
#include "common/grid.glsl"

uniform sampler2D surface_map;   // of the frame: unit normal, depth, whose sign does not count
uniform sampler2D triangle_map;  // from grid_triangles.frag
uniform ivec4 window;            // of squares: first column and row, columns, rows; a column and a row begin before the frame
uniform vec4 source;
uniform mat4 view;
uniform vec4 target;
uniform ivec2 target_size;
uniform float near;

struct Square {
    ivec2 first;  // its first pixel
    vec4 w;       // 1/z of its corners
    int triangles;
    int pieces;
};

float inverse_depth_of(ivec2 pixel) {
    float depth = abs(texel_or_zero(surface_map, pixel).w);
    return depth > 0.0 ? 1.0 / depth : 0.0;
}

Square square_at(ivec2 first) {
    vec4 w = vec4(
        inverse_depth_of(first), inverse_depth_of(first + ivec2(1, 0)),
        inverse_depth_of(first + ivec2(0, 1)), inverse_depth_of(first + ivec2(1, 1))
    );
    int triangles = code_triangles(texel_or_zero(triangle_map, first).r);
    return Square(first, w, triangles, square_pieces(w, triangles, mean_focal_length(source)));
}

// The piece of a square with this number, one of its pieces.
Piece piece_of(Square square, int number) {
    if (number < QUARTER) return inner_piece(square.w, square.triangles, number);
    int corner = number == 8 * QUARTER ? 3 : number / (2 * QUARTER);
    ivec2 pixel = square.first + ivec2(corner & 1, corner >> 1);
    vec4 surface = surface_at(surface_map, pixel);
    vec4 reach = code_reach(texel_at(triangle_map, pixel).r);
    vec2 side = vec2(reach[(corner & 1) == 0 ? 2 : 0], reach[corner < 2 ? 3 : 1]);
    vec2 slope = edge_slope(surface, vec2(pixel), greaterThan(side, vec2(1.0)), source);
    return edge_piece(1.0 / surface.w, square.triangles, corner, slope, reach);
}
