#include "common/resolve.glsl"

// Divides the light of a picture out of its colours, so that another light does not shade them twice. The gain is known
// for samples, some pixels apart; between them it follows the normals and the brightness of the picture.

const float LEAST_SHARE = 1e-3;    // of a sample at the far end of the square between four
const float SAMPLE_BEND = 0.09;    // squared difference of normals
const float MOST_BEND = 4.0;       // the same of two that are opposite
const float STEEPEST = 0.2;        // z of a normal: steeper ones count as this
const float SAMPLE_STEP = 0.3;     // difference of log luminance
const float DARKEST_LIGHT = 0.002;         // linear luminance that is not told from less
const vec2 NOISY = vec2(0.004, 0.012);     // below the first, a hue is all noise, from the second on it is none
const vec2 RAISED = vec2(2.0, 6.0);        // gains from which on, and from which on certainly, that noise would be seen

// Linear light times a gain, but at most 1: all channels are multiplied by the same, so that the hue stays.
vec3 gained(vec3 linear, float gain) {
    float most = max(max(linear.r, linear.g), max(linear.b, 1e-6));
    return linear * min(gain, max(1.0 / most, 1.0));
}

float luminance_of(vec3 linear) {
    return dot(linear, vec3(0.2126, 0.7152, 0.0722));
}

// What is seen at a position between the pixels of a frame: the nearest of the four that has a surface.
Seen see_nearest(sampler2D surface_map, vec2 at) {
    Corners corners = corners_at(surface_map, at);
    vec4 far = vec4(
        distance(at, vec2(corners.low)), distance(at, vec2(corners.high.x, corners.low.y)),
        distance(at, vec2(corners.low.x, corners.high.y)), distance(at, vec2(corners.high))
    );
    far += 10.0 * vec4(equal(vec4(corners.a.w, corners.b.w, corners.c.w, corners.d.w), vec4(0.0)));
    bool right_above = far.y < far.x;
    bool right_below = far.w < far.z;
    bool below = (right_below ? far.w : far.z) < (right_above ? far.y : far.x);
    bvec2 side = bvec2(below ? right_below : right_above, below);
    return Seen(at, 0.0, corner_pixel(corners, side), corner_surface(corners, side), corners);
}

// The normal seen there; 0 without a surface or a normal.
vec3 normal_between(sampler2D surface_map, vec2 at, vec4 source) {
    Seen seen = see_nearest(surface_map, at);
    if (seen.own.w == 0.0 || seen.own.xyz == vec3(0.0)) return vec3(0.0);
    return mix_normal(seen, seen_weights(seen, source));
}

// How much one of the four samples around a position counts, that far away.
// own: x and y of the normal and log luminance of what is seen there; sampled: those of the sample; slope: how much z of
// the normal grows with x and y
float sample_weight(vec2 off, vec3 own, vec2 slope, vec3 sampled) {
    vec2 turn = sampled.xy - own.xy;
    float rise = dot(slope, turn), bend = min(dot(turn, turn) + rise * rise, MOST_BEND) / SAMPLE_BEND;
    vec2 share = max(1.0 - abs(off), LEAST_SHARE);
    return share.x * share.y * exp(-bend - abs(sampled.z - own.z) / SAMPLE_STEP);
}

// What linear light of such a normal is multiplied by, at a position among the samples; 1 without any.
// gain_map: x and y of the normal, log luminance, log gain; hue_map: linear light around the samples
vec3 unlit(sampler2D gain_map, sampler2D hue_map, vec2 at, vec3 normal, vec3 linear) {
    ivec2 last = textureSize(gain_map, 0) - 1, low = ivec2(floor(at));
    float luminance = luminance_of(linear), total = 0.0, sum = 0.0;
    vec3 own = vec3(normal.xy, log(max(luminance, DARKEST_LIGHT)));
    vec2 slope = normal.xy / max(-normal.z, STEEPEST);
    for (int k = 0; k < 4; ++k) {
        ivec2 place = clamp(low + ivec2(k % 2, k / 2), ivec2(0), last);
        vec4 sampled = texel_at(gain_map, place);
        float weight = sample_weight(vec2(place) - at, own, slope, sampled.xyz);
        total += weight;
        sum += weight * sampled.w;
    }
    float gain = total > 0.0 ? exp(sum / total) : 1.0;
    float hueless = clamp((NOISY.y - luminance) / (NOISY.y - NOISY.x), 0.0, 1.0);
    hueless *= clamp((gain - RAISED.x) / (RAISED.y - RAISED.x), 0.0, 1.0);
    vec3 around = vec3(0.0);
    int reads = hueless > 0.0 ? 4 : 0;  // a loop that no pixel takes costs software drivers nothing
    for (int k = 0; k < reads; ++k) {
        ivec2 place = clamp(low + ivec2(k % 2, k / 2), ivec2(0), last);
        float weight = sample_weight(vec2(place) - at, own, slope, texel_at(gain_map, place).xyz);
        around += weight * texel_at(hue_map, place).rgb;
    }
    float bright = luminance_of(around);
    if (bright > 0.0) linear = mix(linear, around * (luminance / bright), hueless);
    return gained(linear, gain);
}
