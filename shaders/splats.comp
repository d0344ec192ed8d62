#version 430 core
// The compute rasteriser, one thread a source pixel: carries the pixel's square into the view and notes 1/z of its
// tangent plane at every target pixel that it covers; the nearest stays (cf. software rasterisation of points by
// atomics: Schuetz, Kerbl, Wimmer 2021). Inverse depths are above 0, where floats have the order of their bits.
#include "common/splat.glsl"

layout(local_size_x = 128) in;
layout(std430, binding = 0) restrict buffer Nearest { uint nearest[]; };

uniform sampler2D surface_map;  // unit normal, depth
uniform vec4 source;
uniform vec4 target;
uniform mat4 view;
uniform ivec2 target_size;
uniform float near;

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (pixel.x >= textureSize(surface_map, 0).x) return;
    vec4 surface = texelFetch(surface_map, pixel, 0);
    if (surface.w == 0.0) return;
    Footprint splat = carry_footprint(vec2(pixel), surface.w, surface.xyz, source, view, target);
    if (splat.inverse_depth <= 0.0 || splat.inverse_depth * near >= 1.0) return;
    float reach = splat_reach(1.0, false);
    vec2 extent = footprint_extent(splat.to_target, reach, false);
    ivec2 low = ivec2(max(ceil(splat.centre - extent), 0.0));
    ivec2 high = ivec2(min(floor(splat.centre + extent), vec2(target_size) - 1.0));
    vec4 to_source = invert_footprint(splat.to_target);
    for (int y = low.y; y <= high.y; ++y) {
        for (int x = low.x; x <= high.x; ++x) {
            vec2 offset = vec2(x, y) - splat.centre;
            if (!footprint_covers(to_source, offset, reach, false)) continue;
            float inverse_depth = footprint_inverse_depth(splat, to_source, offset);
            atomicMax(nearest[y * target_size.x + x], floatBitsToUint(inverse_depth));
        }
    }
}
