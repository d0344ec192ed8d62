#version 330 core
// The picture of a frame -> the same without its highlights.
#include "common/color.glsl"
#include "common/highlights.glsl"

uniform sampler2D color_map;     // sRGB, of any size
uniform sampler2D surface_map;   // unit normal, depth
uniform sampler2D strength_map;  // small: strength, depth
uniform vec4 source;             // of the surface
uniform vec4 light;              // l and q, see highlight_of
uniform float exponent;

out vec4 matte;  // sRGB, and the picture's own alpha

void main() {
    vec4 color = texelFetch(color_map, ivec2(gl_FragCoord.xy), 0);
    vec2 at = rescale_position(gl_FragCoord.xy - 0.5, vec2(textureSize(color_map, 0)), vec2(textureSize(surface_map, 0)));
    float highlight = highlight_at(surface_map, strength_map, at, source, light, exponent);
    matte = color;
    if (highlight > 0.0) {
        matte.rgb = linear_to_srgb(without_highlight(srgb_to_linear(color.rgb), highlight));
    }
}
