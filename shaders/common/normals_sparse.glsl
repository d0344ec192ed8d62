#include "common/robust_plane.glsl"
#include "common/sparse_cells.glsl"

// Normals where few depths are known, such as LiDAR in a picture: a plane in 1/z through the pixel and 5x5 cells around
// it. Cells grow until the plane's own residuals say that its tilt is known well enough; no noise is given or measured.

const int CELLS = 25;
const int SAMPLES = 26;       // the cells, and the pixel itself
const float CLOSE = 3.0;      // standard deviations from which on a sample has no weight
const float FLOOR = 1e-4;     // share of 1/z by which depths are wrong at least
const float UNSURE = 3.0;     // so many samples know FLOOR only: few samples that fit by chance prove little
const float FEWEST = 7.0;     // samples of a plane
const float SURE = 0.04;      // radians of error in the tilt up to which the pixel counts as on its plane
const float ACROSS = 1.0;     // least spread of the samples across their narrowest direction: they lie on no line

struct Fit {
    vec3 plane;      // value at the pixel, slope per cell in u and v
    float variance;  // of one sample
    float tilt;      // standard deviation of the slope, per cell; below 0 where there is no plane
};

// Least squares; samples are offsets in cells (xy) and values (z).
Fit fit_samples(vec3 samples[SAMPLES], float weights[SAMPLES]) {
    float s = 0.0, su = 0.0, sv = 0.0, suu = 0.0, suv = 0.0, svv = 0.0, sd = 0.0, sud = 0.0, svd = 0.0;
    for (int k = 0; k < SAMPLES; ++k) {
        float u = samples[k].x, v = samples[k].y, weight = weights[k], product = weight * samples[k].z;
        s += weight;
        su += weight * u;
        sv += weight * v;
        suu += weight * (u * u);
        suv += weight * (u * v);
        svv += weight * (v * v);
        sd += product;
        sud += product * u;
        svd += product * v;
    }
    vec3 plane = solve_plane(s, su, sv, suu, suv, svv, sd, sud, svd);
    float squares = UNSURE * FLOOR * FLOOR;
    for (int k = 0; k < SAMPLES; ++k) {
        float miss = samples[k].z - (plane.x + plane.y * samples[k].x + plane.z * samples[k].y);
        squares += weights[k] * miss * miss;
    }
    float uu = suu - su * su / max(s, 1e-6), uv = suv - su * sv / max(s, 1e-6), vv = svv - sv * sv / max(s, 1e-6);
    float narrow = 0.5 * (uu + vv - sqrt((uu - vv) * (uu - vv) + 4.0 * uv * uv));
    float more = max(s - 3.0, 0.5);  // samples than a plane needs
    float variance = squares / more * (1.0 + UNSURE / more);
    return Fit(plane, variance, narrow > ACROSS ? sqrt(variance / narrow) : -1.0);
}

// Is a cell in a window? 0: all 5x5 cells; 1 to 4: 3x3 in a corner, which contain the pixel's own.
bool in_window(int cell, int window) {
    ivec2 corner = 2 * ivec2((window - 1) % 2, (window - 1) / 2);
    ivec2 off = ivec2(cell % 5, cell / 5) - corner;
    return window == 0 || (min(off.x, off.y) >= 0 && max(off.x, off.y) <= 2);
}

// Slope of w per pixel (xy) and distance from the pixel's w to its plane if that is sure (z), relative to w; w is 1 where
// the error of the tilt is at most `tilt` radians, otherwise 0. cells: 2^level pixels wide
vec4 sparse_plane(sampler2D cells, ivec2 pixel, float here, int level, vec4 intrinsics, float tilt) {
    vec3 samples[SAMPLES];
    float known[SAMPLES];
    float side = float(1 << level);
    for (int k = 0; k < CELLS; ++k) {
        vec4 cell = cell_at(cells, (pixel >> level) + ivec2(k % 5 - 2, k / 5 - 2));
        known[k] = cell.w > 0.0 ? 1.0 : 0.0;
        samples[k] = known[k] * vec3((cell.xy - vec2(pixel)) / side, cell.z * here - 1.0);
    }
    known[CELLS] = 1.0;
    samples[CELLS] = vec3(0.0);
    Fit best = Fit(vec3(0.0), 1.0, -1.0);
    for (int window = 0; window < 5; ++window) {
        float weights[SAMPLES];
        float count = 0.0;
        for (int k = 0; k < SAMPLES; ++k) {
            weights[k] = k == CELLS || in_window(k, window) ? known[k] : 0.0;
            count += weights[k];
        }
        Fit fit = fit_samples(samples, weights);
        bool better = count >= FEWEST && fit.tilt > 0.0 && (best.tilt < 0.0 || fit.tilt < best.tilt);
        if (better) best = fit;
    }
    for (int turn = 0; turn < 2; ++turn) {
        float weights[SAMPLES];
        for (int k = 0; k < SAMPLES; ++k) {
            float miss = samples[k].z - (best.plane.x + best.plane.y * samples[k].x + best.plane.z * samples[k].y);
            float near = max(1.0 - miss * miss / (CLOSE * CLOSE * best.variance), 0.0);
            weights[k] = known[k] * near * near;
        }
        if (best.tilt > 0.0) best = fit_samples(samples, weights);
    }
    vec2 slope = best.plane.yz / side;
    vec2 ray = (vec2(pixel) - intrinsics.zw) / intrinsics.xy, turned = intrinsics.xy * slope;
    float away = ray.x * turned.x + ray.y * turned.y - 1.0;
    float focal = 0.5 * (abs(intrinsics.x) + abs(intrinsics.y));
    float error = focal * best.tilt / side / sqrt(turned.x * turned.x + turned.y * turned.y + away * away);
    bool own = abs(best.plane.x) < CLOSE * sqrt(best.variance);
    float moved = error < SURE ? best.plane.x : 0.0;
    return vec4(slope, moved, best.tilt > 0.0 && own && error < tilt ? 1.0 : 0.0);
}
