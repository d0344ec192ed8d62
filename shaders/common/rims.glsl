#include "common/splat_corners.glsl"
#include "common/rim_marks.glsl"

// A rim pixel is drawn as what is there. A surface that bends away ends at an outline between this pixel and the next:
// near a smooth outline, the square of the depth that is left to it is linear in pixels: seen from the side, the surface
// is a circle. A surface that something nearer hides goes on behind it. A surface that folds turns down at the crease,
// where its plane meets the neighbour's.

const float MOST_TILT = 10.0;    // pixels of depth for each pixel by which the surface may leave its tangent plane
const float NARROWEST = 0.02;    // pixels from a rim pixel to the outline
const float BROADEST = 0.98;
const float FARTHEST = 1.3;      // an outline that seems farther off than that is none
const float SHALLOWEST = 1.0;    // pixels of depth between the last two pixels
const float DEEPEST = 200.0;
const float STRAIGHT = 1.05;     // without a step so many times larger than the one before, the surface does not bend
const float AT_ODDS = 0.6;       // cosine between two borders of a corner
const float FARTHER_IN = 0.3;    // how far the outline of the circle may lie from the border of the pixels, inward
const float FARTHER_OUT = 0.1;
const float ALONG_A_ROW = 0.5;   // both, where the border lies along a row or a column and so may be anywhere in it
const float UNSURE = 0.5;        // share of a tilt by which a neighbour may differ that bears it out
const float CREASED = 1.0;       // pixels of depth for each pixel between two planes that meet at a crease, at least
const float UNCREASED = 0.1;     // of that, the neighbour lies so much behind the pixel's plane; as much counts as on a plane

struct Rim {
    vec2 outward;  // unit, source pixels; 0 at a corner
    float width;   // from the pixel's centre to the outline, source pixels
    float drop;    // by how many pixels of depth the outline lies behind the pixel; 0: on its tangent plane
    vec2 slope;    // of its plane: change of 1/z per pixel as a share of it
    vec4 hidden;   // how many pixels it goes on behind what is nearer: left, right, up, down
    mat4x3 folds;  // the planes of the neighbours in these directions on which it goes on beyond a crease: 1/z at the pixel
                   // and its change per pixel, as shares of the pixel's 1/z; 0 where there is none
};

// A rim pixel, its plane and its neighbours. Four directions: left, right, up, down.
struct Around {
    ivec2 pixel;
    float here;    // its depth
    vec2 facing;   // slope of the surface that faces the viewer there
    float focal;
    vec2 tilt;     // pixels of depth by which its plane rises for each pixel, where a neighbour bears it out
    vec4 rises;    // how far the next pixels rise
    vec4 farther;  // and those after them
};

// How far the pixel rises that is this far off, see rise_of.
float rise_at(sampler2D surface_map, ivec2 pixel, ivec2 off, float here, vec2 facing, float focal) {
    float there = abs(texel_or_zero(surface_map, pixel + off).w);
    return rise_of(relative_step(here, there), dot(facing, vec2(off)), focal);
}

// 1 for a direction, across and down, in which a neighbour on either side rises much as a plane does: narrow objects have
// no plane across, whatever their normal.
vec2 borne_out(vec2 tilt, vec4 rises) {
    vec4 off = abs(rises - vec4(-tilt.x, tilt.x, -tilt.y, tilt.y));
    vec2 least = vec2(min(off.x, off.y), min(off.z, off.w));
    return vec2(lessThanEqual(least, BEFORE + UNSURE * abs(tilt)));
}

Around look_around(sampler2D surface_map, ivec2 pixel, vec4 source) {
    vec4 surface = surface_at(surface_map, pixel);
    vec3 ray = pixel_ray(vec2(pixel), source);
    float focal = mean_focal_length(source);
    vec2 facing = facing_slope(ray.xy, source);
    vec2 tilt = focal * (surface.w * inverse_depth_slope(surface.xyz, ray, surface.w, source) - facing);
    vec4 rises, farther;
    for (int k = 0; k < 4; ++k) {
        rises[k] = rise_at(surface_map, pixel, direction_of(k), surface.w, facing, focal);
        farther[k] = rise_at(surface_map, pixel, 2 * direction_of(k), surface.w, facing, focal);
    }
    return Around(pixel, surface.w, facing, focal, tilt * borne_out(tilt, rises), rises, farther);
}

// How far a pixel rises that is this far off the rim pixel.
float rise_around(sampler2D surface_map, Around around, ivec2 off) {
    return rise_at(surface_map, around.pixel, off, around.here, around.facing, around.focal);
}

// Which of the 5x5 pixels belong to its surface: a bit for each, row by row.
int own_pixels(sampler2D surface_map, Around around) {
    float leave = min(length(around.tilt), MOST_TILT);
    int own = 0;
    for (int k = 0; k < 25; ++k) {
        ivec2 off = ivec2(k % 5, k / 5) - 2;
        float rise = rise_around(surface_map, around, off) - dot(around.tilt, vec2(off));
        if (rise > -(DROP + leave * length(vec2(off)))) own |= 1 << k;
    }
    return own;
}

bool is_own(int own, ivec2 off) {
    return ((own >> ((off.y + 2) * 5 + off.x + 2)) & 1) == 1;
}

// The line where the own pixels end in a direction: by how much it lies outside of the pixel's edge (x), and its slope
// (y), by least squares over five rows; z is 1 where all rows end alike.
vec3 border_line(int own, ivec2 outward) {
    ivec2 across = ivec2(-outward.y, outward.x);
    int sum = 0, moment = 0, nearest = 2, farthest = -3;
    for (int row = -2; row <= 2; ++row) {
        int end = -3;
        bool is_open = true;
        for (int k = -2; k <= 2; ++k) {
            bool belongs = is_own(own, k * outward + row * across);
            is_open = is_open && (belongs || end == -3);
            if (is_open && belongs) end = k;
        }
        sum += end;
        moment += row * end;
        nearest = min(nearest, end);
        farthest = max(farthest, end);
    }
    return vec3(0.2 * float(sum), 0.1 * float(moment), nearest == farthest ? 1.0 : 0.0);
}

float border_distance(vec3 line) {
    return clamp(0.5 + line.x, NARROWEST, BROADEST);
}

// A rim that is nothing but an outline.
Rim rim_at(vec2 outward, float width, float drop) {
    return Rim(outward, width, drop, vec2(0.0), vec4(0.0), mat4x3(0.0));
}

// The rim as the border of the pixels alone has it.
Rim straight_rim(vec3 line, ivec2 outward) {
    float cosine = 1.0 / sqrt(1.0 + line.y * line.y);
    vec2 across = vec2(float(-outward.y), float(outward.x));
    return rim_at(cosine * (vec2(outward) - line.y * across), cosine * border_distance(line), 0.0);
}

// How far the outline of a circle lies outward if the border of the pixels has a say.
float held_distance(float distance, vec3 line) {
    float border = border_distance(line);
    if (line.z > 0.5) return clamp(distance, border - ALONG_A_ROW, border + ALONG_A_ROW);
    return clamp(distance, border - FARTHER_IN, border + FARTHER_OUT);
}

// The rim from the depth of the two pixels inward, the first of which rises by a, and of those beside; `straight` where
// they lie on no circle. own: from own_pixels; line: the border outward.
Rim bent_rim(sampler2D surface_map, Around around, int own, ivec2 outward, float a, vec3 line, Rim straight) {
    float b = rise_around(surface_map, around, -2 * outward) - a;
    if (!(a > SHALLOWEST && a < DEEPEST && abs(b) < 2.0 * a + 4.0 && a > STRAIGHT * b)) return straight;
    ivec2 side = ivec2(-outward.y, outward.x);
    vec2 known = vec2(is_own(own, -side) ? 1.0 : 0.0, is_own(own, side) ? 1.0 : 0.0);
    float before = rise_around(surface_map, around, -side) * known.x;
    float after = rise_around(surface_map, around, side) * known.y;
    float share = known.x * known.y > 0.0 ? 0.5 : 1.0;
    float lateral = share * (after - before);
    float straightness = a * a / (a * a + lateral * lateral);  // nearly the square of the cosine below
    float drop = (2.0 * a * b + b * b - a * a + 2.0 * straightness) / (2.0 * (a - b));
    // Along the outward direction and across, the square of the depth that is left changes so much for each pixel.
    float along = 2.0 * drop * a + a * a + straightness;
    float across = share * (2.0 * drop * (after - before) + after * after - before * before)
        + (known.y - known.x) * (1.0 - straightness);
    float slope = sqrt(along * along + across * across);
    float cosine = along / slope;
    float width = 0.5 * (sqrt(slope * slope + 4.0 * drop * drop) - slope);
    float distance = width / cosine;
    if (!(drop > 0.0 && along > 0.0 && distance <= FARTHEST)) return straight;
    float held = held_distance(distance, line);
    if (held != distance) {
        width = held * cosine;
        drop = held * a + sqrt(held * held * a * a + held * (a * a + cosine * cosine) + width * width);
    }
    return rim_at(vec2(outward) * cosine - vec2(side) * (across / slope), max(width, NARROWEST), drop);
}

// 1 where a number is less than another, else 0.
vec4 is_less(vec4 one, float other) {
    return vec4(lessThan(one, vec4(other)));
}

// How many pixels the surface of a rim pixel goes on behind what is nearer: as long as its plane stays near its depth.
// Where it does not go on the other way, it is too narrow to tell more than one.
vec4 hidden_pixels(Around around) {
    vec4 rise = vec4(-around.tilt.x, around.tilt.x, -around.tilt.y, around.tilt.y);
    vec4 wide = is_less(abs(around.rises.yxwz + rise), BEFORE);
    vec4 first = is_less(rise - around.rises, -BEFORE) * is_less(abs(rise), DROP);
    vec4 second = is_less(2.0 * rise - around.farther, -BEFORE) * is_less(2.0 * abs(rise), DROP);
    return first * (1.0 + wide * second);
}

// The plane of a rim pixel's neighbour on which the surface goes on beyond a crease, see Rim; 0 if there is none. Each
// plane of a crease that stands out lies before the other pixel; ours may lie on the crease.
vec3 fold_at(sampler2D surface_map, Around around, int direction, vec4 source) {
    vec2 outward = vec2(direction_of(direction));
    float theirs = dot(around.tilt, outward) - around.rises[direction];
    vec3 plane = vec3(0.0);
    int folds = theirs > UNCREASED && theirs < -BOTTOMLESS ? 1 : 0;  // a loop, see estimate_rim
    for (int k = 0; k < folds; ++k) {
        vec4 there = surface_at(surface_map, around.pixel + direction_of(direction));
        vec2 slope = inverse_depth_slope(there.xyz, pixel_ray(vec2(around.pixel) + outward, source), there.w, source);
        plane = around.here * vec3(1.0 / there.w - dot(slope, outward), slope);
        float ours = around.focal * (plane.x - 1.0);
        plane.x = max(plane.x, 1.0);  // the pixel itself stays where it is
        if (!(ours > -UNCREASED && ours + theirs > CREASED)) plane = vec3(0.0);
    }
    return plane;
}

// Where the surface of a rim pixel ends, if it does.
Rim estimate_outline(sampler2D surface_map, Around around) {
    int own = own_pixels(surface_map, around);
    ivec2 last = textureSize(surface_map, 0) - 1;
    Rim straight = rim_at(vec2(0.0), 1.0, 0.0);
    ivec2 steepest = ivec2(0);  // direction in which the surface ends after the largest step
    vec3 border = vec3(0.0);     // there
    float largest = BOTTOMLESS, least = 1e30;
    bool is_corner = false;
    for (int k = 0; k < 4; ++k) {
        ivec2 outward = direction_of(k);
        ivec2 next = around.pixel + outward;
        float inner = around.rises[k ^ 1];
        if (next != clamp(next, ivec2(0), last) || !ends_before(around.rises[k], inner)) continue;
        vec3 line = border_line(own, outward);
        Rim found = straight_rim(line, outward);
        is_corner = is_corner || (least < 1e30 && dot(found.outward, straight.outward) < AT_ODDS);
        if (abs(line.y) < least) {
            least = abs(line.y);
            straight = found;
        }
        if (inner > largest) {
            largest = inner;
            steepest = outward;
            border = line;
        }
    }
    if (is_corner) return rim_at(vec2(0.0), 1.0, 0.0);
    if (steepest == ivec2(0)) return straight;
    return bent_rim(surface_map, around, own, steepest, largest, border, straight);
}

Rim estimate_rim(sampler2D surface_map, ivec2 pixel, vec4 source) {
    Around around = look_around(surface_map, pixel, source);
    bool ends = false;
    for (int k = 0; k < 4; ++k) ends = ends || ends_before(around.rises[k], around.rises[k ^ 1]);
    Rim rim = rim_at(vec2(0.0), 1.0, 0.0);
    int outlines = ends ? 1 : 0;  // a loop that no pixel takes costs software drivers nothing
    for (int k = 0; k < outlines; ++k) rim = estimate_outline(surface_map, around);
    rim.slope = around.tilt / around.focal + around.facing;
    if (rim.drop == 0.0) rim.hidden = hidden_pixels(around);
    vec4 below = vec4(-around.tilt.x, around.tilt.x, -around.tilt.y, around.tilt.y) - around.rises;
    for (int k = 0; k < 4; k += 2) {  // of two neighbours on a line, the one that falls away more
        vec3 fold = fold_at(surface_map, around, below[k] > below[k + 1] ? k : k + 1, source);
        rim.folds[k] = below[k] > below[k + 1] ? fold : vec3(0.0);
        rim.folds[k + 1] = below[k] > below[k + 1] ? vec3(0.0) : fold;
    }
    return rim;
}
