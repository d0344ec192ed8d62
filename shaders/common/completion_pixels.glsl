#define CANDIDATES 18  // of 3x3 cells, and 2 planes of each
#include "common/completion.glsl"
#include "common/rim_marks.glsl"

// The surface of missing points: of the planes of the cells around.

const float NEIGHBOURHOOD = 1.0;  // standard deviation of a vote's weight, cells
const float COMPLETED = 0.5;      // what the vote of a cell's completed plane counts

// Unit normal and depth of a missing point; 0 if it stays missing. The maps are those of completion_rays.glsl, plane_map the
// one of settle_cell.
vec4 complete_pixel(
    sampler2D near_planes, sampler2D other_planes, sampler2D colors_map, sampler2D plane_map, ivec2 pixel, vec3 color,
    float hidden_below, vec4 source
) {
    ivec2 cell = pixel / SIDE;
    for (int k = 0; k < 9; ++k) {
        ivec2 there = cell + ivec2(k % 3, k / 3) - 1;
        vec4 near_plane = texel_or_zero(near_planes, there), colors = texel_or_zero(colors_map, there);
        bool has_own = near_plane.w >= MANY;
        vec4 other_plane = has_own ? texel_or_zero(other_planes, there) : texel_or_zero(plane_map, there);
        vec2 off = vec2(pixel) - cell_middle(there);
        vec2 likeness = vec2(
            color_likeness(unpack_color(colors.x), color), color_likeness(unpack_color(has_own ? colors.y : colors.z), color)
        );
        vec2 votes = vec2(min(near_plane.w / MANY, 1.0), has_own ? min(other_plane.w / MANY, 1.0) : COMPLETED * other_plane.w);
        votes *= (UNLIKE + likeness) * gaussian(off / float(SIDE), NEIGHBOURHOOD);
        candidates[2 * k] = candidate_of(moved_plane(near_plane.xyz, off), votes.x, hidden_below);
        candidates[2 * k + 1] = candidate_of(moved_plane(other_plane.xyz, off), votes.y, hidden_below);
    }
    vec4 plane = elected(elect());
    bool is_found = plane.w > 0.0 && texel_at(plane_map, cell).w > 0.0;
    vec3 ray = pixel_ray(vec2(pixel), source);
    return is_found ? vec4(normal_of_slope(plane.yz / plane.x, ray.xy, source), 1.0 / plane.x) : vec4(0.0);
}

// Depth without the mark of rims, 0 outside the picture.
float depth_or_zero(sampler2D surface_map, ivec2 pixel) {
    return abs(texel_or_zero(surface_map, pixel).w);
}

// The surface at a pixel once others are completed: its own, with the mark of rims where there is another one beside it now.
// completed_map: of complete_pixel; beyond: the depth of points that still have none, which face away then, so that no light
// falls on them; 0 leaves them out
vec4 join_completed(sampler2D surface_map, sampler2D completed_map, ivec2 pixel, vec4 source, float beyond) {
    vec4 own = texel_at(surface_map, pixel), completed = texel_at(completed_map, pixel);
    vec4 beside = vec4(
        texel_or_zero(completed_map, pixel - ivec2(1, 0)).w, texel_or_zero(completed_map, pixel + ivec2(1, 0)).w,
        texel_or_zero(completed_map, pixel - ivec2(0, 1)).w, texel_or_zero(completed_map, pixel + ivec2(0, 1)).w
    );
    bool is_new = completed.w > 0.0 || (own.w != 0.0 && max(max(beside.x, beside.y), max(beside.z, beside.w)) > 0.0);
    for (int turn = 0; turn < once_if(is_new ? 0.5 : 0.0); ++turn) {
        own = completed.w > 0.0 ? completed : vec4(own.xyz, abs(own.w));
        vec4 steps = vec4(
            relative_step(own.w, max(beside.x, depth_or_zero(surface_map, pixel - ivec2(1, 0)))),
            relative_step(own.w, max(beside.y, depth_or_zero(surface_map, pixel + ivec2(1, 0)))),
            relative_step(own.w, max(beside.z, depth_or_zero(surface_map, pixel - ivec2(0, 1)))),
            relative_step(own.w, max(beside.w, depth_or_zero(surface_map, pixel + ivec2(0, 1))))
        );
        own.w = is_rim(steps, pixel, textureSize(surface_map, 0), source, 0.0) ? -own.w : own.w;
    }
    return own.w == 0.0 && beyond > 0.0 ? vec4(normalize(pixel_ray(vec2(pixel), source)), beyond) : own;
}
