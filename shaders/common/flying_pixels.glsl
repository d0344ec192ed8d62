#include "common/inverse_depth.glsl"

// Flying pixels: samples that hang in the air between two surfaces, because the sensor has mixed both. They are put
// back onto the nearer one of the two along their rays (cf. Sabov, Krueger 2008).

const float STEEPEST = 8.0;     // depth per width, both in pixels: within 7 degrees of the ray no surface is expected
const float CERTAIN = 6.0;      // standard deviations of noise that a step exceeds
const float RAMP = 0.1;         // share of a step that lies on each side of every pixel within it
const float WIDEST_RAMP = 4.0;  // pixels from one surface to the other: all pixels of a ramp fly, or none
const float UNKNOWN = 0.5e6;    // a step above comes from a missing pixel

// A step of 1, 2 or 3 pixels from a pixel to a surface that ends there is so many times the step to the next pixel, or
// larger. It is as large on a slanted surface. Where a round surface ends, the change of depth grows with the root of
// the distance: 1 / (sqrt(2) - 1) = 2.41, sqrt(2) / (sqrt(3) - sqrt(2)) = 4.45, sqrt(3) / (2 - sqrt(3)) = 6.46.
const vec3 ENDS = vec3(2.5, 4.5, 6.5);

// Steps of 1/z from a pixel to those 1 to 4 away.
vec4 steps_along(sampler2D depth_map, ivec2 pixel, float here, ivec2 along) {
    vec4 steps;
    for (int k = 0; k < 4; ++k) steps[k] = relative_step(here, depth_at(depth_map, pixel, (k + 1) * along));
    return steps;
}

// The step to the surface on one side, 1 to 3 pixels away, if it is nearer (side 1) or farther (side -1) and does not
// lead here, and how many pixels away; otherwise zeros.
vec2 step_aside(vec4 steps, float side, float steepest, float noise) {
    bvec4 missing = greaterThan(steps, vec4(UNKNOWN));
    vec4 away = mix(side * steps, vec4(-UNKNOWN), missing);
    vec3 leads = max(away.yzw - away.xyz, vec3(0.5 * (away.zw - away.xy), 0.0));  // two pixels: some lines are copies
    vec3 least = ENDS * max(leads, 0.0) + max(vec3(1.0, 2.0, 3.0) * steepest, noise);
    vec3 within = abs(away.xxy - 0.5 * away.yzz), ramp = (0.5 - RAMP) * away.yzz;
    if (!missing.y && away.x > least.x) return vec2(steps.x, 1.0);
    if (!missing.z && away.y > least.y && within.x < ramp.x) return vec2(steps.y, 2.0);
    if (!missing.w && away.z > least.z && within.y < ramp.y && within.z < ramp.z) return vec2(steps.z, 3.0);
    return vec2(0.0);
}

// The smaller one of two steps, of a nearer surface on one side and a farther one on the other; 0 without both.
float step_between(vec4 before, vec4 after, float steepest, float noise) {
    vec2 nearer = step_aside(before, 1.0, steepest, noise), farther = step_aside(after, -1.0, steepest, noise);
    if (nearer.x == 0.0 || farther.x == 0.0 || nearer.y + farther.y > WIDEST_RAMP) return 0.0;
    return nearer.x < -farther.x ? nearer.x : farther.x;
}

float smaller_step(float one, float other) {
    return other != 0.0 && (one == 0.0 || abs(other) < abs(one)) ? other : one;
}

// Whether 1/z two pixels away, in the row or the column, differs by more than the least step.
bool beside_step(sampler2D depth_map, ivec2 pixel, float here, float least) {
    float largest = 0.0;
    for (int k = 0; k < 4; ++k) {
        ivec2 offset = k < 2 ? ivec2(4 * k - 2, 0) : ivec2(0, 4 * k - 10);
        largest = max(largest, abs(relative_step(here, depth_at(depth_map, pixel, offset))));
    }
    return largest > least;
}

// The step of 1/z that puts a flying pixel onto a surface beside it in its row or column, over its own 1/z; 0 if the
// pixel does not fly. here: its depth, above 0; noise: standard deviation of that, over it; focal: mean focal length,
// pixels.
float flying_step(sampler2D depth_map, ivec2 pixel, float here, float noise, float focal) {
    float found = 0.0, steepest = STEEPEST / focal, certain = CERTAIN * noise;
    int lines = beside_step(depth_map, pixel, here, max(steepest, certain)) ? 2 : 0;
    for (int k = 0; k < lines; ++k) {
        ivec2 along = ivec2(1 - k, k);
        vec4 before = steps_along(depth_map, pixel, here, -along), after = steps_along(depth_map, pixel, here, along);
        found = smaller_step(found, step_between(before, after, steepest, certain));
        found = smaller_step(found, step_between(after, before, steepest, certain));
    }
    return found;
}
