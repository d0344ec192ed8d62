#version 330 core
// The caller's normals and depth -> surface (unit normal, depth, negative at rims).
#include "common/splat_corners.glsl"
#include "common/rim_marks.glsl"

uniform sampler2D normal_map;  // (0, 0, 0) where missing
uniform sampler2D depth_map;
uniform vec4 intrinsics;

out vec4 surface;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    vec3 normal = texel_at(normal_map, pixel).xyz;
    surface = normal == vec3(0.0) ? vec4(0.0) : vec4(normal, mark_rim(depth_map, pixel, intrinsics, 0.0));
}
