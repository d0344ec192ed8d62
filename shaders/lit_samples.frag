#version 330 core
// A small copy of a frame, for the search of its light: the mean colour of a block of pixels, and its normal.
#include "common/color.glsl"
#include "common/corners.glsl"
#include "common/picture.glsl"

const float CLIPPED = 0.93;  // linear light above which a camera may have cut a colour off
const float ALIKE = 0.95;    // cosine between the normals of one surface

uniform sampler2D color_map;  // sRGB, of any size
uniform sampler2D surface_map;
uniform float stride;         // pixels of the surface between samples

layout(location = 0) out vec4 color_sample;    // linear, and 1; 0 where nothing is known
layout(location = 1) out vec4 surface_sample;  // unit normal, depth

void main() {
    ivec2 size = textureSize(surface_map, 0);
    vec2 centre = gl_FragCoord.xy * stride - 0.5;
    surface_sample = surface_at(surface_map, min(ivec2(centre + 0.5), size - 1));
    color_sample = vec4(0.0);
    if (surface_sample.w == 0.0 || surface_sample.xyz == vec3(0.0)) return;
    float brightest = 0.0;
    for (int k = 0; k < 16; ++k) {
        vec2 off = (vec2(k % 4, k / 4) - 1.5) * (0.25 * stride);
        ivec2 pixel = clamp(ivec2(centre + off + 0.5), ivec2(0), size - 1);
        vec4 surface = surface_at(surface_map, pixel);
        if (surface.w == 0.0 || dot(surface.xyz, surface_sample.xyz) < ALIKE) continue;
        vec3 linear = srgb_to_linear(picture_at(color_map, vec2(pixel), vec2(size)));
        color_sample += vec4(linear, 1.0);
        brightest = max(brightest, max(max(linear.r, linear.g), linear.b));
    }
    color_sample = brightest < CLIPPED ? color_sample / max(color_sample.a, 1.0) : vec4(0.0);
}
