#version 330 core
// The pieces of a mesh in a view: only their depth counts. A piece may be cut by a diagonal.
#include "common/grid.glsl"

in vec3 place;
flat in vec3 side;

void main() {
    if (dot(side, place) < -SEAM * place.z) discard;
}
