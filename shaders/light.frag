#version 330 core
#ifndef POINTS
#define POINTS 0
#endif
// Lights every texel of a picture of surfaces: the pixels of a view (phong), or with POINTS the points of a frame, whose
// light is then shown flat or interpolated (gouraud). Deferred shading: Deering et al. 1988.
#include "common/camera.glsl"
#include "common/color.glsl"
#include "common/lights.glsl"
#include "common/picture.glsl"

uniform sampler2D surface_map;  // unit normal, depth (0 is nothing)
uniform sampler2D albedo_map;   // of pixels linear, of points a picture: sRGB, of any size
uniform sampler2D lights;
uniform vec4 intrinsics;
uniform vec3 eye;  // in the axes of the surfaces, as the lights are
uniform vec4 material;
uniform vec3 ambient;
uniform int light_count;

out vec4 color;

void main() {
    ivec2 texel = ivec2(gl_FragCoord.xy);
    vec4 surface = texelFetch(surface_map, texel, 0);
    if (surface.w == 0.0) discard;
    vec2 pixel = gl_FragCoord.xy - 0.5;
#if POINTS
    vec3 albedo = srgb_to_linear(picture_at(albedo_map, pixel, vec2(textureSize(surface_map, 0))));
#else
    vec3 albedo = texelFetch(albedo_map, texel, 0).rgb;
#endif
    vec3 point = pixel_ray(pixel, intrinsics) * surface.w;
    vec3 lit = light_surface(point, eye, surface.xyz, albedo, material, ambient, lights, light_count);
#if POINTS
    color = vec4(lit, 1.0);
#else
    color = vec4(linear_to_srgb(lit), 1.0);
#endif
}
