#version 330 core
#ifndef STAGE
#define STAGE 0  // 0: where the surface ends; 1: how far that is in each row; 2: trust, from that and from the votes
#endif
// How far the points of a frame are trusted, and where its rims end, when others see them, too.
#include "common/consensus.glsl"

uniform sampler2D surface_map;
uniform vec4 source;
uniform sampler2D ends_map;   // of stage 0
uniform sampler2D rows_map;   // of stage 1
uniform sampler2D votes_map;   // these three from view_votes.frag
uniform sampler2D beside_map;
uniform sampler2D here_map;
uniform float band;
uniform bool is_exact;

layout(location = 0) out vec2 trust;
layout(location = 1) out vec4 cuts;  // see end_cut

// The votes for a rim at the next pixel, with the frame's own: one for a surface that goes on there, and one against others.
float votes_beside(ivec2 pixel, vec4 own, vec2 slope, int k) {
    ivec2 next = pixel + direction_of(k);
    bool goes_on = lies_on_plane(surface_at(surface_map, next).w, vec2(next - pixel), own.w, slope, band);
    return texel_at(beside_map, pixel)[k] + (goes_on ? 1.0 : 0.0) + 1.0;
}

vec4 cuts_around(ivec2 pixel) {
    vec4 own = texel_at(surface_map, pixel), found = vec4(0.0);
    int rims = own.w < 0.0 ? 1 : 0;  // a loop that no pixel takes costs software drivers nothing
    own.w = abs(own.w);
    vec2 slope = inverse_depth_slope(own.xyz, pixel_ray(vec2(pixel), source), own.w, source);
    float here = 0.5 + texel_at(here_map, pixel).r;
    for (int k = 0; k < 4 * rims; ++k) found[k] = end_cut(here, votes_beside(pixel, own, slope, k));
    return found;
}

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    cuts = vec4(0.0);
    if (STAGE == 0) trust = vec2(surface_ends(surface_map, pixel, source), 0.0);
    if (STAGE == 1) trust = vec2(end_in_row(ends_map, pixel), 0.0);
    if (STAGE == 2) {
        ivec2 size = textureSize(surface_map, 0);
        int border = min(min(pixel.x, size.x - 1 - pixel.x), min(pixel.y, size.y - 1 - pixel.y));
        float cosine = -dot(surface_at(surface_map, pixel).xyz, normalize(pixel_ray(vec2(pixel), source)));
        vec2 votes = floor(texel_at(votes_map, pixel).rg * 255.0 + 0.5);
        trust = trust_in(votes, end_around(rows_map, pixel), border + 1, cosine, is_exact);
        if (is_exact && is_shown_better(votes_map, surface_map, pixel, source)) trust.x = SPARE;
        cuts = cuts_around(pixel);
    }
}
