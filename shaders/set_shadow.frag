#version 330 core
#ifndef LOOK_UP
#define LOOK_UP 0
#endif
// What the splats of several frames left in a light's view -> a tile of the shadow map: 1 - near/z.
#include "common/parts.glsl"
#include "keys.glsl"

uniform ivec2 first;  // pixel of the tile
uniform float near;   // divided by the scale of the object

void main() {
    uint key = key_at(ivec2(gl_FragCoord.xy) - first);
    if (key == 0u) discard;
    gl_FragDepth = 1.0 - near * key_inverse_depth(key);
}
