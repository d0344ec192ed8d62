#version 330 core
#ifndef LIT
#define LIT 0  // 1: the splat has its colour already, and is drawn with it
#endif
// Keeps the pixels that the footprint covers and notes which source pixel they show; light comes later.
#include "common/splat.glsl"

uniform bool is_round;

flat in vec2 centre;
flat in vec4 to_source;
flat in vec2 bend;
flat in float reach;
flat in int id;

#if LIT
flat in vec3 lit;  // sRGB

out vec4 color;
#else
out int source_id;
#endif

void main() {
    vec2 offset = gl_FragCoord.xy - 0.5 - centre;
    if (!footprint_covers(to_source, bend, offset, reach, is_round)) discard;
#if LIT
    color = vec4(lit, 1.0);
#else
    source_id = id;
#endif
}
