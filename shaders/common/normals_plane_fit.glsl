#include "common/inverse_depth.glsl"

// Classical normals from a least-squares plane in w = 1/z over a square window: smooths noise, rounds edges.

const float DEPTH_GATE = 0.02;   // neighbours farther off than this share of the pixel's depth are another surface
const float DEGENERATE = 1e-3;   // squared sine between two directions of the known pixels; below, they lie on a line

// window = odd size of the square, 3 to 13. Steps are taken from the centre pixel, offsets are small integers,
// so the sums of offsets are exact in float32; multiplying the normal equations by the count keeps them so.
vec3 estimate_plane_fit(sampler2D depth_map, ivec2 pixel, vec4 intrinsics, int window) {
    float here = depth_at(depth_map, pixel, ivec2(0));
    if (!(here > 0.0)) return vec3(0.0);
    int reach = window / 2;
    float count = 0.0, x = 0.0, y = 0.0, xx = 0.0, xy = 0.0, yy = 0.0, s = 0.0, xs = 0.0, ys = 0.0;
    for (int dv = -reach; dv <= reach; ++dv) {
        for (int du = -reach; du <= reach; ++du) {
            float there = depth_at(depth_map, pixel, ivec2(du, dv));
            if (abs(there - here) <= DEPTH_GATE * here) {
                float u = float(du), v = float(dv), step = relative_step(here, there);
                count += 1.0;
                x += u;
                y += v;
                xx += u * u;
                xy += u * v;
                yy += v * v;
                s += step;
                xs += u * step;
                ys += v * step;
            }
        }
    }
    float a = count * xx - x * x;
    float b = count * xy - x * y;
    float c = count * yy - y * y;
    float r = count * xs - x * s;
    float t = count * ys - y * s;
    float determinant = a * c - b * b;
    vec2 ray = (vec2(pixel) - intrinsics.zw) / intrinsics.xy;
    vec2 slope = facing_slope(ray, intrinsics);
    if (determinant > DEGENERATE * (a * c)) slope = vec2(c * r - b * t, a * t - b * r) / determinant;
    return normal_of_slope(slope, ray, intrinsics);
}
