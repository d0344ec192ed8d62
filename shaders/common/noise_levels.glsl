#include "common/noise_patch.glsl"

// Summaries of blocks of 6x6 patches, and the noise of a pixel from the grid of blocks.

const int PATCH_PITCH = 8;    // pixels between patches: a quarter of the picture is measured
const int BLOCK_PATCHES = 6;  // a block is 48x48 pixels
const int PATCHES = 36;       // in a block
const int FEWEST = 4;         // patches that are enough for a noise level

// First pixel of a patch; patches of a wider stride keep their centre (stride is odd). The grid of patches is centred
// on the picture: `first` is the first pixel of its first patch.
ivec2 patch_corner(ivec2 patch_index, ivec2 first, int stride) {
    return first + patch_index * PATCH_PITCH - 3 * (stride - 1) / 2;
}

// One number of a patch: 0 noise of w, 1 noise of z, 2 isolated jump of w, 3 lattice step of z.
float patch_value(vec4 patch_texel, int which) {
    if (which == 0) return patch_texel.x;
    if (which == 1) return patch_texel.x < 0.0 ? NOTHING : patch_texel.x * patch_texel.w * patch_texel.w;
    return which == 2 ? patch_texel.y : patch_texel.z;
}

// The value below which `share` of a block's patches lie, NOTHING if too few have a value. Radix selection on the upper
// bits of the float: exact to 0.4 %, and the same on every machine.
float block_quantile(sampler2D patches, ivec2 block, int which, float share) {
    int bits[PATCHES];
    int total = 0;
    ivec2 size = textureSize(patches, 0);
    for (int k = 0; k < PATCHES; ++k) {
        ivec2 p = block * BLOCK_PATCHES + ivec2(k % BLOCK_PATCHES, k / BLOCK_PATCHES);
        float value = patch_value(texelFetch(patches, min(p, size - 1), 0), which);
        bool counts = p.x < size.x && p.y < size.y && value >= 0.0;
        bits[k] = counts ? floatBitsToInt(value) : 0x7fffffff;
        total += counts ? 1 : 0;
    }
    int rank = max(int(floor(share * float(total + 1) + 0.5)) - 1, 0);
    int prefix = 0;
    for (int b = 30; b >= 15; --b) {
        int trial = prefix | (1 << b);
        int below = 0;
        for (int k = 0; k < PATCHES; ++k) below += bits[k] < trial ? 1 : 0;
        prefix = below <= rank ? trial : prefix;
    }
    return total >= (which < 2 ? FEWEST : 1) ? intBitsToFloat(prefix | 0x4000) : NOTHING;
}

// x: share of copied lines, NOTHING if no line could show it; y: share of the patches with an isolated jump; z: steps
// per pixel along the gradient (1: no plateaus); w: mean depth, 0 where nothing is known.
vec4 block_counts(sampler2D patches, sampler2D patch_steps, ivec2 block) {
    float copies = 0.0, lines = 0.0, jumps = 0.0, pairs = 0.0, depth = 0.0, known = 0.0;
    vec2 steps = vec2(0.0);
    ivec2 size = textureSize(patches, 0);
    for (int k = 0; k < PATCHES; ++k) {
        ivec2 p = block * BLOCK_PATCHES + ivec2(k % BLOCK_PATCHES, k / BLOCK_PATCHES);
        if (p.x >= size.x || p.y >= size.y) continue;
        vec4 value = texelFetch(patches, p, 0);
        vec4 step = texelFetch(patch_steps, p, 0);
        copies += step.z;
        lines += step.w;
        jumps += value.y >= 0.0 ? 1.0 : 0.0;
        known += value.w > 0.0 ? 1.0 : 0.0;
        depth += value.w;
        pairs += step.x >= 0.0 ? 4.0 : 0.0;
        steps += max(step.xy, vec2(0.0));
    }
    float along = pairs > 0.0 ? sqrt(steps.x * steps.x + steps.y * steps.y) / pairs : 1.0;
    return vec4(lines > 0.0 ? copies / lines : NOTHING, jumps / float(PATCHES), along, known > 0.0 ? depth / known : 0.0);
}

// Noise over depth at a pixel of depth z (x): the larger of the two levels in the block grid (x noise, y rounding),
// bilinear between block centres, each scaled to the pixel's own depth by its power of z; and the part that neighbours
// share (y, from the grid's z). first: first pixel of the first patch.
vec2 noise_at(sampler2D grid, ivec2 pixel, ivec2 first, float z, vec2 powers) {
    float block = float(PATCH_PITCH * BLOCK_PATCHES);
    vec2 place = (vec2(pixel - first) - 0.5 * (block - float(PATCH_PITCH) + 3.0)) / block;
    vec2 corner = floor(place);
    vec2 t = place - corner;
    ivec2 last = textureSize(grid, 0) - 1;
    ivec2 low = clamp(ivec2(corner), ivec2(0), last), high = clamp(ivec2(corner) + 1, ivec2(0), last);
    vec3 top = mix(texelFetch(grid, low, 0).xyz, texelFetch(grid, ivec2(high.x, low.y), 0).xyz, t.x);
    vec3 bottom = mix(texelFetch(grid, ivec2(low.x, high.y), 0).xyz, texelFetch(grid, high, 0).xyz, t.x);
    vec3 level = mix(top, bottom, t.y);
    return vec2(max(level.x * pow(z, powers.x), level.y * pow(z, powers.y)), level.z);
}
