#version 330 core
#ifndef LOOK_UP
#define LOOK_UP 0
#endif
// What the splats drew in a light's view -> a tile of the shadow map: 1 - near/z.
#if LOOK_UP
layout(std430, binding = 0) restrict readonly buffer Nearest { uint nearest[]; };  // bits of 1/z, 0: nothing
#else
uniform sampler2D depth_map;  // 1 - near/z already
#endif
uniform ivec2 first;  // pixel of the tile
uniform int side;
uniform float near;   // divided by the scale of the object

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy) - first;
#if LOOK_UP
    float inverse_depth = uintBitsToFloat(nearest[pixel.y * side + pixel.x]);
    if (inverse_depth == 0.0) discard;
    gl_FragDepth = 1.0 - near * inverse_depth;
#else
    gl_FragDepth = texelFetch(depth_map, pixel, 0).r;
#endif
}
