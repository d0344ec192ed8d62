#include "common/lights.glsl"
#include "common/shadow.glsl"

// As light_surface in lights.glsl, which tells how a row of `lights` is laid out, with spots and shadows.
// to_world turns into the axes in which the six views of a light stand that shines to all sides.

vec3 light_surface_shadowed(
    vec3 point, vec3 eye, vec3 n, vec3 albedo, vec4 material, vec3 ambient, sampler2D lights, int count,
    sampler2D shadow_map, sampler2D views, mat3 to_world
) {
    vec3 v = normalize(eye - point);
    vec3 result = material.x * ambient * albedo;
    for (int i = 0; i < count; ++i) {
        vec4 place = texelFetch(lights, ivec2(0, i), 0);
        vec3 light = texelFetch(lights, ivec2(1, i), 0).rgb;
        vec4 spot = texelFetch(lights, ivec2(3, i), 0);
        vec3 kind = texelFetch(lights, ivec2(4, i), 0).xyz;
        vec3 to_light = place.xyz * (place.w > 0.0 ? 1.0 : -1.0) - point * place.w;
        float distance = length(to_light);
        if (distance == 0.0) continue;  // a light inside the surface has no side to shine from
        vec3 l = to_light / distance;
        if (place.w > 0.0) light *= attenuation(distance, texelFetch(lights, ivec2(2, i), 0).xyz);
        if (spot.xyz != vec3(0.0)) light *= spot_cone(spot.xyz, l, kind.xy);
        if (spot.w >= 0.0 && dot(n, l) > 0.0) {
            int face = kind.z > 1.0 ? cube_face(to_world * -l) : 0;
            light *= light_share(shadow_map, views, int(spot.w) + face, point, n);
        }
        result += phong(n, v, l, albedo, material, light);
    }
    return clamp(result, 0.0, 1.0);
}
