#include "common/color.glsl"
#include "common/consensus.glsl"
#include "common/picture.glsl"

// Highlights in the picture of one of several frames. A highlight moves when the eye does: where other frames see the same
// points and most are darker, by more than noise, this one has a highlight. Brightness is in steps of 255.

const float DARKER_COUNTS = 0.2;       // per step by which a frame is darker, its colour counts e to this more
const vec2 SURE = vec2(2.0, 6.0);      // steps by which one frame is brighter than another: perhaps, surely
const vec2 AGREED = vec2(0.3, 0.5);    // share of the frames that say so: too few, enough
const float ENOUGH = 1.5;              // frames beside this one, at least: one could not tell a highlight from a shadow
const int AROUND = 3;                  // pixels on each side that are judged together
const float ROUGH = 0.6;               // of how rough an excess is counts against it: edges of paint that lie apart
const vec2 BEYOND = vec2(2.0, 3.0);    // times the noise: where a highlight begins to count, and counts in full

float brightness(vec3 linear) {
    return 85.0 * dot(linear_to_srgb(linear), vec3(1.0));
}

bool may_be_clipped(vec3 encoded) {
    return max(encoded.r, max(encoded.g, encoded.b)) > BRIGHTEST;
}

// What another frame says about the colour of a point, to be added up: its linear colour and 1, times a weight.
// gain: of its exposure
vec4 darker_part(vec3 encoded, vec3 gain) {
    vec3 linear = srgb_to_linear(encoded) * gain;
    return may_be_clipped(encoded) ? vec4(0.0) : exp(-DARKER_COUNTS * brightness(linear)) * vec4(linear, 1.0);
}

// What it says about the brightness `own` of this frame, to be added up: whether that is brighter, whether it is darker,
// by how many steps darker, and 1.
vec4 brightness_vote(vec3 encoded, vec3 gain, float own) {
    float off = own - brightness(srgb_to_linear(encoded) * gain);
    off = may_be_clipped(encoded) ? min(off, 0.0) : off;
    vec2 sure = clamp((vec2(off, -off) - SURE.x) / (SURE.y - SURE.x), 0.0, 1.0);
    return vec4(sure, max(-off, 0.0), 1.0);
}

// By how much a frame is brighter than others, and by how much darker, where enough say so; and 1, or 0 if too few see
// the point. sum: of darker_part; votes: of brightness_vote
vec3 excess_over(vec4 sum, vec4 votes, float own) {
    if (votes.w < ENOUGH) return vec3(0.0);
    vec2 agreed = clamp((votes.xy / votes.w - AGREED.x) / (AGREED.y - AGREED.x), 0.0, 1.0);
    float brighter = sum.w > 0.0 ? max(own - brightness(sum.rgb / sum.w), 0.0) : 0.0;
    return vec3(agreed * vec2(brighter, votes.z / votes.w), 1.0);
}

// Of the pixels beside one in its row the sums of both excesses, of the squares of their steps to the next pixels, and how
// many are known.
vec4 excess_in_row(sampler2D excess_map, ivec2 pixel) {
    ivec2 last = textureSize(excess_map, 0) - 1;
    vec4 sum = vec4(0.0);
    for (int k = -AROUND; k <= AROUND; ++k) {
        ivec2 place = clamp(pixel + ivec2(k, 0), ivec2(0), last);
        vec3 own = texel_at(excess_map, place).rgb;
        vec3 right = texel_at(excess_map, min(place + ivec2(1, 0), last)).rgb;
        vec3 below = texel_at(excess_map, min(place + ivec2(0, 1), last)).rgb;
        vec2 steps = vec2(right.x - right.y, below.x - below.y) - (own.x - own.y);
        steps *= own.z * vec2(right.z, below.z);
        sum += vec4(own.xy, 0.5 * dot(steps, steps), own.z);
    }
    return sum;
}

// Both excesses around a pixel, less how rough they are, and 1 if they are known. rows_map: of excess_in_row
vec3 excess_around(sampler2D rows_map, ivec2 pixel) {
    int last = textureSize(rows_map, 0).y - 1;
    vec4 sum = vec4(0.0);
    for (int k = -AROUND; k <= AROUND; ++k) sum += texel_at(rows_map, ivec2(pixel.x, clamp(pixel.y + k, 0, last)));
    return sum.w > 0.0 ? vec3(sum.xy / sum.w - ROUGH * sqrt(sum.z / sum.w), 1.0) : vec3(0.0);
}

// How much of a pixel's colour others replace, 0 to 1. excess: around it; noise: what is no highlight
float highlight_share(float excess, float noise) {
    return clamp((excess / noise - BEYOND.x) / (BEYOND.y - BEYOND.x), 0.0, 1.0);
}

// Between the pixels of a picture of four values. Outside, its border repeats.
vec4 found_at(sampler2D found_map, vec2 at) {
    ivec2 last = textureSize(found_map, 0) - 1;
    ivec2 low = clamp(ivec2(floor(at)), ivec2(0), last), high = clamp(ivec2(floor(at)) + 1, ivec2(0), last);
    vec2 share = at - floor(at);
    vec4 top = mix(texel_at(found_map, low), texel_at(found_map, ivec2(high.x, low.y)), share.x);
    vec4 bottom = mix(texel_at(found_map, ivec2(low.x, high.y)), texel_at(found_map, high), share.x);
    return mix(top, bottom, share.y);
}
