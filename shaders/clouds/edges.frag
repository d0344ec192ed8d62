#version 330 core
// Points of a cloud near sharp edges -> better planes, see common/cloud_edges.glsl; 0 where there is none.
#include "common/cloud_edges.glsl"

uniform sampler2D query_map;   // xyz of the points that are asked for; w: what a better plane must cost less than
uniform isampler2D cell_map;   // the cell of each
uniform isampler2D range_map;  // nine ranges of points for each cell: from, to
uniform sampler2D point_map;   // xyz of all points, sorted by cell
uniform sampler2D plane_map;   // their planes
uniform int count;             // of those that are asked for
uniform float radius;
uniform float unit;            // of the lengths in plane_map, radii
uniform float noise;           // its square, radii
uniform int most;              // points of a range that are looked at

layout(location = 0) out vec4 plane;
layout(location = 1) out vec4 lean;

void main() {
    ivec2 texel = ivec2(gl_FragCoord.xy);
    plane = lean = vec4(0.0);
    if (texel.y * CLOUD_WIDTH + texel.x >= count) return;
    int cell = texelFetch(cell_map, texel, 0).r;
    vec4 here = texelFetch(query_map, texel, 0);
    vec4 best = elect_plane(point_map, plane_map, range_map, cell, here.xyz, here.w, noise, radius, unit, most);
    if (best.xyz == vec3(0.0)) return;
    Moments m = gather_moments(point_map, range_map, cell, here.xyz, radius, slab_of(best, noise), most);
    plane = fit_plane(m);
    if (plane.xyz == vec3(0.0)) plane = best;
    lean = lean_of(m, plane);
}
