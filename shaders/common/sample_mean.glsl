#include "common/color.glsl"

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
