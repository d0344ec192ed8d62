// What the two steps of the compute rasteriser have in common: their inputs, which splats a block of source pixels is
// drawn as, and how a splat's 1/z is noted in the view.
// SET: it is one of several frames, whose splats leave keys, see common/parts.glsl.
#include "common/rim_splat.glsl"
#if SET
#include "common/parts.glsl"
#endif

const int LARGE = 2048;  // pixels of the view's box round a splat that one thread looks at

layout(std430, binding = 0) restrict buffer Nearest { uint nearest[]; };  // bits of 1/z, or keys; 0 is nothing
layout(std430, binding = 1) restrict buffer Large {
    uvec4 groups;   // of large_splats.comp: x is the count of blocks on the list, or the most groups that a driver takes
    int window[4];  // how far all splats come: to the left, up, right, down
    uint count;     // of blocks with large splats, those too that found no place on the list
    uint large[];   // their numbers, row by row
};

uniform sampler2D surface_map;  // unit normal, depth
uniform vec4 source;
uniform vec4 target;
uniform mat4 view;
uniform ivec2 target_size;
uniform float near;
uniform float tolerance;  // how far off a plane a block's pixels may lie, as a share of 1/z; 0 draws each by itself
uniform int list_length;
#if SET
uniform sampler2D trust_map;
uniform bool is_primary;

int level = 0;        // of the splat that is drawn
float trust = 0.0;    // in it; of a block, in its first pixel
float side_of = 1.0;  // source pixels

void note_source(ivec2 pixel, float side) {
    trust = surface_at(trust_map, pixel).r;
    side_of = side;
}

void note_extent(vec2 extent) {
    level = splat_level(trust, is_stretched(extent, side_of), is_primary);
}

uint noted(float inverse_depth) {
    return splat_key(inverse_depth, level);
}
#else
void note_source(ivec2 pixel, float side) {}

void note_extent(vec2 extent) {}

uint noted(float inverse_depth) {
    return floatBitsToUint(inverse_depth);
}
#endif

// What a step does with a splat; each defines its own.
void take_splat(Footprint splat, float reach);
void take_rim(ivec2 pixel);

vec4 own_surface(ivec2 pixel) {
    if (any(greaterThanEqual(pixel, textureSize(surface_map, 0)))) return vec4(0.0);
    return texelFetch(surface_map, pixel, 0);
}

vec2 slope_at(ivec2 pixel, vec4 surface) {
    return inverse_depth_slope(surface.xyz, pixel_ray(vec2(pixel), source), surface.w, source);
}

// The first and the last pixel of the view that a splat may cover.
void splat_box(Footprint splat, float reach, out ivec2 low, out ivec2 high) {
    vec2 extent = footprint_extent(splat, reach, false);
    note_extent(extent);
    low = ivec2(clamp(ceil(splat.centre - extent), vec2(0.0), vec2(target_size)));
    high = ivec2(clamp(floor(splat.centre + extent), vec2(-1.0), vec2(target_size) - 1.0));
}

// Notes how far splats come.
void note_window(ivec2 low, ivec2 high) {
    ivec4 here = all(lessThanEqual(low, high)) ? ivec4(target_size - low, high + 1) : ivec4(0);
    for (int k = 0; k < 4; ++k) {
        if (here[k] > window[k]) atomicMax(window[k], here[k]);  // seldom, once some splats are drawn
    }
}

// Notes the splat's 1/z at the pixels of a box that it covers, from `low` on by steps, where it is the nearest.
void note_splat(Footprint splat, float reach, ivec2 low, ivec2 high, ivec2 stride) {
    vec4 to_source = invert_footprint(splat.to_target);
    ivec2 steps = max((high - low + stride) / stride, 0);
    ivec2 q = low;
    for (int k = 0; k < steps.x * steps.y; ++k) {
        vec2 offset = vec2(q) - splat.centre;
        if (footprint_covers(to_source, splat.bend, offset, reach, false)) {
            float inverse_depth = footprint_inverse_depth(splat, to_source, offset);
            atomicMax(nearest[q.y * target_size.x + q.x], noted(inverse_depth));
        }
        q = q.x + stride.x <= high.x ? ivec2(q.x + stride.x, q.y) : ivec2(low.x, q.y + stride.y);
    }
}

bool block_on_plane(ivec2 block, vec4 first, vec2 slope, int side) {
    bool on_plane = true;
    for (int y = 0; y < side; ++y) {
        for (int x = 0; x < side; ++x) {
            vec4 there = own_surface(block + ivec2(x, y));
            on_plane = on_plane && lies_on_plane(there.w, vec2(x, y), first.w, slope, tolerance);
        }
    }
    return on_plane;
}

// Takes a block as one splat if its pixels lie on a plane that hardly bends in the view; else false.
bool take_block(ivec2 block, int side) {
    vec4 first = own_surface(block);
    vec2 slope = slope_at(block, first);
    bool whole = block_on_plane(block, first, slope, side);
    if (whole) {
        vec2 middle = vec2(0.5 * float(side - 1));
        float w = 1.0 / first.w + dot(slope, middle);
        Footprint splat = carry_footprint(vec2(block) + middle, 1.0 / w, first.xyz, source, view, target);
        float reach = splat_reach(float(side), false);
        whole = splat.inverse_depth > 0.0 && splat_bends(splat, reach) <= FLAT;
        note_source(block, float(side));
        if (whole && splat_is_ahead(splat, near)) take_splat(splat, reach);
    }
    return whole;
}

// The splats of 4x4 source pixels: one, or of each quarter one, or of its pixels one each.
void take_splats(ivec2 block) {
    int quarters = take_block(block, 4) ? 0 : 4;
    for (int k = 0; k < quarters; ++k) {
        ivec2 quarter = block + 2 * ivec2(k & 1, k >> 1);
        int singles = take_block(quarter, 2) ? 0 : 4;
        for (int j = 0; j < singles; ++j) {
            ivec2 pixel = quarter + ivec2(j & 1, j >> 1);
            vec4 surface = own_surface(pixel);
            if (surface.w == 0.0) continue;
            float z = abs(surface.w);
            Footprint splat = carry_footprint(vec2(pixel), z, surface.xyz, source, view, target);
            if (!splat_is_ahead(splat, near)) continue;
            note_source(pixel, 1.0);
            if (surface.w < 0.0 && draws_rim(splat, z, source, target)) take_rim(pixel);
            else take_splat(splat, splat_reach(1.0, false));
        }
    }
}
