#include "common/inverse_depth.glsl"
#include "common/robust_plane.glsl"

// Planes of rounded depth, as wide as many steps. Rounding errors are no noise: where depth changes by nearly a whole
// number of steps from pixel to pixel, or by nearly none, they grow slowly and look like slopes (rings on walls). But on
// a plane no error exceeds half a step. So where all of a wide window lies within half a step of a plane, that plane is
// the answer. The windows lie around the middles of cells. A plane is (x: depth at its origin, yz: slope of w = 1/z per
// pixel relative to w, w: 1, or 0 for none). rounding: step of z, step of 1/z; one of them is 0.

const int FLAT_CELL = 8;           // pixels
const int FLAT_REACH = 3;          // cells from the middle of a window to its border, and their square
const int FLAT_CIRCLE = 10;
const float KNOWN_SAMPLES = 24.5;  // of 49: with fewer a window shows too little
const float IN_STEP = 0.7;         // steps from the plane: a half by rounding, the rest for the error of the plane

ivec2 flat_middle(ivec2 cell) {
    return FLAT_CELL * cell + FLAT_CELL / 2;
}

// Samples of a window, k: 0 to 48. They lie on a turned grid: no two rows or columns of pixels show the same, not even
// of a surface that changes along one of them only, and no ripples escape.
ivec2 flat_offset(int k) {
    ivec2 place = ivec2(k % 7, k / 7) - 3;
    return 8 * place + 3 * ivec2(place.y, -place.x);
}

// The same plane with another origin.
vec4 move_plane(vec4 plane, vec2 offset) {
    return vec4(plane.xyz / max(1.0 + dot(plane.yz, offset), 1e-3), plane.w);
}

// Whether a depth may be that of a plane, rounded.
bool is_in_step(float plane_depth, float there, vec2 rounding) {
    return abs(there - plane_depth) < IN_STEP * (rounding.x + rounding.y * there * there);
}

// The plane of the window around a pixel.
vec4 flat_window(sampler2D depth_map, ivec2 pixel, vec2 rounding) {
    float here = depth_at(depth_map, pixel, ivec2(0));
    float s = 0.0, su = 0.0, sv = 0.0, suu = 0.0, suv = 0.0, svv = 0.0, sd = 0.0, sud = 0.0, svd = 0.0;
    for (int k = 0; k < 49; ++k) {
        vec2 at = vec2(flat_offset(k));
        float there = depth_at(depth_map, pixel, flat_offset(k));
        float known = there > 0.0 ? 1.0 : 0.0, d = known * relative_step(here, there);
        s += known;
        su += known * at.x;
        sv += known * at.y;
        suu += known * (at.x * at.x);
        suv += known * (at.x * at.y);
        svv += known * (at.y * at.y);
        sd += d;
        sud += d * at.x;
        svd += d * at.y;
    }
    vec3 fit = solve_plane(s, su, sv, suu, suv, svv, sd, sud, svd);
    vec4 plane = vec4(here, fit.yz, 1.0) / max(1.0 + fit.x, 1e-3);
    bool holds = here > 0.0 && s > KNOWN_SAMPLES;
    for (int k = 0; k < 49; ++k) {
        float there = depth_at(depth_map, pixel, flat_offset(k));
        vec4 moved = move_plane(plane, vec2(flat_offset(k)));
        holds = holds && (!(there > 0.0) || is_in_step(moved.x, there, rounding));
    }
    return vec4(plane.xyz, holds ? 1.0 : 0.0);
}

// The plane of a cell: its own, or where it has none, that of the windows around it that reach its middle.
vec4 flat_plane(sampler2D planes, sampler2D depth_map, ivec2 cell, vec2 rounding) {
    vec4 own = texelFetch(planes, cell, 0);
    float here = depth_at(depth_map, flat_middle(cell), ivec2(0)), total = 0.0;
    ivec2 last = textureSize(planes, 0) - 1;
    vec3 sum = vec3(0.0);
    for (int k = 0; k < 49; ++k) {
        ivec2 away = ivec2(k % 7, k / 7) - FLAT_REACH, place = cell + away;
        vec4 moved = move_plane(texelFetch(planes, clamp(place, ivec2(0), last), 0), vec2(-FLAT_CELL * away));
        int square = away.x * away.x + away.y * away.y;
        bool is_near = place == clamp(place, ivec2(0), last) && square <= FLAT_CIRCLE;
        bool counts = is_near && moved.w > 0.5 && is_in_step(moved.x, here, rounding);
        float weight = counts ? 1.0 / float(max(square, 1)) : 0.0;
        sum += weight * moved.xyz;
        total += weight;
    }
    bool found = here > 0.0 && total > 0.0;
    return own.w > 0.5 ? own : vec4(sum / max(total, 1e-6), found ? 1.0 : 0.0);
}

// Whether a pixel and its four neighbours lie on a plane. Then it is no rim. The picture's border does not count.
bool is_on_plane(sampler2D depth_map, ivec2 pixel, vec4 plane, vec2 rounding) {
    ivec2 last = textureSize(depth_map, 0) - 1;
    bool on_plane = true;
    for (int k = 0; k < 5; ++k) {
        ivec2 offset = (k < 2 ? ivec2(1, 0) : ivec2(0, 1)) * (k == 4 ? 0 : 2 * (k % 2) - 1);
        offset = clamp(pixel + offset, ivec2(0), last) - pixel;
        float there = depth_at(depth_map, pixel, offset);
        on_plane = on_plane && there > 0.0 && is_in_step(move_plane(plane, vec2(offset)).x, there, rounding);
    }
    return on_plane;
}

// The plane at a pixel, between those of the four cells around it on which it lies.
vec4 flat_surface(sampler2D planes, sampler2D depth_map, ivec2 pixel, vec2 rounding) {
    float here = depth_at(depth_map, pixel, ivec2(0)), total = 0.0;
    ivec2 low = (pixel + FLAT_CELL / 2) / FLAT_CELL - 1, last = textureSize(planes, 0) - 1;
    vec3 sum = vec3(0.0);
    for (int k = 0; k < 4; ++k) {
        ivec2 cell = clamp(low + ivec2(k % 2, k / 2), ivec2(0), last);
        vec2 away = vec2(pixel - flat_middle(cell));
        vec4 moved = move_plane(texelFetch(planes, cell, 0), away);
        vec2 near = max(1.0 - abs(away) / float(FLAT_CELL), 0.01);
        float weight = moved.w > 0.5 && is_in_step(moved.x, here, rounding) ? near.x * near.y : 0.0;
        sum += weight * moved.xyz;
        total += weight;
    }
    if (!(total > 0.0)) return vec4(0.0);
    vec4 plane = vec4(sum / total, 1.0);
    return is_on_plane(depth_map, pixel, plane, rounding) ? plane : vec4(0.0);
}
