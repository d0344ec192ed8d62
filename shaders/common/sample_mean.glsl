#include "common/color.glsl"
#include "common/texels.glsl"

const int PATTERN = 4;  // pixels after which those of a ground look along the same planes again (see visibility.glsl)

// The alpha of the shadows on the ground in a pixel, summed over its samples: that of lamps, and that in the light from all
// around. Each pixel looks for the latter along planes of its own, so it is the mean of those around, which is as wide as
// their pattern: each plane counts the same, also at the border of the picture.
float smooth_ground(sampler2D grounds, sampler2D sums, ivec2 pixel, float count) {
    ivec2 last = textureSize(sums, 0) - 1;
    float own = count - texel_at(sums, pixel).a, around = 0.0, whole = 0.0;
    for (int k = 0; k < (own > 0.0 ? (PATTERN + 1) * (PATTERN + 1) : 0); ++k) {
        ivec2 off = ivec2(k % (PATTERN + 1), k / (PATTERN + 1)) - PATTERN / 2, place = pixel + off;
        place += PATTERN * (ivec2(lessThan(place, ivec2(0))) - ivec2(greaterThan(place, last)));
        place = clamp(place, ivec2(0), last);
        vec2 weight = mix(vec2(1.0), vec2(0.5), equal(abs(off), ivec2(PATTERN / 2)));
        around += weight.x * weight.y * texel_at(grounds, place).g;
        whole += weight.x * weight.y * max(count - texel_at(sums, place).a, 0.0);
    }
    return texel_at(grounds, pixel).r + (whole > 0.0 ? own * around / whole : 0.0);
}

// A pixel of a picture, from the sums of its samples: surfaces (linear light, coverage), and the alpha of the shadows on
// the ground, which shows where a sample has no surface; above its horizon that is 0. So over all samples that have no
// surface, the ground's mean is ground / (count - surfaces.a), and they are 1 - surfaces.a / count of the pixel. The
// background lies behind, linear; its alpha is 1, or 0 for a transparent one: then the alpha of the pixel is its own,
// and the colour is not multiplied by it (straight alpha, as in PNG). Only here is light cut off at 1.
vec4 developed(vec4 surfaces, float ground, float count, vec4 background) {
    vec4 mean = (surfaces + vec4(0.0, 0.0, 0.0, ground)) / count;
    vec3 light = mean.rgb + (1.0 - mean.a) * background.a * background.rgb;
    float alpha = mix(mean.a, 1.0, background.a);
    return vec4(linear_to_srgb(clamp(light / max(alpha, 1e-6), 0.0, 1.0)), alpha);
}
