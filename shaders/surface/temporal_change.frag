#version 330 core
#ifndef MOVED
#define MOVED 1  // 0: the camera stands where it stood
#endif
// Averaged depth with its noise, and what is remembered -> how they differ (common/temporal.glsl), and the old normal.
#include "common/temporal.glsl"

uniform sampler2D picture;      // from depth_average.frag
uniform sampler2D history_map;  // from temporal_depth.frag, of the frame before
uniform sampler2D normal_map;   // from temporal_normals.frag, of the frame before
uniform vec2 rounding;
#if MOVED
uniform vec4 intrinsics;
uniform mat4 view;
#endif

layout(location = 0) out vec2 change;
layout(location = 1) out vec4 old_normal;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    vec2 here = depth_and_noise_at(picture, pixel, ivec2(0));
#if MOVED
    vec3 there = carry_to_old(pixel, here.x, intrinsics, view);
    vec2 step = here.x > 0.0 ? carried_step(history_map, there) : vec2(0.0);
    vec3 normal = step.y > 0.0 ? carried_normal(normal_map, there) * mat3(view) : vec3(0.0);
#else
    vec2 step = old_step(history_map, pixel, here.x);
    vec3 normal = step.y > 0.0 ? history_at(normal_map, pixel, ivec2(0)).xyz : vec3(0.0);
#endif
    change = change_of(step, fresh_noise(here, rounding));
    old_normal = vec4(normal, 0.0);
}
