#version 330 core
// Averaged depth with its noise, and how it differs from what is remembered -> what is remembered from now on: depth,
// the noise that normals_adaptive.frag reads, which is that of the new frame alone, the noise that is left, and the
// share of the new frame.
#include "common/normals_adaptive.glsl"
#include "common/temporal.glsl"

uniform sampler2D picture;     // from depth_average.frag
uniform sampler2D change_map;  // from temporal_change.frag
uniform vec4 intrinsics;
uniform vec2 rounding;

layout(location = 0) out vec4 history;
layout(location = 1) out vec2 calm;  // its first two values

const int LEAST_STRIDE = 5;  // pixels: closer ones share noise, because each is averaged over 5x5

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    vec2 here = depth_and_noise_at(picture, pixel, ivec2(0));
    vec2 change = history_at(change_map, pixel, ivec2(0)).rg;
    float noise = fresh_noise(here, rounding);
    float power = change_power(change_map, pixel, max(widest_stride(here, intrinsics), LEAST_STRIDE));
    vec2 share = fresh_share(noise, change, power);
    history = vec4(mixed_depth(here.x, noise, change, share.x), here.y, share.y, share.x);
    calm = history.rg;
}
