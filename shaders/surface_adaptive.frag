#version 330 core
// Averaged depth with the noise that is left -> surface (unit normal, the frame's own depth), for noisy depth.
#include "common/normals_adaptive.glsl"

uniform sampler2D picture;    // depth after depth_average.frag, noise over depth
uniform sampler2D depth_map;  // as it was taken: points stay where they were measured
uniform vec4 intrinsics;

out vec4 surface;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    surface = vec4(estimate_adaptive(picture, pixel, intrinsics), depth_at(depth_map, pixel, ivec2(0)));
}
