#define CANDIDATES 16
#include "common/completion.glsl"

// Joins the points of a surface in cells.

struct Cell {
    vec4 planes[2];  // at the cell's middle: 1/z and its change per pixel, and how many points lie on it
    vec4 colors;     // packed: those of the two planes' points, that of the missing ones; and how many are missing
};

Cell join_points(sampler2D surface_map, sampler2D color_map, ivec2 cell, vec4 source) {
    ivec2 size = textureSize(surface_map, 0);
    vec3 colors[CANDIDATES];
    Cell found;
    vec4 gap = vec4(0.0);
    for (int k = 0; k < CANDIDATES; ++k) {
        ivec2 pixel = SIDE * cell + ivec2(k % SIDE, k / SIDE);
        bool is_inside = all(lessThan(pixel, size));
        pixel = min(pixel, size - 1);
        vec4 surface = surface_at(surface_map, pixel), color = guide_at(color_map, pixel, size);
        bool is_known = is_inside && surface.w > 0.0, is_gap = is_inside && surface.w == 0.0 && color.a > 0.0;
        vec4 facing = is_known ? surface : vec4(0.0, 0.0, -1.0, 1.0);
        vec3 plane = vec3(1.0 / facing.w, inverse_depth_slope(facing.xyz, pixel_ray(vec2(pixel), source), facing.w, source));
        candidates[k] = candidate_of(moved_plane(plane, cell_middle(cell) - vec2(pixel)), is_known ? 1.0 : 0.0, 0.0);
        colors[k] = color.rgb;
        gap += is_gap ? vec4(color.rgb, 1.0) : vec4(0.0);
    }
    found.colors = vec4(0.0, 0.0, pack_color(gap.rgb / max(gap.a, 1.0)), gap.a);
    for (int layer = 0; layer < 2; ++layer) {
        float w = elect();
        vec4 plane = supporters_of(w), color = vec4(0.0);
        for (int k = 0; k < CANDIDATES; ++k) {
            bool is_taken = candidates[k].w > 0.0 && agrees(candidates[k].x, w);
            color += is_taken ? vec4(colors[k], 1.0) : vec4(0.0);
            candidates[k].w = is_taken ? 0.0 : candidates[k].w;
        }
        found.planes[layer] = plane.w > 0.0 ? vec4(plane.xyz / plane.w, plane.w) : vec4(0.0);
        found.colors[layer] = pack_color(color.rgb / max(color.a, 1.0));
    }
    return found;
}
