#define CANDIDATES 64  // of 16 rays, 2 stops on each, and 2 planes at each
#include "common/completion.glsl"

// The planes of cells with missing points: rays go out from them to the cells with points around.

const int RAYS = 16;
const int AROUND = 12;     // of these, so many meet points where they surround a cell
const int STOPS = 2;       // cells with points that a ray visits
const int REGION = 4;      // cells on each side of one whose colours are asked, too, whether they are known
const float ALIKE = 0.1;   // likeness from which on they are, in the mean
const int BLOCK = 8;       // cells along a side of a block: rays jump over those without points
const float MOST_STEPS = 65535.0;  // of a ray

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

// Does a cell of a block have points?
bool has_points(sampler2D near_planes, ivec2 block) {
    float most = 0.0;
    for (int k = 0; k < BLOCK * BLOCK; ++k) {
        most = max(most, texel_or_zero(near_planes, BLOCK * block + ivec2(k % BLOCK, k / BLOCK)).w);
    }
    return most > 0.0;
}

// So many steps further a ray is still in the block of a cell, at least.
int steps_inside(ivec2 cell, vec2 direction) {
    ivec2 low = cell % BLOCK, ahead = ivec2(
        direction.x > 0.0 ? BLOCK - 1 - low.x : direction.x < 0.0 ? low.x : BLOCK,
        direction.y > 0.0 ? BLOCK - 1 - low.y : direction.y < 0.0 ? low.y : BLOCK
    );
    return min(ahead.x, ahead.y);
}

// The cell that a ray visits after so many steps.
ivec2 cell_on_ray(ivec2 cell, vec2 direction, float steps) {
    return cell + ivec2(floor(steps * direction + 0.5));
}

// Are planes looked for in a cell? Where points are missing, unless many are there: these have their own plane.
bool is_asked(sampler2D near_planes, sampler2D colors_map, ivec2 cell, bool is_alone) {
    return texel_at(colors_map, cell).w > 0.0 && (is_alone || texel_at(near_planes, cell).w < MANY);
}

// After how many steps a ray stops: at the first cells with points; 0 where there are no more.
// block_map: has_points of each block.
vec2 stops_of(
    sampler2D near_planes, sampler2D colors_map, sampler2D block_map, ivec2 cell, vec2 direction, bool is_alone
) {
    ivec2 cells = textureSize(colors_map, 0);
    int stops = 0, reach = is_asked(near_planes, colors_map, cell, is_alone) ? max(cells.x, cells.y) : 0;
    vec2 steps = vec2(0.0);
    for (int k = 1; k <= reach && stops < STOPS; ++k) {
        ivec2 there = cell_on_ray(cell, direction, float(k));
        if (there != clamp(there, ivec2(0), cells - 1)) break;
        if (texel_at(block_map, there / BLOCK).r == 0.0) {
            k += steps_inside(there, direction);
        } else if (texel_at(near_planes, there).w > 0.0) {
            steps = stops == 0 ? vec2(k, 0.0) : vec2(steps.x, k);
            ++stops;
        }
    }
    return steps;
}

// Where the stops of a ray of a cell are kept: all cells side by side, once for each ray.
ivec2 stops_place(ivec2 cell, int ray, ivec2 cells) {
    return cell + cells * ivec2(ray % SIDE, ray / SIDE);
}

// The plane in the middle of a cell (1/z, its change per pixel, share of the votes); 0 if there is none, or nothing missing.
// Cells with many points have their own.
// evidence: how alike the colours are of the points that it comes from, at best, and 1 where these decide.
// stops_map: stops_of each ray, as shares of MOST_STEPS.
// is_alone: most of the picture's border is missing, as round an object that was cut out. Only what all rays find points
// around has a plane then.
vec4 cast_rays(
    sampler2D near_planes, sampler2D other_planes, sampler2D colors_map, sampler2D stops_map, ivec2 cell,
    float hidden_below, bool is_alone, out vec2 evidence
) {
    ivec2 cells = textureSize(colors_map, 0);
    vec4 own = texel_at(colors_map, cell), plane = texel_at(near_planes, cell);
    bool asked = is_asked(near_planes, colors_map, cell, is_alone);
    vec3 missing = unpack_color(own.z);
    float likeness[CANDIDATES];
    evidence = vec2(0.0);
    plane = own.w > 0.0 && !asked ? vec4(plane.xyz, 1.0) : vec4(0.0);
    for (int turn = 0; turn < once_if(asked ? own.w / float(SIDE * SIDE) : 0.0); ++turn) {
        int meeting = 0;  // rays that meet points
        for (int k = 0; k < CANDIDATES; ++k) candidates[k] = vec4(0.0);
        for (int ray = 0; ray < RAYS; ++ray) {
            vec2 direction = ray_direction(ray);
            vec2 steps = floor(texel_at(stops_map, stops_place(cell, ray, cells)).xy * MOST_STEPS + 0.5);
            for (int stop = 0; stop < STOPS; ++stop) {
                float step = stop == 0 ? steps.x : steps.y;
                ivec2 there = cell_on_ray(cell, direction, step);
                for (int layer = 0; layer < (step > 0.0 ? 2 : 0); ++layer) {
                    vec4 one = layer == 0 ? texel_at(near_planes, there) : texel_at(other_planes, there);
                    vec2 colors = texel_at(colors_map, there).xy;
                    vec2 off = vec2(cell - there);
                    int number = (ray * STOPS + stop) * 2 + layer;
                    likeness[number] = color_likeness(unpack_color(layer == 0 ? colors.x : colors.y), missing);
                    float votes = color_vote(likeness[number]) * min(one.w / MANY, 1.0) / length(off);
                    candidates[number] = candidate_of(moved_plane(one.xyz, float(SIDE) * off), votes, hidden_below);
                }
            }
            meeting += steps.x > 0.0 ? 1 : 0;
        }
        float farthest = 1e30;
        int doubted = hidden_below > 0.0 ? CANDIDATES : 0;  // what lies in a shadow is hidden by what is nearer
        for (int k = 0; k < doubted; ++k) {
            farthest = candidates[k].w > 0.0 ? min(farthest, candidates[k].x) : farthest;
        }
        for (int k = 0; k < doubted; ++k) {
            candidates[k].w *= candidates[k].x > NEARER * farthest ? proven_share(likeness[k]) : 1.0;
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
