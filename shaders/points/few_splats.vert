#version 330 core
#ifndef VISIBILITY
#define VISIBILITY 0  // 1: it is known what the points see of the light from all around
#endif
// A few points of a frame, drawn at once while something moves: each brings what the light pass reads, the same for its
// whole footprint. Rims are drawn as all others. As splats.vert, which finds what each pixel of a view shows.
#include "common/color.glsl"
#include "common/picture.glsl"
#include "common/splat.glsl"
#include "common/surroundings.glsl"

uniform sampler2D surface_map;    // unit normal, depth
uniform sampler2D light_normals;  // those that are lit
uniform sampler2D color_map;      // sRGB, of any size
uniform sampler2D visibility_map;
uniform vec4 source;
uniform vec4 target;
uniform mat4 view;
uniform vec2 target_size;
uniform float near;
uniform float side;    // of a point, source pixels
uniform float scale;   // of the object; the view does not contain it
uniform float behind;  // by how much farther the points are taken to be, as in set_shadow.frag
uniform bool is_lit;
uniform vec3 gain;     // of the frame's exposure
uniform float material_number;

flat out vec2 centre;
flat out vec4 to_source;
flat out float reach;
flat out vec3 window_depth;  // and by how much it changes for each target pixel
flat out vec4 own_surface;  // these three as resolve_surfaces.frag gives them
flat out vec4 own_albedo;
flat out vec4 own_visibility;

const float FLATTEST = 0.2;  // cosine: what a frame sees flatter others see better

void main() {
    gl_Position = vec4(2.0, 2.0, 2.0, 1.0);
    gl_PointSize = 1.0;
    ivec2 size = textureSize(surface_map, 0), pixel = ivec2(gl_VertexID % size.x, gl_VertexID / size.x);
    vec4 surface = texelFetch(surface_map, pixel, 0);
    vec3 ray = pixel_ray(vec2(pixel), source);
    if (-dot(surface.xyz, ray) < FLATTEST * length(ray)) return;
    Footprint splat = carry_footprint(vec2(pixel), abs(surface.w), surface.xyz, source, view, target);
    reach = splat_reach(side, false);
    if (!splat_is_ahead(splat, near) || splat_bends(splat, reach) >= ENDLESS) return;
    vec2 extent = footprint_extent(splat, reach, false);
    if (any(greaterThan(abs(splat.centre + 0.5 - 0.5 * target_size), 0.5 * target_size + extent))) return;
    centre = splat.centre;
    to_source = invert_footprint(splat.to_target);
    vec3 normal = mat3(view) * texelFetch(light_normals, pixel, 0).xyz;
    own_surface = vec4(is_lit ? normal : vec3(0.0), scale / splat.inverse_depth);
    own_albedo = vec4(gain * srgb_to_linear(picture_at(color_map, vec2(pixel) + 0.5, vec2(size))), material_number);
    own_visibility = vec4(0.0, 0.0, 0.0, -1.0);
    if (VISIBILITY == 1) own_visibility = carried_visibility(visibility_map, vec2(pixel), vec2(size), mat3(view));
    float inverse_depth = splat.inverse_depth / (1.0 + behind * splat.inverse_depth);
    vec2 change = to_source.xz * splat.tilt.x + to_source.yw * splat.tilt.y;
    window_depth = vec3(1.0 - near * inverse_depth, -near * change);
    gl_Position = vec4((splat.centre + 0.5) * 2.0 / target_size - 1.0, 1.0 - 2.0 * near * inverse_depth, 1.0);
    gl_PointSize = 2.0 * max(extent.x, extent.y) + 0.125;
}
