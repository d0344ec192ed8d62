#version 330 core
// Depth -> surface (unit normal, depth, negative at rims) by 1, 2, 4 or 8 triangles around each pixel.
#include "common/normals_triangles.glsl"
#include "common/rim_marks.glsl"

uniform sampler2D depth_map;
uniform vec4 intrinsics;
uniform int triangle_count;
uniform vec2 max_step;

out vec4 surface;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    vec3 normal = normal_from_triangles(depth_map, pixel, intrinsics, triangle_count, max_step);
    surface = vec4(normal, mark_rim(depth_map, pixel, intrinsics, 0.0));
}
