#version 330 core
// Surface of a noisy frame -> how certain its normals are, one texel for 16x16 pixels: how far they spread, but no
// more than the noise can tilt them.
#include "common/noise_levels.glsl"
#include "common/normal_variance.glsl"
#include "common/toksvig.glsl"

uniform sampler2D surface_map;
uniform sampler2D grid;  // these three as in depth_average.frag
uniform ivec2 first;
uniform vec2 powers;
uniform vec2 cells;      // texels of the target
uniform vec4 intrinsics;

out float certainty;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy / cells * vec2(textureSize(surface_map, 0)));
    pixel = known_pixel(surface_map, pixel);
    vec2 noise = noise_at(grid, pixel, first, max(surface_beside(surface_map, pixel).w, 1e-30), powers);
    float variance = min(tilt_variance(surface_map, pixel, intrinsics), steepest_variance(noise, intrinsics));
    certainty = normal_certainty(WANDERING * variance);
}
