#version 330 core
// The picture's mean colour around each sample of a depth picture, for votes.
#include "common/upsample_vote.glsl"

uniform sampler2D color_map;
uniform vec2 small_size;  // of the depth picture

out vec4 guide;

void main() {
    float span = GUIDE_SPAN * float(textureSize(color_map, 0).x) / small_size.x;
    guide = vec4(mean_color(color_map, gl_FragCoord.xy - 0.5, small_size, span), 1.0);
}
