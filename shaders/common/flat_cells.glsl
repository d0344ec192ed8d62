#include "common/inverse_depth.glsl"
#include "common/robust_plane.glsl"

// Planes of rounded depth, as wide as many steps. Rounding errors are no noise: where depth changes by nearly a whole
// number of steps from pixel to pixel, or by nearly none, they grow slowly and look like slopes (rings on walls). But on
// a plane no error exceeds half a step. So where all of a wide window lies within half a step of a plane, that plane is
// the answer. The windows lie around the middles of cells. A plane is (x: depth at its origin, yz: slope of w = 1/z per
// pixel relative to w, w: 1, or 0 for none). rounding: step of z, step of 1/z; one of them is 0.

const int FLAT_CELL = 8;           // pixels
const int FLAT_REACH = 3;          // cells from the middle of a window to its border
const float KNOWN_SAMPLES = 40.5;  // of 81: with fewer a window shows too little
const float IN_STEP = 0.6;         // steps from the plane: a half by rounding, the rest for the error of the plane
const float OFF_SURFACE = 4.0;     // steps from which on a sample belongs to another surface, and says nothing

ivec2 flat_middle(ivec2 cell) {
    return FLAT_CELL * cell + FLAT_CELL / 2;
}

// Samples of a window lie at uneven distances: no texture that repeats itself escapes them. k: 0 to 8.
int flat_offset(int k) {
    int side = k - 4, away = abs(side);
    return sign(side) * (6 * away - (away < 4 ? 1 : 0));
}

// The same plane with another origin.
vec4 move_plane(vec4 plane, vec2 offset) {
    return vec4(plane.xyz / max(1.0 + dot(plane.yz, offset), 1e-3), plane.w);
}

// By how many steps a depth lies off a plane.
float steps_off(float plane_depth, float there, vec2 rounding) {
    return abs(there - plane_depth) / (rounding.x + rounding.y * there * there);
}

// The plane of the window around a pixel.
vec4 flat_window(sampler2D depth_map, ivec2 pixel, vec2 rounding) {
    float here = depth_at(depth_map, pixel, ivec2(0));
    float s = 0.0, su = 0.0, sv = 0.0, suu = 0.0, suv = 0.0, svv = 0.0, sd = 0.0, sud = 0.0, svd = 0.0;
    for (int k = 0; k < 81; ++k) {
        ivec2 offset = ivec2(flat_offset(k % 9), flat_offset(k / 9));
        float there = depth_at(depth_map, pixel, offset), u = float(offset.x), v = float(offset.y);
        float known = there > 0.0 ? 1.0 : 0.0, d = known * relative_step(here, there);
        s += known;
        su += known * u;
        sv += known * v;
        suu += known * (u * u);
        suv += known * (u * v);
        svv += known * (v * v);
        sd += d;
        sud += d * u;
        svd += d * v;
    }
    vec3 fit = solve_plane(s, su, sv, suu, suv, svv, sd, sud, svd);
    vec4 plane = vec4(here, fit.yz, 1.0) / max(1.0 + fit.x, 1e-3);
    float worst = 0.0;
    for (int k = 0; k < 81; ++k) {
        ivec2 offset = ivec2(flat_offset(k % 9), flat_offset(k / 9));
        float there = depth_at(depth_map, pixel, offset);
        float off = steps_off(move_plane(plane, vec2(offset)).x, there, rounding);
        worst = there > 0.0 ? max(worst, off) : worst;
    }
    bool holds = here > 0.0 && s > KNOWN_SAMPLES && worst < IN_STEP;
    return vec4(plane.xyz, holds ? 1.0 : 0.0);
}

// The plane of a cell: its own, or where it has none, that of the windows around it that reach its middle.
vec4 flat_plane(sampler2D cells, sampler2D depth_map, ivec2 cell, vec2 rounding) {
    vec4 own = texelFetch(cells, cell, 0);
    ivec2 middle = flat_middle(cell);
    float here = depth_at(depth_map, middle, ivec2(0)), total = 0.0;
    vec3 sum = vec3(0.0);
    for (int k = 0; k < 49; ++k) {
        ivec2 away = ivec2(k % 7, k / 7) - FLAT_REACH, place = cell + away;
        vec4 plane = texelFetch(cells, clamp(place, ivec2(0), textureSize(cells, 0) - 1), 0);
        vec4 moved = move_plane(plane, vec2(-FLAT_CELL * away));
        bool is_inside = place == clamp(place, ivec2(0), textureSize(cells, 0) - 1);
        bool counts = is_inside && plane.w > 0.5 && steps_off(moved.x, here, rounding) < IN_STEP;
        float weight = counts ? 1.0 / float(max(away.x * away.x + away.y * away.y, 1)) : 0.0;
        sum += weight * moved.xyz;
        total += weight;
    }
    bool found = here > 0.0 && total > 0.0;
    return own.w > 0.5 ? own : vec4(sum / max(total, 1e-6), found ? 1.0 : 0.0);
}

// Whether a depth near a pixel shows something else than the pixel's plane: structure that is not flat.
bool is_bumpy(float plane_depth, float there, vec2 rounding) {
    float off = steps_off(plane_depth, there, rounding);
    return there > 0.0 && off > IN_STEP && off < OFF_SURFACE;
}

// The plane at a pixel, between those of the four cells around it on which it lies.
vec4 flat_surface(sampler2D cells, sampler2D depth_map, ivec2 pixel, vec2 rounding) {
    float here = depth_at(depth_map, pixel, ivec2(0)), total = 0.0;
    ivec2 low = (pixel + FLAT_CELL / 2) / FLAT_CELL - 1;
    vec3 sum = vec3(0.0);
    for (int k = 0; k < 4; ++k) {
        ivec2 cell = clamp(low + ivec2(k % 2, k / 2), ivec2(0), textureSize(cells, 0) - 1);
        vec4 plane = texelFetch(cells, cell, 0);
        vec2 away = vec2(pixel - flat_middle(cell));
        vec4 moved = move_plane(plane, away);
        vec2 near = max(1.0 - abs(away) / float(FLAT_CELL), 0.01);
        float weight = plane.w > 0.5 && steps_off(moved.x, here, rounding) < IN_STEP ? near.x * near.y : 0.0;
        sum += weight * moved.xyz;
        total += weight;
    }
    if (!(total > 0.0) || !(here > 0.0)) return vec4(0.0);
    vec4 plane = vec4(sum / total, 1.0);
    bool bumpy = false;
    for (int k = 0; k < 4; ++k) {
        ivec2 offset = (k < 2 ? ivec2(3, 0) : ivec2(0, 3)) * (k % 2 == 0 ? 1 : -1);
        float there = depth_at(depth_map, pixel, offset);
        bumpy = bumpy || is_bumpy(move_plane(plane, vec2(offset)).x, there, rounding);
    }
    return bumpy ? vec4(0.0) : plane;
}
