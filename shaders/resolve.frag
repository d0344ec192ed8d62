#version 330 core
#ifndef SHADING
#define SHADING 3  // one program a model: software drivers run both sides of every branch
#endif
#ifndef LOOK_UP
#define LOOK_UP 0
#endif
#ifndef LIT
#define LIT 0
#endif
#ifndef SCENE
#define SCENE 0  // one of several objects: surfaces for every shading, with depth; no normal means lit already
#endif
// What each pixel of the view shows, found in the frame. SHADING 0 (none): the picture's own colour; 1 (flat): the light
// of the point; 2 (gouraud): the light of the points round it, interpolated; 3 (phong): normal and albedo, interpolated,
// for the light pass, or with LIT lit at once, to the same bits. Nothing blends across an edge.
// Points drew which source pixel is seen; the compute rasteriser (LOOK_UP) only how far it is, which tells where to look.
#include "common/color.glsl"
#include "common/lights.glsl"
#include "common/picture.glsl"
#include "common/surface.glsl"

#if LOOK_UP
layout(std430, binding = 0) restrict readonly buffer Nearest { uint nearest[]; };  // bits of 1/z, 0 is nothing
#else
uniform isampler2D source_ids;
uniform int first_id;  // of the first pixel; 0 stands for nothing
#endif
uniform sampler2D surface_map;  // unit normal, depth
uniform sampler2D color_map;    // sRGB, of any size; the points' linear light for flat and gouraud
uniform vec4 source;
uniform vec4 target;
uniform mat4 view;
uniform ivec2 target_size;

#if LIT
uniform sampler2D lights;
uniform vec4 material;
uniform vec3 ambient;
uniform int light_count;
#endif

#if SCENE
uniform float near;
uniform float scale;  // of the object; the view is without it
uniform float material_number;
#endif

#if SHADING == 3 && !LIT || SCENE
layout(location = 0) out vec4 surface;  // unit normal, depth, both in target axes
layout(location = 1) out vec4 albedo;   // linear
#else
out vec4 color;
#endif

ivec2 size = textureSize(surface_map, 0);

// A sampler read at the texel's centre is quicker than texelFetch on llvmpipe.
vec4 surface_at(ivec2 texel) {
    return textureLod(surface_map, (vec2(texel) + 0.5) * (1.0 / vec2(size)), 0.0);
}

void main() {
    vec2 target_pixel = gl_FragCoord.xy - 0.5;

    // Where in the source picture: `at`, and 1/z there. What the frame has at the four corners round it.
#if LOOK_UP
    float inverse_depth = uintBitsToFloat(nearest[int(gl_FragCoord.y) * target_size.x + int(gl_FragCoord.x)]);
    if (inverse_depth == 0.0) discard;
    vec3 back = carry_back(target_pixel, inverse_depth, target, view, source);
    vec2 at = back.xy;
    float w_at = back.z;
#else
    int index = texelFetch(source_ids, ivec2(gl_FragCoord.xy), 0).r - first_id;
    if (index < 0 || index >= size.x * size.y) discard;
    vec2 pixel = vec2(pixel_of(index, size.x));
    vec4 own = texelFetch(surface_map, ivec2(pixel), 0);
    vec2 slope = inverse_depth_slope(own.xyz, pixel_ray(pixel, source), own.w, source);
    vec2 at = source_position(carry_footprint(pixel, own.w, own.xyz, source, view, target), pixel, target_pixel);
    float w_at = inverse_depth_at(at, pixel, 1.0 / own.w, slope);
    float inverse_depth = w_at / (mat3(view) * pixel_ray(at, source) + view[3].xyz * w_at).z;
#endif
    ivec2 low = clamp(ivec2(floor(at)), ivec2(0), size - 1);
    ivec2 high = clamp(ivec2(floor(at)) + 1, ivec2(0), size - 1);
    ivec2 corner_b = ivec2(high.x, low.y);
    ivec2 corner_c = ivec2(low.x, high.y);
    vec4 a = surface_at(low);
    vec4 b = surface_at(corner_b);
    vec4 c = surface_at(corner_c);
    vec4 d = surface_at(high);

    // The pixel whose splat is seen.
#if LOOK_UP
    vec4 error = vec4(
        look_up_error(a.w, vec2(low), at, w_at), look_up_error(b.w, vec2(corner_b), at, w_at),
        look_up_error(c.w, vec2(corner_c), at, w_at), look_up_error(d.w, vec2(high), at, w_at)
    );
    bool right = error.y < error.x;
    bool right_below = error.w < error.z;
    bool below = (right_below ? error.w : error.z) < (right ? error.y : error.x);
    right = below ? right_below : right;
    vec2 pixel = vec2(right ? high.x : low.x, below ? high.y : low.y);
    vec4 own = below ? (right ? d : c) : (right ? b : a);
    if (own.w == 0.0) discard;
    vec2 slope = inverse_depth_slope(own.xyz, pixel_ray(pixel, source), own.w, source);
#endif

#if SCENE
    gl_FragDepth = 1.0 - near * inverse_depth / scale;
    surface = vec4(0.0, 0.0, 0.0, scale / inverse_depth);
#endif
#if SHADING == 0 && SCENE
    albedo = vec4(srgb_to_linear(picture_at(color_map, pixel, vec2(size))), material_number);
#elif SHADING == 0
    color = vec4(picture_at(color_map, pixel, vec2(size)), 1.0);
#elif SHADING == 1 && SCENE
    albedo = vec4(texelFetch(color_map, ivec2(pixel), 0).rgb, material_number);
#elif SHADING == 1
    color = vec4(linear_to_srgb(texelFetch(color_map, ivec2(pixel), 0).rgb), 1.0);
#else
    float w = 1.0 / own.w;
    vec4 weight = vec4(
        neighbour_weight(a.w, vec2(low), at, pixel, w, slope), neighbour_weight(b.w, vec2(corner_b), at, pixel, w, slope),
        neighbour_weight(c.w, vec2(corner_c), at, pixel, w, slope), neighbour_weight(d.w, vec2(high), at, pixel, w, slope)
    );
    float total = weight.x + weight.y + weight.z + weight.w;
#if SHADING == 2
    vec3 mixed = weight.x * texelFetch(color_map, low, 0).rgb + weight.y * texelFetch(color_map, corner_b, 0).rgb
        + weight.z * texelFetch(color_map, corner_c, 0).rgb + weight.w * texelFetch(color_map, high, 0).rgb;
    vec3 light = total > 0.001 ? mixed / total : texelFetch(color_map, ivec2(pixel), 0).rgb;
#if SCENE
    albedo = vec4(light, material_number);
#else
    color = vec4(linear_to_srgb(light), 1.0);
#endif
#else
    vec3 mixed = weight.x * a.xyz + weight.y * b.xyz + weight.z * c.xyz + weight.w * d.xyz;
    vec3 normal = total > 0.001 ? normalize(mixed) : own.xyz;
    // With neighbours all round the colour is taken between pixels too; at an edge it would take the other side's.
    bool whole = min(min(weight.x, weight.y), min(weight.z, weight.w)) > 0.0;
    vec3 encoded = picture_at(color_map, whole ? at : pixel, vec2(size));
    normal = mat3(view) * normal;
    float depth = 1.0 / inverse_depth;
    vec3 linear = srgb_to_linear(encoded);
#if LIT
    linear = floor(clamp(linear, 0.0, 1.0) * 65535.0 + 0.5) / 65535.0;  // as the albedo texture keeps it
    vec3 point = pixel_ray(target_pixel, target) * depth;
    vec3 light = light_surface(point, vec3(0.0), normal, linear, material, ambient, lights, light_count);
    color = vec4(linear_to_srgb(light), 1.0);
#elif SCENE
    surface.xyz = normal;
    albedo = vec4(linear, material_number);
#else
    surface = vec4(normal, depth);
    albedo = vec4(linear, 1.0);
#endif
#endif
#endif
}
