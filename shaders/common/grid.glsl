#include "common/look_up.glsl"

// The triangles between neighbouring pixels of a frame. The source work (ETH Zurich 2001) formed such triangles only for
// normals (figure 3.4), and proposed to draw them (section 5.3.3); it left out neighbours beyond a depth step (figure 5.5).
// A square has the corners a, b above and c, d below: surfaces, unit normal and depth, depth 0 where there is none.

const int FIRST = 1, SECOND = 2;  // triangles of a square: a b c and d c b
const int OTHER_DIAGONAL = 4;     // instead b d a and c a d

// Four vertices make both triangles: 0 1 2 and 3 2 1. These are their corners, for either diagonal.
const ivec2 CORNERS[8] = ivec2[8](
    ivec2(0, 0), ivec2(1, 0), ivec2(0, 1), ivec2(1, 1), ivec2(1, 0), ivec2(1, 1), ivec2(0, 0), ivec2(0, 1)
);

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

// The square's corner at which a vertex lies. One that belongs only to a triangle that is not there lies on another one,
// so that this triangle has no area.
ivec2 vertex_corner(int triangles, int vertex) {
    bool is_unused = vertex == 0 && (triangles & FIRST) == 0 || vertex == 3 && (triangles & SECOND) == 0;
    return CORNERS[((triangles & OTHER_DIAGONAL) != 0 ? 4 : 0) + (is_unused ? 1 : vertex)];
}

// Unit normal of a triangle, towards the camera at the origin; of one without area, the direction there.
vec3 triangle_normal(vec3 p, vec3 q, vec3 r) {
    vec3 n = cross((q - p) / p.z, (r - p) / p.z);  // divided by z: no unit can overflow
    float size = length(n);
    if (!(size > 0.0)) return -normalize(p);
    return n / (dot(n, p) > 0.0 ? -size : size);
}

// Where a triangle's colour is read: in squares with both triangles between the pixels; beside an edge at the nearest
// pixel, so that the other side of the edge does not mix in.
vec2 triangle_position(vec2 at, bool is_whole) {
    return is_whole ? at : floor(at + 0.5);
}
