#version 330 core
#ifndef COARSE
#define COARSE 0  // 1: the sums are half floats, too coarse for depth: it is that of the front surface
#endif
#ifndef MARKED
#define MARKED 0  // 1: to show doubts: normals are as long as those of the points agree
#endif
// The sums of blend.frag -> what the light pass reads, among the surfaces of other objects.
#include "common/cloud_splat.glsl"
#include "common/toksvig.glsl"

uniform sampler2D geometry_map;
uniform sampler2D albedo_map;
uniform sampler2D front;  // depth of the front surface; 0: nothing
uniform vec4 target;
uniform float near;
uniform bool is_lit;
uniform float material_number;

layout(location = 0) out vec4 surface;
layout(location = 1) out vec4 albedo;
layout(location = 2) out vec4 visibility;  // share -1: not known

// The mean normal at an outline: splats that lie behind it were turned to the viewer by mistake. What is nearer beside
// the pixel belongs to the same surface.
vec3 turned_as_beside(vec3 normal, float inverse_depth, ivec2 pixel) {
    vec3 ray = normalize(pixel_ray(vec2(pixel), target));
    int turns = abs(dot(normal, ray)) < OUTLINE ? 3 : 0;  // no constant: software drivers would always take them
    vec3 beside = vec3(0.0);
    for (int y = 0; y < turns; ++y) {
        for (int x = 0; x < 3; ++x) {
            ivec2 at = clamp(pixel + ivec2(x - 1, y - 1), ivec2(0), textureSize(geometry_map, 0) - 1);
            vec4 geometry = texelFetch(geometry_map, at, 0);
            float own = inverse_depth * texelFetch(albedo_map, at, 0).w;
            beside += geometry.w > own ? geometry.xyz : vec3(0.0);
        }
    }
    return outline_normal(normal, beside, ray);
}

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    if (texelFetch(front, pixel, 0).r == 0.0) discard;
    vec4 colors = texelFetch(albedo_map, pixel, 0), geometry = texelFetch(geometry_map, pixel, 0);
    int rows = colors.w == 0.0 ? 3 : 0;  // a hole that no splat reaches has what is beside it
    for (int y = 0; y < rows; ++y) {
        for (int x = 0; x < 3; ++x) {
            ivec2 at = clamp(pixel + ivec2(x - 1, y - 1), ivec2(0), textureSize(albedo_map, 0) - 1);
            colors += texelFetch(albedo_map, at, 0);
            geometry += texelFetch(geometry_map, at, 0);
        }
    }
    if (colors.w == 0.0) discard;
    geometry /= colors.w;
    float certain = length(geometry.xyz);
    vec3 normal = is_lit && certain > 0.0 ? turned_as_beside(geometry.xyz / certain, geometry.w, pixel) : vec3(0.0);
    if (MARKED == 1 && certain > 0.0) normal *= normal_certainty(WANDERING * max(1.0 / certain - 1.0, 0.0));
    float inverse_depth = COARSE == 1 ? 1.0 / texelFetch(front, pixel, 0).r : geometry.w;
    visibility = vec4(0.0, 0.0, 0.0, -1.0);
    surface = vec4(normal, 1.0 / inverse_depth);
    albedo = vec4(colors.rgb / colors.w, material_number);
    gl_FragDepth = 1.0 - near * inverse_depth;
}
