#version 330 core
// Which pixels of a view show a surface that goes on all around them: moved by half a pixel, the view shows it there, too.
#include "common/depth_lookup.glsl"

uniform sampler2D surface_map;  // unit normal, depth
uniform vec4 source;
uniform vec4 target;
uniform mat4 view;
uniform int first_id;
uniform isampler2D source_ids;
uniform sampler2D window_depths;  // 1 - near/z

out vec4 inside;  // 1 or 0

const float OFF = 0.75;    // source pixels from the point seen in the next pixel to where this pixel's plane expects it
const float APART = 0.01;  // share of 1/z by which pixels beside each other differ where a surface may end
const int AROUND = 2;      // pixels on each side that must show it

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy), size = textureSize(source_ids, 0);
    int columns = textureSize(surface_map, 0).x, id = texelFetch(source_ids, pixel, 0).r;
    inside = vec4(0.0);
    bool is_bordered = any(lessThan(pixel, ivec2(AROUND))) || any(greaterThanEqual(pixel, size - AROUND));
    if (id <= 0 || is_bordered) return;
    vec2 point = vec2(pixel_of(id - first_id, columns));
    vec4 surface = texelFetch(surface_map, ivec2(point), 0);
    Footprint splat = carry_footprint(point, surface.w, surface.xyz, source, view, target);
    float own = 1.0 - texelFetch(window_depths, pixel, 0).r;
    bool goes_on = true;
    int across = 2 * AROUND + 1;
    for (int k = 0; k < across * across; ++k) {
        ivec2 there = pixel + ivec2(k % across, k / across) - AROUND;
        int next = texelFetch(source_ids, there, 0).r;  // rims are below 0
        vec2 off = abs(source_position(splat, point, vec2(there)) - vec2(pixel_of(next - first_id, columns)));
        float step = abs(1.0 - texelFetch(window_depths, there, 0).r - own);
        goes_on = goes_on && next > 0 && max(off.x, off.y) <= OFF && step <= APART * own;
    }
    inside = vec4(goes_on ? 1.0 : 0.0);
}
