#version 330 core
// The pieces of a mesh between the pixels of a frame in the target view, found from gl_VertexID: four of each square, and
// four vertices of each piece.
#include "common/grid.glsl"

uniform sampler2D surface_map;  // of the frame: unit normal, depth, negative at rims
uniform vec4 source;
uniform mat4 view;
uniform vec4 target;
uniform ivec2 target_size;
uniform float near;
uniform ivec4 window_of_squares;  // first column and row, columns, rows
uniform int first_square;         // of those that are drawn

#include "meshes/grid_vertices.glsl"

// The piece, for the pixels that it may cover: drivers move vertices by up to 1/16 of a pixel.
flat out vec3 plane;
flat out vec4 box;
flat out vec3 side;
flat out mat3 seen;  // from invert_carried

const float GROWN = 0.125;  // target pixels by which quads are larger than pieces
const vec4 NOWHERE = vec4(2.0, 2.0, 2.0, 1.0);

// One of the pieces: 0 to 3; 0 if there are not so many.
int nth_piece(int pieces, int n) {
    for (int k = 0; k < n; ++k) pieces &= pieces - 1;
    return pieces & -pieces;
}

void main() {
    gl_Position = NOWHERE;
    Square square = square_at(window_of_squares.xy + pixel_of(first_square + (gl_VertexID >> 4), window_of_squares.z));
    int number = nth_piece(square.pieces, gl_VertexID >> 2 & 3);
    if (number == 0) return;
    Piece piece = triangle_piece(square.w, square.triangles, number == SECOND);
    if (number >= QUARTER) piece = outer_piece(square, number == 8 * QUARTER ? 3 : number / (2 * QUARTER));
    if (piece.box.x > piece.box.z) return;  // of a rim, which draws its own pixel
    plane = piece.plane;
    box = piece.box;
    side = piece.side;
    mat3 carried = carry_plane(plane, vec2(square.first), source, view, target);
    seen = invert_carried(carried);
    vec3 middle = carried * vec3(0.5 * (box.xy + box.zw), 1.0);
    vec2 grown = SEAM + GROWN * middle.z * (abs(seen[0].xy) + abs(seen[1].xy));
    vec4 around = box + vec4(-grown, grown);
    vec3 place = vec3((gl_VertexID & 1) == 0 ? around.x : around.z, (gl_VertexID & 2) == 0 ? around.y : around.w, 1.0);
    vec3 at = carried * place;
    // Pixel centres are at integers: (u + 0.5) / width of the way across. Depth is 1 - near/z, linear in 1/z, as for splats.
    float near_share = near * dot(plane, place);
    gl_Position = vec4(2.0 * (at.xy + 0.5 * at.z) / vec2(target_size) - at.z, at.z - 2.0 * near_share, at.z);
}
