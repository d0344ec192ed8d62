#version 330 core
// What vote.frag asks of each sample of a small surface: the picture's mean colour there (rgb), and whether all around
// it lies on its plane (a).
#include "common/vote.glsl"

uniform sampler2D surface_map;
uniform sampler2D color_map;
uniform vec4 source;
uniform float least_span;  // pixels of the picture over which colours are averaged at least

out vec4 guide;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    vec2 size = vec2(textureSize(surface_map, 0));
    float span = GUIDE_SPAN * float(textureSize(color_map, 0).x) / size.x;
    guide = vec4(mean_color(color_map, vec2(pixel), size, max(span, least_span)), is_calm(surface_map, pixel, source));
}
