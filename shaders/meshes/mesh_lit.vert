#version 330 core
#ifndef COPIES
#define COPIES 0  // 1: many copies of a mesh, each at its place
#endif
// A mesh that is lit at its corners (gouraud) or once per triangle (flat: every corner is lit at the middle).
#include "common/shadowed_lights.glsl"
#include "common/surroundings.glsl"

#if COPIES
in mat4 view;               // node axes to target axes
in mat3 normal_view;        // inverse transpose of view
#else
uniform mat4 view;
uniform mat3 normal_view;
#endif
uniform vec4 target;
uniform vec2 target_size;
uniform float near;
uniform sampler2D lights;
uniform int light_count;
uniform vec3 ambient;
uniform vec4 material;
uniform sampler2D shadow_map;
uniform sampler2D views;
uniform mat3 to_world;
uniform mat3 first_bands;  // of an environment, see surroundings.glsl; 0 without
uniform mat3 second_bands;
uniform mat3 third_bands;

in vec3 position;
in vec3 lit_at;  // the triangle's middle for flat
in vec3 normal;
in vec2 uv;
in vec3 tint;  // linear colour less white: 0 without one

out vec3 diffuse;   // light to multiply with the albedo
out vec3 specular;
out vec2 texture_uv;
out vec3 corner_tint;
out float depth;

void main() {
    vec3 point = (view * vec4(position, 1.0)).xyz;
    vec3 lit_point = (view * vec4(lit_at, 1.0)).xyz;
    vec3 n = normalize(normal_view * normal);
    if (dot(n, lit_point) > 0.0) n = -n;
    vec4 matt = vec4(material.xy, 0.0, material.w);
    vec4 shiny = vec4(0.0, 0.0, material.zw);
    diffuse = light_surface_shadowed(
        lit_point, vec3(0.0), n, vec3(1.0), matt, ambient, lights, light_count, shadow_map, views, to_world
    );
    diffuse += material.y * environment_light(vec4(OPEN * n, 1.0), first_bands, second_bands, third_bands);
    specular = light_surface_shadowed(
        lit_point, vec3(0.0), n, vec3(0.0), shiny, ambient, lights, light_count, shadow_map, views, to_world
    );
    texture_uv = uv;
    corner_tint = tint;
    depth = point.z;
    vec2 pixel = target.xy * point.xy + (target.zw + 0.5) * point.z;
    gl_Position = vec4(2.0 * pixel / target_size - point.z, point.z - 2.0 * near, point.z);
}
