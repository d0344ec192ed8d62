#version 330 core
// Points of a cloud -> how far their nearest neighbours are, and how alike these lie, see common/cloud_edges.glsl.
#include "common/cloud_edges.glsl"

uniform sampler2D query_map;   // xyz of the points that are asked for
uniform sampler2D own_map;     // the plane of each
uniform isampler2D cell_map;   // the cell of each
uniform isampler2D range_map;  // nine ranges of points for each cell: from, to
uniform sampler2D point_map;   // xyz of all points, sorted by cell
uniform sampler2D plane_map;   // their planes
uniform int count;             // of those that are asked for
uniform float radius;
uniform int most;              // points of a range that are looked at

layout(location = 0) out vec4 nearest;
layout(location = 1) out vec4 unused;

void main() {
    ivec2 texel = ivec2(gl_FragCoord.xy);
    nearest = unused = vec4(0.0);
    if (texel.y * CLOUD_WIDTH + texel.x >= count) return;
    int cell = texelFetch(cell_map, texel, 0).r;
    vec3 here = texelFetch(query_map, texel, 0).xyz, own = texelFetch(own_map, texel, 0).xyz;
    nearest.xy = nearest_points(point_map, plane_map, range_map, cell, here, own, radius, most);
}
