#version 330 core
#ifndef POINTS
#define POINTS 0
#endif
#ifndef SCENE
#define SCENE 0  // spots, shadows, a material for each object, and surfaces that are lit already
#endif
// Lights every texel of a picture of surfaces: the pixels of a view (phong), or with POINTS the points of a frame, whose
// light is then shown flat or interpolated (gouraud). Deferred shading: Deering et al. 1988.
#include "common/camera.glsl"
#include "common/color.glsl"
#include "common/lights.glsl"
#include "common/picture.glsl"
#include "common/scene_light.glsl"

uniform sampler2D surface_map;  // unit normal, depth (0 is nothing)
uniform sampler2D albedo_map;   // of pixels linear, of points a picture: sRGB, of any size
uniform sampler2D lights;
uniform vec4 intrinsics;
uniform vec3 eye;  // in the axes of the surfaces, as the lights are
#if SCENE
uniform sampler2D shadow_map;
uniform sampler2D views;
uniform mat3 to_world;
uniform float scale;  // of the points' object
#endif
#if SCENE && !POINTS
uniform sampler2D materials;  // a row each
#else
uniform vec4 material;
#endif
uniform vec3 ambient;
uniform int light_count;

out vec4 color;

void main() {
    vec2 texel = gl_FragCoord.xy * (1.0 / vec2(textureSize(surface_map, 0)));  // quicker than texelFetch on llvmpipe
    vec4 surface = textureLod(surface_map, texel, 0.0);
    if (surface.w == 0.0) discard;
    vec2 pixel = gl_FragCoord.xy - 0.5;
#if POINTS
    vec3 albedo = srgb_to_linear(picture_at(albedo_map, pixel, vec2(textureSize(surface_map, 0))));
#else
    vec4 texel_albedo = textureLod(albedo_map, texel, 0.0);
    vec3 albedo = texel_albedo.rgb;
#endif
    vec3 point = pixel_ray(pixel, intrinsics) * surface.w;
#if SCENE && POINTS
    point *= scale;
#endif
#if SCENE && POINTS
    vec3 lit = scene_light(
        point, eye, surface.xyz, albedo, material, ambient, lights, light_count, shadow_map, views, to_world
    );
#elif SCENE
    vec4 material = texelFetch(materials, ivec2(0, int(texel_albedo.a * 65535.0 + 0.5) - 1), 0);
    vec3 lit = surface.xyz == vec3(0.0) ? albedo : scene_light(
        point, eye, surface.xyz, albedo, material, ambient, lights, light_count, shadow_map, views, to_world
    );
#else
    vec3 lit = light_surface(point, eye, surface.xyz, albedo, material, ambient, lights, light_count);
#endif
#if POINTS
    color = vec4(lit, 1.0);
#else
    color = vec4(linear_to_srgb(lit), 1.0);
#endif
}
