#version 330 core
// Noisy depth -> surface (unit normal, depth) where it is a plane of bumpy_planes.glsl and nothing else. What it
// discards is left to the stages of normals_adaptive.frag.
#include "common/bumpy_planes.glsl"
#include "common/camera.glsl"

uniform sampler2D calm_depth;
uniform sampler2D planes;  // of the cells; these three as in bumpy_windows.frag
uniform ivec2 first;
uniform float bumps;
uniform vec4 intrinsics;

out vec4 surface;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    vec4 plane = bumpy_surface(planes, calm_depth, pixel, first);
    if (plane.w < 1.0 || !is_bumpy_plane(calm_depth, pixel, plane.xyz, bumps)) discard;
    surface = vec4(normal_of_slope(plane.yz, pixel_ray(vec2(pixel), intrinsics).xy, intrinsics), plane.x);
}
