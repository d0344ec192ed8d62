#version 330 core
// A frame of a film as a page has decoded it -> surface (unit normal, depth, negative at rims).
#include "common/film_planes.glsl"

uniform isampler2D codes;         // 4 times the code of the depth, and what the pixel is: 0 missing, 1 point, 2 rim
uniform sampler2D normal_planes;  // one coordinate below the other
uniform float nearest;            // the depth of code 0
uniform float depth_step;         // share of the depth from code to code

out vec4 surface;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    int height = textureSize(codes, 0).y, code = texelFetch(codes, pixel, 0).r, kind = code & 3;
    vec2 place = vec2(texelFetch(normal_planes, pixel, 0).r, texelFetch(normal_planes, pixel + ivec2(0, height), 0).r);
    float depth = nearest * exp(float(code >> 2) * depth_step);
    surface = kind == 0 ? vec4(0.0) : vec4(unfolded_normal(place), kind == 2 ? -depth : depth);
}
