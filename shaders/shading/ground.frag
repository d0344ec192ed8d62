#version 330 core
// The ground below all objects, seen where no surface is: transparent, with black shadows of these alphas: those of
// lamps, and those in the light from all around.
#include "common/ground.glsl"
#include "shading/around.glsl"
#if VISIBILITY
#include "common/visibility.glsl"
#endif

uniform sampler2D surface_map;  // what the view shows: depth in w, 0 is nothing
uniform vec4 intrinsics;
uniform vec4 plane;  // unit normal that points up, and the eye's height above it
uniform vec4 material;
uniform sampler2D lights;
uniform vec3 ambient;
uniform int light_count;
uniform sampler2D shadow_map;
uniform sampler2D views;
uniform mat3 to_world;
#if VISIBILITY
uniform float radius;  // how far things may be that hide light from all around
uniform ivec2 shift;   // of the planes in which they are looked for
uniform float turned;  // and by how much these are turned, in half circles: few planes alike show as rays
#endif

out vec2 alpha;

void main() {
    if (texelFetch(surface_map, ivec2(gl_FragCoord.xy), 0).w != 0.0) discard;
    vec3 ray = pixel_ray(gl_FragCoord.xy - 0.5, intrinsics);
    float depth = ground_depth(ray, plane);
    if (depth == 0.0) discard;
    vec3 around = material.x * ambient, left = around;
    vec4 open = vec4(OPEN * plane.xyz, 1.0), visibility = open;
#if VISIBILITY
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    vec4 own = vec4(plane.xyz, depth);
    visibility = seen_from_plane(surface_map, pixel + shift, pixel, own, intrinsics, radius, turned);
    left *= visibility.w;
#endif
    if (ENVIRONMENT > 0) {
        around += material.y * environment_light(open, first_bands, second_bands, third_bands);
        left += material.y * environment_light(visibility, first_bands, second_bands, third_bands);
    }
    alpha = shadow_alpha(
        ray * depth, plane.xyz, material, around, left, lights, light_count, shadow_map, views, to_world
    );
}
