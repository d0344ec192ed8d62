#include "common/lights.glsl"
#include "common/shadow.glsl"

// What light i sends to a point, without shadows; l is the unit vector to it, share what shadows leave of it. lights.glsl
// tells how a row of `lights` is laid out. to_world turns into the axes in which the six views of a light stand that
// shines to all sides.
vec3 sent_light(
    sampler2D lights, int i, vec3 point, vec3 n, sampler2D shadow_map, sampler2D views, mat3 to_world,
    out vec3 l, out float share
) {
    vec4 place = texelFetch(lights, ivec2(0, i), 0);
    vec3 light = texelFetch(lights, ivec2(1, i), 0).rgb;
    vec4 spot = texelFetch(lights, ivec2(3, i), 0);
    vec4 kind = texelFetch(lights, ivec2(4, i), 0);
    vec3 to_light = place.xyz * (place.w > 0.0 ? 1.0 : -1.0) - point * place.w;
    float distance = length(to_light);
    l = n;
    share = 1.0;
    if (distance == 0.0) return vec3(0.0);  // a light inside the surface has no side to shine from
    l = to_light / distance;
    if (place.w > 0.0) light *= attenuation(distance, texelFetch(lights, ivec2(2, i), 0).xyz);
    if (kind.w > 0.0) light *= max(dot(spot.xyz, -l), 0.0);
    else if (spot.xyz != vec3(0.0)) light *= spot_cone(spot.xyz, l, kind.xy);
    if (spot.w >= 0.0 && dot(n, l) > 0.0) {
        int face = kind.z > 1.0 ? cube_face(to_world * -l) : 0;
        share = light_share(shadow_map, views, int(spot.w) + face, point, n);
    }
    return light;
}

// As light_surface in lights.glsl, with spots and shadows.
vec3 light_surface_shadowed(
    vec3 point, vec3 eye, vec3 n, vec3 albedo, vec4 material, vec3 ambient, sampler2D lights, int count,
    sampler2D shadow_map, sampler2D views, mat3 to_world
) {
    vec3 v = normalize(eye - point);
    vec3 result = material.x * ambient * albedo;
    for (int i = 0; i < count; ++i) {
        vec3 l;
        float share;
        vec3 light = sent_light(lights, i, point, n, shadow_map, views, to_world, l, share);
        result += phong(n, v, l, albedo, material, light * share);
    }
    return clamp(result, 0.0, BRIGHTEST);
}
