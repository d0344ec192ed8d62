#version 330 core
#ifndef STAGE
#define STAGE 0  // 0: by how much pixels are brighter than in other frames; 1: in rows; 2: around; 3: what others show
#endif
// Where a frame has a highlight, and which colour others show there.
#include "common/highlights.glsl"

uniform sampler2D color_map;
uniform sampler2D sum_map;  // from darker_views.frag, these two
uniform sampler2D vote_map;
uniform sampler2D excess_map;  // of stage 0
uniform sampler2D rows_map;    // of stage 1
uniform vec3 gain;             // of the frame's exposure
uniform int stride;            // stage 2: pixels from one that is looked at to the next
uniform float noise;           // stage 3: steps of brightness

out vec4 found;  // stage 3: linear colour times its share, and the share

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    if (STAGE == 0) {
        vec3 own = srgb_to_linear(picture_at(color_map, vec2(pixel), vec2(textureSize(sum_map, 0)))) * gain;
        found = vec4(excess_over(texel_at(sum_map, pixel), texel_at(vote_map, pixel), brightness(own)), 0.0);
    }
    if (STAGE == 1) found = excess_in_row(excess_map, pixel);
    if (STAGE == 2) found = vec4(excess_around(rows_map, pixel * stride), 0.0);
    if (STAGE == 3) {
        vec4 sum = texel_at(sum_map, pixel);
        float share = sum.w > 0.0 ? highlight_share(excess_around(rows_map, pixel).x, noise) : 0.0;
        found = share > 0.0 ? share * vec4(sum.rgb / (sum.w * gain), 1.0) : vec4(0.0);
    }
}
