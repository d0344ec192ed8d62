#version 330 core
#ifndef COPIES
#define COPIES 0  // 1: many copies of a mesh, each at its place
#endif
// A mesh in the target view; its depth is 1 - near/z, linear in 1/z, as for splats.
#if COPIES
in mat4 view;               // node axes to target axes
in mat3 normal_view;        // inverse transpose of view
#else
uniform mat4 view;
uniform mat3 normal_view;
#endif
uniform vec4 target;
uniform vec2 target_size;
uniform float near;

in vec3 position;
in vec3 normal;
in vec2 uv;
in vec3 tint;  // linear colour less white: 0 without one

out vec3 target_normal;
out vec2 texture_uv;
out vec3 corner_tint;
out float depth;

void main() {
    vec3 point = (view * vec4(position, 1.0)).xyz;
    target_normal = normal_view * normal;
    texture_uv = uv;
    corner_tint = tint;
    depth = point.z;
    // Pixel centres are at integers: (u + 0.5) / width of the way across. Homogeneous, for points behind the viewer.
    vec2 pixel = target.xy * point.xy + (target.zw + 0.5) * point.z;
    gl_Position = vec4(2.0 * pixel / target_size - point.z, point.z - 2.0 * near, point.z);
}
