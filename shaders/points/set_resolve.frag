#version 330 core
#ifndef LOOK_UP
#define LOOK_UP 0
#endif
#ifndef AT_TARGET
#define AT_TARGET 0  // 1: normals that were found in the view, on the depth that set_resolve_depth.frag makes
#endif
#ifndef VISIBILITY
#define VISIBILITY 0  // 1: it is known what the points see of the light from all around
#endif
#ifndef CERTAINTY
#define CERTAINTY 0  // 1: some frames have uncertain normals
#endif
#ifndef MARKED
#define MARKED 0     // 1: to show doubts: what no frame is trusted for has the least certain normal
#endif
// The sums of set_accumulate.frag over all frames -> what the light pass reads, as resolve_surfaces.frag does of one frame.
#include "common/parts.glsl"
#include "common/toksvig.glsl"
#include "points/set_visibility.glsl"

uniform sampler2D geometry_map;
uniform sampler2D albedo_map;
uniform sampler2D visibility_map;  // its sums
uniform sampler2D target_map;  // unit normal, depth (0: not known)
uniform float others;         // frames less one
uniform float near;
uniform float scale;  // of the object; the view does not contain it
uniform float material_number;

layout(location = 0) out vec4 surface;
layout(location = 1) out vec4 albedo;
layout(location = 2) out vec4 visibility;

const float LEAST_CERTAIN = 0.1;  // where no frame is trusted

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    vec4 geometry = texel_at(geometry_map, pixel), colors = texel_at(albedo_map, pixel);
    if (colors.w == 0.0) discard;
    float inverse_depth = merged_inverse_depth(key_at(pixel), geometry.w, colors.w);
    vec3 normal = geometry.xyz == vec3(0.0) ? vec3(0.0) : normalize(geometry.xyz / colors.w);  // weights may be tiny
    if (CERTAINTY == 1) normal *= mean_certainty(length(geometry.xyz / colors.w), MARKED == 1 ? others / WANDERING : others);
    if (MARKED == 1 && colors.w < 2.0 * FALLBACK * (others + 1.0)) normal *= LEAST_CERTAIN / max(length(normal), 1e-6);
    if (AT_TARGET == 1) normal = target_normal(texelFetch(target_map, pixel, 0), normal);
    visibility = vec4(0.0, 0.0, 0.0, -1.0);
    if (VISIBILITY == 1) visibility = texel_at(visibility_map, pixel) / colors.w;
    surface = vec4(normal, scale / inverse_depth);
    albedo = vec4(colors.rgb / colors.w, material_number);
    gl_FragDepth = 1.0 - near * inverse_depth / scale;
}
