#version 330 core
// The pieces of a mesh in a view: only their depth counts.
#include "common/grid.glsl"

uniform float near;

flat in vec3 plane;
flat in vec4 box;
flat in vec3 side;
flat in mat3 seen;

void main() {
    float inverse_depth = piece_inverse_depth(Piece(plane, box, side), seen, gl_FragCoord.xy - 0.5, near);
    if (inverse_depth == 0.0) discard;
    gl_FragDepth = 1.0 - near * inverse_depth;
}
