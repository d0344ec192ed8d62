#version 330 core
#ifndef LOOK_UP
#define LOOK_UP 0
#endif
// What the splats of several frames left in a light's view -> a tile of the shadow map: 1 - near/z.
#include "common/parts.glsl"
#include "points/set_visibility.glsl"

uniform ivec2 first;  // pixel of the tile
uniform float near;    // divided by the scale of the object
uniform float behind;  // by how much farther the splats are taken to be: frames that nearly agree must not shade each other

void main() {
    uint key = key_at(ivec2(gl_FragCoord.xy) - first);
    if (key == 0u) discard;
    float inverse_depth = key_inverse_depth(key);
    gl_FragDepth = 1.0 - near * inverse_depth / (1.0 + behind * inverse_depth);
}
