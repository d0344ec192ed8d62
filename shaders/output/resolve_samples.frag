#version 330 core
#ifndef GROUND
#define GROUND 0  // 1: a ground was drawn, too; 2: one whose shadows are also those in the light from all around
#endif
#ifndef TONE
#define TONE 0    // 1: light above white rolls off
#endif
// The sums of a picture's samples -> the picture.
#include "common/sample_mean.glsl"
#include "common/tone.glsl"

uniform sampler2D sums;     // surfaces: linear light, coverage
uniform sampler2D grounds;  // alpha of the shadows on the ground, of lamps and in the light from all around
uniform float count;
uniform vec4 background;

out vec4 color;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    float ground = 0.0;
    if (GROUND == 1) ground = texelFetch(grounds, pixel, 0).r;
    if (GROUND == 2) ground = smooth_ground(grounds, sums, pixel, count);
    vec4 surfaces = texelFetch(sums, pixel, 0);
    if (TONE == 1) surfaces.rgb = surfaces.a * neutral_tone(surfaces.rgb / max(surfaces.a, 1e-6));
    color = developed(surfaces, ground, count, background);
}
