#include "common/camera.glsl"
#include "common/inverse_depth.glsl"

// Marks the rim of surfaces: the pixels beside which they end, go on behind something nearer, or fold. Depth is in pixels
// here: as many as an object of that size is wide in the picture.

const float DROP = 6.0;          // where a surface ends, the next pixel lies so many pixels of depth behind it, at least,
const float STEEPER = 3.0;       // and so many times the step to the pixel before
const float BENT = 1.5;          // pixels of depth by which a surface that goes on leaves a straight line, at most
const float NOISY = 6.0;         // or so many standard deviations of the depth
const float MISSING = 1e5;       // so large is only the step to a missing pixel
const float BOTTOMLESS = -1e30;  // its rise

// By how many pixels of depth a neighbour lies before the surface that faces the viewer at the pixel. step: from
// relative_step; facing: by how much the 1/z of that surface changes to there, as a share of it.
float rise_of(float step, float facing, float focal) {
    return step < MISSING ? focal * (step - facing) : BOTTOMLESS;
}

// Does the surface end before a neighbour that rises so much, if that on the opposite side does so?
bool ends_before(float rise, float opposite) {
    return rise < -(DROP + STEEPER * max(opposite, 0.0));
}

// Does the surface end along one direction, before or after the pixel, or leave a straight line there by more than
// `most` pixels of depth? steps, inside: before, after
bool ends_along(vec2 steps, bvec2 inside, float facing, float focal, float most) {
    float before = rise_of(steps.x, -facing, focal), after = rise_of(steps.y, facing, focal);
    float bend = min(before, after) > BOTTOMLESS ? before + after : 0.0;
    return (inside.x && ends_before(before, after)) || (inside.y && ends_before(after, before)) || abs(bend) > most;
}

// Is a pixel a rim? beside: the steps to the pixels on the left and right, above and below; noise: standard deviation of
// the depth over depth. The picture's border is none.
bool is_rim(vec4 beside, ivec2 pixel, ivec2 size, vec4 intrinsics, float noise) {
    float focal = mean_focal_length(intrinsics), most = max(BENT, NOISY * noise * focal);
    vec2 facing = facing_slope(pixel_ray(vec2(pixel), intrinsics).xy, intrinsics);
    bvec2 low = greaterThan(pixel, ivec2(0)), high = lessThan(pixel, size - 1);
    return ends_along(beside.xy, bvec2(low.x, high.x), facing.x, focal, most)
        || ends_along(beside.zw, bvec2(low.y, high.y), facing.y, focal, most);
}

// The depth of a pixel, negative if it is a rim. noise: as above
float mark_rim(sampler2D depth_map, ivec2 pixel, vec4 intrinsics, float noise) {
    float here = depth_at(depth_map, pixel, ivec2(0));
    vec4 beside = vec4(
        relative_step(here, depth_at(depth_map, pixel, ivec2(-1, 0))),
        relative_step(here, depth_at(depth_map, pixel, ivec2(1, 0))),
        relative_step(here, depth_at(depth_map, pixel, ivec2(0, -1))),
        relative_step(here, depth_at(depth_map, pixel, ivec2(0, 1)))
    );
    return is_rim(beside, pixel, textureSize(depth_map, 0), intrinsics, noise) ? -here : here;
}
