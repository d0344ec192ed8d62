#version 430 core
// The compute rasteriser: projects splats into the view and notes 1/z of their planes at every target pixel that they
// cover; the nearest stays (cf. software rasterisation of points by atomics: Schuetz, Kerbl, Wimmer 2021). Inverse
// depths are above 0, where floats have the order of their bits.
// On software drivers a thread draws a block of 4x4 source pixels. Where the block, or a quarter of it, lies on one plane,
// it is one larger splat. The picture loses nothing: the resolve pass finds every source pixel again by its place.
// GPUs want many small threads: there each draws a pixel.
// Splats near the camera cover much of the view, or bend in it: large_splats.comp draws them, many threads each.
// Rims cost more than splats, and are few: rims.comp draws them, one thread each, all that the frame has.
#ifndef WINDOW
#define WINDOW 0  // 1: note how far the splats come
#endif
#ifndef SET
#define SET 0     // 1: one of several frames
#endif
#ifndef EXACT
#define EXACT 0  // 1: one of several frames without noise
#endif
#ifndef MASKED
#define MASKED 0  // only some tiles of the view are drawn; 1: lists the blocks that may be seen there, 2: draws only those
#endif
#ifndef GROUP
#define GROUP 32  // threads
#endif
#include "points/splat_blocks.glsl"

layout(local_size_x = GROUP) in;

uniform ivec2 corner;     // of the part that has points, a multiple of BLOCK
uniform int most_groups;  // of large_splats.comp and of rims.comp
uniform int known_rims;   // of the frame, if rims.comp has kept them; -1 lists them

#if MASKED
layout(std430, binding = 3) restrict buffer Chosen {
    uvec4 chosen_groups;  // for the next samples
    uint chosen_count;
    uint chosen[];        // the numbers of blocks, row by row
};

uniform sampler2D active_map;  // the tiles of the view that are drawn: 1, else 0

const int TILE = 4;   // pixels a side
const int MOVED = 1;  // pixels: by so much, at most, lies a splat elsewhere in another sample

bool is_chosen = false;

void choose(ivec2 low, ivec2 high) {
    ivec2 first = max(low - MOVED, 0) / TILE, last = min(high + MOVED, target_size - 1) / TILE, tile = first;
    while (tile.y <= last.y && tile.x <= last.x && !is_chosen) {
        is_chosen = texel_at(active_map, tile).r > 0.0;
        tile = tile.x < last.x ? ivec2(tile.x + 1, tile.y) : ivec2(first.x, tile.y + 1);
    }
}

void put_chosen_on_list(uint block) {
    uint place = atomicAdd(chosen_count, 1u);
    atomicMax(chosen_groups.x, min(place / uint(GROUP) + 1u, uint(most_groups)));
    if (place < uint(chosen.length())) chosen[place] = block;
}
#endif

bool leaves_some = false;  // large splats of the block
uint rims_here = 0u;       // rim pixels of the block, a bit for each, row by row

void take_splat(Footprint splat, float reach) {
    bool is_bent = splat_bends(splat, reach) > FLAT;
    splat.bend = vec2(0.0);  // of those that are drawn here: the compiler leaves out what others need
    ivec2 low, high;
    splat_box(splat, reach, low, high);
    bool is_large = is_bent || (high.x - low.x) * (high.y - low.y) > LARGE;
    leaves_some = leaves_some || is_large;
#if MASKED == 1
    choose(low, high);
#endif
    if (is_large) high = low - 1;
#if WINDOW
    widen_window(low, high);
#endif
    note_splat(splat, reach, low, high, ivec2(1));
}

void take_rim(ivec2 pixel) {
    rims_here |= 1u << uint(4 * (pixel.y & BLOCK - 1) + (pixel.x & BLOCK - 1));
#if MASKED == 1
    is_chosen = true;
#endif
}

void put_on_list(uint block) {
    uint place = atomicAdd(count, 1u);
    if (place < uint(list_length)) large[place] = block;
    atomicMax(groups.x, min(place + 1u, uint(most_groups)));
}

void put_rims_on_list(ivec2 block) {
    uint end = atomicAdd(rim_count, uint(bitCount(rims_here))) + uint(bitCount(rims_here));
    atomicMax(rim_groups.x, min((end + 31u) / 32u, uint(most_groups)));
    for (; rims_here != 0u; rims_here &= rims_here - 1u) {
        int bit = findLSB(rims_here);
        uint rim = uint((block.y + (bit >> 2)) * textureSize(surface_map, 0).x + block.x + (bit & 3));
        if (--end < uint(rims.length())) rims[end] = rim;
    }
}

void draw_block(ivec2 block, int columns) {
    leaves_some = false;
    rims_here = 0u;
    take_splats(block);
    if (rims_here != 0u && known_rims < 0) put_rims_on_list(block);
    if (leaves_some) put_on_list(uint(block.y / BLOCK * columns + block.x / BLOCK));
#if MASKED == 1
    if (is_chosen) put_chosen_on_list(uint(block.y / BLOCK * columns + block.x / BLOCK));
#endif
}

void main() {
    int columns = (textureSize(surface_map, 0).x + BLOCK - 1) / BLOCK;
#if MASKED == 2
    for (uint k = gl_GlobalInvocationID.x; k < chosen_count; k += uint(GROUP) * gl_NumWorkGroups.x) {
        draw_block(BLOCK * pixel_of(int(chosen[k]), columns), columns);
    }
#else
    ivec2 block = corner + BLOCK * ivec2(gl_GlobalInvocationID.xy);
    if (block.x >= BLOCK * columns) return;
    draw_block(block, columns);
#endif
#if WINDOW
    note_window();
#endif
}
