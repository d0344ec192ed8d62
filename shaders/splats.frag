#version 330 core
// Keeps the pixels that the splat covers and notes which source pixel they show; light comes later.
#include "drawn.glsl"

out int source_id;

void main() {
    if (covering_inverse_depth() == 0.0) discard;
    source_id = id;
}
