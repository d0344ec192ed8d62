#version 330 core
// Points of a cloud -> planes through their neighbours, see common/cloud_planes.glsl, and how they lie round the point.
#include "common/cloud_planes.glsl"

uniform sampler2D query_map;   // xyz of the points that are asked for
uniform isampler2D cell_map;   // the cell of each
uniform isampler2D range_map;  // nine ranges of points for each cell: from, to
uniform sampler2D point_map;   // xyz of all points, sorted by cell
uniform int count;             // of those that are asked for
uniform float radius;
uniform int most;              // points of a range that are looked at

layout(location = 0) out vec4 plane;
layout(location = 1) out vec4 lean;  // xyz: how far aside the mean of the neighbours lies, radii; w: how many there are

void main() {
    ivec2 texel = ivec2(gl_FragCoord.xy);
    plane = lean = vec4(0.0);
    if (texel.y * CLOUD_WIDTH + texel.x >= count) return;
    int cell = texelFetch(cell_map, texel, 0).r;
    vec3 here = texelFetch(query_map, texel, 0).xyz;
    Moments m = gather_moments(point_map, range_map, cell, here, radius, vec4(0.0), most);
    plane = fit_plane(m);
    lean = lean_of(m, plane);
}
