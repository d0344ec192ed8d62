#version 330 core
// Points of a cloud -> their planes, fitted again without the neighbours that lie far off them; 0 where that is little
// better.
#include "common/cloud_edges.glsl"

uniform sampler2D query_map;   // xyz of the points that are asked for
uniform sampler2D own_map;     // the plane of each
uniform isampler2D cell_map;   // the cell of each
uniform isampler2D range_map;  // nine ranges of points for each cell: from, to
uniform sampler2D point_map;   // xyz of all points, sorted by cell
uniform int count;             // of those that are asked for
uniform float radius;
uniform float noise;           // its square, radii
uniform int most;              // points of a range that are looked at

layout(location = 0) out vec4 plane;
layout(location = 1) out vec4 lean;

void main() {
    ivec2 texel = ivec2(gl_FragCoord.xy);
    plane = lean = vec4(0.0);
    if (texel.y * CLOUD_WIDTH + texel.x >= count) return;
    int cell = texelFetch(cell_map, texel, 0).r;
    vec3 here = texelFetch(query_map, texel, 0).xyz;
    vec4 own = texelFetch(own_map, texel, 0);
    plane = own;
    for (int k = 0; k < TRIMS && plane.xyz != vec3(0.0); ++k) {
        vec4 slab = slab_of(plane, noise);
        Moments m = gather_moments(point_map, range_map, cell, here, radius, slab, most);
        plane = fit_plane(m);
        lean = lean_of(m, plane);
    }
    if (!is_thinner(plane, own)) plane = vec4(0.0);
}
