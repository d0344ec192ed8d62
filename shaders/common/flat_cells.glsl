#include "common/inverse_depth.glsl"
#include "common/robust_plane.glsl"

// Planes of rounded depth, as wide as many steps. Rounding errors are no noise: where depth changes by nearly a whole
// number of steps from pixel to pixel, or by hardly any, they grow slowly and look like slopes (rings on walls). But on
// a plane no error exceeds half a step. So where all of a wide window lies within half a step of a plane, that plane is
// the answer. Windows lie around the middles of cells. A plane is (x: depth at its origin, yz: slope of w = 1/z per
// pixel relative to w, w: square of the cells that it reaches, 0 for no plane). rounding: steps of z and of 1/z, one of
// them is 0.

const int FLAT_CELL = 9;           // pixels
const int WIDE_REACH = 10;         // square of the distance from its middle that a window contains, cells
const int NARROW_REACH = 2;
// Places of the samples: each stands for all eight that are mirrored and turned. Almost no two share a row or column of
// pixels: so they differ also where the surface changes only along one of them, and no ripples escape.
const ivec2 WIDE[6] = ivec2[6](ivec2(27, 9), ivec2(25, 3), ivec2(22, 13), ivec2(18, 6), ivec2(15, 11), ivec2(8, 2));
const ivec2 NARROW[6] = ivec2[6](ivec2(13, 5), ivec2(12, 2), ivec2(10, 7), ivec2(9, 3), ivec2(8, 1), ivec2(6, 4));
const float KNOWN_SAMPLES = 24.5;  // of 49, the middle one included: with fewer a window shows too little
const float LEAST = 1e-3;          // keeps a plane before the camera
const float IN_STEP = 0.7;         // steps from the plane: a half by rounding, the rest for the error of the plane

// The middle pixel of a cell; first: that of the first cell. The cells are centred on the picture.
ivec2 flat_middle(ivec2 cell, ivec2 first) {
    return first + FLAT_CELL * cell;
}

// Sample k, 0 to 47, around the middle of a window.
ivec2 flat_offset(int k, ivec2 places[6]) {
    ivec2 place = places[k / 8];
    place = k % 2 == 0 ? place.xy : place.yx;
    return place * ivec2(k / 2 % 2 == 0 ? 1 : -1, k / 4 % 2 == 0 ? 1 : -1);
}

// The same plane with another origin.
vec3 move_plane(vec3 plane, vec2 offset) {
    return plane / max(1.0 + plane.y * offset.x + plane.z * offset.y, LEAST);
}

// Whether a depth may be that of a plane, rounded.
bool is_in_step(float plane_depth, float there, vec2 rounding) {
    return abs(there - plane_depth) < IN_STEP * (rounding.x + rounding.y * there * there);
}

// Whether the farthest samples of a window do not rule a plane out: on one, the mean 1/z of two opposite samples is the
// pixel's, except for rounding. Most of what is not flat ends here.
bool may_be_flat(sampler2D depth_map, ivec2 pixel, ivec2 places[6], vec2 rounding) {
    float here = depth_at(depth_map, pixel, ivec2(0));
    bool flat_so_far = here > 0.0;
    for (int k = 0; k < 4; ++k) {
        ivec2 offset = flat_offset(k, places);
        float before = depth_at(depth_map, pixel, -offset), after = depth_at(depth_map, pixel, offset);
        float middle = 2.0 * before * after / max(before + after, 1e-30);
        flat_so_far = flat_so_far && (min(before, after) <= 0.0 || is_in_step(here, 0.5 * (here + middle), rounding));
    }
    return flat_so_far;
}

// The plane of the window around a pixel.
vec4 flat_window(sampler2D depth_map, ivec2 pixel, ivec2 places[6], int reach, vec2 rounding) {
    if (!may_be_flat(depth_map, pixel, places, rounding)) return vec4(0.0);
    float here = depth_at(depth_map, pixel, ivec2(0));
    float s = 1.0, su = 0.0, sv = 0.0, suu = 0.0, suv = 0.0, svv = 0.0, sd = 0.0, sud = 0.0, svd = 0.0;
    for (int k = 0; k < 48; ++k) {
        ivec2 offset = flat_offset(k, places);
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
    vec3 plane = vec3(here, fit.yz) / max(1.0 + fit.x, LEAST);
    bool holds = s > KNOWN_SAMPLES;
    for (int k = 0; k < 48; ++k) {
        ivec2 offset = flat_offset(k, places);
        float there = depth_at(depth_map, pixel, offset);
        holds = holds && (!(there > 0.0) || is_in_step(move_plane(plane, vec2(offset)).x, there, rounding));
    }
    return holds ? vec4(plane, float(reach)) : vec4(0.0);
}

// The plane of the widest window around a pixel.
vec4 widest_window(sampler2D depth_map, ivec2 pixel, vec2 rounding) {
    vec4 plane = flat_window(depth_map, pixel, WIDE, WIDE_REACH, rounding);
    if (plane.w < 0.5) plane = flat_window(depth_map, pixel, NARROW, NARROW_REACH, rounding);
    return plane;
}

// The plane of a cell: its own, or where it has none, that of the windows around it that contain its middle.
vec4 flat_plane(sampler2D planes, sampler2D depth_map, ivec2 cell, ivec2 first, vec2 rounding) {
    vec4 own = texelFetch(planes, cell, 0);
    float here = depth_at(depth_map, flat_middle(cell, first), ivec2(0)), total = 0.0;
    ivec2 last = textureSize(planes, 0) - 1;
    vec3 sum = vec3(0.0);
    for (int k = 0; k < 49; ++k) {
        ivec2 away = ivec2(k % 7, k / 7) - 3, place = cell + away;
        int square = max(away.x * away.x + away.y * away.y, 1);
        vec4 plane = texelFetch(planes, clamp(place, ivec2(0), last), 0);
        vec3 moved = move_plane(plane.xyz, vec2(-FLAT_CELL * away));
        bool reaches = place == clamp(place, ivec2(0), last) && float(square) <= plane.w;
        float weight = reaches && is_in_step(moved.x, here, rounding) ? plane.w * plane.w / float(square) : 0.0;
        sum += weight * moved;
        total += weight;
    }
    bool found = here > 0.0 && total > 0.0;
    vec4 lent = found ? vec4(sum / total, 1.0) : vec4(0.0);
    return own.w > 0.5 ? own : lent;
}

// Whether a pixel and its four neighbours lie on a plane. Then it is no rim. The picture's border does not count.
bool is_on_plane(sampler2D depth_map, ivec2 pixel, vec3 plane, vec2 rounding) {
    const ivec2 beside[5] = ivec2[5](ivec2(0), ivec2(-1, 0), ivec2(1, 0), ivec2(0, -1), ivec2(0, 1));
    ivec2 last = textureSize(depth_map, 0) - 1;
    bool on_plane = true;
    for (int k = 0; k < 5; ++k) {
        ivec2 offset = clamp(pixel + beside[k], ivec2(0), last) - pixel;
        float there = depth_at(depth_map, pixel, offset);
        on_plane = on_plane && there > 0.0 && is_in_step(move_plane(plane, vec2(offset)).x, there, rounding);
    }
    return on_plane;
}

// The plane at a pixel, between those of the four cells around it on which it lies. w: 1, or 0 for no plane.
vec4 flat_surface(sampler2D planes, sampler2D depth_map, ivec2 pixel, ivec2 first, vec2 rounding) {
    float here = depth_at(depth_map, pixel, ivec2(0)), total = 0.0;
    ivec2 low = ivec2((vec2(pixel - first) + 0.5) / float(FLAT_CELL));  // integers are slow to divide
    vec3 sum = vec3(0.0);
    for (int k = 0; k < 4; ++k) {
        ivec2 cell = low + ivec2(k % 2, k / 2);
        vec4 plane = texelFetch(planes, cell, 0);
        vec2 away = vec2(pixel - flat_middle(cell, first));
        vec3 moved = move_plane(plane.xyz, away);
        vec2 near = max(1.0 - abs(away) / float(FLAT_CELL), 0.01);
        float weight = plane.w > 0.5 && is_in_step(moved.x, here, rounding) ? near.x * near.y : 0.0;
        sum += weight * moved;
        total += weight;
    }
    if (!(total > 0.0)) return vec4(0.0);
    vec3 plane = sum / total;
    return is_on_plane(depth_map, pixel, plane, rounding) ? vec4(plane, 1.0) : vec4(0.0);
}
