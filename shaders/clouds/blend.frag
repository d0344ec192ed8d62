#version 330 core
// What a splat adds to a pixel of the view, if it lies on the front surface: sums, each value times the weight.
#include "clouds/hit.glsl"

uniform sampler2D front;  // 1 - near/z of the front surface, pushed back
uniform float near;

layout(location = 0) out vec4 geometry;  // normal, 1/z
layout(location = 1) out vec4 albedo;    // linear; the weight

void main() {
    SplatHit hit = hit_splat(gl_FragCoord.xy - 0.5);
    if (hit.depth == 0.0 || 1.0 - near / hit.depth > texelFetch(front, ivec2(gl_FragCoord.xy), 0).r) discard;
    float weight = hit_weight(hit, centre);
    geometry = weight * vec4(hit.normal, 1.0 / hit.depth);
    albedo = weight * vec4(linear_color, 1.0);
}
