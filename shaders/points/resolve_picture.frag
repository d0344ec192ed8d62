#version 330 core
#ifndef LOOK_UP
#define LOOK_UP 0
#endif
#ifndef SHADING
#define SHADING 2  // one program for each model: software drivers run both sides of every branch
#endif
#ifndef LINEAR
#define LINEAR 0   // 1: the picture stays linear, to be averaged with other samples
#endif
// What each pixel of the view shows -> the picture. SHADING 0 (none): the frame's own colour; 1 (flat): the light of the
// point; 2 (gouraud): the light of the points around it, interpolated.
#include "common/color.glsl"
#include "points/visible_point.glsl"

uniform sampler2D color_map;  // none: sRGB, of any size
uniform sampler2D light_map;  // flat and gouraud: the points' light, linear

out vec4 color;

void main() {
    Seen seen = find_seen();
    vec3 shown = vec3(0.0);
    if (SHADING == 0) shown = picture_at(color_map, vec2(seen.pixel), vec2(textureSize(surface_map, 0)));
    if (SHADING == 1) shown = texelFetch(light_map, seen.pixel, 0).rgb;
    if (SHADING == 2) shown = mix_light(seen, seen_weights(seen, source), light_map);
    if (SHADING == 0 && LINEAR == 1) shown = srgb_to_linear(shown);
    if (SHADING != 0 && LINEAR == 0) shown = linear_to_srgb(min(shown, 1.0));
    color = is_seen ? vec4(shown, 1.0) : vec4(0.0);
}
