#version 330 core
// The picture of a frame -> the colours of its surfaces alone.

#ifndef ALIGNED
#define ALIGNED 0  // whether each pixel of the picture is one of the surface
#endif

#include "common/color.glsl"
#include "common/unlighting.glsl"

uniform sampler2D color_map;    // sRGB, of any size
uniform sampler2D surface_map;  // unit normal, depth
uniform sampler2D gain_map;     // of samples: x and y of the normal, log luminance, log gain
uniform sampler2D hue_map;      // of samples: linear light around them
#if ALIGNED == 0
uniform vec4 source;            // of the surface
#endif
uniform vec2 samples;           // the picture's size, in samples

out vec4 albedo;  // sRGB, and the picture's own alpha

void main() {
    vec4 color = texel_at(color_map, ivec2(gl_FragCoord.xy));
    vec2 size = vec2(textureSize(color_map, 0));
#if ALIGNED == 1
    vec3 normal = surface_at(surface_map, ivec2(gl_FragCoord.xy)).xyz;
#else
    vec2 at = rescale_position(gl_FragCoord.xy - 0.5, size, vec2(textureSize(surface_map, 0)));
    vec3 normal = normal_between(surface_map, at, source);
#endif
    albedo = color;
    if (normal != vec3(0.0)) {
        vec3 linear = srgb_to_linear(color.rgb);
        albedo.rgb = linear_to_srgb(unlit(gain_map, hue_map, rescale_position(gl_FragCoord.xy - 0.5, size, samples), normal, linear));
    }
}
