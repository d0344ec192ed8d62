#define CANDIDATES 64  // of 16 rays, 2 stops on each, and 2 planes at each
#include "common/completion.glsl"

// The planes of cells with missing points: rays go out from them to the cells with points around.

const int RAYS = 16;
const int AROUND = 12;     // of these, so many meet points where they surround a cell
const int STOPS = 2;       // cells with points that a ray visits
const int REGION = 4;      // cells on each side of one whose colours are asked, too, whether they are known
const float ALIKE = 0.1;   // likeness from which on they are, in the mean

// A direction, 1 along its longer axis. All steps are exact in floats, so that everybody visits the same cells.
vec2 ray_direction(int ray) {
    int k = ray % 8;
    vec2 along = k < 3 ? vec2(1.0, 0.5 * float(k))
        : k < 6 ? vec2(0.5 * float(4 - k), 1.0) : vec2(-1.0, 0.5 * float(8 - k));
    return ray < 8 ? along : -along;
}

// The 1/z from which on the sensor would have seen a surface somewhere in a cell; 0 if it may be any.
float cell_hidden_below(sampler2D surface_map, sampler2D hidden_map, ivec2 cell) {
    ivec2 size = textureSize(surface_map, 0);
    float lowest = 1e30;
    for (int k = 0; k < SIDE * SIDE; ++k) {
        ivec2 pixel = min(SIDE * cell + ivec2(k % SIDE, k / SIDE), size - 1);
        float one = hidden_below_at(hidden_map, pixel, size);
        bool counts = one > 0.0 && texel_at(surface_map, pixel).w == 0.0;
        lowest = counts ? min(lowest, one) : lowest;
    }
    return lowest < 1e30 ? lowest : 0.0;
}

// The plane in the middle of a cell (1/z, its change per pixel, share of the votes); 0 if there is none, or nothing missing.
// Cells with many points have their own.
// evidence: how alike the colours are of the points that it comes from, at best, and 1 where these decide.
// is_alone: most of the picture's border is missing, as round an object that was cut out. Only what all rays find points
// around has a plane then.
vec4 cast_rays(
    sampler2D near_planes, sampler2D other_planes, sampler2D colors_map, ivec2 cell, float hidden_below, bool is_alone,
    out vec2 evidence
) {
    ivec2 cells = textureSize(colors_map, 0);
    vec4 own = texel_at(colors_map, cell), plane = texel_at(near_planes, cell);
    bool has_own = plane.w >= MANY && !is_alone, is_asked = own.w > 0.0 && !has_own;
    vec3 missing = unpack_color(own.z);
    float likeness[CANDIDATES];
    evidence = vec2(0.0);
    plane = own.w > 0.0 && has_own ? vec4(plane.xyz, 1.0) : vec4(0.0);
    for (int turn = 0; turn < once_if(is_asked ? own.w / float(SIDE * SIDE) : 0.0); ++turn) {
        int meeting = 0;  // rays that meet points
        for (int k = 0; k < CANDIDATES; ++k) candidates[k] = vec4(0.0);
        for (int ray = 0; ray < RAYS; ++ray) {
            vec2 direction = ray_direction(ray);
            int stops = 0, reach = max(cells.x, cells.y);
            for (int k = 1; k <= reach && stops < STOPS; ++k) {
                ivec2 there = cell + ivec2(floor(float(k) * direction + 0.5));
                if (there != clamp(there, ivec2(0), cells - 1)) break;
                vec4 near_plane = texel_at(near_planes, there);
                for (int layer = 0; layer < (near_plane.w > 0.0 ? 2 : 0); ++layer) {
                    vec4 one = layer == 0 ? near_plane : texel_at(other_planes, there);
                    vec2 colors = texel_at(colors_map, there).xy;
                    vec2 off = vec2(cell - there);
                    int number = (ray * STOPS + stops) * 2 + layer;
                    likeness[number] = color_likeness(unpack_color(layer == 0 ? colors.x : colors.y), missing);
                    float votes = color_vote(likeness[number]) * min(one.w / MANY, 1.0) / length(off);
                    candidates[number] = candidate_of(moved_plane(one.xyz, float(SIDE) * off), votes, hidden_below);
                }
                stops += near_plane.w > 0.0 ? 1 : 0;
            }
            meeting += stops > 0 ? 1 : 0;
        }
        float w = elect(), alike = 0.0;
        for (int k = 0; k < CANDIDATES; ++k) {
            bool counts = candidates[k].w > 0.0 && agrees(candidates[k].x, w);
            alike = counts ? max(alike, likeness[k]) : alike;
        }
        bool is_surrounded = meeting >= (is_alone ? RAYS : AROUND);
        plane = is_alone && !is_surrounded ? vec4(0.0) : elected(w);
        evidence = vec2(alike, is_surrounded && !is_alone ? 0.0 : 1.0);
    }
    return plane;
}

// The plane of cast_rays; 0 where the colours decide, and those around are unlike all colours that a surface could come from.
vec4 settle_cell(sampler2D plane_map, sampler2D evidence_map, ivec2 cell) {
    vec4 own = texel_at(plane_map, cell);
    float doubtful = texel_at(evidence_map, cell).g, alike = 0.0, count = 0.0;
    for (int k = 0; k < (own.w * doubtful > 0.0 ? (2 * REGION + 1) * (2 * REGION + 1) : 0); ++k) {
        ivec2 off = ivec2(k % (2 * REGION + 1), k / (2 * REGION + 1)) - REGION;
        vec2 evidence = texel_or_zero(evidence_map, cell + off).rg;
        alike += evidence.r * evidence.g;
        count += evidence.g;
    }
    return count > 0.0 && alike < ALIKE * count ? vec4(0.0) : own;
}
