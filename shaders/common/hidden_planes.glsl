#include "common/splat_corners.glsl"

// Planes that continue behind the objects in front of them, for shadows: without them light falls through silhouettes.
// Where a plane (on which 1/z is linear) comes out again on the other side of an object, it is there in between.

const float STEP_UP = 0.04;   // share of the depth by which something stands before what it hides, at least
const float MEETING = 0.02;   // share of 1/z within which the planes from both sides meet
const float WELL_BEHIND = 0.015;  // share of 1/z by which they lie behind what is seen, at least
const int FARTHEST = 96;      // places that are looked at on either side

const int LAYERS = 2;         // so many of them: what stands before may have parts before each other

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

// The surface that is hidden at a pixel: by its row, or else by its column.
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
