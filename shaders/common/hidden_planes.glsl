#include "common/splat_corners.glsl"

// Planes that continue behind the objects in front of them, for shadows: without them light falls through silhouettes.
// Where a plane (on which 1/z is linear) comes out again on the other side of an object, it is there in between. Elsewhere
// a body whose surface turns away at its outlines has a back, without which light from the side falls through it.

const float STEP_UP = 0.04;   // share of the depth by which something stands before what it hides, at least
const float MEETING = 0.02;   // share of 1/z within which the planes from both sides meet
const float WELL_BEHIND = 0.015;  // share of 1/z by which they lie behind what is seen, at least
const int FARTHEST = 96;      // places that are looked at on either side
const float TURNED_AWAY = 0.35;  // cosine between the ray and the surface at the outline of a body, at most,
const float BENT = 0.75;      // and as a share of that a little inside: a flat side that is seen at an angle has no back
const int LAYERS = 2;         // so many planes: what stands before may have parts before each other

struct Side {
    float inverse_depth;  // of the plane at the middle, 0 if there is none
    vec3 normal;
    float places;         // to where it is seen
};

// The planes that an object may hide, from the first places in a direction at which the depth steps back. stride: pixels
// between places
Side[LAYERS] find_sides(sampler2D surface_map, ivec2 middle, ivec2 direction, int stride, vec4 source) {
    Side sides[LAYERS];
    for (int k = 0; k < LAYERS; ++k) sides[k] = Side(0.0, vec3(0.0), 0.0);
    float before = surface_at(surface_map, middle).w;
    int steps = before > 0.0 ? FARTHEST : 0, count = 0;
    for (int k = 1; k <= steps; ++k) {
        ivec2 place = middle + k * stride * direction;
        vec4 there = texel_or_zero(surface_map, place);
        float z = abs(there.w);
        if (z > before * (1.0 + STEP_UP)) {
            vec2 slope = inverse_depth_slope(there.xyz, pixel_ray(vec2(place), source), z, source);
            sides[count++] = Side(1.0 / z - float(k * stride) * dot(slope, vec2(direction)), there.xyz, float(k));
        }
        if (count == LAYERS || z == 0.0) steps = 0;
        before = z;
    }
    return sides;
}

// The surface between two sides: unit normal and depth; 0 if their planes do not meet behind the one that is seen.
vec4 between(Side one, Side other, float seen) {
    if (!(min(one.inverse_depth, other.inverse_depth) > 0.0)) return vec4(0.0);
    float share = one.places / (one.places + other.places);
    float inverse_depth = mix(one.inverse_depth, other.inverse_depth, share);
    bool meets = abs(one.inverse_depth - other.inverse_depth) < MEETING * inverse_depth;
    if (!meets || inverse_depth > seen * (1.0 - WELL_BEHIND)) return vec4(0.0);
    return vec4(normalize(mix(one.normal, other.normal, share)), 1.0 / inverse_depth);
}

// Depth of the last pixel of a body in a direction, how many pixels away it lies, and the cosine between its ray and its
// surface; 0 where that does not bend away, or something stands before it. First in steps of `stride` pixels, then of one.
vec3 find_outline(sampler2D surface_map, ivec2 middle, ivec2 direction, int stride, vec4 source) {
    int away = -stride, pace = stride, steps = FARTHEST;
    vec4 last = texel_or_zero(surface_map, middle + away * direction);
    last.w = abs(last.w);
    float cosine = abs(dot(last.xyz, normalize(pixel_ray(vec2(middle + away * direction), source)))), inside = cosine;
    for (int k = 0; k < steps; ++k) {
        ivec2 place = middle + (away + pace) * direction;
        vec4 there = texel_or_zero(surface_map, place);
        float z = abs(there.w);
        bool ends = z == 0.0 || z > last.w * (1.0 + STEP_UP), is_hidden = z > 0.0 && z < last.w * (1.0 - STEP_UP);
        if (is_hidden || (ends && (away < 0 || pace == 1))) {
            bool bends = cosine < TURNED_AWAY && cosine < BENT * inside && away >= 0;
            return bends && !is_hidden ? vec3(last.w, float(away), cosine) : vec3(0.0);
        }
        if (ends) pace = 1;
        else {
            inside = pace == stride ? cosine : inside;
            cosine = abs(dot(there.xyz, normalize(pixel_ray(vec2(place), source))));
            last = vec4(there.xyz, z);
            away += pace;
        }
    }
    return vec3(0.0);
}

// The back of a body between two outlines: as far behind them as its front is before. They lie a little behind the last
// pixels: as those of a ball that is as wide.
vec4 back_of(vec3 one, vec3 other, vec4 seen, vec3 ray, float focal) {
    if (min(one.x, other.x) == 0.0) return vec4(0.0);
    float width = max(one.y + other.y, 1.0), depth = 1.0 / mix(1.0 / one.x, 1.0 / other.x, one.y / width);
    float z = 2.0 * depth * (1.0 + 0.25 * (one.z + other.z) * width / focal) - seen.w;
    return z > seen.w * (1.0 + WELL_BEHIND) ? vec4(2.0 * dot(seen.xyz, ray) * ray - seen.xyz, z) : vec4(0.0);
}

// The plane that is hidden at a pixel: by its row, or else by its column.
vec4 bridge(sampler2D surface_map, ivec2 pixel, int stride, vec4 source) {
    float seen = 1.0 / max(surface_at(surface_map, pixel).w, 1e-9);
    vec4 found = vec4(0.0);
    for (int k = 0; k < 2; ++k) {
        ivec2 direction = ivec2(1 - k, k);
        Side before[LAYERS] = find_sides(surface_map, pixel, -direction, stride, source);
        Side after[LAYERS] = find_sides(surface_map, pixel, direction, stride, source);
        for (int j = 0; j < LAYERS * LAYERS; ++j) {
            if (found.w == 0.0) found = between(before[j / LAYERS], after[j % LAYERS], seen);
        }
    }
    return found;
}

// What a pixel hides: a plane that goes on behind it, or else the back of its own body, by its row or its column.
vec4 hidden_at(sampler2D surface_map, ivec2 pixel, int stride, vec4 source) {
    vec4 found = bridge(surface_map, pixel, stride, source), seen = surface_at(surface_map, pixel);
    vec3 ray = normalize(pixel_ray(vec2(pixel), source));
    for (int k = 0; k < 2; ++k) {
        ivec2 direction = ivec2(1 - k, k);
        vec3 before = find_outline(surface_map, pixel, -direction, stride, source);
        vec3 after = find_outline(surface_map, pixel, direction, stride, source);
        if (found.w == 0.0) found = back_of(before, after, seen, ray, abs(source[k]));
    }
    return found;
}
