#version 330 core
#ifndef LOOK_UP
#define LOOK_UP 0
#endif
#ifndef SHADING
#define SHADING 3  // one program for each model: software drivers run both sides of every branch
#endif
#ifndef VISIBILITY
#define VISIBILITY 0  // 1: it is known what the points see of the light from all around
#endif
#ifndef CALM
#define CALM 0  // 1: normals for light are not those of the surface
#endif
#ifndef CERTAINTY
#define CERTAINTY 0  // 1: some normals are uncertain
#endif
#ifndef SHARED
#define SHARED 0  // the albedo is the mean of all samples, and depth negative where more than that may change in a pixel;
                  // 2: the picture has the frame's size, and its sides are those of the view
#endif
// What each pixel of the view shows -> what the light pass reads. SHADING 3 (phong): normal and albedo, interpolated.
// 0 to 2 (as in resolve_picture.frag): the light itself, with normal 0, which means: already lit.
#include "common/color.glsl"
#include "common/pixel_mean.glsl"
#include "common/surroundings.glsl"
#include "common/toksvig.glsl"
#include "points/visible_point.glsl"

uniform sampler2D color_map;  // none and phong: sRGB, of any size
uniform sampler2D light_map;  // flat and gouraud: the points' light, linear
uniform sampler2D certainty_map;
uniform sampler2D light_normals;
uniform float near;
uniform float scale;  // of the object; the view does not contain it
uniform sampler2D visibility_map;
uniform float material_number;
uniform int samples;

layout(location = 0) out vec4 surface;  // normal as long as it is certain, depth, both in target axes
layout(location = 1) out vec4 albedo;   // linear; number of the material
layout(location = 2) out vec4 visibility;  // bent normal, share; the share -1 where it is not known

void main() {
    Seen seen = find_seen();
    vec2 size = vec2(textureSize(surface_map, 0));
    vec3 normal = vec3(0.0);
    vec3 linear = vec3(0.0);
    bool is_even = true;
    visibility = vec4(0.0, 0.0, 0.0, -1.0);
    if (SHADING == 0) linear = srgb_to_linear(picture_at(color_map, vec2(seen.pixel), size));
    if (SHADING == 1) linear = texelFetch(light_map, seen.pixel, 0).rgb;
    if (SHADING == 2) linear = mix_light(seen, seen_weights(seen, source), light_map);
    if (SHADING == 3) {
        vec4 weight = seen_weights(seen, source);
        normal = mat3(view) * (CALM == 1 ? normalize(mix_light(seen, weight, light_normals)) : mix_normal(seen, weight));
        if (CERTAINTY == 1) normal *= certainty_at(certainty_map, seen.at, size);
        vec2 at = color_position(seen, weight);
        if (SHARED > 0) {
            mat2 wide = source_step(gl_FragCoord.xy - 0.5, target, view, source);
            if (SHARED == 1) linear = mean_color(color_map, seen.at, wide, size, samples);
            else linear = mean_of_nine(color_map, seen.at, vec2(wide[0].x, wide[1].y), samples);
            vec2 pixel = vec2(seen.pixel);
            vec2 slope = inverse_depth_slope(seen.own.xyz, pixel_ray(pixel, source), seen.own.w, source);
            is_even = are_on_surface(seen.corners, pixel, 1.0 / seen.own.w, slope) && shows_all(wide);
        } else {
            linear = srgb_to_linear(picture_at(color_map, at, size));
        }
        if (VISIBILITY == 1) visibility = carried_visibility(visibility_map, at, size, mat3(view));
    }
    surface = vec4(normal, is_even ? scale / seen.inverse_depth : -scale / seen.inverse_depth);
    albedo = vec4(linear, material_number);
    gl_FragDepth = 1.0 - near * seen.inverse_depth / scale;
}
