#version 330 core
// Every STRIDE-th pixel of a frame, compared with another frame of the same object: by which share the other's depth is
// greater, and how much brighter this frame is.
#ifndef STRIDE
#define STRIDE 8
#endif
#include "common/color.glsl"
#include "common/consensus.glsl"
#include "common/picture.glsl"

uniform sampler2D surface_map;
uniform sampler2D color_map;
uniform sampler2D other_map;
uniform sampler2D other_color_map;
uniform vec4 source;
uniform vec4 other;
uniform mat4 view;  // source axes to the other's axes

out vec4 compared;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy) * STRIDE + STRIDE / 2;
    ivec2 size = textureSize(surface_map, 0);
    vec4 own = surface_at(surface_map, min(pixel, size - 1));
    compared = vec4(NO_OVERLAP);
    if (own.w == 0.0) return;
    if (!faces(mat3(view) * own.xyz, mat3(view) * pixel_ray(vec2(min(pixel, size - 1)), source) + view[3].xyz / own.w)) return;
    vec3 direction = pixel_ray(vec2(min(pixel, size - 1)), source) * own.w + view[3].xyz * mat3(view);
    if (!faces(own.xyz, direction)) return;
    vec3 there = carry_forth(vec2(min(pixel, size - 1)), 1.0 / own.w, source, view, other);
    float excess = depth_excess(other_map, there, other);
    if (excess == NO_OVERLAP) return;
    vec3 ours = picture_at(color_map, vec2(pixel), vec2(size));
    vec3 theirs = picture_at(other_color_map, there.xy, vec2(textureSize(other_map, 0)));
    compared = vec4(excess, log_ratio(ours, theirs, srgb_to_linear(ours), srgb_to_linear(theirs)));
}
