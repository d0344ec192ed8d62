#version 330 core
// A splat that is not blended with its neighbours, among the surfaces of other objects.
#include "clouds/hit.glsl"

uniform float near;
uniform bool is_lit;
uniform float material_number;

layout(location = 0) out vec4 surface;
layout(location = 1) out vec4 albedo;
layout(location = 2) out vec4 visibility;  // share -1: not known

void main() {
    SplatHit hit = hit_splat(gl_FragCoord.xy - 0.5);
    if (hit.depth == 0.0) discard;
    visibility = vec4(0.0, 0.0, 0.0, -1.0);
    surface = vec4(is_lit ? hit.normal : vec3(0.0), hit.depth);
    albedo = vec4(linear_color, material_number);
    gl_FragDepth = 1.0 - near / hit.depth;
}
