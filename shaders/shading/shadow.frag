#version 330 core
#ifndef LOOK_UP
#define LOOK_UP 0
#endif
// What the splats drew in a light's view -> a tile of the shadow map: 1 - near/z, on the splats' tilted planes.
#include "common/resolve.glsl"

#if LOOK_UP
layout(std430, binding = 0) restrict readonly buffer Nearest { uint nearest[]; };  // bits of 1/z, 0: nothing
uniform int side;
#else
uniform isampler2D source_ids;
uniform sampler2D window_depths;  // 1 - near/z: exact at rims, elsewhere of the splats' centres
uniform int first_id;         // of the first pixel; 0: nothing, below: a rim
uniform sampler2D surface_map;  // of the frame: unit normal, depth
uniform vec4 source;
uniform vec4 target;
uniform mat4 view;
#endif
uniform ivec2 first;  // pixel of the tile
uniform float near;   // divided by the scale of the object

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy) - first;
#if LOOK_UP
    float inverse_depth = uintBitsToFloat(nearest[pixel.y * side + pixel.x]);
    if (inverse_depth == 0.0) discard;
#else
    int id = texelFetch(source_ids, pixel, 0).r;
    int index = abs(id) - first_id;
    if (index < 0) discard;
    float rim_depth = id < 0 ? (1.0 - texelFetch(window_depths, pixel, 0).r) / near : 0.0;
    ivec2 place = pixel_of(index, textureSize(surface_map, 0).x);
    float inverse_depth = see_splat(surface_map, place, vec2(pixel), source, view, target, rim_depth).inverse_depth;
#endif
    gl_FragDepth = 1.0 - near * inverse_depth;
}
