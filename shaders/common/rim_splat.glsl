#include "common/rims.glsl"

// Rims in a view: the circle of a rim pixel is met by the rays of the view's pixels.

const float NEXT_PIXEL = 0.98;   // source pixels that a rim reaches towards an outline that lies in the next pixel:
const float OUTLINE_NEAR = 1.16; // along an axis it is no farther than this
const float ENLARGED = 8.0;      // target pixels for each source pixel, beyond which a rim is drawn as its tangent plane
const float BEHIND = 0.1;        // share of the pixel's depth in the view that all of a rim is taken to have
const float ENDS_HIDDEN = 0.5;   // source pixels beyond the last pixel behind which a surface goes on

// How far a rim that nothing hides may reach from its pixel in the source picture: left and up, right and down.
vec4 open_reach(Rim rim) {
    vec4 n = OUTLINE_NEAR * vec4(-rim.outward.x, rim.outward.x, -rim.outward.y, rim.outward.y);
    vec4 reach = mix(vec4(splat_reach(1.0, false)), vec4(NEXT_PIXEL), greaterThan(n, vec4(rim.width)));
    return vec4(-reach.x, -reach.z, reach.y, reach.w);
}

// The same with what goes on behind other pixels.
vec4 rim_reach(Rim rim) {
    vec4 hidden = (sign(rim.hidden) * (rim.hidden + ENDS_HIDDEN)).xzyw;
    vec4 reach = open_reach(rim);
    return vec4(min(reach.xy, -hidden.xy), max(reach.zw, hidden.zw));
}

// Does a place in the source picture, so far from a rim's pixel, lie behind other pixels?
bool is_hidden(Rim rim, vec2 off) {
    vec4 open = open_reach(rim);
    return off != clamp(off, open.xy, open.zw);
}

// Does a rim come to a place so far from its pixel? Behind others only straight on in a row or a column.
bool rim_comes_to(vec2 off, vec4 open, vec4 reach) {
    bool inside = all(greaterThanEqual(off, reach.xy)) && all(lessThanEqual(off, reach.zw));
    bvec2 straight = bvec2(off.x == clamp(off.x, open.x, open.z), off.y == clamp(off.y, open.y, open.w));
    return inside && any(straight);
}

// The circle's diameter; it is 0 for a rim on the tangent plane.
float rim_diameter(Rim rim) {
    return rim.drop > 0.0 ? (rim.drop * rim.drop + rim.width * rim.width) / rim.width : 0.0;
}

// Is a rim pixel at depth z drawn as a rim in a view where its footprint is this?
bool draws_rim(Footprint splat, float z, vec4 source, vec4 target) {
    float enlarged = splat.inverse_depth * z * mean_focal_length(target) / mean_focal_length(source);
    return enlarged <= ENLARGED && splat_bends(splat, splat_reach(1.0, false)) <= FLAT;
}

// The slope of the surface that a rim is drawn relative to, as a share of 1/z: for a circle the one facing the viewer.
vec2 rim_slope(Rim rim, vec3 ray, vec4 source) {
    return rim.drop > 0.0 ? facing_slope(ray.xy, source) : rim.slope;
}

// 1 where there is a fold, else 0.
vec4 folds_exist(Rim rim) {
    return vec4(greaterThan(vec3(1.0, 0.0, 0.0) * rim.folds, vec4(0.0)));
}

// By how many pixels of depth a rim lies behind its plane where folds turn it down, this far from its pixel.
float fold_drop(Rim rim, vec2 slope, vec2 off, float focal) {
    vec4 below = folds_exist(rim) * focal * (1.0 + dot(slope, off) - vec3(1.0, off) * rim.folds);
    return max(max(max(below.x, below.y), max(below.z, below.w)), 0.0);
}

// A box round a rim in the view: left, top, right and bottom, target pixels.
vec4 rim_box(Rim rim, vec2 pixel, vec4 own, vec4 source, mat4 view, vec4 target) {
    vec3 ray = pixel_ray(pixel, source);
    float w = 1.0 / own.w;
    vec2 slope = rim_slope(rim, ray, source);
    vec4 reach = rim_reach(rim);
    float focal = mean_focal_length(source), diameter = rim_diameter(rim);
    vec2 farthest = max(-reach.xy, reach.zw);
    float inward = min(rim.width + dot(farthest, abs(rim.outward)), 0.5 * diameter);
    float top = sqrt(inward * (diameter - inward)) - rim.drop;
    vec3 h = mat3(view) * ray + view[3].xyz * w;  // target point times w: linear in u, v and pixels of depth
    vec3 h_u = view[0].xyz / source.x + view[3].xyz * (w * slope.x);
    vec3 h_v = view[1].xyz / source.y + view[3].xyz * (w * slope.y);
    vec3 h_t = view[3].xyz * (w / focal);
    vec4 box = vec4(1e9, 1e9, -1e9, -1e9);
    for (int k = 0; k < 4; ++k) {
        vec2 off = vec2((k & 1) == 0 ? reach.x : reach.z, (k & 2) == 0 ? reach.y : reach.w);
        vec3 corner = h + h_u * off.x + h_v * off.y;
        vec3 highest = corner + h_t * top;
        vec3 lowest = corner - h_t * (diameter > 0.0 ? rim.drop : fold_drop(rim, slope, off, focal));
        highest.z = max(highest.z, BEHIND * h.z);
        lowest.z = max(lowest.z, BEHIND * h.z);
        vec2 one = project(highest, target), other = project(lowest, target);
        box = vec4(min(box.xy, min(one, other)), max(box.zw, max(one, other)));
    }
    return box;
}

// Where a quadratic is 0: two places, or twice the same beyond all where there are none.
vec2 roots_of(float square, float linear, float constant) {
    float rest = linear * linear - 4.0 * square * constant;
    if (!(rest >= 0.0)) return vec2(BOTTOMLESS);
    float q = -0.5 * (linear + (linear < 0.0 ? -sqrt(rest) : sqrt(rest)));
    return vec2(q / square, constant / q);
}

// Where a ray meets the plane of a rim, folded: the unknown of meet_rim, or BOTTOMLESS. before: how far it runs
// before the plane, and how that changes; start, change: as there. What is behind all planes is inside: the ray enters
// at the last plane that it meets from ahead, unless it has left one before.
float meet_folds(Rim rim, vec2 before, float closer, float focal, vec3 start, vec3 change) {
    float entry = before.y > 0.0 ? -before.x / before.y : -BOTTOMLESS;
    float leaving = before.y > 0.0 ? BOTTOMLESS : -before.x / before.y;
    vec4 from = focal * (closer - start.zxy * rim.folds), by = focal * (closer - change.zxy * rim.folds);
    vec4 met = -from / by, exist = folds_exist(rim), ahead = exist * vec4(greaterThan(by, vec4(0.0)));
    vec4 entries = mix(vec4(-BOTTOMLESS), met, greaterThan(ahead, vec4(0.0)));
    vec4 exits = mix(vec4(BOTTOMLESS), met, greaterThan(exist - ahead, vec4(0.0)));
    entry = min(min(entry, min(entries.x, entries.y)), min(entries.z, entries.w));
    leaving = max(max(leaving, max(exits.x, exits.y)), max(exits.z, exits.w));
    if (entry == -BOTTOMLESS) return leaving;  // seen from behind
    return entry >= leaving ? entry : BOTTOMLESS;
}

// Where the ray of a target pixel first meets a rim: 1/z in the view, 0 where it misses it; and where that is in the source
// picture, from the rim's pixel. inverse_depth is that of this pixel. The unknown is by which share the answer exceeds it:
// so float32 loses nothing at the frame's own camera.
vec3 meet_rim(
    Rim rim, vec2 pixel, vec4 own, float inverse_depth, vec2 target_pixel, vec4 source, mat4 view, vec4 target
) {
    vec3 ray = pixel_ray(pixel, source);
    vec2 slope = rim_slope(rim, ray, source);
    float focal = mean_focal_length(source), closer = inverse_depth * own.w, diameter = rim_diameter(rim);
    // Source pixels from the rim's pixel, times depth; depth; and how both change with the unknown.
    vec3 change = -inverse_depth * (view[3].xyz * mat3(view));
    vec3 start = pixel_ray(target_pixel, target) * mat3(view) + change;
    start.xy = source.xy * start.xy + (source.zw - pixel) * start.z;
    change.xy = source.xy * change.xy + (source.zw - pixel) * change.z;
    // How far before the outline: in pixels of depth; in pixels of the picture. Both times depth.
    vec2 before = focal * (closer - vec2(start.z + dot(slope, start.xy), change.z + dot(slope, change.xy)));
    before += rim.drop * vec2(start.z, change.z);
    vec2 inside = rim.width * vec2(start.z, change.z) - vec2(dot(rim.outward, start.xy), dot(rim.outward, change.xy));
    vec2 share = vec2(meet_folds(rim, before, closer, focal, start, change));
    if (diameter > 0.0) {
        share = roots_of(
            before.y * before.y + inside.y * (inside.y - diameter * change.z),
            2.0 * (before.x * before.y + inside.x * inside.y) - diameter * (inside.x * change.z + inside.y * start.z),
            before.x * before.x + inside.x * (inside.x - diameter * start.z)
        );
    }
    vec4 open = open_reach(rim), reach = rim_reach(rim);
    vec3 nearest = vec3(0.0);
    for (int k = 0; k < 2; ++k) {
        float here = k == 0 ? share.x : share.y;
        vec3 place = start + here * change;
        vec2 off = place.xy / place.z;
        bool ends = inside.x + here * inside.y < 0.0 || (diameter > 0.0 && before.x + here * before.y < 0.0);
        bool meets = place.z > 0.0 && here > -1.0 && rim_comes_to(off, open, reach) && !ends;
        float met = inverse_depth * (1.0 + here);
        if (meets && met > nearest.x) nearest = vec3(met, off);
    }
    return nearest;
}
