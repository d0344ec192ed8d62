#version 330 core
// Depth and its noise -> calmer depth and the noise that is left; first of two passes for noisy depth.
#include "common/depth_average.glsl"

uniform sampler2D picture;  // depth, noise over depth
uniform float correlation;

out vec2 averaged;

void main() {
    averaged = average_pairs(picture, ivec2(gl_FragCoord.xy), correlation);
}
