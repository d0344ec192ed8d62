#include "common/color.glsl"
#include "common/splat_corners.glsl"
#include "common/picture.glsl"

// Samples of a lit surface, for the search of its light.

const float CLIPPED = 0.93;     // linear light above which a camera may have cut a colour off
const float SAME_SIDE = 0.95;   // cosine between normals whose colours are averaged

// The mean colour (linear) of those of 8 places around a pixel, every second of 4x4, that face the same way, and 1, or
// 0.5 where a camera may have cut one off; 0 where it is not known.
// span: pixels from end to end of these places; aligned: each pixel of the picture is one of the surface
vec4 mean_lit_color(sampler2D color_map, sampler2D surface_map, ivec2 pixel, float span, bool aligned) {
    vec2 size = vec2(textureSize(surface_map, 0));
    vec4 centre = surface_at(surface_map, pixel);
    vec4 sum = vec4(0.0);
    float brightest = 0.0;
    for (int k = 0; k < 8; ++k) {
        vec2 off = (vec2(k % 4, k / 4 * 2 + k % 2) - 1.5) * (0.25 * span);
        ivec2 place = ivec2(clamp(floor(vec2(pixel) + off + 0.5), vec2(0.0), size - 1.0));
        vec4 surface = surface_at(surface_map, place);
        bool alike = surface.w > 0.0 && dot(surface.xyz, centre.xyz) > SAME_SIDE;
        vec3 color = aligned ? texel_at(color_map, place).rgb : picture_at(color_map, vec2(place), size);
        vec3 linear = srgb_to_linear(color);
        sum += alike ? vec4(linear, 1.0) : vec4(0.0);
        brightest = max(brightest, alike ? max(max(linear.r, linear.g), linear.b) : 0.0);
    }
    vec4 mean = sum / max(sum.a, 1.0);
    return vec4(mean.rgb, brightest < CLIPPED ? mean.a : 0.5);
}
