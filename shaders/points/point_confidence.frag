#version 330 core
#ifndef STAGE
#define STAGE 0  // 0: where the surface ends; 1: how far that is in each row; 2: trust, from that and from the votes
#endif
// How far the points of a frame are trusted, when others see them, too.
#include "common/consensus.glsl"

uniform sampler2D surface_map;
uniform vec4 source;
uniform sampler2D ends_map;   // of stage 0
uniform sampler2D rows_map;   // of stage 1
uniform sampler2D votes_map;  // from view_votes.frag

out vec2 trust;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    if (STAGE == 0) trust = vec2(surface_ends(surface_map, pixel, source), 0.0);
    if (STAGE == 1) trust = vec2(end_in_row(ends_map, pixel), 0.0);
    if (STAGE == 2) {
        ivec2 size = textureSize(surface_map, 0);
        int border = min(min(pixel.x, size.x - 1 - pixel.x), min(pixel.y, size.y - 1 - pixel.y));
        float cosine = -dot(surface_at(surface_map, pixel).xyz, normalize(pixel_ray(vec2(pixel), source)));
        vec2 votes = floor(texel_at(votes_map, pixel).rg * 255.0 + 0.5);
        trust = trust_in(votes, end_around(rows_map, pixel), border + 1, cosine);
    }
}
