#include "common/splat_corners.glsl"

// How much the normals of a surface vary beyond its curvature. Noise that neighbours share leaves bumps, and no fit of a
// few pixels tells them from the surface.

const int APART = 8;           // pixels between the 5x5 normals that are looked at, on small surfaces half as many
const float SAME_SIDE = 0.87;  // cosine below which two normals belong to different surfaces
const float SAME_PLACE = 8.0;  // pixels before or behind the tangent plane, from which on another surface begins
const float ENOUGH = 6.5;      // normals
const float UNLIKE = 1.0;      // variance where normals that lie close belong to different surfaces: as much as any
const float UNSHARED = 0.45;   // tilt, radians, of the narrowest fit by noise over depth that neighbours do not share,
                               // times the focal length: STAR_GAIN of estimation/noise_model.py

// Unit normal and depth at a pixel; zeros outside the picture.
vec4 surface_beside(sampler2D surface_map, ivec2 pixel) {
    bool is_inside = pixel == clamp(pixel, ivec2(0), textureSize(surface_map, 0) - 1);
    return is_inside ? surface_at(surface_map, pixel) : vec4(0.0);
}

// The pixel, or one close to it whose surface is known, if there is any.
ivec2 known_pixel(sampler2D surface_map, ivec2 pixel) {
    ivec2 found = pixel;
    for (int k = 8; k >= 0; --k) {
        ivec2 beside = pixel + 2 * (ivec2((k + 4) % 3, (k + 4) / 3 % 3) - 1);
        if (surface_beside(surface_map, beside).w > 0.0) found = beside;
    }
    return found;
}

// Variance of the normals' tilt, radians squared along each axis, about a mean that changes evenly from side to side, as
// on spheres and cylinders. Only normals of the pixel's own surface count, and of these what lies across its own normal.
// UNLIKE if these are too few.
float variance_apart(sampler2D surface_map, ivec2 pixel, vec4 intrinsics, int apart) {
    vec4 own = surface_beside(surface_map, pixel);
    vec3 point = pixel_ray(vec2(pixel), intrinsics) * own.w;
    float far = SAME_PLACE * own.w * 2.0 / (abs(intrinsics.x) + abs(intrinsics.y));
    float s = 0.0, su = 0.0, sv = 0.0, suu = 0.0, suv = 0.0, svv = 0.0, squares = 0.0;
    vec3 sd = vec3(0.0), sud = vec3(0.0), svd = vec3(0.0);
    for (int k = 0; k < 25; ++k) {
        ivec2 place = ivec2(k % 5 - 2, k / 5 - 2);
        vec4 surface = surface_beside(surface_map, pixel + apart * place);
        vec3 way = pixel_ray(vec2(pixel + apart * place), intrinsics) * surface.w - point;
        float along = dot(surface.xyz, own.xyz), u = float(place.x), v = float(place.y);
        float m = along > SAME_SIDE && abs(dot(way, own.xyz)) < far ? 1.0 : 0.0;
        vec3 d = m * (surface.xyz - along * own.xyz);
        s += m;
        su += m * u;
        sv += m * v;
        suu += m * u * u;
        suv += m * u * v;
        svv += m * v * v;
        sd += d;
        sud += d * u;
        svd += d * v;
        squares += dot(d, d);
    }
    float mean_u = su / max(s, 1.0), mean_v = sv / max(s, 1.0);
    float uu = suu - su * mean_u, uv = suv - su * mean_v, vv = svv - sv * mean_v;
    float determinant = uu * vv - uv * uv;
    if (s < ENOUGH || determinant < 1.0) return UNLIKE;
    vec3 mean = sd / s, ud = sud - mean_u * sd, vd = svd - mean_v * sd;
    vec3 slope_u = (vv * ud - uv * vd) / determinant, slope_v = (uu * vd - uv * ud) / determinant;
    float rest = squares - s * dot(mean, mean) - dot(slope_u, ud) - dot(slope_v, vd);
    return max(rest, 0.0) / (2.0 * (s - 3.0));
}

// The same of the pixel's surface, whether it is wide or small.
float tilt_variance(sampler2D surface_map, ivec2 pixel, vec4 intrinsics) {
    float wide = variance_apart(surface_map, pixel, intrinsics, APART);
    return wide < UNLIKE ? wide : variance_apart(surface_map, pixel, intrinsics, APART / 2);
}

// The most that noise can tilt normals: noise over depth, and what of it neighbours share, see noise_at.
float steepest_variance(vec2 noise, vec4 intrinsics) {
    float tilt = noise.x * 0.5 * (abs(intrinsics.x) + abs(intrinsics.y));
    return tilt * tilt * (UNSHARED * UNSHARED + noise.y * noise.y);
}
