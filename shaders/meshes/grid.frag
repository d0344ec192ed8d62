#version 330 core
#ifndef LOOK_UP
#define LOOK_UP 0
#endif
#ifndef SHADING
#define SHADING 3  // 0: the colours as they are; 2: the light of the pixels interpolated; 3: their normals
#endif
#ifndef VISIBILITY
#define VISIBILITY 0  // 1: it is known what the points see of the light from all around
#endif
#ifndef CERTAINTY
#define CERTAINTY 0  // 1: some normals are uncertain
#endif
#ifndef SHARED
#define SHARED 0  // as in resolve_surfaces.frag
#endif
// The mesh between the pixels of a frame -> what the light pass reads. Colours are looked up in the picture, where the
// frame's camera saw the point. Normal 0 says: lit already.
#include "common/color.glsl"
#include "common/pixel_mean.glsl"
#include "common/surroundings.glsl"
#include "common/toksvig.glsl"
#include "meshes/visible_grid_point.glsl"

uniform sampler2D color_map;  // sRGB, of any size; where light is interpolated, linear light
uniform sampler2D certainty_map;
uniform float scale;  // of the object; the view does not contain it
uniform sampler2D visibility_map;
uniform float material_number;
uniform int samples;

layout(location = 0) out vec4 surface;
layout(location = 1) out vec4 albedo;
layout(location = 2) out vec4 visibility;  // bent normal, share; the share -1 where it is not known

void main() {
    GridSeen seen = find_seen();
    vec2 size = vec2(textureSize(surface_map, 0)), at = grid_color_position(seen);
    vec3 normal = vec3(0.0);
    if (SHADING == 3) normal = mat3(view) * grid_normal(surface_map, seen);
    if (CERTAINTY == 1) normal *= certainty_at(certainty_map, at, size);
    visibility = vec4(0.0, 0.0, 0.0, -1.0);
    if (VISIBILITY == 1) visibility = carried_visibility(visibility_map, at, size, mat3(view));
    bool is_even = true;
    if (SHARED > 0) {
        mat2 wide = source_step(gl_FragCoord.xy - 0.5, target, view, source);
        vec3 mean;
        if (SHARED == 1) mean = mean_color(color_map, at, wide, size, samples);
        else mean = mean_of_nine(color_map, at, vec2(wide[0].x, wide[1].y), samples);
        albedo = vec4(mean, material_number);
        is_even = seen.is_whole && shows_all(wide);
    } else if (SHADING == 2) {
        albedo = vec4(grid_light(color_map, seen), material_number);
    } else {
        albedo = vec4(srgb_to_linear(picture_at(color_map, at, size)), material_number);
    }
    surface = vec4(normal, is_even ? scale / seen.inverse_depth : -scale / seen.inverse_depth);
    gl_FragDepth = 1.0 - near * seen.inverse_depth;
}
