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
// The mesh between the pixels of a frame -> what the light pass reads. Colours are looked up in the picture, where the
// frame's camera saw the point. Normal 0 says: lit already.
#include "common/color.glsl"
#include "common/picture.glsl"
#include "common/surroundings.glsl"
#include "common/toksvig.glsl"
#include "meshes/visible_grid_point.glsl"

uniform sampler2D color_map;  // sRGB, of any size; where light is interpolated, linear light
uniform sampler2D certainty_map;
uniform float scale;  // of the object; the view does not contain it
uniform sampler2D visibility_map;
uniform float material_number;

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
    surface = vec4(normal, scale / seen.inverse_depth);
    if (SHADING == 2) albedo = vec4(grid_light(color_map, seen), material_number);
    else albedo = vec4(srgb_to_linear(picture_at(color_map, at, size)), material_number);
    gl_FragDepth = 1.0 - near * seen.inverse_depth;
}
