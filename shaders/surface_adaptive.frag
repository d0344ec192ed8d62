#version 330 core
#ifndef STAGE
#define STAGE 0  // 0 to 3 in turn; a depth test leaves each stage only the pixels that earlier ones discarded
#endif
// Averaged depth with its remaining noise -> surface (unit normal, averaged depth, negative at rims), for noisy depth.
// Points move along their rays by about their noise: otherwise gaps open between neighbours in every view except the
// frame's own.
#include "common/camera.glsl"
#include "common/normals_adaptive.glsl"
#include "common/rim_marks.glsl"

uniform sampler2D calm_depth;  // depth after depth_average.frag, noise over depth
uniform vec4 intrinsics;

out vec4 surface;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    vec2 here = depth_and_noise_at(calm_depth, pixel, ivec2(0));
    vec3 slope = vec3(0.0);
    if (STAGE == 0) slope = calm_slope(calm_depth, pixel, here, widest_stride(here, intrinsics));
    if (STAGE == 1) slope = robust_slope(calm_depth, pixel, here, widest_stride(here, intrinsics));
    if (STAGE == 2) slope = nearer_slope(calm_depth, pixel, here, widest_stride(here, intrinsics));
    vec4 beside;
    if (STAGE == 3) slope = vec3(star_slope(calm_depth, pixel, here.x, intrinsics, here.y, beside).xy, 1.0);
    bool known = here.x > 0.0;
    if (known && slope.z < 0.5) discard;
    vec3 normal = normal_of_slope(slope.xy, pixel_ray(vec2(pixel), intrinsics).xy, intrinsics);
    surface = known ? vec4(normal, mark_rim(calm_depth, pixel, intrinsics)) : vec4(0.0);
}
