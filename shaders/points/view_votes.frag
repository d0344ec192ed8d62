#version 330 core
// The votes of another frame on the points of this one, in steps of 1/255, to be added up.
#include "common/consensus.glsl"

uniform sampler2D surface_map;
uniform sampler2D other_map;
uniform vec4 source;
uniform vec4 other;
uniform mat4 view;  // source axes to the other's axes
uniform float band;

out vec2 votes;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    vec4 own = surface_at(surface_map, pixel);
    if (own.w == 0.0) discard;
    votes = vote_on(other_map, carry_forth(vec2(pixel), 1.0 / own.w, source, view, other), other, band) / 255.0;
}
