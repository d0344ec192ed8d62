#version 330 core
// The means of mean_hidden.frag in a view, and what frames know of their points -> the visibility of all of them.
#include "common/surroundings.glsl"
#include "common/visibility.glsl"

uniform sampler2D surface_map;
uniform sampler2D mean_map;        // of known points: what other objects leave
uniform sampler2D visibility_map;  // share -1: not known
uniform vec4 intrinsics;
uniform int stride;

out vec4 visibility;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    if (texel_at(surface_map, pixel).w == 0.0) discard;
    vec4 known = texelFetch(visibility_map, pixel, 0);
    vec4 seen = visibility_at(mean_map, surface_map, pixel, stride, intrinsics);
    visibility = known.w < 0.0 ? seen : both_visible(known, seen, texel_at(surface_map, pixel).xyz);
}
