#version 330 core
// How each square between the pixels of a frame is drawn: on a plane with its neighbours, alone on a plane, or in pieces.
#include "common/grid.glsl"

uniform sampler2D surface_map;   // unit normal, depth, whose sign does not count
uniform sampler2D triangle_map;  // from grid_triangles.frag
uniform vec4 intrinsics;

out vec4 plane;  // as in Piece; how it is drawn

float inverse_depth_of(ivec2 pixel) {
    float z = abs(texel_or_zero(surface_map, pixel).w);
    return z > 0.0 ? 1.0 / z : 0.0;
}

// The plane of a block of squares, and 1 if all of them are whole and lie on it.
vec4 block_plane(ivec2 first, int side) {
    ivec2 right = ivec2(side, 0), down = ivec2(0, side);
    vec4 w = vec4(
        inverse_depth_of(first), inverse_depth_of(first + right),
        inverse_depth_of(first + down), inverse_depth_of(first + right + down)
    );
    vec3 across = square_plane(w), found = vec3(across.xy / float(side), across.z);
    bool is_one = true;
    for (int k = 0; k < (side + 1) * (side + 1); ++k) {
        ivec2 off = ivec2(k % (side + 1), k / (side + 1));
        bool is_square = all(lessThan(off, ivec2(side)));
        int triangles = is_square ? code_triangles(texel_or_zero(triangle_map, first + off).r) : FIRST + SECOND;
        bool is_whole = (triangles & (FIRST + SECOND)) == FIRST + SECOND;
        bool is_flat = is_level(inverse_depth_of(first + off), vec2(off), found, mean_focal_length(intrinsics));
        is_one = is_one && is_whole && is_flat;
    }
    return vec4(found, is_one ? 1.0 : 0.0);
}

void main() {
    ivec2 place = ivec2(gl_FragCoord.xy), first = place - FIRST_SQUARE, block = first - (place & 1);
    vec4 together = block_plane(block, 2), alone = block_plane(first, 1);
    bool is_first = block == first, is_empty = true;
    for (int k = 0; k < 4; ++k) is_empty = is_empty && inverse_depth_of(first + ivec2(k & 1, k >> 1)) == 0.0;
    if (together.w > 0.0) plane = is_first ? vec4(together.xyz, PAIRS) : vec4(0.0, 0.0, 0.0, NOTHING);
    else plane = vec4(alone.xyz, is_empty ? NOTHING : (alone.w > 0.0 ? SINGLE : IN_PIECES));
}
