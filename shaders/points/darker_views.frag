#version 330 core
// What another frame says about the colours of the points of this one, to be added up.
#include "common/highlights.glsl"

uniform sampler2D surface_map;
uniform sampler2D color_map;
uniform sampler2D other_map;
uniform sampler2D other_color_map;
uniform vec4 source;
uniform vec4 other;
uniform mat4 view;  // source axes to the other's axes
uniform float band;
uniform vec3 gain;  // of its exposure
uniform vec3 other_gain;

layout(location = 0) out vec4 part;
layout(location = 1) out vec4 vote;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    vec4 own = surface_at(surface_map, pixel);
    if (own.w == 0.0) discard;
    vec3 there = carry_forth(vec2(pixel), 1.0 / own.w, source, view, other);
    if (abs(depth_excess(other_map, there, other)) >= band) discard;
    vec3 encoded = picture_at(other_color_map, there.xy, vec2(textureSize(other_map, 0)));
    vec3 ours = srgb_to_linear(picture_at(color_map, vec2(pixel), vec2(textureSize(surface_map, 0)))) * gain;
    part = darker_part(encoded, other_gain);
    vote = brightness_vote(encoded, other_gain, brightness(ours));
}
