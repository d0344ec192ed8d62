#include "common/color.glsl"

// A pixel of a picture, from the sum of its samples: linear light and coverage. The background lies behind, linear; its
// alpha is 1, or 0 for a transparent one: then the alpha of the pixel is its coverage, and the colour is not multiplied
// by it (straight alpha, as in PNG).
vec4 developed(vec4 sum, float count, vec4 background) {
    vec4 mean = sum / count;
    vec3 light = mean.rgb + (1.0 - mean.a) * background.a * background.rgb;
    float alpha = mix(mean.a, 1.0, background.a);
    return vec4(linear_to_srgb(clamp(light / max(alpha, 1e-6), 0.0, 1.0)), alpha);
}
