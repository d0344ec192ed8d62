#version 330 core
// The votes of another frame on the points of this one, in steps of 1/255, and on where its rims end, to be added up. The
// third is whether it shows the point better.
#include "common/consensus.glsl"

uniform sampler2D surface_map;
uniform sampler2D other_map;
uniform vec4 source;
uniform vec4 other;
uniform mat4 view;  // source axes to the other's axes
uniform float band;
uniform bool is_exact;  // where the other has no depth, nothing is

layout(location = 0) out vec4 votes;
layout(location = 1) out vec4 beside;  // left, right, above, below
layout(location = 2) out float here;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    vec4 own = texel_at(surface_map, pixel);
    if (own.w == 0.0) discard;
    int rims = own.w < 0.0 ? 1 : 0;  // loops that no pixel takes cost software drivers nothing
    own.w = abs(own.w);
    vec3 there = carry_forth(vec2(pixel), 1.0 / own.w, source, view, other);
    vec2 vote = vote_on(other_map, there, other, band);
    bool is_better = false;
    int asked = is_exact && vote.x > 0.0 ? 1 : 0;
    for (int k = 0; k < asked; ++k) {
        is_better = shows_better(other_map, there, other, band, point_density(own, vec2(pixel), source));
    }
    votes = vec4(vote, is_better ? 1.0 : 0.0, 0.0) / 255.0;
    beside = vec4(0.0);
    here = 0.0;
    vec2 slope = inverse_depth_slope(own.xyz, pixel_ray(vec2(pixel), source), own.w, source);
    for (int k = 0; k < 5 * rims; ++k) {
        vec2 at = vec2(pixel + (k < 4 ? direction_of(k) : ivec2(0)));
        float w = inverse_depth_at(at, vec2(pixel), 1.0 / own.w, slope);
        float end = end_vote(other_map, carry_forth(at, w, source, view, other), other, band, is_exact);
        if (k < 4) beside[k] = end;
        else here = end;
    }
}
