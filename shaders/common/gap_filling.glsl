#include "common/splat_corners.glsl"

// Fills the gaps between known pixels of a surface: pixels that known ones of one surface enclose. So outlines stay.

const float ONE_SURFACE = 0.05;  // planes that meet a pixel within this share of 1/z are one surface
const float NOWHERE = 255.0;      // pixels to the nearest known one where none is near

// Pixels to the nearest known one on the left and on the right; 0 for a pixel that is known itself.
vec2 known_in_row(sampler2D surface_map, ivec2 pixel, int reach) {
    vec2 found = vec2(NOWHERE);
    int columns = textureSize(surface_map, 0).x;
    for (int k = reach; k >= 0; --k) {
        ivec2 left = pixel - ivec2(k, 0), right = pixel + ivec2(k, 0);
        if (left.x >= 0 && texelFetch(surface_map, left, 0).w != 0.0) found.x = float(k);
        if (right.x < columns && texelFetch(surface_map, right, 0).w != 0.0) found.y = float(k);
    }
    return found;
}

// Offset of the nearest known pixel in each quadrant, its edges included: upper left, upper right, lower left, lower
// right; 0 where none is near. row_map: known_in_row over 255
void known_around(sampler2D row_map, ivec2 pixel, int reach, out vec2 hits[4]) {
    float nearest[4];
    for (int k = 0; k < 4; ++k) {
        hits[k] = vec2(0.0);
        nearest[k] = 1e30;
    }
    int rows = textureSize(row_map, 0).y;
    for (int v = -reach; v <= reach; ++v) {
        ivec2 at = pixel + ivec2(0, v);
        bool inside = at.y >= 0 && at.y < rows;
        vec2 row = inside ? floor(texelFetch(row_map, at, 0).xy * 255.0 + 0.5) : vec2(NOWHERE);
        for (int k = 0; k < 4; ++k) {
            float side = k % 2 == 0 ? row.x : row.y;
            vec2 offset = vec2(k % 2 == 0 ? -side : side, float(v));
            float square = dot(offset, offset);
            bool better = side < NOWHERE && (k < 2 ? v <= 0 : v >= 0) && square < nearest[k];
            hits[k] = better ? offset : hits[k];
            nearest[k] = better ? square : nearest[k];
        }
    }
}

// Do these offsets enclose the pixel? Each then has another on either side, or opposite.
bool is_enclosed(vec2 hits[4], bool counts[4]) {
    bool any_hit = false, all_held = true;
    for (int i = 0; i < 4; ++i) {
        bool before = false, after = false;
        for (int j = 0; j < 4; ++j) {
            float cross_product = hits[i].x * hits[j].y - hits[i].y * hits[j].x;
            bool opposite = cross_product == 0.0 && dot(hits[i], hits[j]) < 0.0;
            before = before || (counts[j] && (cross_product < 0.0 || opposite));
            after = after || (counts[j] && (cross_product > 0.0 || opposite));
        }
        any_hit = any_hit || counts[i];
        all_held = all_held && (!counts[i] || (before && after));
    }
    return any_hit && all_held;
}

// The surface of a pixel, or in a gap that of the nearest that encloses it: unit normal and depth; 0 where none does.
vec4 fill_gap(sampler2D surface_map, sampler2D row_map, ivec2 pixel, int reach, vec4 source) {
    vec4 own = surface_at(surface_map, pixel);
    vec2 hits[4];
    known_around(row_map, pixel, reach, hits);
    vec4 found[4];  // normal, and 1/z of its plane at the pixel
    float weights[4];
    for (int k = 0; k < 4; ++k) {
        vec4 there = surface_at(surface_map, pixel + ivec2(hits[k]));
        float z = max(there.w, 1e-30);
        vec2 slope = inverse_depth_slope(there.xyz, pixel_ray(vec2(pixel) + hits[k], source), z, source);
        found[k] = vec4(there.xyz, 1.0 / z - dot(slope, hits[k]));
        weights[k] = there.w > 0.0 && found[k].w > 0.0 ? 1.0 / max(dot(hits[k], hits[k]), 1.0) : 0.0;
    }
    vec4 best = vec4(0.0);
    float nearest = 0.0;
    for (int i = 0; i < 4; ++i) {
        bool counts[4];
        vec4 sum = vec4(0.0);
        float total = 0.0;
        for (int k = 0; k < 4; ++k) {
            counts[k] = weights[k] > 0.0 && abs(found[k].w - found[i].w) <= ONE_SURFACE * found[i].w;
            sum += counts[k] ? weights[k] * found[k] : vec4(0.0);
            total += counts[k] ? weights[k] : 0.0;
        }
        bool better = weights[i] > nearest && is_enclosed(hits, counts);
        best = better ? vec4(normalize(sum.xyz), total / sum.w) : best;
        nearest = better ? weights[i] : nearest;
    }
    return own.w > 0.0 ? own : best;
}

// Does a straight line of missing pixels lead to one that was left open? Then the pixel's hole is not filled as a whole.
// filled_map: normal, and in w 1 for what the colours cut out; that leaves no hole open. Its depth: 0 where nothing is.
bool is_left_open(sampler2D surface_map, sampler2D filled_map, sampler2D filled_depth, ivec2 pixel, int reach) {
    ivec2 last = textureSize(surface_map, 0) - 1;
    bool open = false;
    for (int k = 0; k < 9; ++k) {
        ivec2 along = ivec2(k % 3, k / 3) - 1;
        for (int i = 1; i <= reach && k != 4; ++i) {
            ivec2 at = pixel + i * along;
            if (at != clamp(at, ivec2(0), last) || texelFetch(surface_map, at, 0).w != 0.0) break;
            bool is_nothing = texelFetch(filled_depth, at, 0).x == 0.0 && texelFetch(filled_map, at, 0).w == 0.0;
            open = open || is_nothing;
        }
    }
    return open;
}
