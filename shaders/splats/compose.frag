#version 330 core
#ifndef LINEAR
#define LINEAR 0  // 1: linear light times coverage, to be averaged with other samples
#endif
#ifndef LIT
#define LIT 0     // 1: the light pass has lit them; 0: their own colours, which blend in sRGB as they were trained
#endif
#ifndef BEHIND
#define BEHIND 0  // 1: other objects are behind
#endif
// The blended splats of a view over what is behind them -> the picture.
#include "common/color.glsl"

uniform sampler2D colors_sum;
#if LIT
uniform sampler2D lit_sum;     // linear light, 1 where there is some
#endif
#if BEHIND
uniform sampler2D behind_sum;
#endif

out vec4 color;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    vec4 splats = texelFetch(colors_sum, pixel, 0), behind = vec4(0.0);
    float cover = min(splats.a, 1.0);
#if BEHIND
    behind = texelFetch(behind_sum, pixel, 0);
#endif
    float alpha = cover + (1.0 - cover) * behind.a;
    if (alpha == 0.0) discard;
#if LIT
    vec3 sum = cover * texelFetch(lit_sum, pixel, 0).rgb + (1.0 - cover) * behind.rgb;
    color = vec4(LINEAR == 1 ? sum : linear_to_srgb(clamp(sum / alpha, 0.0, 1.0)), LINEAR == 1 ? alpha : 1.0);
#else
    vec3 back = behind.a > 0.0 ? linear_to_srgb(clamp(behind.rgb / behind.a, 0.0, 1.0)) : vec3(0.0);
    vec3 sum = (splats.rgb + (1.0 - cover) * behind.a * back) / alpha;
    color = vec4(LINEAR == 1 ? alpha * srgb_to_linear(min(sum, 1.0)) : sum, alpha);
#endif
#if LIT && !LINEAR
    color.a = alpha;
#endif
}
