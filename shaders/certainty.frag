#version 330 core
// Surface of a noisy frame -> how certain its normals are, one texel for several pixels: how far they spread, but no
// more than the noise that neighbours share can tilt them.
#include "common/noise_levels.glsl"
#include "common/tilt.glsl"
#include "common/toksvig.glsl"

uniform sampler2D surface_map;
uniform sampler2D grid;  // these three as in depth_average.frag
uniform ivec2 first;
uniform vec2 powers;
uniform vec2 cells;      // texels of the target
uniform float focal;     // mean focal length, pixels

out float certainty;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy / cells * vec2(textureSize(surface_map, 0)));
    vec4 middle = middle_surface(surface_map, pixel);
    vec2 noise = noise_at(grid, pixel, first, max(middle.w, 1e-30), powers);
    float steepest = noise.x * noise.y * focal;
    certainty = normal_certainty(min(tilt_variance(surface_map, pixel, middle.xyz), steepest * steepest));
}
