#ifndef BALLS
#define BALLS 0  // 1: points without a plane, or all of them; 0: discs
#endif
// What the pixel's ray meets of a splat.
#include "common/cloud_splat.glsl"

uniform vec4 target;

flat in vec3 centre;
flat in vec2 middle;
flat in vec4 normal_radius;
flat in vec3 plane_normal;
flat in vec3 onward;
flat in vec3 linear_color;

SplatHit hit_splat(vec2 pixel) {
    CloudSplat splat = CloudSplat(centre, normal_radius.xyz, normal_radius.w);
#if BALLS
    return hit_ball(splat, pixel - middle, target);
#else
    return hit_disc(splat, plane_normal, onward, pixel - middle, target);
#endif
}
