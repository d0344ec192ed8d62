#version 330 core
// The ground below all objects, seen where no surface is: transparent, with black shadows of this alpha.
#include "common/ground.glsl"

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

out float alpha;

void main() {
    if (texelFetch(surface_map, ivec2(gl_FragCoord.xy), 0).w != 0.0) discard;
    vec3 ray = pixel_ray(gl_FragCoord.xy - 0.5, intrinsics);
    float depth = ground_depth(ray, plane);
    if (depth == 0.0) discard;
    alpha = shadow_alpha(
        ray * depth, plane.xyz, material, ambient, lights, light_count, shadow_map, views, to_world
    );
}
