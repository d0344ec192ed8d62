#version 330 core
#ifndef STAGE
#define STAGE 0  // 0 to 3 in turn; a depth test leaves each stage only the pixels that earlier ones discarded
#endif
#ifndef BUMPY
#define BUMPY 0  // 1: planes of bumpy_planes.glsl have their share
#endif
// Averaged depth with its remaining noise -> surface (unit normal, depth, negative at rims), for noisy depth. Points move
// along their rays onto the surface that was fitted to them, by about their noise: otherwise gaps open between neighbours
// in every view except the frame's own.
#include "common/camera.glsl"
#include "common/normals_adaptive.glsl"
#if BUMPY
#include "common/bumpy_planes.glsl"
#endif
#include "common/rim_marks.glsl"

uniform sampler2D calm_depth;  // depth after depth_average.frag, noise over depth
uniform sampler2D planes;      // of the cells, from bumpy_windows.frag
uniform ivec2 first;
uniform vec4 intrinsics;

out vec4 surface;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    vec2 here = depth_and_noise_at(calm_depth, pixel, ivec2(0));
    vec4 found = vec4(0.0);
    if (STAGE == 0) found = calm_surface(calm_depth, pixel, here, widest_stride(here, intrinsics));
    if (STAGE == 1) found = robust_surface(calm_depth, pixel, here, widest_stride(here, intrinsics));
    if (STAGE == 2) found = nearer_surface(calm_depth, pixel, here, widest_stride(here, intrinsics));
    vec4 beside;
    if (STAGE == 3) found = vec4(0.0, star_slope(calm_depth, pixel, here.x, intrinsics, here.y, beside).xy, 1.0);
    bool known = here.x > 0.0;
    if (known && found.w < 0.5) discard;
#if BUMPY
    vec4 plane = bumpy_surface(planes, calm_depth, pixel, first);
    if (plane.w > 0.0) found.xyz = mix(found.xyz, vec3(relative_step(here.x, plane.x), plane.yz), plane.w);
#endif
    vec3 normal = normal_of_slope(found.yz, pixel_ray(vec2(pixel), intrinsics).xy, intrinsics);
    surface = known ? vec4(normal, mark_rim(calm_depth, pixel, intrinsics, here.y) / (1.0 + found.x)) : vec4(0.0);
}
