#version 330 core
// Surface without the samples that mix two surfaces -> surface where these lie on one of the two.
#include "common/flying_pixel_snap.glsl"

uniform sampler2D surface_map;  // without mixed samples
uniform sampler2D mixed_map;    // with them
uniform sampler2D depth_map;    // as taken
uniform sampler2D mixing_map;   // from flying_pixels.frag
uniform sampler2D guide_map;    // from upsample_guide.frag
uniform vec4 source;

out vec4 surface;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    surface = surface_at(surface_map, pixel);
    if (needs_snap(surface_map, mixing_map, pixel, source)) {
        surface = snap_sample(surface_map, guide_map, pixel, 1.0 / texel_at(depth_map, pixel).r, source);
        if (surface.w == 0.0) surface = surface_at(mixed_map, pixel);
    }
}
