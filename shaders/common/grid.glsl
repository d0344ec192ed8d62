#include "common/splat_corners.glsl"
#include "common/rim_marks.glsl"

// The mesh between neighbouring pixels of a frame. The source work (ETH Zurich 2001) formed such triangles only for
// normals (figure 3.4), and proposed to draw them (section 5.3.3); it left out neighbours beyond a depth step (figure 5.5).
// A square has the corners a, b above and c, d below: surfaces, unit normal and depth, depth 0 where there is none. Places
// in it are counted from a. Where triangles are missing, each corner's own pixel goes on to its edge, on its tangent plane;
// behind something nearer it goes on for two more pixels.

const int FIRST = 1, SECOND = 2;  // triangles of a square: a b c and d c b
const int OTHER_DIAGONAL = 4;     // instead b d a and c a d
const int CODES = 8;
const int QUARTER = 4;            // pieces of a square: FIRST, SECOND; QUARTER, 2 QUARTER, ... of its corners' own pixels

const float LEVEL = 0.05;         // pixels of depth by which pixels may leave a plane to be drawn as one piece
const float NOTHING = 0.0;        // how a square is drawn: not, or by another one
const float SINGLE = 1.0;         // as one piece
const float PAIRS = 2.0;          // as one piece with those on the right and below
const float IN_PIECES = 3.0;
const int FIRST_SQUARE = 1;       // columns and rows of squares before the frame

const float SEAM = 0.02;          // source pixels by which pieces overlap
const float STEEPEST = 10.0;      // pixels of depth for each pixel: a steeper surface does not go on behind another
const float STEEP_END = 1.0;      // and one that ends there ends less steep
const float ON_MESH = 0.0005;     // share of 1/z by which what is seen may be off the triangle that it is looked up in

// A part of a plane, over a square.
struct Piece {
    vec3 plane;  // change of 1/z for each pixel to the right and down, and 1/z at the first corner
    vec4 box;    // left, top, right, bottom
    vec3 side;   // it is where dot(side, vec3(place, 1)) is not below 0
};

// What is seen of a mesh.
struct GridSeen {
    vec2 at;              // position in the frame
    float inverse_depth;  // 1/z in the target view
    ivec2 pixel;          // the nearest one that belongs to it
    int triangle;         // FIRST or SECOND, and OTHER_DIAGONAL; 0 beside all triangles
    bool is_whole;        // the square has both triangles
    Corners corners;
};

// Do two neighbours, the second one this many pixels off, belong to one surface? By max_step, in z: metres, and share of
// the nearer one's depth. Where it is 0: if one of them lies on the other's tangent plane, as nearly as for splats.
bool is_joined(vec4 own, vec4 other, vec2 pixel, vec2 off, vec4 intrinsics, vec2 max_step) {
    if (own.w == 0.0 || other.w == 0.0) return false;
    if (max_step != vec2(0.0)) return abs(own.w - other.w) <= max_step.x + max_step.y * min(own.w, other.w);
    vec2 slope = inverse_depth_slope(own.xyz, pixel_ray(pixel, intrinsics), own.w, intrinsics);
    vec2 other_slope = inverse_depth_slope(other.xyz, pixel_ray(pixel + off, intrinsics), other.w, intrinsics);
    return lies_on_plane(other.w, off, own.w, slope, SAME_SURFACE)
        || lies_on_plane(own.w, -off, other.w, other_slope, SAME_SURFACE);
}

// Which triangles a square has, the sum of the numbers above: those whose corners are joined, two at most. The diagonal is
// b c, unless only the other one has a triangle.
int square_triangles(vec4 a, vec4 b, vec4 c, vec4 d, vec2 pixel, vec4 intrinsics, vec2 max_step) {
    const vec2 right = vec2(1.0, 0.0), down = vec2(0.0, 1.0);
    bool above = is_joined(a, b, pixel, right, intrinsics, max_step);
    bool below = is_joined(c, d, pixel + down, right, intrinsics, max_step);
    bool left = is_joined(a, c, pixel, down, intrinsics, max_step);
    bool beside = is_joined(b, d, pixel + right, down, intrinsics, max_step);
    bool rising = is_joined(b, c, pixel + right, down - right, intrinsics, max_step);
    bool falling = is_joined(a, d, pixel, right + down, intrinsics, max_step);
    int usual = (above && left && rising ? FIRST : 0) + (below && beside && rising ? SECOND : 0);
    int others = (above && beside && falling ? FIRST : 0) + (left && below && falling ? SECOND : 0);
    return usual == 0 && others != 0 ? OTHER_DIAGONAL + others : usual;
}

// Is what the pixel shows that is this far off nearer than a surface goes on to there? slope: of that, as a share of 1/z
bool hides(sampler2D surface_map, ivec2 pixel, ivec2 off, float z, vec2 slope, float focal) {
    float there = abs(texel_or_zero(surface_map, pixel + off).w);
    return there > 0.0 && focal * (relative_step(z, there) - dot(slope, vec2(off))) > BEFORE;
}

// How far a pixel's own square reaches where no triangle is: left, up, right, down, source pixels. Half a pixel; farther
// where the next pixels hide what its plane goes on to.
vec4 edge_reach(sampler2D surface_map, ivec2 pixel, vec4 source) {
    vec4 own = surface_at(surface_map, pixel), reach = vec4(0.5);
    vec3 ray = pixel_ray(vec2(pixel), source);
    float focal = mean_focal_length(source);
    vec2 slope = own.w * inverse_depth_slope(own.xyz, ray, own.w, source), steep = slope - facing_slope(ray.xy, source);
    for (int k = 0; k < 4; ++k) {
        ivec2 outward = (k & 1) == 0 ? ivec2(k - 1, 0) : ivec2(0, k - 2);
        bool goes_on = focal * abs(dot(steep, vec2(outward))) < STEEPEST;
        for (int off = 1; off <= HIDDEN_PIXELS; ++off) {
            goes_on = goes_on && hides(surface_map, pixel, off * outward, own.w, slope, focal);
            if (goes_on) reach[k] += 1.0;
        }
    }
    // Between two such directions as well; else the square goes on in one of them only.
    for (int k = 0; k < 4 * HIDDEN_PIXELS * HIDDEN_PIXELS; ++k) {
        int right = 2 * (k & 1), down = 1 + (k & 2);
        ivec2 off = ivec2(k >> 2 & 1, k >> 3) + 1, outward = ivec2(right - 1, down - 2);
        bool is_reached = reach[right] > float(off.x) && reach[down] > float(off.y);
        if (is_reached && !hides(surface_map, pixel, off * outward, own.w, slope, focal)) reach[down] = 0.5;
    }
    return reach;
}

// The slope of 1/z of a pixel's own square on one side: of its tangent plane; where it does not go on behind something else,
// at a smooth outline, not so steep that it would stick out in other views. hidden: to the right or left, up or down
vec2 edge_slope(vec4 own, vec2 pixel, bvec2 is_hidden, vec4 source) {
    vec3 ray = pixel_ray(pixel, source);
    vec2 slope = inverse_depth_slope(own.xyz, ray, own.w, source), facing = facing_slope(ray.xy, source) / own.w;
    vec2 most = vec2(STEEP_END / (mean_focal_length(source) * own.w));
    return mix(facing + clamp(slope - facing, -most, most), slope, is_hidden);
}

// A square's triangles and the reach of its first pixel as one number, and back.
float grid_code(int triangles, vec4 reach) {
    return float(triangles) + float(CODES) * dot(floor(reach), vec4(1.0, 4.0, 16.0, 64.0));
}

int code_triangles(float code) {
    return int(code) & (CODES - 1);
}

vec4 code_reach(float code) {
    int hidden = int(code) / CODES;
    return 0.5 + vec4(float(hidden & 3), float(hidden >> 2 & 3), float(hidden >> 4 & 3), float(hidden >> 6 & 3));
}

// On which side of its diagonal a square's first triangle lies.
vec3 first_side(int triangles) {
    return (triangles & OTHER_DIAGONAL) != 0 ? vec3(1.0, -1.0, 0.0) : vec3(-1.0, -1.0, 1.0);
}

// The plane of one of a square's triangles. w: 1/z of its corners
vec3 triangle_plane(vec4 w, int triangles, bool is_second) {
    bool is_other = (triangles & OTHER_DIAGONAL) != 0;
    float right = is_second ? w.w - w.z : w.y - w.x;
    float down = is_second != is_other ? w.w - w.y : w.z - w.x;
    return vec3(right, down, is_second && !is_other ? w.y + w.z - w.w : w.x);
}

// The plane nearest to all four corners of a square; of one that is so many pixels wide, its slope times that.
vec3 square_plane(vec4 w) {
    vec2 slope = 0.5 * vec2(w.y - w.x + w.w - w.z, w.z - w.x + w.w - w.y);
    return vec3(slope, 0.25 * (w.x + w.y + w.z + w.w) - 0.5 * (slope.x + slope.y));
}

// Do a square's triangles cover all that belongs to the pixel of a corner, 0 to 3?
bool covers_corner(int triangles, int corner) {
    int there = triangles & (FIRST + SECOND);
    bool is_other = (triangles & OTHER_DIAGONAL) != 0;
    return there == FIRST + SECOND || (there == FIRST && corner == (is_other ? 1 : 0))
        || (there == SECOND && corner == (is_other ? 2 : 3));
}

// Does a pixel lie on a plane, so nearly that nobody sees a difference? w: its 1/z
bool is_level(float w, vec2 place, vec3 plane, float focal) {
    return focal * abs(w - dot(plane, vec3(place, 1.0))) < LEVEL * w;
}

// Which pieces a square is drawn as, the sum of their numbers. w: 1/z of its corners, 0 where there is none
int square_pieces(vec4 w, int triangles) {
    int pieces = triangles & (FIRST + SECOND);
    for (int k = 0; k < 4; ++k) {
        if (w[k] > 0.0 && !covers_corner(triangles, k)) pieces += QUARTER << k;
    }
    return pieces;
}

// Both triangles of squares on one plane, this many in a row.
Piece plane_piece(vec3 plane, float side) {
    return Piece(plane, vec4(0.0, 0.0, side, side), vec3(0.0, 0.0, 1.0));
}

Piece triangle_piece(vec4 w, int triangles, bool is_second) {
    vec3 side = first_side(triangles);
    return Piece(triangle_plane(w, triangles, is_second), vec4(0.0, 0.0, 1.0, 1.0), is_second ? -side : side);
}

// What a corner's own pixel covers of a square. corner: 0 to 3; slope, reach: the pixel's
Piece edge_piece(float w, int triangles, int corner, vec2 slope, vec4 reach) {
    vec2 at = vec2(float(corner & 1), float(corner >> 1));
    vec4 box = vec4(at - reach.xy * at, at + reach.zw * (1.0 - at));
    vec3 side = (triangles & FIRST) != 0 ? -first_side(triangles) : first_side(triangles);
    bool is_alone = (triangles & (FIRST + SECOND)) == 0;
    return Piece(vec3(slope, w - dot(slope, at)), box, is_alone ? vec3(0.0, 0.0, 1.0) : side);
}

// A plane over a square in the view: takes (x, y, 1), a place in the square, to a target pixel's (u, v, 1) times depth
// there over depth here.
mat3 carry_plane(vec3 plane, vec2 square, vec4 source, mat4 view, vec4 target) {
    vec3 first = mat3(view) * pixel_ray(square, source) + view[3].xyz * plane.z;
    vec3 right = view[0].xyz / source.x + view[3].xyz * plane.x;
    vec3 down = view[1].xyz / source.y + view[3].xyz * plane.y;
    mat3 lens = mat3(target.x, 0.0, 0.0, 0.0, target.y, 0.0, target.z, target.w, 1.0);
    return lens * mat3(right, down, first);
}

// The inverse; 0 where the plane is seen exactly from its edge.
mat3 invert_carried(mat3 carried) {
    vec3 x = cross(carried[1], carried[2]), y = cross(carried[2], carried[0]), s = cross(carried[0], carried[1]);
    float volume = dot(carried[0], x);
    return volume == 0.0 ? mat3(0.0) : transpose(mat3(x, y, s)) * (1.0 / volume);
}

// The box of a piece in the view, the first and the last pixel; empty where none of it can be seen. near: source units
ivec4 piece_pixels(Piece piece, mat3 carried, ivec2 target_size, float near) {
    vec2 low = vec2(1e9), high = vec2(-1e9), size = vec2(target_size);
    bool is_ahead = true, is_seen = false;
    bvec4 is_beside = bvec4(true);
    for (int k = 0; k < 4; ++k) {
        vec4 box = piece.box + SEAM * vec4(-1.0, -1.0, 1.0, 1.0);
        vec3 place = vec3((k & 1) == 0 ? box.x : box.z, (k & 2) == 0 ? box.y : box.w, 1.0), at = carried * place;
        bool is_before = near * dot(piece.plane, place) <= at.z;
        is_ahead = is_ahead && is_before;
        is_seen = is_seen || is_before;
        is_beside.xy = bvec2(is_beside.x && at.x < -at.z, is_beside.y && at.y < -at.z);
        is_beside.zw = bvec2(is_beside.z && at.x > size.x * at.z, is_beside.w && at.y > size.y * at.z);
        low = min(low, at.xy / at.z);
        high = max(high, at.xy / at.z);
    }
    if (!is_seen || any(is_beside)) return ivec4(0, 0, -1, -1);
    if (!is_ahead) return ivec4(0, 0, target_size - 1);
    return ivec4(clamp(ceil(low), vec2(0.0), size), clamp(floor(high), vec2(-1.0), size - 1.0));
}

// 1/z of a piece at a target pixel; 0 where it does not cover it. seen: from invert_carried
float piece_inverse_depth(Piece piece, mat3 seen, vec2 target_pixel, float near) {
    vec3 place = seen * vec3(target_pixel, 1.0);
    vec4 off = vec4(place.xy - piece.box.xy * place.z, piece.box.zw * place.z - place.xy) + SEAM * place.z;
    float inverse_depth = dot(piece.plane, place);
    bool is_inside = min(min(off.x, off.y), min(off.z, off.w)) >= 0.0 && dot(piece.side, place) >= -SEAM * place.z;
    bool is_ahead = place.z > 0.0 && inverse_depth > 0.0 && near * inverse_depth <= 1.0;
    return is_inside && is_ahead ? inverse_depth : 0.0;
}

// Weights of a, b, c, d at a place on a triangle: FIRST or SECOND, with the diagonal.
vec4 triangle_weights(int triangle, vec2 place) {
    float x = place.x, y = place.y;
    if (triangle == FIRST) return vec4(1.0 - x - y, x, y, 0.0);
    if (triangle == SECOND) return vec4(0.0, 1.0 - y, 1.0 - x, x + y - 1.0);
    if (triangle == OTHER_DIAGONAL + FIRST) return vec4(1.0 - x, x - y, 0.0, y);
    return vec4(1.0 - y, 0.0, y - x, x);
}

// 1/z of a pixel's own square at a position; 0 where it does not reach.
float edge_inverse_depth(sampler2D surface_map, sampler2D triangle_map, ivec2 pixel, vec2 at, vec4 source) {
    vec4 own = surface_at(surface_map, pixel), reach = code_reach(texel_at(triangle_map, pixel).r);
    vec2 off = at - vec2(pixel), side = mix(reach.xy, reach.zw, greaterThan(off, vec2(0.0)));
    if (own.w == 0.0 || any(greaterThan(abs(off), side + 2.0 * SEAM))) return 0.0;
    return 1.0 / own.w + dot(edge_slope(own, vec2(pixel), greaterThan(side, vec2(1.0)), source), off);
}

// By which share of 1/z it is off what is seen there, and a little for its distance; very much where it does not reach. Rims
// are where they are seen.
float edge_error(sampler2D surface_map, sampler2D triangle_map, ivec2 pixel, vec2 at, float w_at, vec4 source) {
    float w = edge_inverse_depth(surface_map, triangle_map, pixel, at, source), marked = texel_at(surface_map, pixel).w;
    float error = w > 0.0 ? abs(w - w_at) : 1e30;
    float as_rim = marked < 0.0 ? look_up_error(marked, vec2(pixel), at, w_at) : 1e30;
    return min(error, as_rim) / w_at + NEARBY * length(at - vec2(pixel));
}

// The pixel whose own square is seen at a position; the nearest one if it fits.
ivec2 edge_pixel(sampler2D surface_map, sampler2D triangle_map, vec2 at, float w_at, vec4 source) {
    ivec2 last = textureSize(surface_map, 0) - 1;
    ivec2 pixel = clamp(ivec2(floor(at + 0.5)), ivec2(0), last);
    float least = edge_error(surface_map, triangle_map, pixel, at, w_at, source);
    int across = 2 * HIDDEN_PIXELS + 2;
    int others = least > ON_MESH ? across * across : 0;  // a loop that no pixel takes costs software drivers nothing
    for (int k = 0; k < others; ++k) {
        ivec2 other = clamp(ivec2(floor(at)) - HIDDEN_PIXELS + ivec2(k % across, k / across), ivec2(0), last);
        float error = edge_error(surface_map, triangle_map, other, at, w_at, source);
        pixel = error < least ? other : pixel;
        least = min(error, least);
    }
    return pixel;
}

// What a target pixel shows of a mesh whose 1/z is known there. 1/z is then that of the triangle or of
// the pixel's own square, to the last digit.
GridSeen look_up_grid(
    sampler2D surface_map, sampler2D triangle_map, float inverse_depth, vec2 target_pixel, vec4 source, mat4 view,
    vec4 target
) {
    vec3 back = carry_back(target_pixel, inverse_depth, target, view, source);
    Corners corners = corners_at(surface_map, back.xy);
    vec2 place = back.xy - floor(back.xy);
    int triangles = 0;
    if (ivec2(floor(back.xy)) == corners.low) triangles = code_triangles(texel_at(triangle_map, corners.low).r);
    int which = dot(first_side(triangles), vec3(place, 1.0)) >= 0.0 ? FIRST : SECOND;
    vec4 w = 1.0 / abs(vec4(corners.a.w, corners.b.w, corners.c.w, corners.d.w));
    float on_mesh = dot(triangle_plane(w, triangles, which == SECOND), vec3(place, 1.0));
    GridSeen seen = GridSeen(back.xy, inverse_depth, ivec2(0), 0, false, corners);
    if ((triangles & which) != 0 && abs(on_mesh - back.z) <= ON_MESH * back.z) {
        seen.triangle = which + (triangles & OTHER_DIAGONAL);
        seen.is_whole = (triangles & (FIRST + SECOND)) == FIRST + SECOND;
    }
    seen.pixel = clamp(ivec2(floor(back.xy + 0.5)), ivec2(0), textureSize(surface_map, 0) - 1);
    int edges = seen.triangle == 0 ? 1 : 0;  // a loop that no pixel takes costs software drivers nothing
    for (int k = 0; k < edges; ++k) {
        seen.pixel = edge_pixel(surface_map, triangle_map, back.xy, back.z, source);
        on_mesh = edge_inverse_depth(surface_map, triangle_map, seen.pixel, back.xy, source);
    }
    if (abs(on_mesh - back.z) <= ON_MESH * back.z) {
        seen.inverse_depth = on_mesh / (mat3(view) * pixel_ray(back.xy, source) + view[3].xyz * on_mesh).z;
    }
    return seen;
}

// Where a colour is read: in squares with both triangles between the pixels; beside an edge at the nearest pixel, so that
// the other side of the edge does not mix in.
vec2 grid_color_position(GridSeen seen) {
    return seen.is_whole ? seen.at : vec2(seen.pixel);
}

// A value of the pixels, interpolated on a triangle; beside them that of the pixel itself.
vec3 mix_corners(GridSeen seen, vec3 a, vec3 b, vec3 c, vec3 d, vec3 own) {
    vec4 weight = triangle_weights(seen.triangle, seen.at - floor(seen.at));
    return seen.triangle == 0 ? own : weight.x * a + weight.y * b + weight.z * c + weight.w * d;
}

vec3 grid_normal(sampler2D surface_map, GridSeen seen) {
    Corners corners = seen.corners;
    vec3 own = texel_at(surface_map, seen.pixel).xyz;
    return normalize(mix_corners(seen, corners.a.xyz, corners.b.xyz, corners.c.xyz, corners.d.xyz, own));
}

// lit_map: linear light of each pixel of the frame
vec3 grid_light(sampler2D lit_map, GridSeen seen) {
    ivec2 low = seen.corners.low, high = seen.corners.high;
    return mix_corners(
        seen, texelFetch(lit_map, low, 0).rgb, texelFetch(lit_map, ivec2(high.x, low.y), 0).rgb,
        texelFetch(lit_map, ivec2(low.x, high.y), 0).rgb, texelFetch(lit_map, high, 0).rgb,
        texelFetch(lit_map, seen.pixel, 0).rgb
    );
}

// Unit normal of a triangle, towards the camera at the origin; of one without area, the direction there.
vec3 triangle_normal(vec3 p, vec3 q, vec3 r) {
    vec3 n = cross((q - p) / p.z, (r - p) / p.z);  // divided by z: no unit can overflow
    float size = length(n);
    if (!(size > 0.0)) return -normalize(p);
    return n / (dot(n, p) > 0.0 ? -size : size);
}

// The point at which a triangle is lit that is lit only once, and its normal: of a square's own pixel itself.
void grid_facet(sampler2D surface_map, GridSeen seen, vec4 source, out vec3 middle, out vec3 facet) {
    vec2 low = vec2(seen.corners.low);
    vec3 a = pixel_ray(low, source) * abs(seen.corners.a.w);
    vec3 b = pixel_ray(low + vec2(1.0, 0.0), source) * abs(seen.corners.b.w);
    vec3 c = pixel_ray(low + vec2(0.0, 1.0), source) * abs(seen.corners.c.w);
    vec3 d = pixel_ray(low + 1.0, source) * abs(seen.corners.d.w);
    bool is_second = (seen.triangle & SECOND) != 0, is_other = (seen.triangle & OTHER_DIAGONAL) != 0;
    vec3 p = is_other ? (is_second ? c : b) : (is_second ? d : a);
    vec3 q = is_other ? (is_second ? a : d) : (is_second ? c : b);
    vec3 r = is_other ? (is_second ? d : a) : (is_second ? b : c);
    vec4 own = surface_at(surface_map, seen.pixel);
    middle = seen.triangle == 0 ? pixel_ray(vec2(seen.pixel), source) * own.w : (p + q + r) / 3.0;
    facet = seen.triangle == 0 ? own.xyz : triangle_normal(p, q, r);
}
