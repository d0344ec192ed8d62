#version 330 core
// Which pixels of a view are the same in all samples, but for the colour of their surface, whose mean is known: they get the
// sum of all samples at once, and are so near that no sample is drawn there any more. The others are left to the samples.
#include "common/pixel_mean.glsl"
#include "common/texels.glsl"

uniform sampler2D albedo_map;   // mean of all samples
uniform sampler2D shade_map;    // light that a white matt surface sends back; 1, 0 for nothing, -1 where more may change
uniform sampler2D shine_map;    // highlights
uniform float count;            // of samples

out vec4 color;

// To the next pixel of four rows through a pixel. At the picture's border, where there may be none, all pixels are open.
ivec2 offset_of(int k) {
    return k < 3 ? ivec2(k - 1, 1) : ivec2(1, 0);
}

// The errors of shade and of shine, as if no change were more than a fold.
void find_errors(ivec2 pixel, vec4 shade, vec4 shine, inout vec3 shade_error, inout vec3 shine_error) {
    shade_error = vec3(0.0);
    shine_error = vec3(0.0);
    for (int k = 0; k < 4; ++k) {
        ivec2 off = offset_of(k);
        vec3 before = texel_at(shade_map, pixel - off).rgb, after = texel_at(shade_map, pixel + off).rgb;
        vec3 first = texel_at(shade_map, pixel - 2 * off).rgb, last = texel_at(shade_map, pixel + 2 * off).rgb;
        shade_error = max(shade_error, mean_error_of_five(first, before, shade.rgb, after, last));
        shade_error = max(shade_error, slope_error(before, after));
        before = texel_at(shine_map, pixel - off).rgb;
        after = texel_at(shine_map, pixel + off).rgb;
        first = texel_at(shine_map, pixel - 2 * off).rgb;
        last = texel_at(shine_map, pixel + 2 * off).rgb;
        shine_error = max(shine_error, mean_error_of_five(first, before, shine.rgb, after, last));
    }
}

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy), last = textureSize(shade_map, 0) - 1;
    vec4 shade = texel_at(shade_map, pixel), shine = texel_at(shine_map, pixel);
    bool is_alike = shade.a >= 0.0 && all(greaterThan(pixel, ivec2(0))) && all(lessThan(pixel, last));
    vec3 shade_error = vec3(0.0), shine_error = vec3(0.0);
    for (int k = 0; k < 4; ++k) {
        ivec2 off = offset_of(k);
        vec4 before = texel_at(shade_map, pixel - off), after = texel_at(shade_map, pixel + off);
        is_alike = is_alike && before.a == shade.a && after.a == shade.a;
        shade_error = max(shade_error, mean_error(before.rgb, shade.rgb, after.rgb));
        shade_error = max(shade_error, slope_error(before.rgb, after.rgb));
        vec3 first = texel_at(shine_map, pixel - off).rgb, second = texel_at(shine_map, pixel + off).rgb;
        shine_error = max(shine_error, mean_error(first, shine.rgb, second));
    }
    vec3 albedo = texel_at(albedo_map, pixel).rgb, light = shade.rgb * albedo + shine.rgb;
    bool is_sure = is_steady(light, shade_error * albedo + shine_error);
    int looks = is_alike && !is_sure ? 1 : 0;  // a loop that no pixel takes costs software drivers nothing
    for (int k = 0; k < looks; ++k) find_errors(pixel, shade, shine, shade_error, shine_error);
    bool is_shared = is_alike && is_steady(light, shade_error * albedo + shine_error);
    color = is_shared && shade.a > 0.0 ? count * vec4(light, 1.0) : vec4(0.0);
    gl_FragDepth = is_shared ? 0.0 : 1.0;
}
