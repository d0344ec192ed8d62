#version 330 core
// Rounded depth -> surface (unit normal, depth) where wide planes hold. What it discards is left to the stages of
// normals_adaptive.frag.
#include "common/camera.glsl"
#include "common/flat_cells.glsl"

uniform sampler2D depth_map;
uniform sampler2D planes;  // of the cells, from flat_cells.frag
uniform ivec2 first;       // these two as in flat_cells.frag
uniform vec2 rounding;
uniform vec4 intrinsics;

out vec4 surface;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    vec4 plane = flat_surface(planes, depth_map, pixel, first, rounding);
    if (plane.w < 0.5) discard;
    surface = vec4(normal_of_slope(plane.yz, pixel_ray(vec2(pixel), intrinsics).xy, intrinsics), plane.x);
}
