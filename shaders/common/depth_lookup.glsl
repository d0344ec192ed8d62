#include "common/splat.glsl"

// Looks a target pixel up in its frame.

const float SAME_SURFACE = 0.02;  // a neighbour off the tangent plane by more than this share of 1/z is another surface
const float RIM_REACH = 0.985;    // source pixels from a rim's pixel that it may cover
const float BEFORE = 1.5;         // pixels of depth by which what hides a surface lies before its plane, at least
const float NEARBY = 1e-4;        // share of 1/z by which an error counts for more, a pixel farther: of equals the nearest counts
const int HIDDEN_PIXELS = 2;      // so many pixels a surface goes on behind what hides it

// Row and column of a pixel by its number. Integer division is slow on many GPUs; float division may be wrong by one.
ivec2 pixel_of(int index, int columns) {
    int row = int(float(index) / float(columns));
    int column = index - row * columns;
    if (column < 0) return ivec2(column + columns, row - 1);
    if (column >= columns) return ivec2(column - columns, row + 1);
    return ivec2(column, row);
}

// Position in the source picture that a target pixel shows; inside the splat by construction.
vec2 source_position(Footprint splat, vec2 pixel, vec2 target_pixel) {
    vec2 bend = splat_bend(splat, splat_reach(1.0, false));
    vec3 back = carry_offset_back(invert_footprint(splat.to_target), bend, target_pixel - splat.centre);
    return pixel + back.xy;
}

// 1/z of the tangent plane at a position in the source picture; w and slope are the plane's at pixel.
float inverse_depth_at(vec2 at, vec2 pixel, float w, vec2 slope) {
    return max(w + dot(slope, at - pixel), 0.01 * w);  // never behind the camera
}

// The same from the other side: what a target pixel with this 1/z shows, as a position in the source picture and 1/z
// there. view takes source axes to target axes.
vec3 carry_back(vec2 target_pixel, float inverse_depth, vec4 target, mat4 view, vec4 source) {
    vec3 h = (pixel_ray(target_pixel, target) - view[3].xyz * inverse_depth) * mat3(view);  // v * M = transpose(M) * v
    return vec3(project(h, source), inverse_depth / h.z);
}

// The bits of a 1/z, the last of which says whether it is that of a surface that goes on behind another in its frame.
uint hidden_mark(uint bits, bool hidden) {
    return hidden ? bits | 1u : bits & ~1u;
}

// Depths z are negative at rims.

// Weight of the neighbour with depth z at a corner around `at`: bilinear, but 0 if the neighbour is missing or on
// another surface, so that nothing blends across an edge.
float neighbour_weight(float z, vec2 corner, vec2 at, vec2 pixel, float w, vec2 slope) {
    float expected = w + dot(slope, corner - pixel);
    vec2 closeness = max(1.0 - abs(at - corner), 0.0);
    return z == 0.0 || abs(1.0 / abs(z) - expected) > SAME_SURFACE * w ? 0.0 : closeness.x * closeness.y;
}

// Whether the splat at a corner covers this position, and how well its 1/z agrees. The most likely has the least value.
float look_up_error(float z, vec2 corner, vec2 at, float w_at) {
    vec2 off = abs(at - corner);
    if (z == 0.0 || max(off.x, off.y) > (z < 0.0 ? RIM_REACH : 0.501 + MARGIN)) return 1e30;
    return abs(1.0 / abs(z) - w_at);
}
