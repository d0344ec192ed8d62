#version 330 core
#ifndef MISPLACED
#define MISPLACED 1  // 0: the picture was neither enlarged nor moved
#endif
#ifndef SNAP
#define SNAP 0       // 1: flying pixels are put onto surfaces
#endif
// Depth -> depth with less noise, and the remaining noise over depth; runs before normals_adaptive.frag. `told` is the
// caller's noise in metres (1x1 for a single number, 0 if the caller gives none), `grid` what was measured per block.
#include "common/depth_average.glsl"
#if SNAP
#include "common/flying_pixels.glsl"
#endif
#include "common/upsampling_artifacts.glsl"
#include "common/noise_levels.glsl"

uniform sampler2D depth_map;
uniform sampler2D told;
uniform sampler2D grid;
uniform ivec2 first;
uniform vec2 powers;
uniform float misplaced;  // pixels, standard deviation
uniform float focal;      // mean focal length, pixels

out vec2 calm;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    float z = depth_at(depth_map, pixel, ivec2(0));
    vec2 at = gl_FragCoord.xy / vec2(textureSize(depth_map, 0));
    float told_noise = textureLod(told, at, 0.0).r / max(z, 1e-30);
    vec2 noise = noise_at(grid, pixel, first, max(z, 1e-30), powers);
    if (told_noise > noise.x) noise = vec2(told_noise, 0.0);
    if (MISPLACED == 1) noise = add_misplaced(noise, misplaced_noise(depth_map, pixel, z, misplaced));
    calm = z > 0.0 ? average_pairs(depth_map, pixel, noise.x, noise.y) : vec2(0.0);
#if SNAP
    float step = flying_step(depth_map, pixel, z, noise.x, focal);
    if (z > 0.0 && step != 0.0) calm = vec2(z / (1.0 + step), noise.x);
#endif
}
