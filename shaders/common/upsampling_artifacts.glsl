#include "common/inverse_depth.glsl"

// Finds out whether a depth picture was enlarged, or moved to another camera's pixels: then some lines repeat the line
// before.

const float STEEP = 2.5;        // finest steps: if a line moves so far, rounding alone cannot make two lines equal
const float EDGE_STEP = 0.05;   // a larger relative step is a depth edge
const float LINES_SHARE = 0.4;  // whole lines repeat: 5x5 pixels hold 5 positions; their mean keeps 1/5 = 1/25 + 0.4^2
const int SLOPE_REACH = 4;      // pixels over which the slope is measured: longer than one copy

// Among the lines of a 4x4 patch along `across`: how many repeat the line before (x), and how many could (y). Rounding
// repeats lines, too, but only where the surface moves by less than a step per line. So a patch counts only if some
// whole line moves by STEEP times the finest step in the patch.
vec2 count_copies(sampler2D depth_map, ivec2 corner, ivec2 across) {
    float z[16];
    float least = 1e30, finest = 1e30, largest = 0.0, copies = 0.0;
    for (int k = 0; k < 16; ++k) {
        z[k] = depth_at(depth_map, corner, across * (k / 4) + (ivec2(1) - across) * (k % 4));
        least = min(least, z[k]);
    }
    for (int line = 0; line < 4; ++line) {
        float moved = 1e30, most = 0.0;
        for (int k = 4 * line; k < 4 * line + 4; ++k) {
            float along = k % 4 > 0 ? abs(z[k] - z[k - 1]) : 0.0;
            float step = line > 0 ? abs(z[k] - z[k - 4]) : 0.0;
            finest = along > 0.0 ? min(finest, along) : finest;
            finest = step > 0.0 ? min(finest, step) : finest;
            moved = min(moved, step);
            most = max(most, step);
        }
        largest = max(largest, moved);
        copies += line > 0 && most == 0.0 ? 1.0 : 0.0;
    }
    bool counts = least > 0.0 && largest > STEEP * finest && largest < EDGE_STEP * least;
    return counts ? vec2(copies, 3.0) : vec2(0.0);
}

// Noise over depth (x), and the part that neighbours share over the rest (y), with misplacement added.
vec2 add_misplaced(vec2 noise, float moved) {
    float sum = noise.x * noise.x + moved * moved;
    float in_common = noise.x * noise.y * noise.x * noise.y + LINES_SHARE * moved * LINES_SHARE * moved;
    return vec2(sqrt(sum), sqrt(in_common / max(sum, 1e-30)));
}

// Noise over depth, as depths are displaced by `misplaced` pixels (standard deviation) from where they were measured:
// that many times the slope of the surface. The flatter side gives the slope; it is 0 on edges and tops. Beside a hole
// the known side gives it.
float misplaced_noise(sampler2D depth_map, ivec2 pixel, float z, float misplaced) {
    vec2 slope = vec2(0.0);
    for (int axis = 0; axis < 2; ++axis) {
        ivec2 reach = axis == 0 ? ivec2(SLOPE_REACH, 0) : ivec2(0, SLOPE_REACH);
        float before = depth_at(depth_map, pixel, -reach), after = depth_at(depth_map, pixel, reach);
        float rise = relative_step(z, after > 0.0 ? after : z), fall = -relative_step(z, before > 0.0 ? before : z);
        rise = after > 0.0 ? rise : fall;
        fall = before > 0.0 ? fall : rise;
        float least = min(abs(fall), abs(rise)) / float(SLOPE_REACH);
        slope[axis] = fall * rise > 0.0 && least < EDGE_STEP ? least : 0.0;
    }
    return misplaced * length(slope);
}
