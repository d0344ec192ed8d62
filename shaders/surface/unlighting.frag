#version 330 core
// The picture of a frame -> the colours of its surfaces alone.
#include "common/color.glsl"
#include "common/unlighting.glsl"

uniform sampler2D color_map;    // sRGB, of any size
uniform sampler2D surface_map;  // unit normal, depth
uniform vec4 source;            // of the surface
uniform vec4 light;             // unit direction towards it, ambient light
uniform float white;

out vec4 albedo;  // sRGB, and the picture's own alpha

void main() {
    vec4 color = texelFetch(color_map, ivec2(gl_FragCoord.xy), 0);
    vec2 at = rescale_position(gl_FragCoord.xy - 0.5, vec2(textureSize(color_map, 0)), vec2(textureSize(surface_map, 0)));
    vec3 linear = srgb_to_linear(color.rgb);
    linear = gained(linear, gain_at(surface_map, at, source, light, white));
    albedo = vec4(linear_to_srgb(linear), color.a);
}
