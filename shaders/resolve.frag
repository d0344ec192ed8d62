#version 330 core
// Looks every visible pixel up in its frame and lights it once (deferred shading: Deering et al. 1988).
#include "common/color.glsl"
#include "common/lights.glsl"
#include "common/surface.glsl"

uniform isampler2D source_ids;
uniform sampler2D depth_map;
uniform sampler2D normal_map;
uniform sampler2D color_map;
uniform sampler2D lights;
uniform vec4 source;
uniform vec4 target;
uniform mat4 view;
uniform int first_id;  // of the first pixel; 0 stands for nothing
uniform int shading;
uniform vec4 material;
uniform vec3 ambient;
uniform int light_count;

out vec4 color;

const int NONE = 0;
const int FLAT = 1;
const int GOURAUD = 2;

vec3 picture_at(vec2 pixel) {
    return texture(color_map, (pixel + 0.5) / vec2(textureSize(depth_map, 0))).rgb;
}

vec3 lit(vec3 source_point, vec3 source_normal, vec3 albedo) {
    vec3 point = (view * vec4(source_point, 1.0)).xyz;
    return light_surface(point, mat3(view) * source_normal, albedo, material, ambient, lights, light_count);
}

void main() {
    ivec2 size = textureSize(depth_map, 0);
    int index = texelFetch(source_ids, ivec2(gl_FragCoord.xy), 0).r - first_id;
    if (index < 0 || index >= size.x * size.y) discard;
    ivec2 texel = ivec2(index % size.x, index / size.x);
    vec2 pixel = vec2(texel);
    vec3 own = picture_at(pixel);
    if (shading == NONE) {
        color = vec4(own, 1.0);
        return;
    }
    float z = texelFetch(depth_map, texel, 0).r;
    vec3 normal = texelFetch(normal_map, texel, 0).xyz;
    vec3 albedo = srgb_to_linear(own);
    Footprint splat = carry_footprint(pixel, z, normal, source, view, target);
    vec2 at = source_position(splat, pixel, gl_FragCoord.xy - 0.5);
    if (shading == FLAT || all(lessThan(abs(at - pixel), vec2(0.001)))) {
        color = vec4(linear_to_srgb(lit(pixel_ray(pixel, source) * z, normal, albedo)), 1.0);
        return;
    }

    float w = 1.0 / z;
    vec2 slope = inverse_depth_slope(normal, pixel_ray(pixel, source), z, source);
    float total = 0.0;
    vec3 mixed_color = vec3(0.0);
    vec3 mixed_normal = vec3(0.0);
    for (int k = 0; k < 4; ++k) {
        ivec2 corner = ivec2(floor(at)) + ivec2(k & 1, k >> 1);
        float weight = neighbour_weight(depth_map, corner, at, pixel, w, slope);
        if (weight == 0.0) continue;
        vec3 n = texelFetch(normal_map, corner, 0).xyz;
        vec3 c = srgb_to_linear(picture_at(vec2(corner)));
        if (shading == GOURAUD) c = lit(pixel_ray(vec2(corner), source) * texelFetch(depth_map, corner, 0).r, n, c);
        mixed_color += weight * c;
        mixed_normal += weight * n;
        total += weight;
    }
    bool alone = total < 0.001;  // no neighbour on this surface: the splat speaks for itself
    if (!alone) albedo = mixed_color / total;
    if (!alone) normal = normalize(mixed_normal);
    vec3 result = albedo;
    if (shading != GOURAUD || alone) result = lit(point_on_plane(at, pixel, w, slope, source), normal, albedo);
    color = vec4(linear_to_srgb(result), 1.0);
}
