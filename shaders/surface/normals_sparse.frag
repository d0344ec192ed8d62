#version 330 core
#ifndef REST
#define REST 0  // 1: all pixels that are left face the camera: nothing else is known about them
#endif
// Depth of which little is known -> surface (unit normal, depth on its plane, negative at rims), in many draws; a depth
// test leaves each only the pixels that earlier ones discarded. Points move along their rays by about their noise, as in
// normals_adaptive.frag.
#include "common/normals_sparse.glsl"
#include "common/rim_marks.glsl"

uniform sampler2D depth_map;
uniform vec4 intrinsics;
#if REST == 0
uniform sampler2D cells;  // 2^level pixels wide, from sparse_cells.frag
uniform int level;
uniform float tilt;  // radians: a larger error is no answer
#endif

out vec4 surface;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    float here = depth_at(depth_map, pixel, ivec2(0));
    bool known = here > 0.0;
    vec2 ray = pixel_ray(vec2(pixel), intrinsics).xy;
#if REST
    vec4 plane = vec4(facing_slope(ray, intrinsics), 0.0, 1.0);
#else
    vec4 plane = sparse_plane(cells, pixel, here, level, intrinsics, tilt);
#endif
    if (known && plane.w < 0.5) discard;
    vec3 normal = normal_of_slope(plane.xy, ray, intrinsics);
    surface = known ? vec4(normal, mark_rim(depth_map, pixel, intrinsics, 0.0) / (1.0 + plane.z)) : vec4(0.0);
}
