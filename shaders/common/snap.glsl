#include "common/vote.glsl"

// Puts samples that lie between two surfaces onto one of them.

const int SNAP_WINDOW = 7;        // pixels around a sample in which both surfaces are looked for
const float SNAP_REACH = 1.5;     // standard deviation of the weights there, pixels

// Unit normal and depth of a mixed sample whose 1/z is w: the plane of the nearest sample of the nearer or of the farther
// surface around it; depth 0 if there is none. Samples of its colour, and near its own 1/z, decide which.
// surface_map: without mixed samples, which have a depth of 0. guide_map: mean colour of each sample.
vec4 snap_sample(sampler2D surface_map, sampler2D guide_map, ivec2 pixel, float w, vec4 source) {
    float farthest = 1e30, nearest = 0.0;
    for (int k = 0; k < SNAP_WINDOW * SNAP_WINDOW; ++k) {
        ivec2 off = ivec2(k % SNAP_WINDOW, k / SNAP_WINDOW) - SNAP_WINDOW / 2;
        vec4 there = sample_at(surface_map, pixel + off);
        if (there.w <= 0.0) continue;
        farthest = min(farthest, 1.0 / there.w);
        nearest = max(nearest, 1.0 / there.w);
    }
    if (nearest == 0.0) return vec4(0.0);
    float middle = 0.5 * (nearest + farthest);
    vec3 color = surface_at(guide_map, pixel).rgb;
    vec2 votes = vec2(0.0);                // of the nearer surface, of the farther one
    vec2 distances = vec2(1e30);           // to the nearest sample of each
    ivec2 near_place = pixel, far_place = pixel;
    for (int k = 0; k < SNAP_WINDOW * SNAP_WINDOW; ++k) {
        ivec2 off = ivec2(k % SNAP_WINDOW, k / SNAP_WINDOW) - SNAP_WINDOW / 2;
        vec4 there = sample_at(surface_map, pixel + off);
        if (there.w <= 0.0) continue;
        vec3 difference = color - surface_at(guide_map, pixel + off).rgb;
        float away = float(off.x * off.x + off.y * off.y);
        float vote = exp(-away / (2.0 * SNAP_REACH * SNAP_REACH) - dot(difference, difference) / (2.0 * COLOR_REACH * COLOR_REACH));
        if (1.0 / there.w > middle) {
            votes.x += vote;
            if (away < distances.x) { distances.x = away; near_place = pixel + off; }
        } else {
            votes.y += vote;
            if (away < distances.y) { distances.y = away; far_place = pixel + off; }
        }
    }
    float share = clamp((w - farthest) / max(nearest - farthest, 1e-30), 0.05, 0.95);  // of the nearer surface
    bool is_near = votes.x * share > votes.y * (1.0 - share);
    ivec2 place = is_near ? near_place : far_place;
    vec4 found = surface_at(surface_map, place);
    return vec4(found.xyz, 1.0 / (1.0 / found.w + dot(sample_slope(found, place, source), vec2(pixel - place))));
}
