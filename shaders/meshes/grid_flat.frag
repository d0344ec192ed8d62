#version 330 core
#ifndef LOOK_UP
#define LOOK_UP 0
#endif
#ifndef SHADOWS
#define SHADOWS 0  // 1: lights may be spots and cast shadows; 2: some are larger than points
#endif
// The mesh between the pixels of a frame, each triangle lit at its middle. Normal 0 says so to the light pass.
#include "common/color.glsl"
#include "common/picture.glsl"
#include "common/shadowed_lights.glsl"
#include "shading/around.glsl"
#include "meshes/visible_grid_point.glsl"

uniform sampler2D color_map;
uniform vec4 material;
uniform sampler2D lights;
uniform vec3 ambient;
uniform int light_count;
uniform sampler2D shadow_map;
uniform sampler2D views;
uniform mat3 to_world;
uniform float scale;  // of the object; the view does not contain it
uniform float material_number;

layout(location = 0) out vec4 surface;
layout(location = 1) out vec4 albedo;
layout(location = 2) out vec4 visibility;  // share -1: not known

void main() {
    GridSeen seen = find_seen();
    vec3 middle, facet;
    grid_facet(surface_map, seen, source, middle, facet);
    vec2 at = seen.is_whole ? project(middle, source) : floor(project(middle, source) + 0.5);
    vec3 color = srgb_to_linear(picture_at(color_map, at, vec2(textureSize(surface_map, 0))));
    vec3 place = scale * (mat3(view) * middle + view[3].xyz), n = mat3(view) * facet, eye = vec3(0.0);
    vec3 lit;
    if (SHADOWS > 0) {
        lit = light_surface_shadowed(
            place, eye, n, color, material, ambient, lights, light_count, shadow_map, views, to_world
        );
    } else {
        lit = light_surface(place, eye, n, color, material, ambient, lights, light_count);
    }
    visibility = vec4(0.0, 0.0, 0.0, -1.0);
    if (ENVIRONMENT > 0) lit += light_from_around(vec4(OPEN * n, 1.0), normalize(-place), n, color, material, 0.0);
    surface = vec4(vec3(0.0), scale / seen.inverse_depth);
    albedo = vec4(lit, material_number);
    gl_FragDepth = 1.0 - near * seen.inverse_depth;
}
