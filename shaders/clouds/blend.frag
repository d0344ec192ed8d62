#version 330 core
// What a splat adds to a pixel of the view, if it lies on the front surface: sums, each value times the weight.
#include "clouds/hit.glsl"

uniform sampler2D front;  // depth of the front surface; 0: nothing
uniform float band;       // radii: splats this far before and behind belong to it

layout(location = 0) out vec4 geometry;  // normal, 1/z
layout(location = 1) out vec4 albedo;    // linear; the weight

void main() {
    SplatHit hit = hit_splat(gl_FragCoord.xy - 0.5);
    float surface = texelFetch(front, ivec2(gl_FragCoord.xy), 0).r;
    if (hit.depth == 0.0 || surface == 0.0 || abs(hit.depth - surface) > band * normal_radius.w) discard;
    float weight = hit_weight(hit.outside);
    geometry = weight * vec4(facing_weight(hit.normal, centre) * hit.normal, 1.0 / hit.depth);
    albedo = weight * vec4(linear_color, 1.0);
}
