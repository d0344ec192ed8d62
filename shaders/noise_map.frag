#version 330 core
// Noise pass 3: depth with its relative noise. `told` is a depth picture's noise in metres (1x1 for a single number,
// 0 when not told); `grid` the measured levels per block.
#include "common/line_copies.glsl"
#include "common/noise_levels.glsl"

uniform sampler2D depth_map;
uniform sampler2D told;
uniform sampler2D grid;
uniform ivec2 first;
uniform vec2 powers;
uniform float misplaced;  // pixels, standard deviation; 0 in pictures as they were taken

out vec2 picture;  // x: depth, y: noise over depth

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    float z = depth_at(depth_map, pixel, ivec2(0));
    vec2 at = gl_FragCoord.xy / vec2(textureSize(depth_map, 0));
    float told_z = textureLod(told, at, 0.0).r;
    if (!(z > 0.0)) {
        picture = vec2(0.0);
        return;
    }
    float noise = max(told_z / z, noise_at(grid, pixel, first, z, powers));
    picture = vec2(z, misplaced > 0.0 ? length(vec2(noise, misplaced_noise(depth_map, pixel, z, misplaced))) : noise);
}
