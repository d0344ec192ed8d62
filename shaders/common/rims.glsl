#include "common/corners.glsl"
#include "common/rim_marks.glsl"

// A rim pixel is drawn as what is there: a surface that bends away from the viewer, and ends at an outline that lies
// between the pixel and the next. Near an outline, the square of the depth that is left to it grows linearly with the
// distance: seen from the side, the surface is a circle.

const float MOST_TILT = 10.0;     // pixels of depth for each pixel
const float LEAST_WIDTH = 0.02;   // pixels
const float MOST_WIDTH = 0.98;
const float FARTHEST = 1.15;      // an outline that is estimated to lie farther off is no estimate
const float STEEPEST_STEP = 200.0;
const float AT_ODDS = 0.6;        // cosine between two borders of a corner

struct Rim {
    vec2 outward;  // unit, source pixels; 0 at corners, and where the surface ends on opposite sides
    float width;   // to the outline, source pixels
    float drop;    // how much farther than the pixel the outline is, pixels of depth; 0: on the tangent plane
};

// Which of the 5x5 pixels around a pixel belong to its surface: a bit for each, row by row.
int own_pixels(sampler2D surface_map, ivec2 pixel, float here, vec2 facing, vec2 tilt, float focal) {
    int mask = 0;
    ivec2 size = textureSize(surface_map, 0);
    float steepness = min(length(tilt), MOST_TILT);
    for (int k = 0; k < 25; ++k) {
        ivec2 off = ivec2(k % 5, k / 5) - 2;
        vec2 o = vec2(off);
        ivec2 place = pixel + off;
        bool inside = place == clamp(place, ivec2(0), size - 1);
        float rise = rise_of(here, surface_at(surface_map, place).w, dot(facing, o), focal) - dot(tilt, o);
        if (inside && rise > -(DROP + steepness * length(o))) mask |= 1 << k;
    }
    return mask;
}

bool is_own(int mask, ivec2 off) {
    return (mask >> ((off.y + 2) * 5 + off.x + 2) & 1) == 1;
}

// The line where the pixels of a surface end in a direction: how far out it is at the pixel (x), counted from the edge
// of the pixel, and its slope (y), by least squares over five rows; z is 1 where all rows end alike.
vec3 border_line(int mask, ivec2 outward) {
    ivec2 across = ivec2(-outward.y, outward.x);
    int sum = 0, moment = 0, first = 2, last = -3;
    for (int row = -2; row <= 2; ++row) {
        int end = -3;
        bool is_open = true;
        for (int k = -2; k <= 2; ++k) {
            bool here = is_own(mask, k * outward + row * across);
            is_open = is_open && (here || end == -3);
            if (is_open && here) end = k;
        }
        sum += end;
        moment += row * end;
        first = min(first, end);
        last = max(last, end);
    }
    return vec3(float(sum) / 5.0, float(moment) / 10.0, first == last ? 1.0 : 0.0);
}

float rise_at(sampler2D surface_map, ivec2 pixel, ivec2 off, float here, vec2 facing, float focal) {
    ivec2 place = pixel + off;
    bool inside = place == clamp(place, ivec2(0), textureSize(surface_map, 0) - 1);
    float there = inside ? surface_at(surface_map, place).w : 0.0;
    return rise_of(here, there, dot(facing, vec2(off)), focal);
}

ivec2 side_of_pixel(int k) {
    return k < 2 ? ivec2(2 * k - 1, 0) : ivec2(0, 2 * k - 5);
}

Rim estimate_rim(sampler2D surface_map, ivec2 pixel, vec4 source) {
    vec4 own = surface_at(surface_map, pixel);
    vec3 ray = pixel_ray(vec2(pixel), source);
    float focal = mean_focal_length(source);
    vec2 facing = facing_slope(ray.xy, source);
    vec2 tilt = focal * (own.w * inverse_depth_slope(own.xyz, ray, own.w, source) - facing);
    int mask = own_pixels(surface_map, pixel, own.w, facing, tilt, focal);
    ivec2 size = textureSize(surface_map, 0);

    Rim rim = Rim(vec2(0.0), 1.0, 0.0);
    vec3 flattest = vec3(0.0, 1e30, 0.0);
    ivec2 axis = ivec2(0);
    float step1 = -1e30;
    bool is_corner = false;
    for (int k = 0; k < 4; ++k) {
        ivec2 out_ = side_of_pixel(k), place = pixel + out_;
        float rise = rise_at(surface_map, pixel, out_, own.w, facing, focal);
        float inner = rise_at(surface_map, pixel, -out_, own.w, facing, focal);
        bool inside = place == clamp(place, ivec2(0), size - 1);
        if (!inside || !ends_before(rise, inner)) continue;
        vec3 line = border_line(mask, out_);
        vec2 across = vec2(-out_.y, out_.x);
        vec2 normal = (vec2(out_) - across * line.y) / sqrt(1.0 + line.y * line.y);
        if (flattest.y < 1e29 && dot(normal, rim.outward) < AT_ODDS) is_corner = true;
        if (abs(line.y) < abs(flattest.y)) {
            flattest = line;
            rim.outward = normal;
            rim.width = clamp(0.5 + line.x, LEAST_WIDTH, MOST_WIDTH) / sqrt(1.0 + line.y * line.y);
        }
        if (inner > step1) {
            step1 = inner;
            axis = out_;
        }
    }
    if (is_corner) return Rim(vec2(0.0), 1.0, 0.0);
    if (axis == ivec2(0)) return rim;
    ivec2 side = ivec2(-axis.y, axis.x);
    float a = step1, b = rise_at(surface_map, pixel, -2 * axis, own.w, facing, focal) - a;
    if (!(a > 1.0 && a < STEEPEST_STEP && abs(b) < 2.0 * a + 4.0) || a <= 1.05 * b) return rim;
    bool has_before = is_own(mask, -side), has_after = is_own(mask, side);
    float before = has_before ? rise_at(surface_map, pixel, -side, own.w, facing, focal) : 0.0;
    float after = has_after ? rise_at(surface_map, pixel, side, own.w, facing, focal) : 0.0;
    float share = has_before && has_after ? 0.5 : 1.0;
    float lateral = share * (after - before);
    float k = a * a / (a * a + lateral * lateral);
    float drop = (2.0 * a * b + b * b - a * a + 2.0 * k) / (2.0 * (a - b));
    float e = 2.0 * drop * a + a * a + k;
    float s = share * (2.0 * drop * (after - before) + after * after - before * before);
    if (has_after && !has_before) s += 1.0 - k;
    if (has_before && !has_after) s -= 1.0 - k;
    float l = sqrt(e * e + s * s);
    float c = e / l;
    float d = 0.5 * (sqrt(l * l + 4.0 * drop * drop) - l);
    float D = d / c;
    if (!(drop > 0.0 && e > 0.0 && D <= FARTHEST)) return rim;
    // the border of the pixels holds
    vec3 line = border_line(mask, axis);
    float Dm = clamp(0.5 + line.x, LEAST_WIDTH, MOST_WIDTH);
    float held = line.z > 0.5 ? clamp(D, Dm - 0.5, Dm + 0.5) : clamp(D, Dm - 0.3, Dm + 0.1);
    if (held != D) {
        d = held * c;
        drop = held * a + sqrt(held * held * a * a + held * (a * a + c * c) + d * d);
    }
    return Rim(vec2(axis) * c - vec2(side) * (s / l), max(d, LEAST_WIDTH), drop);
}
