#version 330 core
// The pieces of a mesh in a view: only their depth counts. A piece may be cut by a diagonal.
#include "common/grid.glsl"

uniform float near;

in vec3 place;
flat in vec3 side;
flat in vec3 inverse_depth;

void main() {
    if (dot(side, place) < -SEAM * place.z) discard;
    gl_FragDepth = 1.0 - near * dot(inverse_depth, vec3(gl_FragCoord.xy - 0.5, 1.0));
}
