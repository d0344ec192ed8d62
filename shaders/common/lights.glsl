#include "common/phong.glsl"

const float BRIGHTEST = 65504.0;  // of half floats, in which pages keep light; pictures cut it off at 1, where they are encoded

// Share of a spot's light in a direction `l` to it: 1 inside the inner cone, 0 outside the outer.
float spot_cone(vec3 direction, vec3 l, vec2 cosines) {
    float inside = (dot(direction, -l) - cosines.y) / max(cosines.x - cosines.y, 1e-4);
    inside = clamp(inside, 0.0, 1.0);
    return inside * inside * (3.0 - 2.0 * inside);
}

// All lights on one surface point, seen by an eye; all in the same axes. One row of `lights` a light:
// texel 0 position, or direction of travel; w is 1 for a position, 0 for a direction
// texel 1 colour times intensity, linear
// texel 2 attenuation (constant, linear, quadratic)
// texel 3 direction of a spot or an area light, 0 for other lights; w is the number of its first shadow view, -1 without
// texel 4 cosines of a spot's inner and outer cone; how many shadow views it has: 0, 1 or 6; w is 1 for an area light
// The last two are for shadowed_lights.glsl: here no light is a spot or an area light, or casts a shadow.

// What the light of a row adds to a point; the row's texels are its columns.
vec3 light_of_row(mat4 row, vec3 point, vec3 v, vec3 n, vec3 albedo, vec4 material) {
    vec4 place = row[0];
    vec3 light = row[1].rgb;
    vec3 to_light = place.xyz * (place.w > 0.0 ? 1.0 : -1.0) - point * place.w;
    float distance = length(to_light);
    if (distance == 0.0) return vec3(0.0);  // a light inside the surface has no side to shine from
    if (place.w > 0.0) light *= attenuation(distance, row[2].xyz);
    return phong(n, v, to_light / distance, albedo, material, light);
}

vec3 light_surface(
    vec3 point, vec3 eye, vec3 n, vec3 albedo, vec4 material, vec3 ambient, sampler2D lights, int count
) {
    vec3 v = normalize(eye - point);
    vec3 result = material.x * ambient * albedo;
    for (int i = 0; i < count; ++i) {
        vec4 place = texelFetch(lights, ivec2(0, i), 0);
        vec4 light = texelFetch(lights, ivec2(1, i), 0);
        vec4 fading = place.w > 0.0 ? texelFetch(lights, ivec2(2, i), 0) : vec4(0.0);
        result += light_of_row(mat4(place, light, fading, vec4(0.0)), point, v, n, albedo, material);
    }
    return clamp(result, 0.0, BRIGHTEST);
}

// The same for one light, whose row is a uniform: faster than a texture.
vec3 light_surface_alone(vec3 point, vec3 eye, vec3 n, vec3 albedo, vec4 material, vec3 ambient, mat4 row) {
    vec3 v = normalize(eye - point);
    vec3 result = material.x * ambient * albedo + light_of_row(row, point, v, n, albedo, material);
    return clamp(result, 0.0, BRIGHTEST);
}
