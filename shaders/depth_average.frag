#version 330 core
// Depth and its noise -> calmer depth and the noise that is left; first of two passes for noisy depth.
#include "common/depth_average.glsl"

uniform sampler2D picture;  // depth, noise over depth
uniform float correlation;

out vec4 averaged;

void main() {
    averaged = vec4(average_pairs(picture, ivec2(gl_FragCoord.xy), correlation), 0.0, 0.0);
}
