#version 330 core
// Which points of a frame may be seen in a pixel that is not inside of a surface (view_insides.frag), in the view or in one
// moved by half a pixel.
#include "common/splat.glsl"

uniform sampler2D surface_map;  // unit normal, depth
uniform sampler2D insides;      // of the view
uniform vec4 source;
uniform vec4 target;
uniform mat4 view;
uniform float near;
uniform float size;  // of points, source pixels
uniform bool is_round;

out vec4 chosen;  // 1 or 0

const float MOVED = 1.0;  // pixels of the view: half of one by the sample, half from a place to the middle of its pixel
const int REACH = 2;      // pixels around its own that a point is looked for in; larger ones are drawn anew

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    vec4 surface = texelFetch(surface_map, pixel, 0);
    chosen = vec4(0.0);
    if (surface.w == 0.0) return;
    Footprint splat = carry_footprint(vec2(pixel), abs(surface.w), surface.xyz, source, view, target);
    if (!splat_is_ahead(splat, near)) return;
    vec2 extent = footprint_extent(splat, splat_reach(size, is_round), is_round) + MOVED;
    bool is_apart = max(extent.x, extent.y) > float(REACH) + 0.5;
    int across = 2 * REACH + 1;
    for (int k = 0; k < across * across; ++k) {
        ivec2 there = ivec2(floor(splat.centre + 0.5)) + ivec2(k % across, k / across) - REACH;
        ivec2 inside = clamp(there, ivec2(0), textureSize(insides, 0) - 1);
        bool may_show = all(lessThanEqual(abs(vec2(there) - splat.centre), extent));
        is_apart = is_apart || (may_show && texelFetch(insides, inside, 0).r == 0.0);
    }
    chosen = vec4(is_apart ? 1.0 : 0.0);
}
