#version 330 core
#ifndef SHADOWS
#define SHADOWS 0  // 1: lights may be spots and cast shadows
#endif
// The triangles between the pixels of a frame, each lit at its middle. Normal 0 says so to the light pass.
#include "common/color.glsl"
#include "common/grid.glsl"
#include "common/picture.glsl"
#include "common/shadowed_lights.glsl"

uniform sampler2D color_map;
uniform vec2 source_size;
uniform vec4 source;
uniform mat4 view;
uniform float scale;
uniform float material_number;
uniform vec4 material;
uniform sampler2D lights;
uniform vec3 ambient;
uniform int light_count;
uniform sampler2D shadow_map;
uniform sampler2D views;
uniform mat3 to_world;

in vec3 point;
flat in vec3 middle;
flat in vec3 facet;
flat in float is_whole;

layout(location = 0) out vec4 surface;
layout(location = 1) out vec4 albedo;

void main() {
    surface = vec4(0.0, 0.0, 0.0, scale * (mat3(view) * point + view[3].xyz).z);
    vec2 at = triangle_position(project(middle, source), is_whole > 0.5);
    vec3 color = srgb_to_linear(picture_at(color_map, at, source_size));
    vec3 place = scale * (mat3(view) * middle + view[3].xyz), n = mat3(view) * facet, eye = vec3(0.0);
    vec3 lit;
    if (SHADOWS == 1) {
        lit = light_surface_shadowed(
            place, eye, n, color, material, ambient, lights, light_count, shadow_map, views, to_world
        );
    } else {
        lit = light_surface(place, eye, n, color, material, ambient, lights, light_count);
    }
    albedo = vec4(lit, material_number);
}
