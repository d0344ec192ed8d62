#include "common/parts.glsl"
#include "common/rim_marks.glsl"

// What several frames of one object say about each other's points. A frame supports a point if it has one there, too; it
// sees through it if it has only points beyond.

const float NO_OVERLAP = 1e30;
const float SEE_THROUGH = 0.02;  // by which share of the depth all must lie beyond, at least
const float DARKEST = 0.059;     // beyond these, colours may be clipped, and tell no exposure
const float BRIGHTEST = 0.941;
const int EDGE_REACH = 4;        // source pixels from an edge of the surface in which points are trusted less
const int BORDER_REACH = 24;     // and from the border of the picture
const float CONTESTED = 0.75;    // trust in points that some see through, but not most
const float DENSER = 1.3;         // so many times as many points on a surface show it better
const float FLAT_COSINE = 0.25;  // what is seen flatter beside an edge is taken for flying pixels

// Where a point lies for another camera: position in its picture, and 1/z. view takes source axes to its axes.
vec3 carry_forth(vec2 pixel, float w, vec4 source, mat4 view, vec4 other) {
    vec3 h = mat3(view) * pixel_ray(pixel, source) + view[3].xyz * w;
    return vec3(project(h, other), w / h.z);
}

// Does a surface with this normal face a camera that sees it in this direction? Else it hides itself.
bool faces(vec3 normal, vec3 direction) {
    return dot(normal, direction) < 0.0;
}

bool lies_inside(vec3 there, vec2 size) {
    return there.z > 0.0 && all(greaterThanEqual(there.xy, vec2(-0.5))) && all(lessThan(there.xy, size - 0.5));
}

// By which share a frame's depth at this place exceeds that of the point projected there.
float depth_excess(sampler2D surface_map, vec3 there, vec4 intrinsics) {
    if (!lies_inside(there, vec2(textureSize(surface_map, 0)))) return NO_OVERLAP;
    Corners corners = corners_at(surface_map, there.xy);
    bvec2 side = seen_corner(corners, there.xy, there.z);
    vec4 own = corner_surface(corners, side);
    vec2 pixel = vec2(corner_pixel(corners, side));
    if (own.w == 0.0) return NO_OVERLAP;
    vec2 slope = inverse_depth_slope(own.xyz, pixel_ray(pixel, intrinsics), own.w, intrinsics);
    return there.z / inverse_depth_at(there.xy, pixel, 1.0 / own.w, slope) - 1.0;
}

// x: 1 if the frame supports the point projected there; y: 1 if it sees through it.
vec2 vote_on(sampler2D surface_map, vec3 there, vec4 intrinsics, float band) {
    if (!lies_inside(there, vec2(textureSize(surface_map, 0)))) return vec2(0.0);
    Corners corners = corners_at(surface_map, there.xy);
    vec4 depth = vec4(corners.a.w, corners.b.w, corners.c.w, corners.d.w);
    bool is_beyond = all(greaterThan(abs(depth) * there.z, vec4(1.0 + max(2.0 * band, SEE_THROUGH))));
    bool is_there = abs(depth_excess(surface_map, there, intrinsics)) < band;
    return vec2(is_there ? 1.0 : 0.0, is_beyond ? 1.0 : 0.0);
}

// How densely the points of a frame lie on the surface at one of them.
float point_density(vec4 own, vec2 pixel, vec4 intrinsics) {
    return abs(intrinsics.x * intrinsics.y) * max(-dot(own.xyz, normalize(pixel_ray(pixel, intrinsics))), 0.0) / (own.w * own.w);
}

// Does a frame show the surface of the point projected there more densely, and all around it? density: the point's
bool shows_better(sampler2D surface_map, vec3 there, vec4 intrinsics, float band, float density) {
    Corners corners = corners_at(surface_map, there.xy);
    bvec2 side = seen_corner(corners, there.xy, there.z);
    vec4 own = corner_surface(corners, side);
    vec2 pixel = vec2(corner_pixel(corners, side)), low = vec2(corners.low), high = vec2(corners.high);
    vec2 slope = inverse_depth_slope(own.xyz, pixel_ray(pixel, intrinsics), own.w, intrinsics);
    return point_density(own, pixel, intrinsics) > DENSER * density
        && lies_on_plane(corners.a.w, low - pixel, own.w, slope, 2.0 * band)
        && lies_on_plane(corners.b.w, vec2(high.x, low.y) - pixel, own.w, slope, 2.0 * band)
        && lies_on_plane(corners.c.w, vec2(low.x, high.y) - pixel, own.w, slope, 2.0 * band)
        && lies_on_plane(corners.d.w, high - pixel, own.w, slope, 2.0 * band);
}

// Do others show a point better, and all points of its surface beside it? votes_map: from view_votes.frag
bool is_shown_better(sampler2D votes_map, sampler2D surface_map, ivec2 pixel, vec4 source) {
    vec4 own = surface_at(surface_map, pixel);
    ivec2 last = textureSize(surface_map, 0) - 1;
    vec2 slope = inverse_depth_slope(own.xyz, pixel_ray(vec2(pixel), source), own.w, source);
    bool all_are = true;
    for (int k = 0; k < 9; ++k) {
        ivec2 next = clamp(pixel + ivec2(k % 3, k / 3) - 1, ivec2(0), last);
        bool goes_on = lies_on_plane(surface_at(surface_map, next).w, vec2(next - pixel), own.w, slope, SAME_SURFACE);
        all_are = all_are && (!goes_on || texel_at(votes_map, next).b > 0.0);
    }
    return all_are && texel_at(votes_map, pixel).b > 0.0;
}

// The four pixels around a point, by how near they are to it: those that have its surface less those that see through it.
// is_exact: where a frame has no depth, nothing is.
float end_vote(sampler2D surface_map, vec3 there, vec4 intrinsics, float band, bool is_exact) {
    Corners corners = corners_at(surface_map, there.xy);
    vec2 share = there.xy - floor(there.xy);
    float sum = 0.0;
    for (int k = 0; k < 4; ++k) {
        bvec2 side = bvec2((k & 1) == 1, k > 1);
        vec4 surface = corner_surface(corners, side);
        vec2 pixel = vec2(corner_pixel(corners, side));
        float weight = (side.x ? share.x : 1.0 - share.x) * (side.y ? share.y : 1.0 - share.y);
        if (surface.w > 0.0) {
            vec2 slope = inverse_depth_slope(surface.xyz, pixel_ray(pixel, intrinsics), surface.w, intrinsics);
            float excess = there.z / inverse_depth_at(there.xy, pixel, 1.0 / surface.w, slope) - 1.0;
            bool is_beyond = min(excess, surface.w * there.z - 1.0) > band;
            sum += abs(excess) < 0.5 * band ? weight : is_beyond ? -weight : 0.0;
        } else {
            sum -= is_exact ? weight : 0.0;
        }
    }
    return lies_inside(there, vec2(textureSize(surface_map, 0))) ? sum : 0.0;
}

// Log of one colour over the other, linear; NO_OVERLAP where either may be clipped.
vec3 log_ratio(vec3 encoded, vec3 other_encoded, vec3 linear, vec3 other_linear) {
    vec3 low = min(encoded, other_encoded), high = max(encoded, other_encoded);
    bvec3 clipped = bvec3(
        low.r < DARKEST || high.r > BRIGHTEST, low.g < DARKEST || high.g > BRIGHTEST, low.b < DARKEST || high.b > BRIGHTEST
    );
    vec3 ratio = log(max(linear, 1e-6) / max(other_linear, 1e-6));
    return vec3(clipped.r ? NO_OVERLAP : ratio.r, clipped.g ? NO_OVERLAP : ratio.g, clipped.b ? NO_OVERLAP : ratio.b);
}

// 1 if the surface ends at a pixel: it is missing, or a neighbour's depth lies off its plane.
float surface_ends(sampler2D surface_map, ivec2 pixel, vec4 source) {
    vec4 own = surface_at(surface_map, pixel);
    if (own.w == 0.0) return 1.0;
    ivec2 last = textureSize(surface_map, 0) - 1;
    vec2 slope = inverse_depth_slope(own.xyz, pixel_ray(vec2(pixel), source), own.w, source);
    bool ends = false;
    for (int k = 0; k < 4; ++k) {
        ivec2 next = clamp(pixel + (k < 2 ? ivec2(2 * k - 1, 0) : ivec2(0, 2 * k - 5)), ivec2(0), last);
        ends = ends || !lies_on_plane(surface_at(surface_map, next).w, vec2(next - pixel), own.w, slope, SAME_SURFACE);
    }
    return ends ? 1.0 : 0.0;
}

// Pixels to the next end of the surface in the pixel's row, as a share of EDGE_REACH.
float end_in_row(sampler2D ends_map, ivec2 pixel) {
    ivec2 last = textureSize(ends_map, 0) - 1;
    int found = EDGE_REACH;
    for (int k = -EDGE_REACH; k <= EDGE_REACH; ++k) {
        ivec2 place = clamp(pixel + ivec2(k, 0), ivec2(0), last);
        if (texel_at(ends_map, place).r > 0.5) found = min(found, abs(place.x - pixel.x));
    }
    return float(found) / float(EDGE_REACH);
}

// Pixels to the next end of the surface, along rows and columns, up to EDGE_REACH. rows_map: from end_in_row.
int end_around(sampler2D rows_map, ivec2 pixel) {
    ivec2 last = textureSize(rows_map, 0) - 1;
    int found = EDGE_REACH;
    for (int k = -EDGE_REACH; k <= EDGE_REACH; ++k) {
        ivec2 place = clamp(pixel + ivec2(0, k), ivec2(0), last);
        int across = int(texel_at(rows_map, place).r * float(EDGE_REACH) + 0.5);
        if (across < EDGE_REACH) found = min(found, max(across, abs(place.y - pixel.y)));
    }
    return found;
}

// x: above a half if a point is trusted; y: how good it is, more than 0 and at most 1. Points that more frames see through than
// support float; those at an edge, or beside it and seen flat, that nobody supports fly, but in frames without noise.
vec2 trust_in(vec2 votes, int edge, int border, float cosine, bool is_exact) {
    bool floats = votes.y > votes.x + (edge >= 2 ? 1.0 : 0.0);
    bool flies = !is_exact && (edge == 0 || (edge == 1 && cosine < FLAT_COSINE)) && votes.x == 0.0;
    float quality = float(edge) / float(EDGE_REACH) * float(min(border, BORDER_REACH)) / float(BORDER_REACH);
    return vec2(floats || flies ? 0.0 : votes.y > 0.0 ? CONTESTED : 1.0, max(quality, 1.0 / 255.0));
}
