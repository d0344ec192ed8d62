#include "common/camera.glsl"
#include "common/inverse_depth.glsl"

// Marks the rim of surfaces: the pixels beside which they end.

const float DROP = 6.0;          // where a surface ends, the next pixel lies so many pixels of depth behind it, at least,
const float STEEPER = 3.0;       // and so many times the step to the pixel before
const float BOTTOMLESS = -1e30;  // rise of a pixel that is missing

// Depth is in pixels here: as many as a thing of that size is wide in the picture.
float mean_focal_length(vec4 intrinsics) {
    return 0.5 * (abs(intrinsics.x) + abs(intrinsics.y));
}

// By how many pixels of depth a neighbour lies before the surface that faces the viewer at the pixel; `facing` is by how
// much the 1/z of that surface changes to there, as a share of it.
float rise_of(float here, float there, float facing, float focal) {
    return there > 0.0 ? focal * (relative_step(here, there) - facing) : BOTTOMLESS;
}

// Does the surface end before a neighbour that rises so much, if that on the opposite side does so?
bool ends_before(float rise, float opposite) {
    return rise < -(DROP + STEEPER * max(opposite, 0.0));
}

// Does the surface end along one direction, before or after the pixel?
bool ends_along(float here, float before, float after, bvec2 inside, float facing, float focal) {
    float rise_b = rise_of(here, before, -facing, focal);
    float rise_a = rise_of(here, after, facing, focal);
    return (inside.x && ends_before(rise_b, rise_a)) || (inside.y && ends_before(rise_a, rise_b));
}

// The depth of a pixel, negative at a rim. The border of the picture is none.
float mark_rim(sampler2D depth_map, ivec2 pixel, vec4 intrinsics) {
    float here = depth_at(depth_map, pixel, ivec2(0));
    float focal = mean_focal_length(intrinsics);
    vec2 facing = facing_slope(pixel_ray(vec2(pixel), intrinsics).xy, intrinsics);
    bvec2 low = greaterThan(pixel, ivec2(0));
    bvec2 high = lessThan(pixel, textureSize(depth_map, 0) - 1);
    float left = depth_at(depth_map, pixel, ivec2(-1, 0)), right = depth_at(depth_map, pixel, ivec2(1, 0));
    float above = depth_at(depth_map, pixel, ivec2(0, -1)), below = depth_at(depth_map, pixel, ivec2(0, 1));
    bool is_rim = ends_along(here, left, right, bvec2(low.x, high.x), facing.x, focal)
        || ends_along(here, above, below, bvec2(low.y, high.y), facing.y, focal);
    return is_rim ? -here : here;
}
