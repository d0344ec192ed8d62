#include "common/corners.glsl"

// How much the normals of a surface vary beyond its curvature. Noise that neighbours share leaves bumps, and no fit of a
// few pixels tells them from the surface.

const int APART = 8;          // pixels between the 5x5 normals that are looked at
const float SAME_SIDE = 0.7;  // cosine to the middle, below which a normal belongs to another surface
const float ENOUGH = 6.5;     // normals

// Unit normal and depth at a pixel; zeros outside the picture.
vec4 surface_beside(sampler2D surface_map, ivec2 pixel) {
    bool is_inside = pixel == clamp(pixel, ivec2(0), textureSize(surface_map, 0) - 1);
    return is_inside ? surface_at(surface_map, pixel) : vec4(0.0);
}

// The mean of the nine surfaces in the middle, with a unit normal; zeros if none is known.
vec4 middle_surface(sampler2D surface_map, ivec2 pixel) {
    vec4 sum = vec4(0.0);
    float known = 0.0;
    for (int k = 0; k < 9; ++k) {
        vec4 surface = surface_beside(surface_map, pixel + APART * ivec2(k % 3 - 1, k / 3 - 1));
        sum += surface;
        known += surface.w > 0.0 ? 1.0 : 0.0;
    }
    float size = length(sum.xyz);
    return size > 0.0 ? vec4(sum.xyz / size, sum.w / known) : vec4(0.0);
}

// Variance of the normals' tilt, radians squared along each axis, about a mean that changes evenly from side to side, as
// on spheres and cylinders. middle: the normal that all are near.
float tilt_variance(sampler2D surface_map, ivec2 pixel, vec3 middle) {
    float s = 0.0, su = 0.0, sv = 0.0, suu = 0.0, suv = 0.0, svv = 0.0, squares = 0.0;
    vec3 sd = vec3(0.0), sud = vec3(0.0), svd = vec3(0.0);
    for (int k = 0; k < 25; ++k) {
        ivec2 place = ivec2(k % 5 - 2, k / 5 - 2);
        vec3 normal = surface_beside(surface_map, pixel + APART * place).xyz;
        float m = dot(normal, middle) > SAME_SIDE ? 1.0 : 0.0, u = float(place.x), v = float(place.y);
        vec3 d = m * (normal - middle);
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
    if (s < ENOUGH || determinant < 1.0) return 0.0;
    vec3 mean = sd / s, ud = sud - mean_u * sd, vd = svd - mean_v * sd;
    vec3 slope_u = (vv * ud - uv * vd) / determinant, slope_v = (uu * vd - uv * ud) / determinant;
    float rest = squares - s * dot(mean, mean) - dot(slope_u, ud) - dot(slope_v, vd);
    return max(rest, 0.0) / (2.0 * (s - 3.0));
}
