#version 330 core
// A small surface (unit normal, depth) -> the same surface at a larger size, its outlines as the picture shows them.
#include "common/vote.glsl"

uniform sampler2D surface_map;
uniform sampler2D calm_map;   // from calm.frag
uniform sampler2D guide_map;  // from guide.frag
uniform sampler2D color_map;
uniform vec4 source;
uniform vec2 large_size;
uniform float least_span;

out vec4 surface;

void main() {
    vec2 pixel = gl_FragCoord.xy - 0.5;
    vec2 at = rescale_position(pixel, large_size, vec2(textureSize(surface_map, 0)));
    ivec2 last = textureSize(surface_map, 0) - 1;
    float calm = 1.0;
    for (int k = 0; k < 4; ++k) {
        calm = min(calm, surface_at(calm_map, clamp(ivec2(floor(at)) + ivec2(k % 2, k / 2), ivec2(0), last)).r);
    }
    if (calm > 0.0) {
        surface = mix_facets(surface_map, at, source);
    } else {
        float span = max(float(textureSize(color_map, 0).x) / large_size.x, least_span);
        vec3 color = mean_color(color_map, pixel, large_size, span);
        surface = vote_surface(surface_map, guide_map, at, color, source);
    }
}
