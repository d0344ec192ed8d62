#version 330 core
// Rounded depth -> surface (unit normal, depth, negative at rims) where wide planes hold. What it discards is left to
// surface_adaptive.frag, of which it is the first stage.
#include "common/camera.glsl"
#include "common/flat_cells.glsl"
#include "common/rim_marks.glsl"

uniform sampler2D depth_map;   // as it was taken: on a plane no depth is off by more than half a step
uniform sampler2D calm_depth;  // after depth_average.frag: all stages find rims in it
uniform sampler2D cells;
uniform vec2 rounding;
uniform vec4 intrinsics;

out vec4 surface;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    vec4 plane = flat_surface(cells, depth_map, pixel, rounding);
    if (plane.w < 0.5) discard;
    vec3 normal = normal_of_slope(plane.yz, pixel_ray(vec2(pixel), intrinsics).xy, intrinsics);
    surface = vec4(normal, sign(mark_rim(calm_depth, pixel, intrinsics)) * plane.x);
}
