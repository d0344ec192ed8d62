#version 330 core
// The sum of a picture's samples -> the picture.
#include "common/developed.glsl"

uniform sampler2D sums;
uniform float count;
uniform vec4 background;

out vec4 color;

void main() {
    color = developed(texelFetch(sums, ivec2(gl_FragCoord.xy), 0), count, background);
}
