#include "common/depth_lookup.glsl"
#include "common/texels.glsl"

// The four pixels of a frame around a position, and which of their splats is seen there.

struct Corners {
    ivec2 low;   // the upper left pixel
    ivec2 high;  // the lower right one
    vec4 a, b;   // unit normal and depth, negative at rims, above: left, right
    vec4 c, d;   // and below
};

// Unit normal and depth, without the mark of rims.
vec4 surface_at(sampler2D surface_map, ivec2 pixel) {
    vec4 surface = texel_at(surface_map, pixel);
    return vec4(surface.xyz, abs(surface.w));
}

// Outside the frame its outermost pixels repeat.
Corners corners_at(sampler2D surface_map, vec2 at) {
    ivec2 last = textureSize(surface_map, 0) - 1;
    ivec2 low = clamp(ivec2(floor(at)), ivec2(0), last);
    ivec2 high = clamp(ivec2(floor(at)) + 1, ivec2(0), last);
    return Corners(
        low, high,
        texel_at(surface_map, low), texel_at(surface_map, ivec2(high.x, low.y)),
        texel_at(surface_map, ivec2(low.x, high.y)), texel_at(surface_map, high)
    );
}

// The corner whose splat is seen where 1/z is w_at: whether it is on the right, and whether it is below.
bvec2 seen_corner(Corners corners, vec2 at, float w_at) {
    vec2 low = vec2(corners.low), high = vec2(corners.high);
    vec4 error = vec4(
        look_up_error(corners.a.w, low, at, w_at), look_up_error(corners.b.w, vec2(high.x, low.y), at, w_at),
        look_up_error(corners.c.w, vec2(low.x, high.y), at, w_at), look_up_error(corners.d.w, high, at, w_at)
    );
    bool right_above = error.y < error.x;
    bool right_below = error.w < error.z;
    bool below = (right_below ? error.w : error.z) < (right_above ? error.y : error.x);
    return bvec2(below ? right_below : right_above, below);
}

ivec2 corner_pixel(Corners corners, bvec2 side) {
    return ivec2(side.x ? corners.high.x : corners.low.x, side.y ? corners.high.y : corners.low.y);
}

vec4 corner_surface(Corners corners, bvec2 side) {
    vec4 surface = side.y ? (side.x ? corners.d : corners.c) : (side.x ? corners.b : corners.a);
    return vec4(surface.xyz, abs(surface.w));
}

// Do all four pixels lie on the surface of `pixel`, whose w and slope are given, away from its rims?
bool are_on_surface(Corners corners, vec2 pixel, float w, vec2 slope) {
    vec4 depths = vec4(corners.a.w, corners.b.w, corners.c.w, corners.d.w);
    vec2 low = vec2(corners.low), high = vec2(corners.high);
    vec4 expected = w + vec4(
        dot(slope, low - pixel), dot(slope, vec2(high.x, low.y) - pixel),
        dot(slope, vec2(low.x, high.y) - pixel), dot(slope, high - pixel)
    );
    return all(greaterThan(depths, vec4(0.0)))
        && all(lessThanEqual(abs(1.0 / depths - expected), vec4(SAME_SURFACE * w)));
}

// Weights of a, b, c, d at a position: bilinear, and 0 off the surface of `pixel`, whose w and slope are given.
vec4 corner_weights(Corners corners, vec2 at, vec2 pixel, float w, vec2 slope) {
    vec2 low = vec2(corners.low), high = vec2(corners.high);
    return vec4(
        neighbour_weight(corners.a.w, low, at, pixel, w, slope),
        neighbour_weight(corners.b.w, vec2(high.x, low.y), at, pixel, w, slope),
        neighbour_weight(corners.c.w, vec2(low.x, high.y), at, pixel, w, slope),
        neighbour_weight(corners.d.w, high, at, pixel, w, slope)
    );
}
