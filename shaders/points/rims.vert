#version 330 core
#ifndef LIT
#define LIT 0  // 1: the rim is lit here, once for all of its pixels
#endif
#ifndef KNOWN
#define KNOWN 0  // 1: each vertex is one of a list whose rims known_rims.frag has estimated; 0: it is a pixel
#endif
// The rim pixels, which splats.vert leaves out: one point each, a box round the rim in the view.
#include "common/parts.glsl"
#include "common/rim_splat.glsl"
#if KNOWN
#include "points/kept_rims.glsl"
#endif

uniform sampler2D surface_map;  // unit normal, depth
uniform vec4 source;
uniform vec4 target;
uniform mat4 view;
uniform vec2 target_size;
uniform float near;
uniform int first_id;
#if KNOWN
uniform sampler2D known_heads;  // these four: kept_rims.glsl
uniform sampler2D known_outlines;
uniform sampler2D known_slopes;
uniform sampler2D known_folds;
#endif

flat out int id;
flat out float inverse_depth;  // of the pixel
flat out vec4 rim;             // outward, width, drop
flat out vec2 slope;           // these as in rims.glsl
flat out vec4 hidden;
flat out mat4x3 folds;
flat out float stretched;      // for rims.frag with SET: 1 if the pixel's footprint is

#if LIT
#include "points/vertex_lighting.glsl"
#endif

const vec4 NOWHERE = vec4(2.0, 2.0, 2.0, 1.0);

void main() {
    gl_Position = NOWHERE;
    gl_PointSize = 1.0;
    int columns = textureSize(surface_map, 0).x, number = gl_VertexID;
#if KNOWN
    int in_a_row = textureSize(known_heads, 0).x;
    ivec2 place = ivec2(number % in_a_row, number / in_a_row), pixel = ivec2(texelFetch(known_heads, place, 0).xy);
    number = pixel.y * columns + pixel.x;
#else
    ivec2 pixel = ivec2(number % columns, number / columns);
#endif
    vec4 surface = texelFetch(surface_map, pixel, 0);
    int rims = surface.w < 0.0 ? 1 : 0;  // a loop that no point takes costs software drivers nothing
    for (int k = 0; k < rims; ++k) {
        vec4 own = vec4(surface.xyz, -surface.w);
        Footprint splat = carry_footprint(vec2(pixel), own.w, own.xyz, source, view, target);
        if (!splat_is_ahead(splat, near) || !draws_rim(splat, own.w, source, target)) break;
#if KNOWN
        Rim found = unpacked_rim(mat4(
            texelFetch(known_heads, place, 0), texelFetch(known_outlines, place, 0), texelFetch(known_slopes, place, 0),
            texelFetch(known_folds, place, 0)
        ));
#else
        Rim found = estimate_rim(surface_map, pixel, source);
#endif
        vec4 box = rim_box(found, vec2(pixel), own, source, view, target);
        vec2 low = max(box.xy, vec2(-0.5)), high = min(box.zw, target_size - 0.5);
        if (low.x > high.x || low.y > high.y) break;
        id = first_id + number;
        inverse_depth = splat.inverse_depth;
        rim = vec4(found.outward, found.width, found.drop);
        slope = found.slope;
        hidden = found.hidden;
        folds = found.folds;
        stretched = is_stretched(footprint_extent(splat, splat_reach(1.0, false), false), 1.0) ? 1.0 : 0.0;
        vec2 middle = (low + high + 1.0) / target_size - 1.0;
        gl_Position = vec4(middle, 1.0 - 2.0 * near * splat.inverse_depth, 1.0);
        gl_PointSize = max(high.x - low.x, high.y - low.y) + 0.125;
#if LIT
        lit = light_pixel(pixel, pixel_ray(vec2(pixel), source) * own.w, own.xyz, vec2(textureSize(surface_map, 0)));
#endif
    }
}
