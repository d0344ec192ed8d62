#version 330 core
#ifndef LIT
#define LIT 0  // 1: the splat is lit here, once for all of its pixels
#endif
#ifndef EXACT
#define EXACT 0  // 1: one of several frames without noise
#endif
// One point per source pixel, found from gl_VertexID: projects the pixel's square into the target view.
// The GL point is only a box round the footprint, cut to the picture: so a splat whose centre lies outside
// still shows the part that lies inside. The fragment shader keeps what the footprint covers. Rims: rims.vert.
#include "common/rim_splat.glsl"

uniform sampler2D surface_map;  // unit normal, depth
uniform vec4 source;
uniform vec4 target;
uniform mat4 view;
uniform vec2 target_size;
uniform float near;
uniform bool is_round;
uniform bool has_rims;  // drawn by rims.vert
uniform int first_id;  // of the first pixel; 0 stands for nothing
uniform float side;  // source pixels; 0: each point has its own

in float size;  // a point's own side

flat out vec2 centre;
flat out vec4 to_source;
flat out vec2 bend;
flat out float reach;
flat out int id;
flat out float inverse_depth;  // these three for set_splats.frag
flat out vec2 tilt;
flat out vec4 to_target;

#if LIT
#include "points/vertex_lighting.glsl"
#endif

const vec4 NOWHERE = vec4(2.0, 2.0, 2.0, 1.0);

void main() {
    gl_Position = NOWHERE;
    gl_PointSize = 1.0;
    float own_side = side > 0.0 ? side : size;
    int columns = textureSize(surface_map, 0).x;
    ivec2 pixel = ivec2(gl_VertexID % columns, gl_VertexID / columns);
    vec4 surface = texelFetch(surface_map, pixel, 0);
    if (surface.w == 0.0 || !(own_side > 0.0)) return;
    float z = abs(surface.w);
    Footprint splat = carry_footprint(vec2(pixel), z, surface.xyz, source, view, target);
    reach = EXACT == 1 ? exact_reach(own_side, is_round) : splat_reach(own_side, is_round);
    if (!splat_is_ahead(splat, near) || splat_bends(splat, reach) >= ENDLESS) return;
    if (has_rims && surface.w < 0.0 && draws_rim(splat, z, source, target)) return;
    vec2 extent = footprint_extent(splat, reach, is_round);
    vec2 low = max(splat.centre - extent, vec2(-0.5));
    vec2 high = min(splat.centre + extent, target_size - 0.5);
    if (low.x > high.x || low.y > high.y) return;
    centre = splat.centre;
    to_source = invert_footprint(splat.to_target);
    bend = splat_bend(splat, reach);
    id = first_id + gl_VertexID;
    inverse_depth = splat.inverse_depth;
    tilt = splat.tilt;
    to_target = splat.to_target;
    // Window depth 1 - near/z is linear in 1/z and keeps its sharpness relative to distance.
    vec2 middle = (low + high + 1.0) / target_size - 1.0;
    gl_Position = vec4(middle, 1.0 - 2.0 * near * splat.inverse_depth, 1.0);
    gl_PointSize = max(high.x - low.x, high.y - low.y) + 0.125;  // GL places points to 1/16 pixel or better
#if LIT
    lit = light_pixel(pixel, pixel_ray(vec2(pixel), source) * z, surface.xyz, vec2(textureSize(surface_map, 0)));
#endif
}
