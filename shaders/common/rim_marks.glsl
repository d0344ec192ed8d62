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

const float LEAST_SAY = 0.1;      // votes that a rim's own pixel has for it, at least
const float CUT_UNIT = 0.25;     // of 1 over source pixels, in which cuts are kept

// Four directions: left, right, up, down.
ivec2 direction_of(int k) {
    return k < 2 ? ivec2(2 * k - 1, 0) : ivec2(0, 2 * k - 5);
}

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

// Where other frames say that a rim ends, along a direction, from 0: not before the next pixel, to 1: at once. here, there:
// the votes for its surface at the pixel and at the next, which are linear between them.
float end_cut(float here, float there) {
    return there < 0.0 ? min(CUT_UNIT * (1.0 - there / max(here, LEAST_SAY)), 1.0) : 0.0;
}

// Is a place so far from a rim's pixel cut off by the frames that see through it? cuts: to the left, right, up, down
bool is_cut_off(vec4 cuts, vec2 off) {
    return dot(max(vec4(-off.x, off.x, -off.y, off.y), 0.0), cuts) > CUT_UNIT;
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
