#version 330 core
// Sums of flying_pixels.frag, one texel a block: the CPU reads them back and decides whether to snap.
#include "common/flying_pixel_mixing.glsl"

uniform sampler2D mixing_map;

out vec2 counts;

void main() {
    counts = count_mixing(mixing_map, ivec2(gl_FragCoord.xy));
}
