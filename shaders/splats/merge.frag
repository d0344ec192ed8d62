#version 330 core
#ifndef OPAQUE
#define OPAQUE 0  // 1: other objects are behind; 2: with the light from all around that reaches them
#endif
// The surface of the splats of a view among those of other objects, for the light pass: where they cover enough.
#include "common/color.glsl"

uniform sampler2D colors_sum;
uniform sampler2D fitted;
uniform float least;      // that they cover
uniform float number;     // of their material; below 0: eye-dome lighting is wanted
#if OPAQUE > 0
uniform sampler2D opaque_map;
uniform sampler2D opaque_colors;
#endif
#if OPAQUE == 2
uniform sampler2D opaque_visibility;
#endif

layout(location = 0) out vec4 surface;
layout(location = 1) out vec4 albedo;
layout(location = 2) out vec4 visibility;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    vec4 colors = texelFetch(colors_sum, pixel, 0), seen = texelFetch(fitted, pixel, 0);
    visibility = vec4(0.0, 0.0, 0.0, -1.0);
    if (colors.a >= least && seen.w > 0.0) {
        surface = seen;
        albedo = vec4(srgb_to_linear(min(colors.rgb / colors.a, 1.0)), number);
        return;
    }
#if OPAQUE > 0
    surface = texelFetch(opaque_map, pixel, 0);
    if (surface.w == 0.0) discard;
    albedo = texelFetch(opaque_colors, pixel, 0);
#if OPAQUE == 2
    visibility = texelFetch(opaque_visibility, pixel, 0);
#endif
#else
    discard;
#endif
}
