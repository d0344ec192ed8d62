#include "common/camera.glsl"

// The footprint of a splat: the square of its source pixel, laid on the surface's tangent plane and carried
// into the target view. On a plane 1/z is linear in pixels, so position over depth is linear too, and the
// warp's Jacobian has a closed form (cf. surface splatting: Zwicker et al. 2001; plane-induced warp: McMillan 1997).

const float MARGIN = 0.1;       // source pixels added round a square, so that neighbours overlap without gaps
const float MIN_COSINE = 0.05;  // a surface seen flatter than 87 degrees is carried as if seen at 87
const float ASIDE = 0.02;       // more than 88.9 degrees off the optical axis is not ahead: there a footprint has no end

struct Footprint {
    vec2 centre;          // target pixels
    vec4 to_target;       // columns of the Jacobian, target pixels per source pixel: (dx/du, dy/du, dx/dv, dy/dv)
    float inverse_depth;  // 1/z in the target view; below or at 0 the splat lies behind it
    vec2 tilt;            // its change per source pixel
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
    return splat;
}

// Half the splat's side, or its radius when round: the circle through the square's corners.
float splat_reach(float size, bool is_round) {
    return size * (is_round ? 0.70710678 : 0.5) + MARGIN;
}

// Half width and half height of the box round the carried square or ellipse, target pixels.
vec2 footprint_extent(vec4 to_target, float reach, bool is_round) {
    if (is_round) return reach * sqrt(to_target.xy * to_target.xy + to_target.zw * to_target.zw);
    return reach * (abs(to_target.xy) + abs(to_target.zw));
}

// Columns of the inverse Jacobian; 0 where the surface is seen exactly from its edge.
vec4 invert_footprint(vec4 to_target) {
    float determinant = to_target.x * to_target.w - to_target.z * to_target.y;
    if (determinant == 0.0) return vec4(0.0);
    return vec4(to_target.w, -to_target.y, -to_target.z, to_target.x) / determinant;
}

// Is a target pixel, this far from the splat's centre, inside the carried shape?
bool footprint_covers(vec4 to_source, vec2 offset, float reach, bool is_round) {
    vec2 back = to_source.xy * offset.x + to_source.zw * offset.y;
    if (is_round) return dot(back, back) <= reach * reach;
    return max(abs(back.x), abs(back.y)) <= reach;
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
