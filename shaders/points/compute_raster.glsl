// What the three steps of the compute rasteriser have in common: their inputs, and how 1/z is noted in the view.
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
layout(std430, binding = 2) restrict buffer Rims {
    uvec4 rim_groups;  // of rims.comp
    uint rim_count;
    uint rims[];       // the numbers of the rim pixels, row by row
};

uniform sampler2D surface_map;  // unit normal, depth, negative at rims
uniform vec4 source;
uniform vec4 target;
uniform mat4 view;
uniform float near;
uniform ivec2 target_size;
#if SET
uniform sampler2D trust_map;
uniform float primary;  // share of the frame's splats

int level = 0;        // of the splat that is drawn
float trust = 0.0;    // in it; of a block, in its first pixel
float side_of = 1.0;  // source pixels
bool is_primary = false;

void note_source(ivec2 pixel, float side) {
    trust = texel_at(trust_map, pixel).r;
    side_of = side;
    is_primary = is_among(pixel, primary_share(primary, trust));
}

bool is_left_out() {
    return EXACT == 1 && is_spare(trust);
}

// Are all pixels of a block trusted alike? It is not asked of those that are not whole.
bool trusts_alike(ivec2 block, int side, bool whole) {
    int least = 2, most = 0;
    int count = whole ? side * side : 0;  // a loop that no block takes costs software drivers nothing
    for (int k = 0; k < count; ++k) {
        float here = texel_at(trust_map, block + ivec2(k % side, k / side)).r;
        int kind = is_spare(here) ? 1 : here > 0.5 ? 2 : 0;
        least = min(least, kind);
        most = max(most, kind);
    }
    return whole && least == most;
}

void note_extent(vec2 extent) {
    level = splat_level(trust, is_stretched(extent, side_of), is_primary);
}

uint noted(float inverse_depth, bool hidden) {
    return splat_key(inverse_depth, hidden ? level & 1 : level, hidden);
}
#else
void note_source(ivec2 pixel, float side) {}

bool is_left_out() {
    return false;
}

bool trusts_alike(ivec2 block, int side, bool whole) {
    return whole;
}

void note_extent(vec2 extent) {}

uint noted(float inverse_depth, bool hidden) {
    return hidden_mark(floatBitsToUint(inverse_depth), hidden);
}
#endif

// The first and the last pixel of the view in a box: left, top, right, bottom.
void pixels_of(vec4 box, out ivec2 low, out ivec2 high) {
    low = ivec2(clamp(ceil(box.xy), vec2(0.0), vec2(target_size)));
    high = ivec2(clamp(floor(box.zw), vec2(-1.0), vec2(target_size) - 1.0));
}

ivec4 window_here = ivec4(0);  // how far the splats of this thread come, as in `window`

void widen_window(ivec2 low, ivec2 high) {
    if (all(lessThanEqual(low, high))) window_here = max(window_here, ivec4(target_size - low, high + 1));
}

// Notes how far the thread's splats come: once, because software drivers run atomics lane by lane.
void note_window() {
    for (int k = 0; k < 4; ++k) {
        if (window_here[k] > window[k]) atomicMax(window[k], window_here[k]);  // seldom, once some splats are drawn
    }
}
