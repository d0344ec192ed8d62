#version 430 core
// The compute rasteriser: carries splats into the view and notes 1/z of their planes at every target pixel that they
// cover; the nearest stays (cf. software rasterisation of points by atomics: Schuetz, Kerbl, Wimmer 2021). Inverse
// depths are above 0, where floats have the order of their bits.
// One thread a block of 4x4 source pixels: where the block, or a quarter of it, lies on one plane, it is one larger
// splat. Nothing of the picture is lost by that: the resolve pass finds every source pixel again by its place.
#ifndef WINDOW
#define WINDOW 0  // 1: note the window that the splats leave empty round them
#endif
#include "common/splat.glsl"

layout(local_size_x = 32) in;
layout(std430, binding = 0) restrict buffer Nearest { uint nearest[]; };
#if WINDOW
layout(std430, binding = 1) restrict buffer Window { int window[4]; };  // how far they come: to the left, up, right, down
#endif

uniform sampler2D surface_map;  // unit normal, depth
uniform vec4 source;
uniform vec4 target;
uniform mat4 view;
uniform ivec2 target_size;
uniform ivec2 corner;  // of the part that has points, a multiple of 4
uniform float near;
uniform float tolerance;  // how far off a plane its pixels may lie, as a share of 1/z; 0 draws each by itself

vec4 surface_at(ivec2 pixel) {
    if (any(greaterThanEqual(pixel, textureSize(surface_map, 0)))) return vec4(0.0);
    return texelFetch(surface_map, pixel, 0);
}

vec2 slope_at(ivec2 pixel, vec4 surface) {
    return inverse_depth_slope(surface.xyz, pixel_ray(vec2(pixel), source), surface.w, source);
}

void draw_splat(vec2 centre, float z, vec3 normal, float side) {
    Footprint splat = carry_footprint(centre, z, normal, source, view, target);
    if (splat.inverse_depth <= 0.0 || splat.inverse_depth * near >= 1.0) return;
    float reach = splat_reach(side, false);
    vec2 extent = footprint_extent(splat.to_target, reach, false);
    ivec2 low = ivec2(clamp(ceil(splat.centre - extent), vec2(0.0), vec2(target_size)));
    ivec2 high = ivec2(clamp(floor(splat.centre + extent), vec2(-1.0), vec2(target_size) - 1.0));
    vec4 to_source = invert_footprint(splat.to_target);
#if WINDOW
    ivec4 here = all(lessThanEqual(low, high)) ? ivec4(target_size - low, high + 1) : ivec4(0);
    for (int k = 0; k < 4; ++k) {
        if (here[k] > window[k]) atomicMax(window[k], here[k]);  // seldom, once some splats are drawn
    }
#endif
    int count = max(high.x - low.x + 1, 0) * max(high.y - low.y + 1, 0);
    ivec2 q = low;
    for (int k = 0; k < count; ++k) {
        vec2 offset = vec2(q) - splat.centre;
        if (footprint_covers(to_source, offset, reach, false)) {
            float inverse_depth = footprint_inverse_depth(splat, to_source, offset);
            atomicMax(nearest[q.y * target_size.x + q.x], floatBitsToUint(inverse_depth));
        }
        q = q.x < high.x ? ivec2(q.x + 1, q.y) : ivec2(low.x, q.y + 1);
    }
}

bool block_on_plane(ivec2 block, vec4 first, vec2 slope, int side) {
    bool on_plane = true;
    for (int y = 0; y < side; ++y) {
        for (int x = 0; x < side; ++x) {
            vec4 there = surface_at(block + ivec2(x, y));
            on_plane = on_plane && lies_on_plane(there.w, vec2(x, y), first.w, slope, tolerance);
        }
    }
    return on_plane;
}

void draw_block(ivec2 block, vec4 first, vec2 slope, int side) {
    vec2 middle = vec2(0.5 * float(side - 1));
    float w = 1.0 / first.w + dot(slope, middle);
    draw_splat(vec2(block) + middle, 1.0 / w, first.xyz, float(side));
}

void main() {
    ivec2 block = corner + 4 * ivec2(gl_GlobalInvocationID.xy);
    if (block.x >= textureSize(surface_map, 0).x) return;
    vec4 first = surface_at(block);
    vec2 slope = slope_at(block, first);
    bool whole = block_on_plane(block, first, slope, 4);
    if (whole) draw_block(block, first, slope, 4);
    int quarters = whole ? 0 : 4;
    for (int k = 0; k < quarters; ++k) {
        ivec2 quarter = block + 2 * ivec2(k & 1, k >> 1);
        first = surface_at(quarter);
        slope = slope_at(quarter, first);
        whole = block_on_plane(quarter, first, slope, 2);
        if (whole) draw_block(quarter, first, slope, 2);
        int singles = whole ? 0 : 4;
        for (int j = 0; j < singles; ++j) {
            ivec2 pixel = quarter + ivec2(j & 1, j >> 1);
            vec4 surface = surface_at(pixel);
            if (surface.w > 0.0) draw_splat(vec2(pixel), surface.w, surface.xyz, 1.0);
        }
    }
}
