#include "common/inverse_depth.glsl"

// Classical normals from differences of w = 1/z along the two image axes: 5 reads, no noise handling.

const float MISSING_STEP = 5e5;  // relative_step gives a million for a missing neighbour

// Relative steps of w to the left, right, upper and lower neighbour.
vec4 axis_steps(sampler2D depth_map, ivec2 pixel, float here) {
    return vec4(relative_step(here, depth_at(depth_map, pixel, ivec2(-1, 0))),
                relative_step(here, depth_at(depth_map, pixel, ivec2(1, 0))),
                relative_step(here, depth_at(depth_map, pixel, ivec2(0, -1))),
                relative_step(here, depth_at(depth_map, pixel, ivec2(0, 1))));
}

// Half the step from one neighbour to the other, one-sided where a neighbour is missing.
float central_difference(float before, float after, float otherwise) {
    bool has_before = before < MISSING_STEP;
    bool has_after = after < MISSING_STEP;
    if (has_before && has_after) return 0.5 * (after - before);
    return has_after ? after : has_before ? -before : otherwise;
}

// The smaller of the two one-sided differences: it does not cross a depth edge that only one side has.
float smaller_difference(float before, float after, float otherwise) {
    if (min(before, after) >= MISSING_STEP) return otherwise;
    if (abs(after) == abs(before)) return 0.5 * (after - before);  // a ridge: the same in a mirrored picture
    return abs(after) < abs(before) ? after : -before;
}

// Central differences in w: exact on planes, wrong on both sides of every depth edge.
vec3 estimate_central(sampler2D depth_map, ivec2 pixel, vec4 intrinsics) {
    float here = depth_at(depth_map, pixel, ivec2(0));
    if (!(here > 0.0)) return vec3(0.0);
    vec2 ray = (vec2(pixel) - intrinsics.zw) / intrinsics.xy;
    vec2 otherwise = facing_slope(ray, intrinsics);
    vec4 steps = axis_steps(depth_map, pixel, here);
    vec2 slope = vec2(central_difference(steps.x, steps.y, otherwise.x), central_difference(steps.z, steps.w, otherwise.y));
    return normal_of_slope(slope, ray, intrinsics);
}

// Per axis the side where w changes less (Turanszki 2019 selects by depth in this way, atyuwen 2021 refines it).
vec3 estimate_one_sided(sampler2D depth_map, ivec2 pixel, vec4 intrinsics) {
    float here = depth_at(depth_map, pixel, ivec2(0));
    if (!(here > 0.0)) return vec3(0.0);
    vec2 ray = (vec2(pixel) - intrinsics.zw) / intrinsics.xy;
    vec2 otherwise = facing_slope(ray, intrinsics);
    vec4 steps = axis_steps(depth_map, pixel, here);
    vec2 slope = vec2(smaller_difference(steps.x, steps.y, otherwise.x), smaller_difference(steps.z, steps.w, otherwise.y));
    return normal_of_slope(slope, ray, intrinsics);
}
