#version 330 core
// Keeps the pixels that the footprint covers and notes which source pixel they show; light comes later.
#include "common/splat.glsl"

uniform bool is_round;

flat in vec2 centre;
flat in vec4 to_source;
flat in vec2 bend;
flat in float reach;
flat in int id;

out int source_id;

void main() {
    vec2 offset = gl_FragCoord.xy - 0.5 - centre;
    if (!footprint_covers(to_source, bend, offset, reach, is_round)) discard;
    source_id = id;
}
