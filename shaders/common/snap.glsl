#include "common/vote.glsl"

// Puts samples that lie between two surfaces onto one of them.

const int SNAP_WINDOW = 7;       // samples along the square around a sample in which both surfaces are looked for
const float SNAP_REACH = 1.5;    // standard deviation of the weights there, samples
const float LEAST_SHARE = 0.05;  // of either surface, however near a sample's 1/z is to the other one's

// One of the two surfaces around a sample.
struct Side {
    vec4 plane;     // unit normal and 1/z of its planes where the sample is: weighted sum
    float total;    // of the weights
    float alike;    // the same for samples of the sample's colour
};

Side add_to_side(Side side, float weight, vec4 plane, float likeness) {
    return Side(side.plane + weight * plane, side.total + weight, side.alike + weight * likeness);
}

// The nearest and the farthest 1/z around a pixel; 0 and 0 without any.
vec2 range_around(sampler2D surface_map, ivec2 pixel) {
    float farthest = 1e30, nearest = 0.0;
    for (int k = 0; k < SNAP_WINDOW * SNAP_WINDOW; ++k) {
        ivec2 off = ivec2(k % SNAP_WINDOW, k / SNAP_WINDOW) - SNAP_WINDOW / 2;
        float z = facet_at(surface_map, pixel + off, vec4(1.0)).surface.w;
        float w = 1.0 / max(z, 1e-30);
        farthest = z > 0.0 ? min(farthest, w) : farthest;
        nearest = z > 0.0 ? max(nearest, w) : nearest;
    }
    return nearest > 0.0 ? vec2(nearest, farthest) : vec2(0.0);
}

// Unit normal and depth of a mixed sample whose 1/z is w, on the nearer or on the farther surface around it; depth 0 if
// there is none. Which one, say the colours of their samples and how near its own 1/z is to theirs.
// surface_map: mixed samples have a depth of 0. guide_map: mean colour of each sample.
vec4 snap_sample(sampler2D surface_map, sampler2D guide_map, ivec2 pixel, float w, vec4 source) {
    vec2 range = range_around(surface_map, pixel);
    vec3 color = surface_at(guide_map, pixel).rgb;
    Side near = Side(vec4(0.0), 0.0, 0.0), far = near;
    for (int k = 0; k < SNAP_WINDOW * SNAP_WINDOW; ++k) {
        ivec2 off = ivec2(k % SNAP_WINDOW, k / SNAP_WINDOW) - SNAP_WINDOW / 2;
        Facet there = facet_at(surface_map, pixel + off, source);
        if (there.surface.w <= 0.0) continue;
        float weight = gaussian(vec2(off), SNAP_REACH);
        vec4 plane = vec4(there.surface.xyz, facet_reaches(there, vec2(pixel)));
        float likeness = color_likeness(color, surface_at(guide_map, pixel + off).rgb);
        if (1.0 / there.surface.w > 0.5 * (range.x + range.y)) {
            near = add_to_side(near, weight, plane, likeness);
        } else {
            far = add_to_side(far, weight, plane, likeness);
        }
    }
    float share = clamp((w - range.y) / max(range.x - range.y, 1e-30), LEAST_SHARE, 1.0 - LEAST_SHARE);
    float near_vote = near.total > 0.0 ? share * near.alike / near.total : 0.0;
    float far_vote = far.total > 0.0 ? (1.0 - share) * far.alike / far.total : 0.0;
    Side side = near_vote > far_vote || far.total == 0.0 ? near : far;
    return side.total > 0.0 ? vec4(normalize(side.plane.xyz), side.total / side.plane.w) : vec4(0.0);
}
