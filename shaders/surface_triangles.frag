#version 330 core
// Depth -> normals by 1, 2, 4 or 8 triangles round each pixel.
#include "common/normals_triangles.glsl"

uniform sampler2D depth_map;
uniform vec4 intrinsics;
uniform int triangle_count;
uniform vec2 max_step;

out vec4 normal;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    normal = vec4(normal_from_triangles(depth_map, pixel, intrinsics, triangle_count, max_step), 0.0);
}
