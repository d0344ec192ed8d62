#version 330 core
// A small surface (unit normal, depth) -> the same surface at a larger size, its outlines as the picture shows them.
#include "common/upsample_vote.glsl"

uniform sampler2D surface_map;
uniform sampler2D calm_map;   // from planar_mask.frag
uniform sampler2D guide_map;  // from upsample_guide.frag
uniform sampler2D color_map;
uniform vec4 source;
uniform vec2 large_size;

out vec4 surface;

void main() {
    vec2 pixel = gl_FragCoord.xy - 0.5;
    vec2 at = rescale_position(pixel, large_size, vec2(textureSize(surface_map, 0)));
    if (is_cut_out(color_map, pixel, large_size)) {
        surface = vec4(0.0);
    } else if (calm_around(calm_map, at) > 0.0) {
        surface = mix_facets(surface_map, at, source);
    } else {
        vec3 color = mean_color(color_map, pixel, large_size, float(textureSize(color_map, 0).x) / large_size.x);
        surface = vote_surface(surface_map, guide_map, at, color, source);
    }
}
