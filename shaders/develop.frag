#version 330 core
// The sum of a picture's samples -> the picture.
#include "common/developed.glsl"

uniform sampler2D sums;
uniform float count;
uniform vec4 background;

out vec4 color;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy), last = textureSize(sums, 0) - 1;
    float least = count;
    for (int k = 0; k < 9; ++k) {
        ivec2 beside = clamp(pixel + ivec2(k % 3, k / 3) - 1, ivec2(0), last);
        least = min(least, texelFetch(sums, beside, 0).a);
    }
    color = developed(close_crack(texelFetch(sums, pixel, 0), least, count), count, background);
}
