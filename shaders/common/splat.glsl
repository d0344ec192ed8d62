#include "common/camera.glsl"

// The footprint of a splat: the square of its source pixel, laid on the surface's tangent plane and projected
// into the target view. On a plane 1/z is linear in pixels, so position over depth is linear too, and the
// warp's Jacobian has a closed form (cf. surface splatting: Zwicker et al. 2001; plane-induced warp: McMillan 1997).

const float MARGIN = 0.1;       // source pixels added round a square, so that neighbours overlap without gaps
const float EXACT_MARGIN = 0.02; // the same of several frames without noise: others close what is left
const float MIN_COSINE = 0.05;  // a surface seen flatter than 87 degrees is projected as if seen at 87
const float ASIDE = 0.02;       // more than 88.9 degrees off the optical axis is not ahead: there a footprint has no end
const float FLAT = 0.1;         // where depth in the view changes by less to the splat's rim, the Jacobian holds for all of it
const float ENDLESS = 3.0;      // where it changes by more to the splat's rim, the splat passes the camera: it has no end
const float WIDEST = 4.0;       // so many times wider than by its Jacobian is a footprint looked for

struct Footprint {
    vec2 centre;          // target pixels
    vec4 to_target;       // columns of the Jacobian, target pixels per source pixel: (dx/du, dy/du, dx/dv, dy/dv)
    float inverse_depth;  // 1/z in the target view; below or at 0 the splat lies behind it
    vec2 tilt;            // its change per source pixel
    vec2 bend;            // share by which depth in the target view changes per source pixel
};

// Change of w = 1/z per source pixel on the plane through the point z * ray with this normal.
vec2 inverse_depth_slope(vec3 normal, vec3 ray, float z, vec4 intrinsics) {
    float cosine = min(dot(normal, ray), -MIN_COSINE * length(ray));
    return normal.xy / (intrinsics.xy * (cosine * z));
}

// view takes source axes to target axes.
Footprint carry_footprint(vec2 pixel, float z, vec3 normal, vec4 source, mat4 view, vec4 target) {
    vec3 ray = pixel_ray(pixel, source);
    float w = 1.0 / z;
    vec2 slope = inverse_depth_slope(normal, ray, z, source);
    vec3 h = mat3(view) * ray + view[3].xyz * w;  // target point times w: linear in u and v
    vec3 h_u = view[0].xyz / source.x + view[3].xyz * slope.x;
    vec3 h_v = view[1].xyz / source.y + view[3].xyz * slope.y;
    Footprint splat;
    splat.inverse_depth = h.z > ASIDE * max(abs(h.x), abs(h.y)) ? w / h.z : 0.0;
    splat.centre = project(h, target);
    vec2 scale = target.xy / (h.z * h.z);
    splat.to_target = vec4(scale * (h_u.xy * h.z - h.xy * h_u.z), scale * (h_v.xy * h.z - h.xy * h_v.z));
    splat.tilt = (slope * h.z - w * vec2(h_u.z, h_v.z)) / (h.z * h.z);
    splat.bend = vec2(h_u.z, h_v.z) / h.z;
    return splat;
}

// Is the splat's centre ahead of the camera, beyond the near plane?
bool splat_is_ahead(Footprint splat, float near) {
    return splat.inverse_depth > 0.0 && splat.inverse_depth * near < 1.0;
}

// By which share depth in the view changes from the splat's centre to its rim, at most.
float splat_bends(Footprint splat, float reach) {
    return reach * (abs(splat.bend.x) + abs(splat.bend.y));
}

// The bend that has to be heeded for a splat that reaches so far: none where it is little.
vec2 splat_bend(Footprint splat, float reach) {
    return splat_bends(splat, reach) > FLAT ? splat.bend : vec2(0.0);
}

// Half the splat's side, or its radius when round: the circle through the square's corners.
float splat_reach(float size, bool is_round) {
    return size * (is_round ? 0.70710678 : 0.5) + MARGIN;
}

// The same of one of several frames without noise.
float exact_reach(float size, bool is_round) {
    return splat_reach(size, is_round) + (EXACT_MARGIN - MARGIN);
}

// Half width and half height of a box round the projected square or ellipse, target pixels.
vec2 footprint_extent(Footprint splat, float reach, bool is_round) {
    vec4 to_target = splat.to_target;
    float bends = splat_bends(splat, reach);
    float widening = bends > FLAT ? 1.0 / (1.0 - min(bends, 1.0 - 1.0 / WIDEST)) : 1.0;
    if (is_round) return widening * reach * sqrt(to_target.xy * to_target.xy + to_target.zw * to_target.zw);
    return widening * reach * (abs(to_target.xy) + abs(to_target.zw));
}

// Columns of the inverse Jacobian; 0 where the surface is seen exactly from its edge.
vec4 invert_footprint(vec4 to_target) {
    float determinant = to_target.x * to_target.w - to_target.z * to_target.y;
    if (determinant == 0.0) return vec4(0.0);
    return vec4(to_target.w, -to_target.y, -to_target.z, to_target.x) / determinant;
}

// Source pixels from the splat's centre to what a target pixel shows, this far from it there; z is 0 or less where it
// shows no point of the plane. The Jacobian gives the offset, the bend its perspective: exact on the plane.
vec3 carry_offset_back(vec4 to_source, vec2 bend, vec2 offset) {
    vec2 back = to_source.xy * offset.x + to_source.zw * offset.y;
    float ahead = 1.0 - dot(bend, back);
    return vec3(back / ahead, ahead);
}

// Is a target pixel, this far from the splat's centre, inside the projected shape?
bool footprint_covers(vec4 to_source, vec2 bend, vec2 offset, float reach, bool is_round) {
    vec3 back = carry_offset_back(to_source, bend, offset);
    bool inside = is_round ? dot(back.xy, back.xy) <= reach * reach : max(abs(back.x), abs(back.y)) <= reach;
    return inside && back.z > 0.0;
}

// 1/z of the splat's plane at a target pixel this far from its centre. It is linear in target pixels, so the Jacobian
// gives it exactly; beyond the plane's horizon it stays above 0.
float footprint_inverse_depth(Footprint splat, vec4 to_source, vec2 offset) {
    vec2 back = to_source.xy * offset.x + to_source.zw * offset.y;
    return max(splat.inverse_depth + dot(splat.tilt, back), 0.01 * splat.inverse_depth);
}

// Does a pixel with depth z, this many source pixels off, lie on the plane through a pixel with depth own_z?
// tolerance is a share of 1/z; nothing lies on a plane at tolerance 0.
bool lies_on_plane(float z, vec2 off, float own_z, vec2 slope, float tolerance) {
    float w = 1.0 / own_z;
    return z > 0.0 && own_z > 0.0 && abs(1.0 / z - (w + dot(slope, off))) < tolerance * w;
}
