#version 330 core
// Keeps the pixels that a footprint covers, and what few_splats.vert found for all of them.
#include "common/splat.glsl"

flat in vec2 centre;
flat in vec4 to_source;
flat in float reach;
flat in vec3 window_depth;
flat in vec4 own_surface;
flat in vec4 own_albedo;
flat in vec4 own_visibility;

layout(location = 0) out vec4 surface;
layout(location = 1) out vec4 albedo;
layout(location = 2) out vec4 visibility;

void main() {
    vec2 offset = gl_FragCoord.xy - 0.5 - centre;
    if (!footprint_covers(to_source, vec2(0.0), offset, reach, false)) discard;
    surface = own_surface;
    albedo = own_albedo;
    visibility = own_visibility;
    gl_FragDepth = window_depth.x + dot(window_depth.yz, offset);
}
