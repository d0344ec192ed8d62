#include "common/inverse_depth.glsl"

// Flying pixels: samples that hang in the air between two surfaces, because the sensor has mixed both. They are put
// back onto the nearer one of the two along their rays (cf. Sabov, Krueger 2008).

const float STEEPEST = 8.0;   // depth per width, both in pixels: flatter than 7 degrees to the ray, no surface is expected
const float CERTAIN = 6.0;    // standard deviations of noise that a step exceeds
const float RAMP = 0.1;       // share of a step that lies on each side of every pixel within it
const float UNKNOWN = 0.5e6;  // a step above comes from a missing pixel

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
// lead here; otherwise 0.
float step_aside(vec4 steps, float side, float steepest, float noise) {
    vec4 away = side * steps;
    vec3 known = max(steps.xyz, steps.yzw), leads = ENDS * max(away.yzw - away.xyz, 0.0);
    vec3 least = leads + max(vec3(1.0, 2.0, 3.0) * steepest, noise);
    vec3 within = abs(away.xxy - 0.5 * away.yzz), ramp = (0.5 - RAMP) * away.yzz;
    if (known.x < UNKNOWN && away.x > least.x) return steps.x;
    if (known.y < UNKNOWN && away.y > least.y && within.x < ramp.x) return steps.y;
    if (known.z < UNKNOWN && away.z > least.z && within.y < ramp.y && within.z < ramp.z) return steps.z;
    return 0.0;
}

// The smaller one of two steps, of a nearer surface on one side and a farther one on the other; 0 without both.
float step_between(vec4 before, vec4 after, float steepest, float noise) {
    float nearer = step_aside(before, 1.0, steepest, noise), farther = step_aside(after, -1.0, steepest, noise);
    if (nearer == 0.0 || farther == 0.0) return 0.0;
    return nearer < -farther ? nearer : farther;
}

float smaller_step(float one, float other) {
    return other != 0.0 && (one == 0.0 || abs(other) < abs(one)) ? other : one;
}

// The step of 1/z that puts a flying pixel onto a surface beside it in its row or column, over its own 1/z; 0 if the
// pixel does not fly. here: its depth, above 0; noise: standard deviation of that, over it; focal: mean focal length,
// pixels.
float flying_step(sampler2D depth_map, ivec2 pixel, float here, float noise, float focal) {
    float found = 0.0;
    for (int k = 0; k < 2; ++k) {
        ivec2 along = ivec2(1 - k, k);
        vec4 before = steps_along(depth_map, pixel, here, -along), after = steps_along(depth_map, pixel, here, along);
        found = smaller_step(found, step_between(before, after, STEEPEST / focal, CERTAIN * noise));
        found = smaller_step(found, step_between(after, before, STEEPEST / focal, CERTAIN * noise));
    }
    return found;
}
