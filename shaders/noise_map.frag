#version 330 core
// Noise pass 3: depth with its relative noise. `told` is a depth picture's noise in metres (1x1 for a single number,
// 0 when not told); `grid` the measured levels per block.
#include "common/noise_levels.glsl"

uniform sampler2D depth_map;
uniform sampler2D told;
uniform sampler2D grid;
uniform ivec2 first;
uniform vec2 powers;

out vec2 picture;  // x: depth, y: noise over depth

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    float z = depth_at(depth_map, pixel, ivec2(0));
    vec2 at = gl_FragCoord.xy / vec2(textureSize(depth_map, 0));
    float told_z = textureLod(told, at, 0.0).r;
    picture = z > 0.0 ? vec2(z, max(told_z / z, noise_at(grid, pixel, first, z, powers))) : vec2(0.0);
}
