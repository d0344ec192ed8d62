#version 330 core
// Surface of the new frame, and the normals that are remembered -> the surface with normals that rest on both.
#include "common/temporal.glsl"

uniform sampler2D surface_map;     // from normals_adaptive.frag
uniform sampler2D old_normal_map;  // from temporal_change.frag
uniform sampler2D history_map;     // from temporal_depth.frag
uniform vec4 intrinsics;

out vec4 surface;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    surface = texel_at(surface_map, pixel);
    vec3 old = history_at(old_normal_map, pixel, ivec2(0)).xyz;
    float share = history_at(history_map, pixel, ivec2(0)).a;
    if (surface.w != 0.0) surface.xyz = mixed_normal(surface.xyz, old, share, pixel_ray(vec2(pixel), intrinsics));
}
