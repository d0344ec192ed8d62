#version 330 core
#ifndef SHADING
#define SHADING 3  // one program a model: software drivers run both sides of every branch
#endif
// Looks every visible pixel up in its frame and lights it once (deferred shading: Deering et al. 1988).
#include "common/color.glsl"
#include "common/lights.glsl"
#include "common/picture.glsl"
#include "common/surface.glsl"

uniform isampler2D source_ids;
uniform sampler2D surface_map;  // unit normal, depth
uniform sampler2D color_map;
uniform sampler2D lights;
uniform vec4 source;
uniform vec4 target;
uniform mat4 view;
uniform int first_id;  // of the first pixel; 0 stands for nothing
uniform vec4 material;
uniform vec3 ambient;
uniform int light_count;

out vec4 color;

const int NONE = 0;  // 3 is phong
const int FLAT = 1;
const int GOURAUD = 2;

// The colour picture at a position of the depth picture; their sizes may differ.
vec3 picture_at(vec2 pixel) {
    vec2 position = rescale_position(pixel, vec2(textureSize(surface_map, 0)), vec2(textureSize(color_map, 0)));
    return sample_picture(color_map, position);
}

vec3 lit(vec3 source_point, vec3 source_normal, vec3 encoded_albedo) {
    vec3 point = (view * vec4(source_point, 1.0)).xyz;
    vec3 albedo = srgb_to_linear(encoded_albedo);
    return light_surface(point, mat3(view) * source_normal, albedo, material, ambient, lights, light_count);
}

void main() {
    ivec2 size = textureSize(surface_map, 0);
    int index = texelFetch(source_ids, ivec2(gl_FragCoord.xy), 0).r - first_id;
    if (index < 0 || index >= size.x * size.y) discard;
    ivec2 texel = ivec2(index % size.x, index / size.x);
    vec2 pixel = vec2(texel);
    if (SHADING == NONE) {
        color = vec4(picture_at(pixel), 1.0);
        return;
    }
    vec4 own = texelFetch(surface_map, texel, 0);
    vec3 ray = pixel_ray(pixel, source);
    if (SHADING == FLAT) {
        color = vec4(linear_to_srgb(lit(ray * own.w, own.xyz, picture_at(pixel))), 1.0);
        return;
    }

    Footprint splat = carry_footprint(pixel, own.w, own.xyz, source, view, target);
    vec2 at = source_position(splat, pixel, gl_FragCoord.xy - 0.5);
    float w = 1.0 / own.w;
    vec2 slope = inverse_depth_slope(own.xyz, ray, own.w, source);
    float total = 0.0;
    vec3 mixed_normal = vec3(0.0);
    vec3 mixed_light = vec3(0.0);
    bool whole = true;
    for (int k = 0; k < 4; ++k) {
        ivec2 corner = clamp(ivec2(floor(at)) + ivec2(k & 1, k >> 1), ivec2(0), size - 1);
        vec4 there = texelFetch(surface_map, corner, 0);
        float weight = neighbour_weight(there.w, vec2(corner), at, pixel, w, slope);
        whole = whole && weight > 0.0;
        if (weight == 0.0) continue;
        mixed_normal += weight * there.xyz;
        if (SHADING == GOURAUD) {
            vec2 position = vec2(corner);
            mixed_light += weight * lit(pixel_ray(position, source) * there.w, there.xyz, picture_at(position));
        }
        total += weight;
    }
    vec3 result;
    if (SHADING == GOURAUD && total > 0.001) {
        result = mixed_light / total;
    } else {
        // With neighbours all round the colour is taken between pixels too; at an edge it would take the other side's.
        vec3 albedo = picture_at(whole ? at : pixel);
        vec3 normal = total > 0.001 ? normalize(mixed_normal) : own.xyz;
        result = lit(point_on_plane(at, pixel, w, slope, source), normal, albedo);
    }
    color = vec4(linear_to_srgb(result), 1.0);
}
