// Which splats a block of source pixels is drawn as, and how they are drawn: for splats.comp and large_splats.comp.
#include "points/compute_raster.glsl"

#ifndef BLOCK
#define BLOCK 4  // source pixels a side that are drawn together: 4, or 1, which merges none
#endif

uniform float tolerance;  // how far off a plane a block's pixels may lie, as a share of 1/z; 0 draws each by itself
uniform int list_length;

// What a step does with a splat, and with a pixel that is a rim in most views; each defines its own.
void take_splat(Footprint splat, float reach);
void take_rim(ivec2 pixel);

float reach_of(float side) {
    return EXACT == 1 ? exact_reach(side, false) : splat_reach(side, false);
}

// The first and the last pixel of the view that a splat may cover.
void splat_box(Footprint splat, float reach, out ivec2 low, out ivec2 high) {
    vec2 extent = footprint_extent(splat, reach, false);
    note_extent(extent);
    pixels_of(vec4(splat.centre - extent, splat.centre + extent), low, high);
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
            atomicMax(nearest[q.y * target_size.x + q.x], noted(inverse_depth, false));
        }
        q = q.x + stride.x <= high.x ? ivec2(q.x + stride.x, q.y) : ivec2(low.x, q.y + stride.y);
    }
}

vec2 slope_at(ivec2 pixel, vec4 surface) {
    return inverse_depth_slope(surface.xyz, pixel_ray(vec2(pixel), source), surface.w, source);
}

bool block_on_plane(ivec2 block, vec4 first, vec2 slope, int side) {
    bool on_plane = true;
    for (int y = 0; y < side; ++y) {
        for (int x = 0; x < side; ++x) {
            vec4 there = texel_or_zero(surface_map, block + ivec2(x, y));
            on_plane = on_plane && lies_on_plane(there.w, vec2(x, y), first.w, slope, tolerance);
        }
    }
    return on_plane;
}

// Takes a block as one splat if its pixels lie on a plane that hardly bends in the view; else false.
bool take_block(ivec2 block, int side) {
    vec4 first = texel_or_zero(surface_map, block);
    vec2 slope = slope_at(block, first);
    bool whole = block_on_plane(block, first, slope, side);
    whole = trusts_alike(block, side, whole);
    if (whole) {
        vec2 middle = vec2(0.5 * float(side - 1));
        float w = 1.0 / first.w + dot(slope, middle);
        Footprint splat = carry_footprint(vec2(block) + middle, 1.0 / w, first.xyz, source, view, target);
        float reach = reach_of(float(side));
        whole = splat.inverse_depth > 0.0 && splat_bends(splat, reach) <= FLAT;
        note_source(block, float(side));
        if (whole && splat_is_ahead(splat, near) && !is_left_out()) take_splat(splat, reach);
    }
    return whole;
}

// The splats of 4x4 source pixels: one, or of each quarter one, or of its pixels one each. Of BLOCK 1 that of a pixel.
void take_splats(ivec2 block) {
    int quarters = BLOCK == 1 ? 1 : take_block(block, 4) ? 0 : 4;
    for (int k = 0; k < quarters; ++k) {
        ivec2 quarter = block + 2 * ivec2(k & 1, k >> 1);
        int singles = BLOCK == 1 ? 1 : take_block(quarter, 2) ? 0 : 4;
        for (int j = 0; j < singles; ++j) {
            ivec2 pixel = quarter + ivec2(j & 1, j >> 1);
            vec4 surface = texel_or_zero(surface_map, pixel);
            if (surface.w == 0.0) continue;
            if (surface.w < 0.0) take_rim(pixel);
            float z = abs(surface.w);
            Footprint splat = carry_footprint(vec2(pixel), z, surface.xyz, source, view, target);
            if (!splat_is_ahead(splat, near) || (surface.w < 0.0 && draws_rim(splat, z, source, target))) continue;
            note_source(pixel, 1.0);
            if (!is_left_out()) take_splat(splat, reach_of(1.0));
        }
    }
}
