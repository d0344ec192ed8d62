#version 430 core
// The rim pixels that splats.comp has put on its list: a thread draws each.
#ifndef WINDOW
#define WINDOW 0  // 1: note how far the splats come
#endif
#ifndef SET
#define SET 0     // 1: one of several frames
#endif
#include "carried.glsl"

layout(local_size_x = 32) in;

layout(std430, binding = 2) restrict buffer Rims {
    uvec4 rim_groups;
    uint rim_count;
    uint rims[];
};

void take_splat(Footprint splat, float reach) {}

void take_rim(ivec2 pixel) {}

void draw_rim(ivec2 pixel) {
    vec4 own = surface_at(surface_map, pixel);
    Rim rim = estimate_rim(surface_map, pixel, source);
    Footprint splat = carry_footprint(vec2(pixel), own.w, own.xyz, source, view, target);
    note_source(pixel, 1.0);
    note_extent(footprint_extent(splat, splat_reach(1.0, false), false));
    vec4 box = rim_box(rim, vec2(pixel), own, source, view, target);
    ivec2 low = ivec2(clamp(ceil(box.xy), vec2(0.0), vec2(target_size)));
    ivec2 high = ivec2(clamp(floor(box.zw), vec2(-1.0), vec2(target_size) - 1.0));
#if WINDOW
    note_window(low, high);
#endif
    ivec2 steps = max(high - low + 1, 0);
    ivec2 q = low;
    for (int k = 0; k < steps.x * steps.y; ++k) {
        float here = rim_inverse_depth(rim, vec2(pixel), own, splat.inverse_depth, vec2(q), source, view, target);
        if (here > 0.0) atomicMax(nearest[q.y * target_size.x + q.x], noted(here));
        q = q.x < high.x ? ivec2(q.x + 1, q.y) : ivec2(low.x, q.y + 1);
    }
}

void main() {
    int columns = textureSize(surface_map, 0).x;
    for (uint k = gl_GlobalInvocationID.x; k < rim_count; k += 32u * gl_NumWorkGroups.x) {
        int index = int(rims[k]);
        draw_rim(ivec2(index % columns, index / columns));
    }
}
