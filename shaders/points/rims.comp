#version 430 core
// The rims that splats.comp has put on its list: one thread draws each.
#ifndef WINDOW
#define WINDOW 0  // 1: note how far the splats come
#endif
#ifndef SET
#define SET 0     // 1: one of several frames
#endif
#include "points/compute_raster.glsl"

layout(local_size_x = 32) in;

void draw_rim(ivec2 pixel) {
    vec4 own = surface_at(surface_map, pixel);
    Rim rim = estimate_rim(surface_map, pixel, source);
    Footprint splat = carry_footprint(vec2(pixel), own.w, own.xyz, source, view, target);
    note_source(pixel, 1.0);
    note_extent(footprint_extent(splat, splat_reach(1.0, false), false));
    ivec2 low, high;
    pixels_of(rim_box(rim, vec2(pixel), own, source, view, target), low, high);
#if WINDOW
    widen_window(low, high);
#endif
    ivec2 steps = max(high - low + 1, 0), q = low;
    for (int k = 0; k < steps.x * steps.y; ++k) {
        vec3 met = meet_rim(rim, vec2(pixel), own, splat.inverse_depth, vec2(q), source, view, target);
        if (met.x > 0.0) atomicMax(nearest[q.y * target_size.x + q.x], noted(met.x, pixel, is_hidden(rim, met.yz)));
        q = q.x < high.x ? ivec2(q.x + 1, q.y) : ivec2(low.x, q.y + 1);
    }
}

void main() {
    for (uint k = gl_GlobalInvocationID.x; k < rim_count; k += 32u * gl_NumWorkGroups.x) {
        draw_rim(pixel_of(int(rims[k]), textureSize(surface_map, 0).x));
    }
#if WINDOW
    note_window();
#endif
}
