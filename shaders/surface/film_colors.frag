#version 330 core
// The planes of a frame's colours: luma and two chromas, one below the other -> sRGB.
#include "common/film_planes.glsl"

uniform sampler2D color_planes;

out vec4 color;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy), down = ivec2(0, textureSize(color_planes, 0).y / 3);
    vec2 chromas = vec2(texelFetch(color_planes, pixel + down, 0).r, texelFetch(color_planes, pixel + 2 * down, 0).r);
    color = vec4(color_of_luma(texelFetch(color_planes, pixel, 0).r, chromas), 1.0);
}
