#include "common/rims.glsl"

// Draws the circle of a rim pixel into a view.

const float OUTWARD = 0.98;      // source pixels that a rim reaches towards an outline that lies in the next pixel
const float NEXT_PIXEL = 1.16;   // so far off along an axis it does
const float MOST_ENLARGED = 8.0; // target pixels for each source pixel beyond which a rim is drawn as its tangent plane

// How far a rim reaches from its pixel in the source picture: low and high.
vec4 rim_reach(Rim rim) {
    vec2 n = NEXT_PIXEL * rim.outward;
    vec2 low = vec2(-n.x > rim.width ? -OUTWARD : -0.5 - MARGIN, -n.y > rim.width ? -OUTWARD : -0.5 - MARGIN);
    vec2 high = vec2(n.x > rim.width ? OUTWARD : 0.5 + MARGIN, n.y > rim.width ? OUTWARD : 0.5 + MARGIN);
    return vec4(low, high);
}

// Is a rim pixel drawn as a rim in a view, where its footprint is this?
bool draws_rim(Footprint splat, float z, vec4 source, vec4 target) {
    float enlarged = splat.inverse_depth * z * mean_focal_length(target) / mean_focal_length(source);
    return enlarged <= MOST_ENLARGED && splat_bends(splat, splat_reach(1.0, false)) <= FLAT;
}

// A box round a rim in the view: low and high, target pixels.
vec4 rim_box(Rim rim, vec2 pixel, vec4 own, vec4 source, mat4 view, vec4 target) {
    vec3 ray = pixel_ray(pixel, source);
    float w = 1.0 / own.w;
    vec2 slope = inverse_depth_slope(own.xyz, ray, own.w, source);
    if (rim.drop > 0.0) slope = w * facing_slope(ray.xy, source);
    vec4 reach = rim_reach(rim);
    float top = 0.0;
    if (rim.drop > 0.0) {
        float curve = (rim.drop * rim.drop + rim.width * rim.width) / rim.width;
        float inmost = min(rim.width + OUTWARD * (abs(rim.outward.x) + abs(rim.outward.y)), 0.5 * curve);
        top = sqrt(inmost * (curve - inmost)) - rim.drop;
    }
    vec3 h = mat3(view) * ray + view[3].xyz * w;
    vec3 h_u = view[0].xyz / source.x + view[3].xyz * slope.x;
    vec3 h_v = view[1].xyz / source.y + view[3].xyz * slope.y;
    vec3 h_t = view[3].xyz * (w / mean_focal_length(source));
    vec4 box = vec4(1e9, 1e9, -1e9, -1e9);
    for (int k = 0; k < 8; ++k) {
        vec2 back = vec2((k & 1) == 0 ? reach.x : reach.z, (k & 2) == 0 ? reach.y : reach.w);
        vec3 corner = h + h_u * back.x + h_v * back.y + h_t * ((k & 4) == 0 ? top : -rim.drop);
        corner.z = max(corner.z, 0.1 * h.z);
        vec2 at = project(corner, target);
        box = vec4(min(box.xy, at), max(box.zw, at));
    }
    return box;
}

// 1/z of a rim in the view where the ray of a target pixel first meets it; 0 where it does not. inverse_depth is that of
// the pixel itself: the circle is intersected relative to it.
float rim_inverse_depth(
    Rim rim, vec2 pixel, vec4 own, float inverse_depth, vec2 target_pixel, vec4 source, mat4 view, vec4 target
) {
    vec3 ray = pixel_ray(pixel, source);
    float focal = mean_focal_length(source), nearer = inverse_depth * own.w;
    vec3 b = -inverse_depth * (view[3].xyz * mat3(view));
    vec3 a = pixel_ray(target_pixel, target) * mat3(view) + b;
    vec3 back = vec3(source.xy * a.xy + (source.zw - pixel) * a.z, a.z);
    vec3 change = vec3(source.xy * b.xy + (source.zw - pixel) * b.z, b.z);
    vec2 t;
    if (rim.drop > 0.0) {
        vec2 facing = facing_slope(ray.xy, source);
        vec2 rise = focal * vec2(nearer - back.z - dot(facing, back.xy), nearer - change.z - dot(facing, change.xy));
        rise += rim.drop * vec2(back.z, change.z);
        vec2 inside = rim.width * vec2(back.z, change.z) - vec2(dot(rim.outward, back.xy), dot(rim.outward, change.xy));
        float curve = (rim.drop * rim.drop + rim.width * rim.width) / rim.width;
        float square = rise.y * rise.y - curve * inside.y * change.z + inside.y * inside.y;
        float linear = 2.0 * rise.x * rise.y - curve * (inside.x * change.z + inside.y * back.z) + 2.0 * inside.x * inside.y;
        float constant = rise.x * rise.x - curve * inside.x * back.z + inside.x * inside.x;
        float root = linear * linear - 4.0 * square * constant;
        float q = -0.5 * (linear + (linear < 0.0 ? -sqrt(max(root, 0.0)) : sqrt(max(root, 0.0))));
        t = root < 0.0 ? vec2(-2.0) : vec2(q / square, constant / q);
    } else {
        vec2 slope = own.w * inverse_depth_slope(own.xyz, ray, own.w, source);
        float here = nearer - back.z - dot(slope, back.xy), by = nearer - change.z - dot(slope, change.xy);
        t = vec2(-here / by);
    }
    float nearest = 0.0;
    vec4 reach = rim_reach(rim);
    for (int k = 0; k < 2; ++k) {
        float here = t[k];
        vec3 at = back + here * change;
        vec2 off = at.xy / at.z;
        float rise = focal * (nearer * (1.0 + here) / at.z - 1.0 - dot(facing_slope(ray.xy, source), off)) + rim.drop;
        bool meets = at.z > 0.0 && here > -1.0 && all(greaterThanEqual(off, reach.xy)) && all(lessThanEqual(off, reach.zw))
            && dot(rim.outward, off) <= rim.width && (rim.drop == 0.0 || rise >= 0.0);
        if (meets) nearest = max(nearest, inverse_depth * (1.0 + here));
    }
    return nearest;
}
