#include "common/color.glsl"

const float CRACK = 0.5;  // share of a pixel that is covered beside a crack, and in it

// The sum of samples of a pixel beside which the least coverage is this. Where one surface hides the end of another,
// the frame saw nothing between them, and some samples look through. Such a crack, with surfaces all around, is closed by
// what the other samples saw; an outline has something empty beside it.
vec4 close_crack(vec4 sum, float least, float count) {
    return min(sum.a, least) >= CRACK * count ? sum * (count / sum.a) : sum;
}

// A pixel of a picture, from the sum of its samples: linear light and coverage. The background lies behind, linear; its
// alpha is 1, or 0 for a transparent one: then the alpha of the pixel is its coverage, and the colour is not multiplied
// by it (straight alpha, as in PNG).
vec4 developed(vec4 sum, float count, vec4 background) {
    vec4 mean = sum / count;
    vec3 light = mean.rgb + (1.0 - mean.a) * background.a * background.rgb;
    float alpha = mix(mean.a, 1.0, background.a);
    return vec4(linear_to_srgb(clamp(light / max(alpha, 1e-6), 0.0, 1.0)), alpha);
}
