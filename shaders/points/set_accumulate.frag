#version 330 core
#ifndef LOOK_UP
#define LOOK_UP 0
#endif
#ifndef EXACT
#define EXACT 0  // 1: one of several frames without noise
#endif
#ifndef VISIBILITY
#define VISIBILITY 0  // 1: it is known what the points see of the light from all around
#endif
#ifndef CALM
#define CALM 0  // 1: normals for light are not those of the surface
#endif
#ifndef SHADING
#define SHADING 3  // one program for each model: software drivers run both sides of every branch
#endif
// What one of several frames adds to the pixels of a view: sums, each value times the weight. SHADING as in
// resolve_surfaces.frag; none and phong add the picture's colours, flat and gouraud the points' light.
#include "common/color.glsl"
#include "common/parts.glsl"
#include "common/surroundings.glsl"
#include "points/set_visibility.glsl"

uniform sampler2D surface_map;
uniform sampler2D color_map;  // none and phong: sRGB, of any size
uniform sampler2D light_map;  // flat and gouraud: the points' light, linear
uniform sampler2D trust_map;
uniform sampler2D light_normals;
uniform sampler2D visibility_map;
uniform vec4 source;
uniform vec4 target;
uniform mat4 view;
uniform float band;
uniform float importance;  // of the frame in this view
uniform vec3 gain;         // of its exposure

layout(location = 0) out vec4 geometry;  // normal of phong, target axes; by which share 1/z differs from the nearest splat's
layout(location = 1) out vec4 albedo;    // linear; the weight
layout(location = 2) out vec4 visibility;

const float INNER = 0.3;  // quality of points with neighbours on all sides

void main() {
    uint key = key_at(ivec2(gl_FragCoord.xy));
    if (key == 0u) discard;
    float inverse_depth = key_inverse_depth(key);
    vec2 size = vec2(textureSize(surface_map, 0)), pixel = gl_FragCoord.xy - 0.5;
    Seen seen = look_twice(surface_map, inverse_depth, (key & 1u) == 1u, pixel, source, view, target, band);
    if (!part_is_known(seen, size)) discard;

    vec4 corner = seen_weights(seen, source);
    vec3 linear = vec3(0.0);
    vec2 trust = texel_at(trust_map, seen.pixel).rg, at = color_position(seen, corner);
    float off = seen.inverse_depth / inverse_depth - 1.0;
    float across = off * share_across(seen.own.xyz, pixel, view, target);
    float weight = importance * trust.x * trust.y * agreement(across, band) * view_weight(seen, pixel, source, view, target, EXACT == 1);
    if (SHADING == 0 || SHADING == 3) {
        vec3 encoded = picture_at(color_map, at, size);
        bool is_inside = trust.y > INNER && at == seen.at && size == vec2(textureSize(color_map, 0));
        int sharp = EXACT == 1 && is_inside && weight > 0.0 ? 1 : 0;  // a loop that no pixel takes costs little
        for (int k = 0; k < sharp; ++k) encoded = sample_sharply(color_map, at);
        linear = srgb_to_linear(encoded);
    }
    if (SHADING == 1) linear = texelFetch(light_map, seen.pixel, 0).rgb;
    if (SHADING == 2) linear = mix_light(seen, corner, light_map);
    vec3 normal = vec3(0.0);
    if (SHADING == 3) {
        normal = CALM == 1 ? normalize(mix_light(seen, corner, light_normals)) : mix_normal(seen, corner);
        normal = mat3(view) * normal;
    }

    float total = weight + fallback_weight(across, band);
    visibility = VISIBILITY == 1 ? total * carried_visibility(visibility_map, at, size, mat3(view)) : vec4(0.0);
    geometry = vec4(total * normal, weight * off);
    albedo = vec4(total * gain * linear, total);
}
