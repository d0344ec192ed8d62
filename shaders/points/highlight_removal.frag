#version 330 core
// The picture of a frame -> the same without its highlights.
#include "common/highlights.glsl"

uniform sampler2D color_map;
uniform sampler2D found_map;  // from highlights.frag

out vec4 matte;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    vec4 color = texel_at(color_map, pixel);
    vec2 size = vec2(textureSize(color_map, 0)), found_size = vec2(textureSize(found_map, 0));
    vec4 found = found_at(found_map, rescale_position(vec2(pixel), size, found_size));
    matte = color;
    if (found.w > 0.0) matte.rgb = linear_to_srgb((1.0 - found.w) * srgb_to_linear(color.rgb) + found.rgb);
}
