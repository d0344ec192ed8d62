#version 430 core
// The large splats of the blocks that splats.comp has put on its list: 32 threads and gl_NumWorkGroups.y groups share
// each.
#ifndef WINDOW
#define WINDOW 0  // 1: note how far the splats come
#endif
#ifndef SET
#define SET 0     // 1: one of several frames
#endif
#ifndef EXACT
#define EXACT 0  // 1: one of several frames without noise
#endif
#include "points/splat_blocks.glsl"

layout(local_size_x = 32) in;

void take_splat(Footprint splat, float reach) {
    float bends = splat_bends(splat, reach);
    if (bends >= ENDLESS) return;
    splat.bend = splat_bend(splat, reach);
    ivec2 low, high;
    splat_box(splat, reach, low, high);
    if (bends <= FLAT && (high.x - low.x) * (high.y - low.y) <= LARGE) return;
#if WINDOW
    widen_window(low, high);
#endif
    ivec2 start = low + ivec2(gl_LocalInvocationID.x, gl_WorkGroupID.y);
    note_splat(splat, reach, start, high, ivec2(32, gl_NumWorkGroups.y));
}

void take_rim(ivec2 pixel) {}  // rims are never large

void main() {
    int columns = (textureSize(surface_map, 0).x + BLOCK - 1) / BLOCK;
    uint end = min(count, uint(list_length));
    for (uint k = gl_WorkGroupID.x; k < end; k += gl_NumWorkGroups.x) {
        int block = int(large[k]);
        take_splats(BLOCK * ivec2(block % columns, block / columns));
    }
#if WINDOW
    note_window();
#endif
}
