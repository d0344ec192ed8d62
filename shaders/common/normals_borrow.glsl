#include "common/inverse_depth.glsl"

// Second pass after estimate_star: pixels without a good plane of their own mix in the planes of neighbours.

const float MUCH_BETTER = 0.1;    // a neighbour's plane counts if it explains this pixel ten times better
const float COST_FLOOR = 1e-5;    // ten times the rounding error of a residual, so that its last bits decide nothing
const float STEEPEST_STEP = 7.0;  // tan(82 deg): no surface leads to a neighbour by a steeper step

// Normal and residual of estimate_star at pixel + offset, zeros outside the picture.
vec4 surface_at(sampler2D normal_map, ivec2 pixel, ivec2 offset) {
    vec2 at = (vec2(pixel + offset) + 0.5) * (1.0 / vec2(textureSize(normal_map, 0)));
    vec4 surface = textureLod(normal_map, at, 0.0);
    return at == clamp(at, vec2(0.0), vec2(1.0)) ? surface : vec4(0.0);
}

// Mean of the pixel's normal (weight 1) and those of 12 neighbours, weight (limit / cost - 1)^2 where positive.
// cost = the neighbour's residual + how far its plane misses this pixel, both relative to w; limit = a tenth of
// the pixel's own residual. The weight is 0 at the limit, so no answer jumps there. On smooth surfaces all
// residuals are similar and nothing is borrowed. Beside creases, holes and edges the plane of one facet is borrowed.
vec4 borrow(sampler2D depth_map, sampler2D normal_map, ivec2 pixel, vec4 intrinsics) {
    const ivec2 around[12] = ivec2[12](ivec2(1, 0), ivec2(-1, 0), ivec2(0, 1), ivec2(0, -1), ivec2(1, 1), ivec2(-1, -1),
                                       ivec2(1, -1), ivec2(-1, 1), ivec2(2, 0), ivec2(-2, 0), ivec2(0, 2), ivec2(0, -2));
    float here = depth_at(depth_map, pixel, ivec2(0));
    vec4 own = surface_at(normal_map, pixel, ivec2(0));
    if (!(here > 0.0)) return vec4(0.0);
    vec2 ray = (vec2(pixel) - intrinsics.zw) / intrinsics.xy;
    float step_u = STEEPEST_STEP / intrinsics.x, step_v = STEEPEST_STEP / intrinsics.y;
    float limit = min(MUCH_BETTER * own.w, sqrt(step_u * step_u + step_v * step_v));
    vec3 sum = own.xyz;
    for (int k = 0; k < 12; ++k) {
        float there = depth_at(depth_map, pixel, around[k]);
        vec4 other = surface_at(normal_map, pixel, around[k]);
        vec2 its_ray = (vec2(pixel + around[k]) - intrinsics.zw) / intrinsics.xy;
        float facing_here = other.x * ray.x + other.y * ray.y + other.z;  // n.ray, negative towards the camera
        float facing_there = other.x * its_ray.x + other.y * its_ray.y + other.z;
        if (there > 0.0 && facing_here < 0.0) {
            float miss = abs(here * facing_here / (there * facing_there) - 1.0);
            float better = max(limit / (other.w + miss + COST_FLOOR) - 1.0, 0.0);
            sum += better * better * other.xyz;
        }
    }
    return vec4(sum / sqrt(sum.x * sum.x + sum.y * sum.y + sum.z * sum.z), own.w);
}
