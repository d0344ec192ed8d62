#version 430 core
// The rims of a frame: one thread draws each. splats.comp has listed them; where a view shows them again, what was
// estimated for the view before is kept: on software drivers that takes longer than drawing them.
#ifndef WINDOW
#define WINDOW 0  // 1: note how far the splats come
#endif
#ifndef SET
#define SET 0     // 1: one of several frames
#endif
#ifndef EXACT
#define EXACT 0  // 1: one of several frames without noise
#endif
#include "points/compute_raster.glsl"
#include "points/kept_rims.glsl"

#if SET
uniform sampler2D cuts_map;  // where other frames say that rims end: EXACT does not draw what is cut off, else it only closes holes
#endif

layout(local_size_x = 32) in;

const int IN_A_ROW = 256;  // rims of kept_map, four texels each

uniform int known_rims;  // so many are kept; -1: none, those on the list are estimated
uniform bool keeps;      // those are kept
layout(rgba32f, binding = 3) uniform readonly highp image2D known_map;  // the same texture: GLSL ES knows no image for both
layout(rgba32f, binding = 3) uniform writeonly highp image2D kept_map;

ivec2 kept_at(int place) {
    return ivec2(4 * (place % IN_A_ROW), place / IN_A_ROW);
}

void keep_rim(int place, mat4 kept) {
    for (int k = 0; k < 4; ++k) imageStore(kept_map, kept_at(place) + ivec2(k, 0), kept[k]);
}

mat4 known_rim(int place) {
    mat4 known;
    for (int k = 0; k < 4; ++k) known[k] = imageLoad(known_map, kept_at(place) + ivec2(k, 0));
    return known;
}

void draw_rim(int place) {
    mat4 known = known_rim(place);
    ivec2 pixel = ivec2(known[0].xy);
    int listed = known_rims < 0 ? 1 : 0;  // loops, see estimate_rim
    for (int k = 0; k < listed; ++k) pixel = pixel_of(int(rims[place]), textureSize(surface_map, 0).x);
    vec4 own = surface_at(surface_map, pixel);
    Footprint splat = carry_footprint(vec2(pixel), own.w, own.xyz, source, view, target);
    bool is_drawn = splat_is_ahead(splat, near) && draws_rim(splat, own.w, source, target);
    Rim rim = unpacked_rim(known);
    int estimates = is_drawn || keeps ? listed : 0;
    for (int k = 0; k < estimates; ++k) {
        rim = estimate_rim(surface_map, pixel, source);
        if (keeps) keep_rim(place, packed_rim(pixel, rim));
    }
    if (!is_drawn) return;
    note_source(pixel, 1.0);
    if (is_left_out()) return;
    note_extent(footprint_extent(splat, splat_reach(1.0, false), false));
    ivec2 low, high;
    pixels_of(rim_box(rim, vec2(pixel), own, source, view, target), low, high);
#if WINDOW
    widen_window(low, high);
#endif
#if SET
    vec4 cuts = texel_at(cuts_map, pixel);
    int whole_level = level;
#endif
    ivec2 steps = max(high - low + 1, 0), q = low;
    for (int k = 0; k < steps.x * steps.y; ++k) {
        vec3 met = meet_rim(rim, vec2(pixel), own, splat.inverse_depth, vec2(q), source, view, target);
#if SET
        bool is_cut = (EXACT == 1 || rim.drop == 0.0) && is_cut_off(cuts, met.yz);
        level = is_cut ? whole_level & 1 : whole_level;
        bool is_drawn = EXACT == 0 || !(is_cut || is_hidden(rim, met.yz));
        if (!is_drawn || (EXACT == 1 && lies_deep(vec2(q), met.x, own.w, source, view, target))) met.x = 0.0;
#endif
        if (met.x > 0.0) atomicMax(nearest[q.y * target_size.x + q.x], noted(met.x, is_hidden(rim, met.yz)));
        q = q.x < high.x ? ivec2(q.x + 1, q.y) : ivec2(low.x, q.y + 1);
    }
}

void main() {
    int end = known_rims < 0 ? int(min(rim_count, uint(rims.length()))) : known_rims;
    for (int k = int(gl_GlobalInvocationID.x); k < end; k += 32 * int(gl_NumWorkGroups.x)) draw_rim(k);
#if WINDOW
    note_window();
#endif
}
