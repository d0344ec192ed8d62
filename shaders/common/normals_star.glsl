#include "common/inverse_depth.glsl"

// estimate_star: normal of a pixel from its 8-pointed star of 16 neighbours; sharp at depth edges, exact on planes.

const float REJECTED = 1e30;    // error of a stencil that crosses a hole or a jump
const float ONE_SIDED = 1e20;   // tau of a direction that lost a stencil: then the least bent of the others wins alone
const float STEEPEST = 7.0;     // tan(82 deg): a step between neighbours that is steeper may be a jump
const float ROUNDING = 1e-12;   // square of the rounding error of a second difference of float32 depth
const float BEND_NOISE = 6.0;   // variance of a second difference in units of one pixel's: 1 + 4 + 1
const float TWIST_NOISE = 2.5;  // variance of half a third difference: (1 + 4 + 4 + 1) / 4
const float RIDGE = 1e-9;       // weight of the view-facing slope; the weakest real vote has 1e-2
const float FEEBLE = 1e-2;      // weight of a plain difference; that of a bend of 1e-3 is 1e6
const float FOURTH_NOISE = 0.1; // second over fourth difference variance (6 / 70): noise alone keeps tau near 1

// Square of a stencil's second difference `bend`. REJECTED if the bend is most of its larger step and that step is too
// steep for a visible surface: then a jump lies inside the stencil.
float stencil_error(float bend, float step_a, float step_b, float steepest, float variance) {
    float larger = max(abs(step_a), abs(step_b));
    float square = bend * bend;
    bool broken = abs(bend) > 0.7 * larger && larger > steepest && square > 36.0 * variance;
    return broken ? REJECTED : square + (BEND_NOISE * variance + ROUNDING);
}

// How much of a difference is more than noise: 0 well below three standard deviations, 1 well above.
float beyond_noise(float difference, float variance) {
    float ratio = min(difference * difference / (9.0 * (variance + 0.01 * ROUNDING)), 1e15);
    return ratio * ratio / (1.0 + ratio * ratio);
}

// The three parabola stencils of a direction: left, centre, right.
struct Stencils {
    vec3 bend;   // second differences
    vec3 error;  // from stencil_error
};

// Three stencils are mixed as in WENO-Z (Borges, Carmona, Costa, Don 2008): 1 : 4 : 1 where w is smooth, which is the
// fourth-order central difference, and the least bent one where it is not. steps: the relative ones to the two pixels
// before and the two after. The functions below take a direction one step farther each: star_slope takes all four
// directions through each of them, as processors then have four things to do while they divide.
Stencils stencils_along(vec4 steps, float steepest, float variance) {
    float before2 = steps.x, before1 = steps.y, after1 = steps.z, after2 = steps.w;
    float bend_l = before2 - 2.0 * before1;
    float bend_c = before1 + after1;
    float bend_r = after2 - 2.0 * after1;
    float error_l = stencil_error(bend_l, before1, before2 - before1, steepest, variance);
    float error_c = stencil_error(bend_c, before1, after1, steepest, variance);
    float error_r = stencil_error(bend_r, after1, after2 - after1, steepest, variance);
    return Stencils(vec3(bend_l, bend_c, bend_r), vec3(error_l, error_c, error_r));
}

bool are_whole(Stencils stencils) {
    return max(stencils.error.x, max(stencils.error.y, stencils.error.z)) < REJECTED;
}

// tau: the squared fourth difference. It responds to a jump anywhere in the five points, but vanishes faster on smooth
// surfaces.
float tau_of(Stencils stencils) {
    float fourth = stencils.bend.x - 2.0 * stencils.bend.y + stencils.bend.z;
    return are_whole(stencils) ? FOURTH_NOISE * fourth * fourth : ONE_SIDED;
}

// Slope of w per step. Bends that could be noise are ignored: then a side stencil is a straight line.
float mix_slopes(vec4 steps, Stencils stencils, float tau, float variance) {
    float before2 = steps.x, before1 = steps.y, after1 = steps.z, after2 = steps.w;
    float bend_l = stencils.bend.x, bend_r = stencils.bend.z;
    float share_l = 1.0 + tau / stencils.error.x;
    float share_c = 4.0 + 4.0 * tau / stencils.error.y;
    float share_r = 1.0 + tau / stencils.error.z;
    float slope_l = bend_l * beyond_noise(bend_l, BEND_NOISE * variance) - 0.5 * before2;
    float slope_c = 0.5 * (after1 - before1);
    float slope_r = 0.5 * after2 - bend_r * beyond_noise(bend_r, BEND_NOISE * variance);
    return (share_l * slope_l + share_c * slope_c + share_r * slope_r) / (share_l + share_c + share_r);
}

// The same where twists that could be noise are ignored, too: then all five points are a straight line fitted by least
// squares, with a ninth of the variance (Savitzky, Golay 1964).
float straighten(vec4 steps, Stencils stencils, float slope, float variance) {
    float before2 = steps.x, before1 = steps.y, after1 = steps.z, after2 = steps.w;
    float twist = 0.5 * (after2 - before2) - (after1 - before1);
    float line = 0.2 * (after2 - before2) + 0.1 * (after1 - before1);
    return are_whole(stencils) ? line + beyond_noise(twist, TWIST_NOISE * variance) * (slope - line) : slope;
}

// The slope along the direction (x) and its weight (y).
vec2 vote_of(vec4 steps, Stencils stencils, float tau, float slope, float steepest, float variance) {
    float before1 = steps.y, after1 = steps.z;
    vec3 errors = stencils.error;
    float error = min(tau + (BEND_NOISE * variance + ROUNDING), min(errors.x, min(errors.y, errors.z)));
    float weight = 1.0 / error;
    // Structures 1 or 2 px wide have no parabola: plain differences to both sides get a weak vote, except jumps.
    float weak_b = abs(before1) < steepest ? FEEBLE : 0.0;
    float weak_a = abs(after1) < steepest ? FEEBLE : 0.0;
    float total = weight + weak_b + weak_a;
    return vec2((weight * slope - weak_b * before1 + weak_a * after1) / total, total);
}

// Slope of w at `pixel` per step in u and v relative to w (xy), and how far w may lie off that plane one step
// away, relative to w (z: residual; 1e-6 on clean planes, 3e4 if no neighbour has a vote). intrinsics = fx, fy,
// cx, cy; `here` = depth of the pixel, not 0; sigma = std of depth noise over depth at this pixel, 0 if clean; `beside`
// becomes the steps to the left and right, above and below.
//
// Weighted least squares over four directions, exact on planes. It is written as the mean over pairs of
// directions, each weighted by its squared determinant (Jacobi 1841): all terms positive, nothing cancels.
// One last vote of weight 1e-9 goes to the surface facing the viewer. It decides only for isolated pixels.
vec3 star_slope(sampler2D depth_map, ivec2 pixel, float here, vec4 intrinsics, float sigma, out vec4 beside) {
    const ivec2 along[4] = ivec2[4](ivec2(1, 0), ivec2(0, 1), ivec2(1, 1), ivec2(1, -1));
    float variance = sigma * sigma;
    float steep_x = STEEPEST / abs(intrinsics.x);
    float steep_y = STEEPEST / abs(intrinsics.y);
    float steep_diagonal = sqrt(steep_x * steep_x + steep_y * steep_y);
    float steepest[4] = float[4](steep_x, steep_y, steep_diagonal, steep_diagonal);
    vec4 steps[4];
    for (int k = 0; k < 4; ++k) {
        steps[k] = vec4(
            relative_step(here, depth_at(depth_map, pixel, -2 * along[k])),
            relative_step(here, depth_at(depth_map, pixel, -along[k])),
            relative_step(here, depth_at(depth_map, pixel, along[k])),
            relative_step(here, depth_at(depth_map, pixel, 2 * along[k]))
        );
    }
    beside = vec4(steps[0].yz, steps[1].yz);
    Stencils stencils[4];
    float tau[4];
    float slopes[4];
    vec2 votes[4];
    for (int k = 0; k < 4; ++k) stencils[k] = stencils_along(steps[k], steepest[k], variance);
    for (int k = 0; k < 4; ++k) tau[k] = tau_of(stencils[k]);
    for (int k = 0; k < 4; ++k) slopes[k] = mix_slopes(steps[k], stencils[k], tau[k], variance);
    for (int k = 0; k < 4; ++k) slopes[k] = straighten(steps[k], stencils[k], slopes[k], variance);
    for (int k = 0; k < 4; ++k) votes[k] = vote_of(steps[k], stencils[k], tau[k], slopes[k], steepest[k], variance);
    vec2 ray = (vec2(pixel) - intrinsics.zw) / intrinsics.xy;
    vec2 facing = ray / (1.0 + ray.x * ray.x + ray.y * ray.y) / intrinsics.xy;
    float weight_u = votes[0].y + RIDGE, weight_v = votes[1].y + RIDGE;
    float u = (votes[0].y * votes[0].x + RIDGE * facing.x) / weight_u;
    float v = (votes[1].y * votes[1].x + RIDGE * facing.y) / weight_v;
    float p = votes[2].x, q = votes[3].x;  // along the two diagonals: u + v and u - v
    float uv = weight_u * weight_v, up = weight_u * votes[2].y, uq = weight_u * votes[3].y;
    float vp = weight_v * votes[2].y, vq = weight_v * votes[3].y, pq = 4.0 * votes[2].y * votes[3].y;
    float pairs = uv + up + uq + vp + vq + pq;
    float slope_u = ((uv + up + uq) * u + vp * (p - v) + vq * (q + v) + pq * (0.5 * (p + q))) / pairs;
    float slope_v = ((uv + vp + vq) * v + up * (p - u) + uq * (u - q) + pq * (0.5 * (p - q))) / pairs;
    float trace = weight_u + weight_v + 2.0 * (votes[2].y + votes[3].y);
    return vec3(slope_u, slope_v, sqrt(trace / pairs));  // trace over determinant: variance of the worst direction
}

// Unit normal of `pixel` towards the camera (xyz) and its residual (w), zeros where its depth is missing. beside: as above
vec4 estimate_star(sampler2D depth_map, ivec2 pixel, vec4 intrinsics, float sigma, out vec4 beside) {
    beside = vec4(0.0);
    float here = depth_at(depth_map, pixel, ivec2(0));
    if (!(here > 0.0)) return vec4(0.0);
    vec2 ray = (vec2(pixel) - intrinsics.zw) / intrinsics.xy;
    vec3 slope = star_slope(depth_map, pixel, here, intrinsics, sigma, beside);
    return vec4(normal_of_slope(slope.xy, ray, intrinsics), slope.z);
}
