#include "common/upsample_vote.glsl"

// Puts samples that lie between two surfaces onto one of them.

const int SNAP_WINDOW = 7;       // samples along the square around a sample in which both surfaces are looked for
const float SNAP_REACH = 1.5;    // standard deviation of the weights there, samples
const float LEAST_SHARE = 0.05;  // of either surface, however near a sample's 1/z is to the other one's
const float STEEP = 0.35;        // cosine: beside a mixed sample, what is seen flatter than 70 degrees is mixed, too
const float STEEP_WEIGHT = 0.01; // of such a sample for others

// One of the two surfaces around a sample: weighted sums.
struct Side {
    vec4 plane;   // unit normal, and 1/z of the planes where the sample is
    float total;  // of the weights
    float alike;  // of the weights times the likeness of the colours
};

bool is_steep(Facet facet, vec4 source) {
    return -dot(facet.surface.xyz, normalize(pixel_ray(facet.pixel, source))) < STEEP;
}

// Whether a sample is mixed, or tilted by those beside it that are.
bool needs_snap(sampler2D surface_map, sampler2D mixing_map, ivec2 pixel, vec4 source) {
    ivec2 last = textureSize(mixing_map, 0) - 1;
    float beside = 0.0;
    for (int k = 0; k < 9; ++k) {
        ivec2 place = pixel + ivec2(k % 3 - 1, k / 3 - 1);
        beside = max(beside, texel_at(mixing_map, clamp(place, ivec2(0), last)).r);
    }
    Facet facet = facet_at(surface_map, pixel, source);
    bool is_tilted = beside > 0.0 && facet.surface.w > 0.0 && is_steep(facet, source);
    return texel_at(mixing_map, pixel).r > 0.0 || is_tilted;
}

ivec2 snap_offset(int k) {
    return ivec2(k % SNAP_WINDOW, k / SNAP_WINDOW) - SNAP_WINDOW / 2;
}

Side add_to_side(Side side, float weight, float likeness, Facet facet, vec2 at) {
    return Side(add_facet(side.plane, weight, facet, at), side.total + weight, side.alike + weight * likeness);
}

float mean_likeness(Side side) {
    return side.total > 0.0 ? side.alike / side.total : 0.0;
}

// The greatest and the least 1/z around a pixel; 0 and 0 without any.
vec2 range_around(sampler2D surface_map, ivec2 pixel, vec4 source) {
    vec2 range = vec2(0.0, 1e30);
    for (int k = 0; k < SNAP_WINDOW * SNAP_WINDOW; ++k) {
        float z = facet_at(surface_map, pixel + snap_offset(k), source).surface.w;
        if (z > 0.0) range = vec2(max(range.x, 1.0 / z), min(range.y, 1.0 / z));
    }
    return range.x > 0.0 ? range : vec2(0.0);
}

// Unit normal and depth of a mixed sample whose 1/z is w, on the nearer or on the farther surface around it; depth 0 if
// there is none. Which of the two, its colour decides, and how near its own 1/z is to theirs.
// surface_map: mixed samples have a depth of 0. guide_map: mean colour of each sample.
vec4 snap_sample(sampler2D surface_map, sampler2D guide_map, ivec2 pixel, float w, vec4 source) {
    vec2 range = range_around(surface_map, pixel, source);
    vec3 color = texel_at(guide_map, pixel).rgb;
    Side near = Side(vec4(0.0), 0.0, 0.0), far = near;
    for (int k = 0; k < SNAP_WINDOW * SNAP_WINDOW; ++k) {
        ivec2 place = pixel + snap_offset(k);
        Facet facet = facet_at(surface_map, place, source);
        if (facet.surface.w <= 0.0) continue;
        float weight = gaussian(vec2(snap_offset(k)), SNAP_REACH) * (is_steep(facet, source) ? STEEP_WEIGHT : 1.0);
        float likeness = color_likeness(color, texel_at(guide_map, place).rgb);
        if (1.0 / facet.surface.w > 0.5 * (range.x + range.y)) {
            near = add_to_side(near, weight, likeness, facet, vec2(pixel));
        } else {
            far = add_to_side(far, weight, likeness, facet, vec2(pixel));
        }
    }
    float share = clamp((w - range.y) / max(range.x - range.y, 1e-30), LEAST_SHARE, 1.0 - LEAST_SHARE);
    bool is_near = share * mean_likeness(near) > (1.0 - share) * mean_likeness(far) || far.total == 0.0;
    vec4 plane = is_near ? near.plane : far.plane;
    float total = is_near ? near.total : far.total;
    return total > 0.0 ? vec4(normalize(plane.xyz), total / plane.w) : vec4(0.0);
}
