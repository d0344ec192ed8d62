#include "common/shadowed_lights.glsl"

const vec3 LUMINANCE = vec3(0.2126, 0.7152, 0.0722);  // of linear RGB (ITU-R BT.709)

// How far away, in z, a ray with z = 1 meets a plane (unit normal that points up, and the eye's height above it); 0 where
// it does not, or the eye is below.
float ground_depth(vec3 ray, vec4 plane) {
    float down = -dot(plane.xyz, ray);
    return down > 0.0 && plane.w > 0.0 ? plane.w / down : 0.0;
}

// Shares of the light that shadows take from a point of a matt white ground, of that of lamps and of that from all around;
// n is its normal. A background behind a black layer of their sum as alpha looks as if the shadows fell on it. around: the
// light from all around, and what is left of it
vec2 shadow_alpha(
    vec3 point, vec3 n, vec4 material, vec3 around, vec3 left, sampler2D lights, int count,
    sampler2D shadow_map, sampler2D views, mat3 to_world
) {
    vec3 whole = around;
    vec3 lost = vec3(0.0);
    for (int i = 0; i < count; ++i) {
        vec3 l;
        float share;
        vec3 light = sent_light(lights, i, point, n, shadow_map, views, to_world, l, share);
        light *= material.y * max(dot(n, l), 0.0);
        whole += light;
        lost += light * (1.0 - share);
    }
    return vec2(dot(lost, LUMINANCE), dot(around - left, LUMINANCE)) / max(dot(whole, LUMINANCE), 1e-9);
}
